"""The gyroscope: how fast the robot turned in the last tick, and how the motors rock it.

Controllers see the upright axis. The other two, about the forward and the leftward axis, are 0 on a flat floor but for
what disturbs a gyroscope (:func:`rocking`).
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.simulator.physics.defects import GYROSCOPE_AT, spoiled
from elib.simulator.physics.elementary import HALF_TURN, angle
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.motion import shaking
from elib.simulator.physics.noise import GYROSCOPE, GYROSCOPE_OFFSET, gauss, tick_key
from elib.simulator.physics.records import Records

DEGREE: Final = HALF_TURN / 180.0

DEVIATION: Final = (0.16 * DEGREE, 0.19 * DEGREE, 0.11 * DEGREE)
"""Noise of a robot that stands, rad/s: about the forward, the leftward and the upright axis (measured-robots:
gyroscope.epuck2)."""

RELATIVE_DEVIATION: Final = 0.003
"""Noise in a turn, as a part of it (Webots)."""

DRIVING: Final = (1.1 * DEGREE, 2.3 * DEGREE, 4.9 * DEGREE)
"""Noise while a robot drives, rad/s: the same axes (measured-robots: gyroscope.epuck2)."""

OFFSET: Final = (2.0 * DEGREE, 5.0 * DEGREE, 1.0 * DEGREE)
"""Spread between robots of what these axes read at rest, rad/s (measured-robots: gyroscope.epuck2, two robots; the
firmware had subtracted what it read at its start)."""


@kernel
def read(world: Records, i: int) -> None:
    """Read the gyroscope of robot *i* about its upright axis, rad/s, positive to the left.

    The angle between the headings of two ticks, over the tick. Where the chip ends is a matter of its counts: 250
    degrees a second or more, and an e-puck on the spot reaches 278.
    """
    robot = world.robots[i]
    cosine = robot.before_heading_x * robot.heading_x + robot.before_heading_y * robot.heading_y
    sine = robot.before_heading_x * robot.heading_y - robot.before_heading_y * robot.heading_x
    rate = angle(cosine, sine) / world.setting[0].step
    world.views[i].rotation = turning(world, i, 2, rate)


@kernel
def rocking(world: Records, i: int) -> tuple[float, float]:
    """Return what the gyroscope of robot *i* reads about its forward and its leftward axis, rad/s."""
    return turning(world, i, 0, 0.0), turning(world, i, 1, 0.0)


@kernel
def turning(world: Records, i: int, axis: int, rate: float) -> float:
    """Return what is read about an axis that turns at *rate*, both in rad/s."""
    return spoiled(world.setting[0], world.robots[i], GYROSCOPE_AT + axis, rate + disturbance(world, i, axis, rate))


@kernel
def disturbance(world: Records, i: int, axis: int, rate: float) -> float:
    """Return the error of an axis that turns at *rate*, both in rad/s: the robot's offset, and its noise."""
    robot = world.robots[i]
    setting = world.setting[0]
    still = setting.sensor_noise * (DEVIATION[axis] + RELATIVE_DEVIATION * abs(rate))
    offset = shaken = 0.0
    if setting.spread > 0.0:
        offset = setting.spread * OFFSET[axis] * gauss(robot.key, GYROSCOPE_OFFSET + axis)
        shaken = setting.spread * shaking(robot) * DRIVING[axis]
    if still == 0.0 and shaken == 0.0:
        return offset
    deviation = sqrt(still * still + shaken * shaken)
    return offset + deviation * gauss(tick_key(robot.key, setting.tick), GYROSCOPE + axis)
