"""The eight infrared sensors: reflected and ambient light in counts of the robot's 12-bit converter.

The robot measures the room's light with its emitter off and on, and takes the difference: light pulls the
reading down, so the reflected value can never exceed the ambient one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from elib.errors import ArgumentError
from elib.physics.body import RADIUS as ROBOT_RADIUS
from elib.physics.body import SENSOR_RADIUS
from elib.physics.engine import kernel
from elib.physics.geometry import unit
from elib.physics.grid import cell
from elib.physics.layout import (
    BEFORE_HEADING_X,
    BEFORE_HEADING_Y,
    BEFORE_X,
    BEFORE_Y,
    BODIES,
    BODY,
    CELL_COLUMNS,
    CELL_ROWS,
    CELL_SCALE,
    DIGEST,
    DISC,
    DISC_ABSORBS,
    DISC_LISTS,
    DISC_RADIUS,
    DISC_TOP,
    FIRST,
    GAIN,
    GRID_COLUMNS,
    GRID_ROWS,
    GRID_SCALE,
    HALF_WIDTH,
    HEAD,
    HEADING_X,
    HEADING_Y,
    HEADS_AT,
    IR_REACH,
    KEY,
    LAST,
    LENGTH,
    LIGHTS,
    NEXT_AT,
    NUMBER,
    OFFSET,
    QUANTILES,
    RADIUS,
    RAY,
    RAY_COUNT,
    RAYS,
    REACH,
    READINGS,
    RESPONSE,
    ROBOT,
    ROBOTS,
    ROOM,
    SEEN,
    SENSOR_NOISE,
    SLOT,
    STEP,
    TANGENT_X,
    TANGENT_Y,
    TICK,
    WALL,
    WALL_ABSORBS,
    WALL_FAR,
    WALL_LISTS,
    WALL_TOP,
    WALL_X,
    WALL_Y,
    Floats,
    Ints,
    X,
    Y,
)
from elib.physics.noise import MASK, PROXIMITY, STRIDE, mix, tick_key
from elib.physics.sensors.light import AMBIENT_DEVIATION, ROOMS, darkness, lamplight
from elib.physics.sensors.rays import meet_disc, meet_wall
from elib.physics.sensors.sectors import FAR, LIST, SECTORS, sector

COUNT: Final = 8
FULL_SCALE = 4095
"""Largest reading of the 12-bit converter."""

# Where each sensor sits and looks, degrees from straight ahead, positive to the left; 0 is front right,
# then clockwise. Bearings of Webots' positions and its directions, which agree with Enki's and Player's
# within 4 degrees (side and front) and 10 degrees (rear). Left and right are mirrored.
BEARINGS = (-18.43, -48.65, -90.0, -153.43, 153.43, 90.0, 48.65, 18.43)
DIRECTIONS = (-17.2, -45.9, -90.0, -151.5, 151.5, 90.0, 45.9, 17.2)

PLACES = tuple((SENSOR_RADIUS * x, SENSOR_RADIUS * y) for x, y in (unit(math.radians(a)) for a in BEARINGS))
"""m"""

AXES = tuple(unit(math.radians(angle)) for angle in DIRECTIONS)

APERTURE = 15.0
"""Side rays stand this far from the middle one, degrees (Enki)."""

SHARES = {
    1: ((0.0, 1.0),),
    3: ((1.0, 0.25), (0.0, 0.5), (-1.0, 0.25)),
    5: ((1.0, 0.1), (0.5, 0.2), (0.0, 0.4), (-0.5, 0.2), (-1.0, 0.1)),
}
"""Angles of the rays in units of the aperture, and their weights. They add up to 1, so a flat wall ahead gives the
published curve exactly."""

PAIRS: Final = 4
"""Sensors i and i + 4 are sampled together."""

SENSOR_HEIGHT: Final = 0.033
"""Of the infrared sensors above the floor, m (Webots). What is lower is not seen."""

HORIZON: Final = SENSOR_RADIUS + 0.004
"""m. All sensors sit within it, also where they were a slot ago."""

BESIDE: Final = SENSOR_RADIUS + 0.004
"""m. Nearer than that to a wall's line, sensors lie on both sides of it."""

POSES: Final = 80
"""Where in the scratch the robot's places and headings of each pair begin."""

