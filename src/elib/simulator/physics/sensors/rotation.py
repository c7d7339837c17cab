"""The gyroscope's upright axis: how fast the robot turned in the last tick."""

from __future__ import annotations

from typing import Final

from elib.simulator.physics.elementary import angle
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.noise import GYROSCOPE, gauss, tick_key
from elib.simulator.physics.records import Records

DEVIATION: Final = 0.0017
"""Noise at rest, rad/s: 0.1 degree/s (data sheet of the MPU-9250)."""

RELATIVE_DEVIATION: Final = 0.003
"""Noise in a turn, as a part of it (Webots)."""


@kernel
def read(world: Records, i: int) -> None:
    """Read the gyroscope of robot *i* about its upright axis, rad/s, positive to the left.

    The angle between the headings of two ticks, over the tick. Where the chip ends is a matter of its counts: 250
    degrees a second or more, and an e-puck on the spot reaches 278.
    """
    robot = world.robots[i]
    setting = world.setting[0]
    cosine = robot.before_heading_x * robot.heading_x + robot.before_heading_y * robot.heading_y
    sine = robot.before_heading_x * robot.heading_y - robot.before_heading_y * robot.heading_x
    rate = angle(cosine, sine) / setting.step
    if setting.sensor_noise > 0.0:
        key = tick_key(robot.key, setting.tick)
        deviation = DEVIATION + RELATIVE_DEVIATION * abs(rate)
        rate += setting.sensor_noise * deviation * gauss(key, GYROSCOPE)
    world.views[i].rotation = rate
