"""The worlds that come with elib, and the files of worlds: what they say, reading and writing them.

It stands on ``physics``, which knows no files. Begin with ``files.py``.
"""