AMBIENT_MARGIN: Final = 4 * AMBIENT_DEVIATION  # Beyond any noise: below it the cap need not be looked up.

SPACING = 0.00025
"""Distance between the entries of a response table, m: finer than the kinks of every published curve."""


@dataclass(frozen=True, slots=True)
class Profile:
    """How much light comes back from a white flat surface straight ahead.

    Attributes:
        name: As worlds call it.
        counts: Reflected light at multiples of :data:`SPACING`, counts; the last entry holds beyond.
        deviation: Standard deviation of the noise there, counts.
        source: Where the figures come from.
    """

    name: str
    counts: tuple[float, ...]
    deviation: tuple[float, ...]
    source: str

    @property
    def reach(self) -> float:
        """Length a ray must have, m: the side rays go further to the same depth."""
        return (len(self.counts) - 1) * SPACING / unit(math.radians(APERTURE))[0]


def profile(name: str) -> Profile:
    """Return the response profile called *name*.

    Raises:
        ArgumentError: There is none of that name.
    """
    try:
        return PROFILES[name]
    except KeyError:
        raise ArgumentError(
            f"there is no infrared profile {name!r}", hint=f"choose one of {', '.join(PROFILES)}"
        ) from None


def _table(reach: float, law: Callable[[float], float]) -> tuple[float, ...]:
    return tuple(law(k * SPACING) for k in range(round(reach / SPACING) + 1))


def _between(knots: Sequence[tuple[float, float]]) -> Callable[[float], float]:
    """Return the straight-line interpolation of (x, value) pairs."""

    def law(x: float) -> float:
        for (x0, value0), (x1, value1) in pairwise(knots):
            if x <= x1:
                return value0 + (value1 - value0) * (x - x0) / (x1 - x0)
        return knots[-1][1]

    return law


def _enki(distance: float) -> float:
    # Published in centimetres: m (c - x0^2) / (x^2 - 2 x0 x + c) with m 3731, x0 0.3, c 0.7; its maximum
    # holds below x0.
    x = max(distance * 100, 0.3)
    return 0.0 if x > 11.999 else 3731 * (0.7 - 0.09) / (x * x - 0.6 * x + 0.7)


def _gctronic(distance: float) -> float:
    return min((0.5 / max(distance, SPACING)) ** 2, FULL_SCALE)


# (m, counts, relative deviation): the calibration published with Webots and, under Apache-2.0, with
# epuck_ros2.
_WEBOTS = (
    (0.0, 4095.0, 0.002),
    (0.005, 2133.33, 0.003),
    (0.01, 1465.73, 0.007),
    (0.015, 601.46, 0.0406),
    (0.02, 383.84, 0.01472),
    (0.03, 234.93, 0.0241),
    (0.04, 158.03, 0.0287),
    (0.05, 120.0, 0.04225),
    (0.06, 104.09, 0.03065),
    (0.07, 67.19, 0.04897),
)

PROFILES = {
    # The default: a smooth curve, and from 1.5 cm on it agrees within 4 % with GCtronic's independent fit.
    "enki": Profile("enki", _table(0.12, _enki), _table(0.12, lambda _: 10.0), "Enki's formula; noise of 10 counts"),
    "webots": Profile(
        "webots",
        _table(0.07, _between([(x, counts) for x, counts, _ in _WEBOTS])),
        _table(0.07, _between([(x, counts * relative) for x, counts, relative in _WEBOTS])),
        "Webots' and epuck_ros2's calibration table; 67 counts remain in the open",
    ),
    "gctronic": Profile(
        "gctronic",
        _table(0.12, _gctronic),
        _table(0.12, lambda _: 10.0),
        "inverse of GCtronic's ROS driver, (0.5 m / d)^2 capped at full scale; it states no noise, so Enki's",
    ),
}


