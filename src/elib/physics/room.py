"""Where the compiled engine keeps what it needs for a moment: the only place that says what lies where.

Vectors begin at multiples of eight, and so with a line of the cache. Below 128 lies what both engines use
(:mod:`elib.physics.sensors.rays`, :mod:`elib.physics.sensors.light`).
"""

from __future__ import annotations

from typing import Final

BLOCK: Final = 8
"""Robots that are worked on together: what they need meanwhile stays in the nearest cache."""

MOST: Final = 64
"""Walls in sight of these robots, and discs, whose rays are cast in one go."""

# In the scratch. Of each robot of the block, its rays: as many lengths and 1 / reflectances as one robot has; while
# walls are looked at, 1 / length.
BEAMS: Final = 128
BEAM: Final = 80
# Vectors of eight, one number a sensor: where it looked when it was sampled, x, y, and where it was then, seen from
# where the robot is now, x, y. Then one number of the robot.
POSES: Final = BEAMS + BLOCK * BEAM
AHEAD_X: Final = 0
AHEAD_Y: Final = 8
FROM_X: Final = 16
FROM_Y: Final = 24
SEEING: Final = 32  # 1 if anything is in its sight.
POSED: Final = 40
# What its sensors get back, counts, and the deviation of the noise there.
LIGHT: Final = POSES + BLOCK * POSED
DARK: Final = 8
LIT: Final = 16
# Walls in sight: how far to the left of the robot, and where they begin.
OFFSETS: Final = LIGHT + BLOCK * LIT
STARTS: Final = OFFSETS + MOST
# Discs in sight: from the robot's centre to theirs, radius, 1 / reflectance.
ASIDE_X: Final = STARTS + MOST
ASIDE_Y: Final = ASIDE_X + MOST
SIZES: Final = ASIDE_Y + MOST
PALENESS: Final = SIZES + MOST
# Robots that roll: what their wheels travel, and the arcs of it.
LEFTS: Final = PALENESS + MOST
RIGHTS: Final = LEFTS + BLOCK
AXLES: Final = RIGHTS + BLOCK
SINES: Final = AXLES + BLOCK
COSINES: Final = SINES + BLOCK
CHORDS: Final = COSINES + BLOCK
SCRATCH: Final = CHORDS + BLOCK
"""Length of the scratch."""

# Whole numbers, behind numbers[SLATE_AT]: the walls in sight, and who sees them; who sees the discs.
WALL_SEEN: Final = 0
WALL_SEER: Final = WALL_SEEN + MOST
DISC_SEER: Final = WALL_SEER + MOST
# For each robot of the block: where in the table of responses each of its rays is, and its noise in that of quantiles.
PLACES: Final = DISC_SEER + MOST
PLACE: Final = 40
NOISES: Final = PLACES + BLOCK * PLACE
SLATE: Final = NOISES + BLOCK * 8
