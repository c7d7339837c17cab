"""The room's light and that of lamps, as the infrared sensors see it with their emitters off.

The law is that of ARGoS' simulated sensor: a lamp of intensity I at distance d, seen under an angle a from the
sensor's axis, gives

    s = exp(-2 d / I) (1 - a / 90 degrees)    for d < 2.5 m and a < 90 degrees, else 0,

the lamps add up, and the reading falls with light (robot-model.md, 2.4):

    counts = base (1 - min(1, sum of s)).

d and a are those of the line in space from the sensor, 33 mm above the floor, to the lamp. What crosses this line
casts a shadow, if it is tall enough there: walls, boxes, cylinders and other robots. The robot's own body shades
its far side by the angle alone.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.physics.body import HEIGHT, RADIUS
from elib.physics.elementary import QUARTER_TURN, arc_cosine, exponential
from elib.physics.engine import kernel
from elib.physics.layout import (
    AXIS_X,
    AXIS_Y,
    DISC,
    DISC_RADIUS,
    DISC_TOP,
    DISCS,
    HEAD,
    HEADING_X,
    HEADING_Y,
    INTENSITY,
    KEY,
    LENGTH,
    LIGHT,
    LIGHT_TOP,
    LIGHTS,
    NUMBER,
    PLACE_X,
    PLACE_Y,
    ROBOT,
    ROBOTS,
    ROOM,
    SENSOR_NOISE,
    TANGENT_X,
    TANGENT_Y,
    TICK,
    WALL,
    WALL_TOP,
    WALL_X,
    WALL_Y,
    WALLS,
    Floats,
    Ints,
    X,
    Y,
)
from elib.physics.layout import RADIUS as BODY_RADIUS
from elib.physics.noise import AMBIENT, gauss, tick_key

REACH: Final = 2.5
"""A lamp further away gives nothing, m (ARGoS)."""

COUNT: Final = 8
"""Infrared sensors."""

SENSOR_HEIGHT: Final = 0.033
"""Of the infrared sensors above the floor, m (Webots)."""

AMBIENT_DEVIATION: Final = 7.0
"""Noise of one reading of the room's light, counts: the difference of two has Enki's 10. Webots gives 1 %."""

ROOMS: Final = 96
"""Where in the scratch the readings without noise begin."""

SHARES: Final = 104
"""Where in the scratch that begins which the lamp at hand gives to each sensor."""


ROBOT_TOP: Final = HEIGHT
RIM: Final = RADIUS  # All sensors lie within it.


@kernel
def ambient(
    robot: int,
    fixed: Floats,
    robots: Floats,
    walls: Floats,
    discs: Floats,
    lights: Floats,
    numbers: Ints,
    scratch: Floats,
    values: Ints,
) -> None:
    """Read all infrared sensors of *robot* with their emitters off.

    What :func:`lamplight` finds, with 7 counts of noise.

    Args:
        robot: Index of the robot that looks.
        fixed: Settings and the sensors' places and axes.
        robots: All robots.
        walls: All walls, the sides of boxes among them.
        discs: All cylinders.
        lights: All lamps.
        numbers: The tick and the key of the robot's noise.
        scratch: Room for :func:`lamplight`.
        values: Out: one a sensor, counts, 0..4095, higher is darker.
    """
    lamplight(robot, fixed, robots, walls, discs, lights, numbers, True, scratch)
    key = tick_key(numbers[HEAD + robot * NUMBER + KEY], numbers[TICK])
    noise = fixed[SENSOR_NOISE]
    for i in range(COUNT):
        values[i] = darkness(key, i, noise, scratch[ROOMS + i])


@kernel
def darkness(key: int, sensor: int, noise: float, room: float) -> int:
    """Return one sensor's reading with its emitter off, counts, 0..4095, higher is darker.

    Args:
        key: The robot's noise key of this tick.
        sensor: Its number.
        noise: Factor on the noise.
        room: The reading without noise, counts.
    """
    level = room + noise * AMBIENT_DEVIATION * gauss(key, AMBIENT + sensor)
    return int(min(max(level, 0.0), 4095.0) + 0.5)


@kernel
def lamplight(
    robot: int,
    fixed: Floats,
    robots: Floats,
    walls: Floats,
    discs: Floats,
    lights: Floats,
    numbers: Ints,
    is_shaded: bool,
    scratch: Floats,
) -> None:
    """Find what each infrared sensor of *robot* reads in the light of the room and of all lamps.

    counts = base (1 - min(1, s)), s the sum of exp(-2 d / I) (1 - a / 90 degrees) over the lamps that are nearer than
    2.5 m, less than 90 degrees from the axis and not hidden (ARGoS).

    Args:
        robot: Index of the robot that looks.
        fixed: The reading in the room's light, the sensors' places and axes.
        robots: All robots.
        walls: All walls, the sides of boxes among them.
        discs: All cylinders.
        lights: All lamps.
        numbers: How many there are of everything.
        is_shaded: Look for what stands in the light; without, the readings are the least that they can be.
        scratch: Out, from :data:`ROOMS` on: one a sensor, counts without noise. What lies before is left alone.
    """
    for i in range(COUNT):
        scratch[ROOMS + i] = 0.0
    here = robot * ROBOT
    for k in range(0, numbers[LIGHTS] * LIGHT, LIGHT):
        intensity = lights[k + INTENSITY]
        dx = lights[k + X] - robots[here + X]
        dy = lights[k + Y] - robots[here + Y]
        if intensity <= 0.0 or dx * dx + dy * dy > (REACH + RIM) * (REACH + RIM):
            continue
        heading_x = robots[here + HEADING_X]
        heading_y = robots[here + HEADING_Y]
        forward = dx * heading_x + dy * heading_y
        leftward = dy * heading_x - dx * heading_y
        rise = lights[k + LIGHT_TOP] - SENSOR_HEIGHT
        is_lit = False
        for i in range(COUNT):
            ahead = forward - fixed[PLACE_X + i]
            aside = leftward - fixed[PLACE_Y + i]
            facing = ahead * fixed[AXIS_X + i] + aside * fixed[AXIS_Y + i]
            square = ahead * ahead + aside * aside + rise * rise
            scratch[SHARES + i] = 0.0
            if facing > 0.0 and 0.0 < square < REACH * REACH:
                distance = sqrt(square)
                angle = arc_cosine(facing / distance)
                scratch[SHARES + i] = exponential(-2.0 * distance / intensity) * (1.0 - angle / QUARTER_TURN)
                is_lit = True
        if is_lit:
            if is_shaded:
                _shade(robot, fixed, robots, walls, discs, numbers, forward, leftward, rise, scratch)
            for i in range(COUNT):
                scratch[ROOMS + i] += scratch[SHARES + i]
    room = fixed[ROOM]
    for i in range(COUNT):
        scratch[ROOMS + i] = room * (1.0 - min(scratch[ROOMS + i], 1.0))


@kernel
def _shade(
    robot: int,
    fixed: Floats,
    robots: Floats,
    walls: Floats,
    discs: Floats,
    numbers: Ints,
    forward: float,
    leftward: float,
    rise: float,
    scratch: Floats,
) -> None:
    """Put out the lamp at (forward, leftward), *rise* above the sensors, where something stands in its light."""
    here = robot * ROBOT
    x = robots[here + X]
    y = robots[here + Y]
    heading_x = robots[here + HEADING_X]
    heading_y = robots[here + HEADING_Y]
    length = sqrt(forward * forward + leftward * leftward)
    if length <= RIM:  # The lamp hangs over the robot.
        return
    along_x = forward / length
    along_y = leftward / length
    for k in range(0, numbers[WALLS] * WALL, WALL):
        top = walls[k + WALL_TOP]
        dx = walls[k + WALL_X] - x
        dy = walls[k + WALL_Y] - y
        start_x = dx * heading_x + dy * heading_y
        start_y = dy * heading_x - dx * heading_y
        tangent_x = walls[k + TANGENT_X] * heading_x + walls[k + TANGENT_Y] * heading_y
        tangent_y = walls[k + TANGENT_Y] * heading_x - walls[k + TANGENT_X] * heading_y
        extent = walls[k + LENGTH]
        # Nothing of it lies beside the way of the light if both ends are on the same side, or before or behind it.
        across = start_y * along_x - start_x * along_y
        other = across + extent * (tangent_y * along_x - tangent_x * along_y)
        if (across > RIM and other > RIM) or (across < -RIM and other < -RIM):
            continue
        across = start_x * along_x + start_y * along_y
        other = across + extent * (tangent_x * along_x + tangent_y * along_y)
        if (across > length and other > length) or (across < -RIM and other < -RIM):
            continue
        if _rises_over(top, min(across, other) - RIM, length, rise):
            continue
        _shade_by_wall(start_x, start_y, tangent_x, tangent_y, extent, top, forward, leftward, rise, fixed, scratch)
    for k in range(0, numbers[DISCS] * DISC, DISC):
        dx = discs[k + X] - x
        dy = discs[k + Y] - y
        _shade_by_disc(
            dx * heading_x + dy * heading_y,
            dy * heading_x - dx * heading_y,
            discs[k + DISC_RADIUS],
            discs[k + DISC_TOP],
            forward,
            leftward,
            rise,
            length,
            fixed,
            scratch,
        )
    for k in range(0, numbers[ROBOTS] * ROBOT, ROBOT):
        dx = robots[k + X] - x
        dy = robots[k + Y] - y
        if k != here and dx * dx + dy * dy < (REACH + RIM) * (REACH + RIM):
            _shade_by_disc(
                dx * heading_x + dy * heading_y,
                dy * heading_x - dx * heading_y,
                robots[k + BODY_RADIUS],
                ROBOT_TOP,
                forward,
                leftward,
                rise,
                length,
                fixed,
                scratch,
            )


@kernel
def _rises_over(top: float, along: float, length: float, rise: float) -> bool:
    """Return whether the light passes above *top* wherever it is further than *along* from the robot's middle."""
    # Its height grows from the sensor, up to RIM away from the middle, to the lamp.
    return rise > 0.0 and (top - SENSOR_HEIGHT) * (length + RIM) < rise * (along - RIM)