@kernel
def sense(
    robot: int,
    fixed: Floats,
    robots: Floats,
    bodies: Floats,
    walls: Floats,
    discs: Floats,
    cells: Ints,
    numbers: Ints,
    lights: Floats,
    scratch: Floats,
) -> None:
    """Read a robot's eight sensors into its record, once a tick.

    The firmware samples one pair after the other, (0, 4), (1, 5), (2, 6), (3, 7): a reading is as old as its place in
    that row says, so a moving robot is looked up where it was then, by the straight line of its last tick. What it
    looks at counts where it is now.

    Args:
        robot: Whose.
        fixed: Settings, rays and response.
        robots: All robots.
        bodies: Pushable things.
        walls: All walls, seen from both sides.
        discs: All cylinders.
        cells: The grid of fixed things.
        numbers: The grid of moving things; out: the readings, and the digest of all so far.
        lights: All lamps.
        scratch: Room for the rays.
    """
    if numbers[HEAD + robot * NUMBER + SEEN] == numbers[TICK]:
        return
    look(robot, fixed, robots, bodies, walls, discs, cells, numbers, scratch)
    if numbers[LIGHTS] > 0:
        lamplight(robot, fixed, robots, walls, discs, lights, numbers, scratch)
    _respond(robot, fixed, robots, numbers, scratch)


@kernel
def look(
    robot: int,
    fixed: Floats,
    robots: Floats,
    bodies: Floats,
    walls: Floats,
    discs: Floats,
    cells: Ints,
    numbers: Ints,
    scratch: Floats,
) -> None:
    """Find what each ray of a robot's sensors meets: its length, m, and 1 / reflectance, into *scratch*."""
    r = robot * ROBOT
    rays = numbers[RAY_COUNT]
    reach = fixed[IR_REACH]
    here_x = robots[r + X]
    here_y = robots[r + Y]
    heading_x = robots[r + HEADING_X]
    heading_y = robots[r + HEADING_Y]
    for k in range(0, 16 * rays, 2):
        scratch[k] = reach
    step_x = here_x - robots[r + BEFORE_X]
    step_y = here_y - robots[r + BEFORE_Y]
    turn_x = heading_x - robots[r + BEFORE_HEADING_X]
    turn_y = heading_y - robots[r + BEFORE_HEADING_Y]
    ages = 1
    if robots[r + SLOT] > 0.0 and (step_x != 0.0 or step_y != 0.0 or turn_x != 0.0 or turn_y != 0.0):
        ages = PAIRS
    for g in range(ages):
        part = robots[r + SLOT] / fixed[STEP] * (ages - 1 - g)
        then_x = heading_x - part * turn_x
        then_y = heading_y - part * turn_y
        length = 1.5 - 0.5 * (then_x * then_x + then_y * then_y)
        scratch[POSES + 4 * g] = part * step_x
        scratch[POSES + 4 * g + 1] = part * step_y
        scratch[POSES + 4 * g + 2] = then_x * length
        scratch[POSES + 4 * g + 3] = then_y * length

    horizon = reach + HORIZON
    scale = fixed[CELL_SCALE]
    columns = numbers[CELL_COLUMNS]
    here = 2 * (cell(here_y, scale, numbers[CELL_ROWS]) * columns + cell(here_x, scale, columns))
    for m in range(cells[here], cells[here + 1]):
        _look_at_wall(cells[m] * WALL, here_x, here_y, ages, rays, horizon, reach, fixed, walls, numbers, scratch)
    for m in range(cells[here + 1], cells[here + 2]):
        d = cells[m] * DISC
        dx = discs[d] - here_x
        dy = discs[d + 1] - here_y
        radius = discs[d + DISC_RADIUS]
        limit = horizon + radius
        if dx * dx + dy * dy < limit * limit and discs[d + DISC_TOP] >= SENSOR_HEIGHT:
            _look_at_disc(dx, dy, radius, discs[d + DISC_ABSORBS], ages, rays, reach, fixed, numbers, scratch)
    if numbers[ROBOTS] + numbers[BODIES] > 1:
        scale = fixed[GRID_SCALE]
        columns = numbers[GRID_COLUMNS]
        rows = numbers[GRID_ROWS]
        column = cell(here_x, scale, columns)
        row = cell(here_y, scale, rows)
        heads = numbers[HEADS_AT]
        following = numbers[NEXT_AT]
        count = numbers[ROBOTS]
        for v in range(max(row - 1, 0), min(row + 2, rows)):
            for u in range(max(column - 1, 0), min(column + 2, columns)):
                j = numbers[heads + v * columns + u]
                while j >= 0:
                    if j < count:
                        if j != robot:
                            s = j * ROBOT
                            dx = robots[s + X] - here_x
                            dy = robots[s + Y] - here_y
                            limit = horizon + robots[s + RADIUS]
                            if dx * dx + dy * dy < limit * limit:
                                _look_at_disc(
                                    dx, dy, robots[s + RADIUS], 1.0, ages, rays, reach, fixed, numbers, scratch
                                )
                    else:
                        b = (j - count) * BODY
                        dx = bodies[b + X] - here_x
                        dy = bodies[b + Y] - here_y
                        limit = horizon + bodies[b + REACH]
                        if dx * dx + dy * dy < limit * limit:
                            first = int(bodies[b + FIRST])
                            if bodies[b + HALF_WIDTH] == 0.0:
                                d = first * DISC
                                if discs[d + DISC_TOP] >= SENSOR_HEIGHT:
                                    radius = discs[d + DISC_RADIUS]
                                    absorbs = discs[d + DISC_ABSORBS]
                                    _look_at_disc(dx, dy, radius, absorbs, ages, rays, reach, fixed, numbers, scratch)
                            else:
                                for side in range(first, first + 4):
                                    _look_at_wall(
                                        side * WALL,
                                        here_x,
                                        here_y,
                                        ages,
                                        rays,
                                        horizon,
                                        reach,
                                        fixed,
                                        walls,
                                        numbers,
                                        scratch,
                                    )
                    j = numbers[following + j]


