"""The web application: drive, see and understand robots and their virtual world on one page."""
