"""Captured bytes of a link, decoded into lines that a person can read."""