@kernel
def _look_at_wall(
    w: int,
    here_x: float,
    here_y: float,
    ages: int,
    rays: int,
    horizon: float,
    reach: float,
    fixed: Floats,
    walls: Floats,
    numbers: Ints,
    scratch: Floats,
) -> None:
    dx = walls[w + WALL_X] - here_x
    dy = walls[w + WALL_Y] - here_y
    tangent_x = walls[w + TANGENT_X]
    tangent_y = walls[w + TANGENT_Y]
    offset = tangent_x * dy - tangent_y * dx
    if offset > horizon or offset < -horizon:
        return
    start = tangent_x * dx + tangent_y * dy
    end = start + walls[w + LENGTH]
    if start > horizon or end < -horizon or walls[w + WALL_TOP] < SENSOR_HEIGHT:
        return
    absorbs = walls[w + WALL_ABSORBS]
    heading_x = scratch[POSES + 4 * ages - 2]
    heading_y = scratch[POSES + 4 * ages - 1]
    normal_x = tangent_x * heading_y - tangent_y * heading_x
    normal_y = tangent_x * heading_x + tangent_y * heading_y
    if -BESIDE < offset < BESIDE:  # The robot stands astride the wall's line, beyond its end: anybody may see it.
        for sensor in range(COUNT):
            g = 4 * (sensor % PAIRS) if ages > 1 else 0
            back_x = scratch[POSES + g]
            back_y = scratch[POSES + g + 1]
            heading_x = scratch[POSES + g + 2]
            heading_y = scratch[POSES + g + 3]
            meet_wall(
                sensor,
                rays,
                tangent_x * heading_y - tangent_y * heading_x,
                tangent_x * heading_x + tangent_y * heading_y,
                offset + tangent_x * back_y - tangent_y * back_x,
                start + tangent_x * back_x + tangent_y * back_y,
                end + tangent_x * back_x + tangent_y * back_y,
                absorbs,
                reach,
                fixed,
                scratch,
            )
        return
    away = offset
    if offset < 0.0:
        away = -offset
        normal_x = -normal_x
        normal_y = -normal_y
    direction = LIST * sector(normal_x, normal_y)
    for k in range(1, numbers[WALL_LISTS + direction] + 1):
        if away >= fixed[WALL_FAR + direction + k]:
            return
        sensor = numbers[WALL_LISTS + direction + k]
        g = 4 * (sensor % PAIRS) if ages > 1 else 0
        back_x = scratch[POSES + g]
        back_y = scratch[POSES + g + 1]
        heading_x = scratch[POSES + g + 2]
        heading_y = scratch[POSES + g + 3]
        meet_wall(
            sensor,
            rays,
            tangent_x * heading_y - tangent_y * heading_x,
            tangent_x * heading_x + tangent_y * heading_y,
            offset + tangent_x * back_y - tangent_y * back_x,
            start + tangent_x * back_x + tangent_y * back_y,
            end + tangent_x * back_x + tangent_y * back_y,
            absorbs,
            reach,
            fixed,
            scratch,
        )


