"""What the time-of-flight sensor of the e-puck2 reads at a distance: the curve, used both ways."""

from __future__ import annotations

import math
from typing import Final

from elib.base.curves import interpolated

PLACE: Final = (0.034, -0.0018)
"""Where it sits in the robot's frame, m (Webots' model of the e-puck2)."""

CALIBRATION: Final = (
    (-0.045, 0.0, 0.002),
    (0.0, 0.027, 0.002),
    (0.04, 0.051, 0.002),
    (0.1, 0.118, 0.0024),
    (0.2, 0.220, 0.0029),
    (0.28, 0.302, 0.0027),
    (0.4, 0.425, 0.005),
    (0.48, 0.506, 0.0064),
    (0.7, 0.730, 0.0145),
    (0.87, 0.900, 0.027),
    (1.0, 1.030, 0.0285),
    (2.0, 2.040, 0.030),
)
"""True distance, m, what the sensor reads there, m, and the deviation of that, m (measured-robots:
proposals.time_of_flight, from time_of_flight.epuck2). It was measured to 1.1 m; beyond, the scale of 1.01 goes on. What
motion adds to the deviation near the robot, 0.8 mm, is taken off. The first row lets a sensor that reads too little do
so at a touch, too."""

AGE: Final = 0.053
"""s that a reading is old, on average: there is a new one every 106 ms (measured-robots: time_of_flight.epuck2)."""

OFFSET: Final = 0.015
"""Spread between robots of what the sensor reads, m (measured-robots: time_of_flight.offsets_of_others)."""

_READING: Final = tuple((true, reading) for true, reading, _ in CALIBRATION)
_TRUE: Final = tuple((reading, true) for true, reading, _ in CALIBRATION)
_DEVIATION: Final = tuple((true, deviation) for true, _, deviation in CALIBRATION)


def biased(distance: float) -> float:
    """Return what the sensor reads on average at a true *distance*, both in m."""
    return interpolated(_READING, distance)


def unbiased(reading: float) -> float:
    """Return the true distance at which the sensor reads *reading* on average, both in m."""
    return interpolated(_TRUE, reading)


def deviation(distance: float) -> float:
    """Return the standard deviation of what robots read at a true *distance*, m: noise, and the robot's own offset."""
    return math.hypot(interpolated(_DEVIATION, distance), OFFSET)
