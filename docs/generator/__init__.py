"""How the reference pages are made: one module a page."""