@kernel
def _look_at_disc(
    dx: float,
    dy: float,
    radius: float,
    absorbs: float,
    ages: int,
    rays: int,
    reach: float,
    fixed: Floats,
    numbers: Ints,
    scratch: Floats,
) -> None:
    heading_x = scratch[POSES + 4 * ages - 2]
    heading_y = scratch[POSES + 4 * ages - 1]
    listed = DISC_LISTS
    square = dx * dx + dy * dy
    if radius <= ROBOT_RADIUS and square > 0.0:
        if square > FAR * FAR:
            listed += LIST * SECTORS
        listed += LIST * sector(dx * heading_x + dy * heading_y, dy * heading_x - dx * heading_y)
        count = numbers[listed]
    else:
        count = COUNT  # Larger than the lists are made for.
    for k in range(count):
        sensor = k if count == COUNT else numbers[listed + 1 + k]
        g = 4 * (sensor % PAIRS) if ages > 1 else 0
        then_x = dx + scratch[POSES + g]
        then_y = dy + scratch[POSES + g + 1]
        heading_x = scratch[POSES + g + 2]
        heading_y = scratch[POSES + g + 3]
        forward = then_x * heading_x + then_y * heading_y
        leftward = then_y * heading_x - then_x * heading_y
        meet_disc(sensor, rays, forward, leftward, radius, absorbs, reach, fixed, scratch)


@kernel
def _respond(robot: int, fixed: Floats, robots: Floats, numbers: Ints, scratch: Floats) -> None:
    """Turn what the rays met into reflected light.

    light = gain * sum over rays of weight * response(depth / reflectance) + offset + noise, cut at what the sensor
    reads with its emitter off, since the firmware sends the difference of the two.
    """
    n = HEAD + robot * NUMBER
    r = robot * ROBOT
    rays = numbers[RAY_COUNT]
    reach = fixed[IR_REACH]
    last = numbers[LAST]
    deviations = RESPONSE + last + 1
    noise = fixed[SENSOR_NOISE]
    room = fixed[ROOM]
    key = tick_key(numbers[n + KEY], numbers[TICK])
    clear = fixed[RESPONSE + last]
    clear_deviation = fixed[deviations + last]
    is_lit = numbers[LIGHTS] > 0
    word = 0
    at = 0
    for i in range(COUNT):
        light = 0.0
        deviation = clear_deviation
        for k in range(RAYS, RAYS + rays * RAY, RAY):
            length = scratch[at]
            if length < reach:
                place = length * fixed[k + 2] * scratch[at + 1]
                if place >= last:
                    light += fixed[k + 3] * clear
                else:
                    below = int(place)
                    low = fixed[RESPONSE + below]
                    light += fixed[k + 3] * (low + (place - below) * (fixed[RESPONSE + below + 1] - low))
                    deviation = max(deviation, fixed[deviations + below])
            else:
                light += fixed[k + 3] * clear
            at += 2
        light = light * robots[r + GAIN + i] + robots[r + OFFSET + i]
        if noise > 0.0:
            if i % 3 == 0:
                word = mix((key + (PROXIMITY + i) * STRIDE) & MASK)
            light += noise * deviation * fixed[QUANTILES + (word & 1023)]
            word >>= 10
        if is_lit:
            room = scratch[ROOMS + i]
        if light > room - AMBIENT_MARGIN * noise:
            light = min(light, darkness(key, i, noise, room))
        numbers[n + READINGS + i] = int(light + 0.5) if light > 0.0 else 0
    numbers[n + SEEN] = numbers[TICK]
    m = n + READINGS
    digest = numbers[n + DIGEST]
    front = numbers[m] | numbers[m + 1] << 12 | numbers[m + 2] << 24 | numbers[m + 3] << 36
    rear = numbers[m + 4] | numbers[m + 5] << 12 | numbers[m + 6] << 24 | numbers[m + 7] << 36
    digest = ((digest ^ front) * 0x735A2D97) & 0xFFFFFFFFFFFF
    digest = (((digest ^ (digest >> 23)) ^ rear) * 0x21F0AAAD) & 0xFFFFFFFFFFFF
    numbers[n + DIGEST] = digest ^ (digest >> 23)
