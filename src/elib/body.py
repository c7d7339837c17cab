"""The e-puck's drive as numbers: what every part of elib that turns steps into metres agrees on.

Sources are gathered in the project's robot model: e-puck.org, the thesis of 2011 and the firmware.
"""

from __future__ import annotations

import math
from typing import Final

WHEEL_DIAMETER: Final = 0.041
"""m. e-puck.org, the thesis and ARGoS; one motor step of 1/1000 turn is 0.1288 mm."""

AXLE: Final = 0.053
"""Distance of the wheels' contact points, m. e-puck.org; the firmware's own 1300 steps a turn on the spot
give 53.3 mm."""

STEPS_PER_REVOLUTION: Final = 1000
"""Motor steps for one turn of a wheel: 20 steps a turn of the motor, times the gear's 50 (protocol.md, 5.1)."""

METRES_PER_STEP: Final = math.pi * WHEEL_DIAMETER / STEPS_PER_REVOLUTION
"""0.1288 mm of the nominal wheel's rim."""

SENSOR_DIRECTIONS: Final = tuple(
    math.radians(angle) for angle in (-17.2, -45.9, -90.0, -151.5, 151.5, 90.0, 45.9, 17.2)
)
"""Where the eight infrared sensors look, clockwise from the front right, rad from straight ahead, positive to the left.
Webots' directions, which agree with Enki's and Player's within 4 degrees (side and front) and 10 degrees (rear); left
and right are mirrored (robot-model, 2.2)."""
