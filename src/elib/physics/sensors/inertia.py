"""Accelerometer and gyroscope: what the motion of the last two ticks comes to.

The accelerometer feels what holds the robot up as well as what moves it: at rest it reads 1 g upwards. In motion it
is the second difference of the place, with all that a real one would feel: the start, a curve, a bump into a wall.
The wheels change their speed at once, as step motors do, so that a start lasts one tick.
"""

from __future__ import annotations

from typing import Final

from elib.physics.elementary import angle
from elib.physics.engine import kernel
from elib.physics.layout import (
    BEFORE_HEADING_X,
    BEFORE_HEADING_Y,
    BEFORE_X,
    BEFORE_Y,
    HEAD,
    HEADING_X,
    HEADING_Y,
    KEY,
    LAST_STEP_X,
    LAST_STEP_Y,
    NUMBER,
    ROBOT,
    SENSOR_NOISE,
    STEP,
    TICK,
    Floats,
    Ints,
    X,
    Y,
)
from elib.physics.noise import gauss, tick_key

ACCELEROMETER: Final = 72  # +0..2: channels of the noise.
GYROSCOPE: Final = 80

GRAVITY: Final = 9.81
"""m/s2."""

RANGE: Final = 2.0 * GRAVITY
"""Most that a chip set to +-2 g reads, m/s2 (firmware)."""

DEVIATION: Final = 0.003 * GRAVITY
"""Noise of each axis, m/s2: Webots' 0.3 %, taken of 1 g."""

RATE_DEVIATION: Final = 0.0017
"""Noise of the gyroscope at rest, rad/s: 0.1 degree/s (data sheet of the MPU-9250)."""

RELATIVE_RATE_DEVIATION: Final = 0.003
"""Noise of the gyroscope in a turn, as a part of it (Webots)."""


@kernel
def accelerate(robot: int, fixed: Floats, robots: Floats, numbers: Ints, values: Floats) -> None:
    """Read the accelerometer of *robot*.

    a = ((p - p1) - (p1 - p2)) / step^2 with its places p now, p1 one and p2 two ticks ago, in the robot's frame of
    one tick ago, which is the middle of the three: on a circle nothing but the centripetal part is left. Each axis
    is cut off at +-2 g.

    Args:
        robot: Index of the robot.
        fixed: Settings.
        robots: All robots.
        numbers: The tick and the key of the robot's noise.
        values: Out: forward, to the left and upwards, m/s2; (0, 0, 9.81) at rest.
    """
    key = tick_key(numbers[HEAD + robot * NUMBER + KEY], numbers[TICK])
    noise = fixed[SENSOR_NOISE]
    step = fixed[STEP]
    here = robot * ROBOT
    square = step * step
    x = ((robots[here + X] - robots[here + BEFORE_X]) - robots[here + LAST_STEP_X]) / square
    y = ((robots[here + Y] - robots[here + BEFORE_Y]) - robots[here + LAST_STEP_Y]) / square
    heading_x = robots[here + BEFORE_HEADING_X]
    heading_y = robots[here + BEFORE_HEADING_Y]
    values[0] = x * heading_x + y * heading_y
    values[1] = y * heading_x - x * heading_y
    values[2] = GRAVITY
    for i in range(3):
        value = values[i]
        if noise > 0.0:
            value += noise * DEVIATION * gauss(key, ACCELEROMETER + i)
        values[i] = min(max(value, -RANGE), RANGE)


@kernel
def turn_rate(robot: int, fixed: Floats, robots: Floats, numbers: Ints) -> float:
    """Return what the gyroscope of *robot* reads about its upright axis, rad/s, positive to the left.

    The angle between the headings of two ticks, over the tick. Where the chip ends is a matter of its counts: 250
    degrees a second or more, and an e-puck on the spot reaches 278.

    Args:
        robot: Index of the robot.
        fixed: Settings.
        robots: All robots.
        numbers: The tick and the key of the robot's noise.
    """
    key = tick_key(numbers[HEAD + robot * NUMBER + KEY], numbers[TICK])
    noise = fixed[SENSOR_NOISE]
    step = fixed[STEP]
    here = robot * ROBOT
    before_x = robots[here + BEFORE_HEADING_X]
    before_y = robots[here + BEFORE_HEADING_Y]
    now_x = robots[here + HEADING_X]
    now_y = robots[here + HEADING_Y]
    rate = angle(before_x * now_x + before_y * now_y, before_x * now_y - before_y * now_x) / step
    if noise > 0.0:
        size = rate if rate >= 0.0 else -rate
        rate += noise * (RATE_DEVIATION + RELATIVE_RATE_DEVIATION * size) * gauss(key, GYROSCOPE)
    return rate
