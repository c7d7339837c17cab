"""The web panel: drive and watch robots in the browser."""
