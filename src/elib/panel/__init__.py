"""Robots as a person sees them: one page in the browser to drive and to watch robots and their virtual worlds.

It stands on ``behaviours``, ``tools`` and what they stand on. Begin with ``panel.py`` (the robots of a page), then
``slot.py`` (one of them). ``drivelock.py`` and ``interlock.py`` keep robots safe, ``server`` is the only part that
knows HTTP, and ``page`` is what the build made of the folder ``page`` beside ``src``.
"""
