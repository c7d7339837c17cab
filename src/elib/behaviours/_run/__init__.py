"""Declare, find and run behaviours. The samples are the other modules of ``elib.behaviours``."""
