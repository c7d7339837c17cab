"""A robot that answers: its world, its sensors, its firmware, and the faults of its link.

It stands on ``base`` and ``link`` and knows nothing of the programs that drive it. Begin with ``physics/world.py`` (a
world in SI units), then ``emulator/emulator.py`` (bytes in, bytes out). ``worlds`` and ``faults`` are the files that
come with elib, and ``drawing`` makes pictures of a world.
"""
