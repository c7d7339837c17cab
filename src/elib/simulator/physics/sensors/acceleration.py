"""The accelerometer: what the motion of the last two ticks comes to.

It feels what holds the robot up as well as what moves it: at rest it reads 1 g upwards. In motion it is the second
difference of the place, with all that a real one would feel: the start, a curve, a bump into a wall. The wheels change
their speed at once, as step motors do, so a start lasts one tick.
"""

from __future__ import annotations

from typing import Final

from elib.simulator.physics.body import GRAVITY
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.noise import ACCELEROMETER, gauss, tick_key
from elib.simulator.physics.records import Records

RANGE: Final = 2.0 * GRAVITY
"""Most that a chip set to +-2 g reads, m/s2 (firmware)."""

DEVIATION: Final = 0.003 * GRAVITY
"""Noise of each axis, m/s2: Webots' 0.3 %, taken of 1 g."""


@kernel
def read(world: Records, i: int) -> None:
    """Read the accelerometer of robot *i*: forward, to the left and upwards, m/s2; (0, 0, 9.81) at rest.

    a = ((p - p1) - (p1 - p2)) / step^2 with its places p now, p1 one and p2 two ticks ago, in the robot's frame of
    one tick ago, which is the middle of the three: on a circle nothing but the centripetal part is left. Each axis
    is cut off at +-2 g.
    """
    robot = world.robots[i]
    step = world.setting[0].step
    square = step * step
    x = ((robot.x - robot.before_x) - robot.last_step_x) / square
    y = ((robot.y - robot.before_y) - robot.last_step_y) / square
    out = world.views[i].acceleration
    out[0] = x * robot.before_heading_x + y * robot.before_heading_y
    out[1] = y * robot.before_heading_x - x * robot.before_heading_y
    out[2] = GRAVITY
    key = tick_key(robot.key, world.setting[0].tick)
    noise = world.setting[0].sensor_noise
    for axis in range(3):
        value = out[axis]
        if noise > 0.0:
            value += noise * DEVIATION * gauss(key, ACCELEROMETER + axis)
        out[axis] = min(max(value, -RANGE), RANGE)