@kernel
def _shade_by_wall(
    start_x: float,
    start_y: float,
    tangent_x: float,
    tangent_y: float,
    extent: float,
    top: float,
    forward: float,
    leftward: float,
    rise: float,
    fixed: Floats,
    scratch: Floats,
) -> None:
    for i in range(COUNT):
        if scratch[SHARES + i] == 0.0:
            continue
        # The light's way from the sensor is t * (way_x, way_y), 0 < t < 1; the wall is crossed at one t, if at all.
        way_x = forward - fixed[PLACE_X + i]
        way_y = leftward - fixed[PLACE_Y + i]
        from_x = start_x - fixed[PLACE_X + i]
        from_y = start_y - fixed[PLACE_Y + i]
        crossing = way_x * tangent_y - way_y * tangent_x
        to_wall = from_x * tangent_y - from_y * tangent_x
        along = from_x * way_y - from_y * way_x
        if crossing < 0.0:
            crossing = -crossing
            to_wall = -to_wall
            along = -along
        if not (0.0 < to_wall < crossing and 0.0 <= along <= extent * crossing):
            continue
        if (SENSOR_HEIGHT - top) * crossing + rise * to_wall < 0.0:
            scratch[SHARES + i] = 0.0


@kernel
def _shade_by_disc(
    centre_x: float,
    centre_y: float,
    radius: float,
    top: float,
    forward: float,
    leftward: float,
    rise: float,
    length: float,
    fixed: Floats,
    scratch: Floats,
) -> None:
    along = (centre_x * forward + centre_y * leftward) / length
    across = (centre_y * forward - centre_x * leftward) / length
    beside = radius + RIM
    if across > beside or across < -beside or along < -beside or along > length + radius:
        return
    if _rises_over(top, along - beside, length, rise):
        return
    for i in range(COUNT):
        if scratch[SHARES + i] == 0.0:
            continue
        way_x = forward - fixed[PLACE_X + i]
        way_y = leftward - fixed[PLACE_Y + i]
        from_x = centre_x - fixed[PLACE_X + i]
        from_y = centre_y - fixed[PLACE_Y + i]
        square = way_x * way_x + way_y * way_y
        middle = from_x * way_x + from_y * way_y
        under = middle * middle - square * (from_x * from_x + from_y * from_y - radius * radius)
        if under <= 0.0 or square == 0.0:
            continue
        half = sqrt(under)
        enters = max((middle - half) / square, 0.0)
        leaves = min((middle + half) / square, 1.0)
        lowest = enters if rise > 0.0 else leaves
        if enters < leaves and SENSOR_HEIGHT + rise * lowest < top:
            scratch[SHARES + i] = 0.0
