"""Doors to other tools, each a thin layer on the panel's robots: Foxglove, programs in other languages, agents.

It stands on ``panel``. Begin with ``robots.py``, which opens a door and closes it again, then with the package of the
door: ``foxglove``, ``serve`` or ``agent``.
"""
