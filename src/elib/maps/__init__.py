"""Where a robot is and what stands around it: a map of its readings, its place on a map, and ways on it.

It stands on ``base`` and knows no link: it takes poses and distances, and ``robot`` drives by it. Worlds of the
simulator are found by name. Begin with ``grid.py``, then ``localiser.py``, then ``ways.py``.
"""
