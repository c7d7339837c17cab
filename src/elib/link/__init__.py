"""Bytes and calls: what is said to a robot, in which order, and over what.

It stands on ``base`` alone and knows no simulator. Begin with ``protocol/commands.py``, the table of all commands. Then
``session`` puts calls into a queue and ends each of them once, and ``transport`` carries bytes, opened by URL.
"""
