"""The accelerometer: what the motion of the last two ticks comes to.

It feels what holds the robot up as well as what moves it: at rest it reads 1 g upwards. In motion it is the second
difference of the place, with all that a real one would feel: the start, a curve, a bump into a wall. The wheels change
their speed at once, as step motors do, so a start lasts one tick. In real robots the chip is not quite level, and the
motors shake it.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.simulator.physics.body import GRAVITY
from elib.simulator.physics.defects import ACCELEROMETER_AT, spoiled
from elib.simulator.physics.elementary import HALF_TURN
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.motion import shaking
from elib.simulator.physics.noise import ACCELEROMETER, TILT, gauss, tick_key
from elib.simulator.physics.records import Records

RANGE: Final = 2.0 * GRAVITY
"""Most that a chip set to +-2 g reads, m/s2 (firmware)."""

DEVIATION: Final = (0.0026 * GRAVITY, 0.0023 * GRAVITY, 0.0033 * GRAVITY)
"""Noise of a robot that stands, m/s2: forward, to the left, upwards (measured-robots: accelerometer.epuck2, 2.0, 1.8
and 2.5 of 768 counts)."""

DRIVING: Final = (0.045 * GRAVITY, 0.022 * GRAVITY, 0.043 * GRAVITY)
"""Noise while it drives, m/s2: the same axes (measured-robots: accelerometer.epuck2: 34, 17 and 32 of 768 counts). The
upward part is a little more: with it the length of the vector has that of another robot, 37 to 40 counts
(accelerometer.magnitude_by_speed)."""

LEVEL: Final = 3.0 / 180.0 * HALF_TURN
"""Sine of the angle by which a typical chip is tilted forward, and to the left: 3 degrees
(measured-robots: accelerometer.epuck2: 1.6 and 18 degrees)."""


@kernel
def read(world: Records, i: int) -> None:
    """Read the accelerometer of robot *i*: forward, to the left and upwards, m/s2; (0, 0, 9.81) at rest.

    a = ((p - p1) - (p1 - p2)) / step^2 with its places p now, p1 one and p2 two ticks ago, in the robot's frame of
    one tick ago, which is the middle of the three: on a circle nothing but the centripetal part is left. Each axis
    is cut off at +-2 g.
    """
    robot = world.robots[i]
    setting = world.setting[0]
    square = setting.step * setting.step
    x = ((robot.x - robot.before_x) - robot.last_step_x) / square
    y = ((robot.y - robot.before_y) - robot.last_step_y) / square
    out = world.views[i].acceleration
    out[0] = x * robot.before_heading_x + y * robot.before_heading_y
    out[1] = y * robot.before_heading_x - x * robot.before_heading_y
    out[2] = GRAVITY
    key = tick_key(robot.key, setting.tick)
    noise = setting.sensor_noise
    shaken = 0.0
    if setting.spread > 0.0:
        shaken = setting.spread * shaking(robot)
        for axis in range(2):
            sine = setting.spread * LEVEL * gauss(robot.key, TILT + axis)
            cosine = sqrt(1.0 - sine * sine)
            ahead = out[axis]
            out[axis] = cosine * ahead + sine * out[2]
            out[2] = cosine * out[2] - sine * ahead
    for axis in range(3):
        value = out[axis]
        if noise > 0.0 or shaken > 0.0:
            still = noise * DEVIATION[axis]
            driving = shaken * DRIVING[axis]
            value += sqrt(still * still + driving * driving) * gauss(key, ACCELEROMETER + axis)
        out[axis] = min(max(spoiled(setting, robot, ACCELEROMETER_AT + axis, value), -RANGE), RANGE)
