"""The time-of-flight sensor of the e-puck2, looking forward.

Its light fills a cone, and what comes back first counts: a fan of rays across the cone, of which the shortest is the
reading. The sensor is 33 mm above the floor; lower things it does not see.
"""

from __future__ import annotations

from typing import Final

from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.elementary import interpolated
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.noise import DISTANCE, gauss, tick_key
from elib.simulator.physics.raycast import cast, see_all
from elib.simulator.physics.records import Records

PLACE = (0.034, -0.0018)
"""Where it sits in the robot's frame, m (Webots' model of the e-puck2)."""

CONE = 0.44
"""Full width of the cone, rad (Webots): its rays stand at 0, 1/4 and 1/2 of it on both sides."""

REACH: Final = 2.0
"""m. The last row of the sensor's published calibration."""

CALIBRATION: Final = (
    (0.0, 0.0198, 0.126),
    (0.05, 0.0585, 0.032),
    (0.1, 0.1110, 0.019),
    (0.2, 0.2189, 0.009),
    (0.5, 0.5319, 0.007),
    (1.0, 1.0520, 0.010),
    (1.7, 1.7805, 0.013),
    (2.0, 2.0, 0.0),
)
"""The sensor's published calibration: true distance, m, what it reads there, m, and the relative deviation of that
(Webots' table of the VL53L0X)."""

TRUE: Final = tuple(true for true, _, _ in CALIBRATION)

DEVIATION: Final = tuple(relative * reading for _, reading, relative in CALIBRATION)
"""Noise of a reading there, m."""


def biased(distance: float) -> float:
    """Return what the sensor reads on average at a true *distance*, both in m."""
    return interpolated([(true, reading) for true, reading, _ in CALIBRATION], distance)


@kernel
def read(world: Records, i: int) -> None:
    """Read the time-of-flight sensor of robot *i*, m, 0..2, before its own bias.

    The shortest of five rays, with the deviation of the published calibration, in straight lines between its rows:
    2.5 mm when touching, 2 mm at 0.1 m, 11 mm at 1 m. What is 2 m away or more reads 2 m without noise.
    """
    robot = world.robots[i]
    scratch = see_all(world, i, REACH + RADIUS)
    axis_x = robot.heading_x
    axis_y = robot.heading_y
    x = robot.x + axis_x * PLACE[0] - axis_y * PLACE[1]
    y = robot.y + axis_y * PLACE[0] + axis_x * PLACE[1]
    nearest = REACH
    for k in range(len(world.fans) - 2, len(world.fans)):
        ahead, left, right, _, _, _ = cast(world, scratch, x, y, axis_x, axis_y, world.fans[k])
        nearest = min(nearest, ahead, left, right)
    noise = world.setting[0].sensor_noise
    if noise > 0.0 and nearest < REACH:
        row = 1
        while TRUE[row] <= nearest:
            row += 1
        share = (nearest - TRUE[row - 1]) / (TRUE[row] - TRUE[row - 1])
        deviation = DEVIATION[row - 1] + (DEVIATION[row] - DEVIATION[row - 1]) * share
        key = tick_key(robot.key, world.setting[0].tick)
        nearest = min(max(nearest + noise * deviation * gauss(key, DISTANCE), 0.0), REACH)
    world.views[i].distance = nearest
