"""The time-of-flight sensor of the e-puck2, looking forward.

Its light fills a cone, and what comes back first counts: a fan of rays across the cone, of which the shortest is the
reading. The sensor is 33 mm above the floor; lower things it does not see.
"""

from __future__ import annotations

from typing import Final

from elib.physics.body import RADIUS
from elib.physics.engine import kernel
from elib.physics.geometry import unit
from elib.physics.layout import (
    AXIS_X,
    DISC,
    DISC_RADIUS,
    DISC_TOP,
    HEAD,
    HEADING_X,
    HEADING_Y,
    KEY,
    LENGTH,
    NUMBER,
    PLACE_X,
    PLACE_Y,
    RAY,
    RAYS,
    ROBOT,
    SENSOR_NOISE,
    SPREAD,
    TANGENT_X,
    TANGENT_Y,
    TICK,
    WALL,
    WALL_TOP,
    WALL_X,
    WALL_Y,
    WIDEST,
    Floats,
    Ints,
    X,
    Y,
)
from elib.physics.layout import RADIUS as BODY_RADIUS
from elib.physics.noise import DISTANCE, gauss, tick_key
from elib.physics.sensors.rays import HITS, STRIDE, meet_disc, meet_wall

PLACE = (0.034, -0.0018)
"""Where it sits in the robot's frame, m (Webots' model of the e-puck2)."""

SENSOR_HEIGHT: Final = 0.033
"""Above the floor, m (Webots)."""

CONE = 0.44
"""Full width of the cone, rad (Webots)."""

COUNT: Final = 5
"""Rays across the cone."""

RIM: Final = RADIUS  # The sensor lies within it.

REACH: Final = 2.0
"""m. The last row of the sensor's published calibration."""

TRUE: Final = (0.0, 0.05, 0.1, 0.2, 0.5, 1.0, 1.7, 2.0)
"""Distances of the published calibration, m (Webots' table of the VL53L0X)."""

DEVIATION: Final = (
    0.126 * 0.0198,
    0.032 * 0.0585,
    0.019 * 0.1110,
    0.009 * 0.2189,
    0.007 * 0.5319,
    0.010 * 1.0520,
    0.013 * 1.7805,
    0.0,
)
"""Noise of a reading there, m: the table's relative deviation times its reading."""


def eye() -> list[float]:
    """Return the sensor laid out as the infrared ones are in a world's settings: one sensor, five rays."""
    settings = [0.0] * (RAYS + COUNT * RAY)
    settings[WIDEST], settings[SPREAD] = unit(CONE / 2)
    settings[PLACE_X], settings[PLACE_Y] = PLACE
    settings[AXIS_X] = 1.0
    for k, share in enumerate((0.0, 0.25, -0.25, 0.5, -0.5)):
        settings[RAYS + k * RAY : RAYS + k * RAY + 2] = unit(CONE * share)
    return settings


@kernel
def measure(
    robot: int,
    fixed: Floats,
    robots: Floats,
    walls: Floats,
    discs: Floats,
    numbers: Ints,
    eye: Floats,
    scratch: Floats,
) -> float:
    """Return what the sensor of *robot* measures, m, 0..2, before its own bias.

    The shortest of five rays, with the deviation of the published calibration, in straight lines between its rows:
    2.5 mm when touching, 2 mm at 0.1 m, 11 mm at 1 m. What is 2 m away or more reads 2 m without noise.

    Args:
        robot: Index of the robot that looks.
        fixed: Settings.
        robots: All robots.
        walls: All walls, the sides of boxes among them.
        discs: All cylinders.
        numbers: The tick and the key of the robot's noise.
        eye: As :func:`eye` returns it.
        scratch: Room for two numbers a ray.
    """
    nearest = look_ahead(robot, robots, walls, discs, eye, scratch)
    noise = fixed[SENSOR_NOISE]
    if noise <= 0.0 or nearest >= REACH:
        return nearest
    row = 1
    while TRUE[row] <= nearest:
        row += 1
    share = (nearest - TRUE[row - 1]) / (TRUE[row] - TRUE[row - 1])
    deviation = DEVIATION[row - 1] + (DEVIATION[row] - DEVIATION[row - 1]) * share
    key = tick_key(numbers[HEAD + robot * NUMBER + KEY], numbers[TICK])
    return min(max(nearest + noise * deviation * gauss(key, DISTANCE), 0.0), REACH)


@kernel
def look_ahead(robot: int, robots: Floats, walls: Floats, discs: Floats, eye: Floats, scratch: Floats) -> float:
    """Return the true distance to the nearest thing in the cone, m, at most :data:`REACH`."""
    scratch[HITS] = 1.0
    for k in range(COUNT):
        scratch[k * STRIDE] = REACH
    here = robot * ROBOT
    x = robots[here + X]
    y = robots[here + Y]
    heading_x = robots[here + HEADING_X]
    heading_y = robots[here + HEADING_Y]
    horizon = REACH + RIM
    for k in range(0, len(walls), WALL):
        dx = walls[k + WALL_X] - x
        dy = walls[k + WALL_Y] - y
        tangent_x = walls[k + TANGENT_X]
        tangent_y = walls[k + TANGENT_Y]
        offset = tangent_x * dy - tangent_y * dx
        if offset > horizon or offset < -horizon or walls[k + WALL_TOP] < SENSOR_HEIGHT:
            continue
        start = tangent_x * dx + tangent_y * dy
        end = start + walls[k + LENGTH]
        if start > horizon or end < -horizon:
            continue
        normal_x = tangent_x * heading_y - tangent_y * heading_x
        normal_y = tangent_x * heading_x + tangent_y * heading_y
        meet_wall(0, COUNT, normal_x, normal_y, offset, start, end, 1.0, REACH, eye, scratch)
    for k in range(0, len(discs), DISC):
        if discs[k + DISC_TOP] >= SENSOR_HEIGHT:
            dx = discs[k + X] - x
            dy = discs[k + Y] - y
            ahead = dx * heading_x + dy * heading_y
            radius = discs[k + DISC_RADIUS]
            if -radius < ahead < horizon + radius:
                meet_disc(0, COUNT, ahead, dy * heading_x - dx * heading_y, radius, 1.0, REACH, eye, scratch)
    # A robot that has its middle beside or behind does not reach into the cone.
    for k in range(0, len(robots), ROBOT):
        dx = robots[k + X] - x
        dy = robots[k + Y] - y
        ahead = dx * heading_x + dy * heading_y
        radius = robots[k + BODY_RADIUS]
        if k != here and 0.0 < ahead < horizon + radius:
            meet_disc(0, COUNT, ahead, dy * heading_x - dx * heading_y, radius, 1.0, REACH, eye, scratch)
    nearest = REACH
    for k in range(COUNT):
        nearest = min(nearest, scratch[k * STRIDE])
    return nearest
