"""What the eight infrared sensors of a robot read: rays, response, noise and the ambient cap, on flat records.

Each engine reads the sensors in a form of its own (:mod:`elib.physics.sensors.glance`,
:mod:`elib.physics.sensors.sweep`); :func:`look`, which finds the rays alone, runs on both as it stands.
"""

from __future__ import annotations

from typing import Final

from elib.physics.body import RADIUS as ROBOT_RADIUS
from elib.physics.engine import compiled_as, kernel
from elib.physics.grid import HORIZON, cell, cell_at
from elib.physics.layout import (
    AGE,
    BEFORE_HEADING_X,
    BEFORE_HEADING_Y,
    BEFORE_X,
    BEFORE_Y,
    BODIES,
    BODY,
    DISC,
    DISC_ABSORBS,
    DISC_LISTS,
    DISC_RADIUS,
    DISC_TOP,
    FIRST,
    GRID_COLUMNS,
    GRID_ROWS,
    GRID_SCALE,
    HALF_WIDTH,
    HEAD,
    HEADING_X,
    HEADING_Y,
    HEADS_AT,
    IR_REACH,
    LENGTH,
    NEAR_AT,
    NEXT_AT,
    NUMBER,
    RADIUS,
    RAY_COUNT,
    REACH,
    ROBOT,
    ROBOTS,
    SEEN,
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
from elib.physics.sensors.glance import glance
from elib.physics.sensors.rays import (
    CALM,
    DEVIATION,
    HITS,
    POSE,
    REFLECTED,
    SENSOR_HEIGHT,
    meet_disc,
    meet_wall,
)
from elib.physics.sensors.responding import respond
from elib.physics.sensors.sectors import FAR, LIST, SECTORS, STRAY, STRAY_ANGLE, TOUCHING, sector

COUNT: Final = 8


@compiled_as("elib.physics.sensors.sweep:sense_all")
def sense_all(
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
    """Read the sensors of all robots into their records, once a tick."""
    for robot in range(numbers[ROBOTS]):
        sense(robot, fixed, robots, bodies, walls, discs, cells, numbers, lights, scratch)


@compiled_as("elib.physics.sensors.sweep:sense")
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
    glance(robot, fixed, robots, bodies, walls, discs, cells, numbers, scratch)
    respond(robot, REFLECTED, DEVIATION, fixed, robots, walls, discs, numbers, lights, scratch)


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
    """Find what each ray of a robot's sensors meets: its length, m, and 1 / reflectance, into *scratch*.

    The numbers of a sensor hold only if scratch[:data:`HITS` + sensor] is 1; otherwise it sees nothing.
    """
    r = robot * ROBOT
    here_x = robots[r + X]
    here_y = robots[r + Y]
    heading_x = robots[r + HEADING_X]
    heading_y = robots[r + HEADING_Y]
    for k in range(HITS, HITS + COUNT):
        scratch[k] = 0.0
    scratch[POSE] = heading_x
    scratch[POSE + 1] = heading_y
    scratch[POSE + 2] = heading_x - robots[r + BEFORE_HEADING_X]
    scratch[POSE + 3] = heading_y - robots[r + BEFORE_HEADING_Y]
    scratch[POSE + 4] = here_x - robots[r + BEFORE_X]
    scratch[POSE + 5] = here_y - robots[r + BEFORE_Y]
    share = robots[r + SLOT] / fixed[STEP]
    scratch[POSE + 6] = share
    step = scratch[POSE + 4] * scratch[POSE + 4] + scratch[POSE + 5] * scratch[POSE + 5]
    turn = scratch[POSE + 2] * scratch[POSE + 2] + scratch[POSE + 3] * scratch[POSE + 3]
    share *= 9.0 * share  # Three slots, squared.
    scratch[CALM] = 1.0 if share * step < STRAY * STRAY and share * turn < STRAY_ANGLE * STRAY_ANGLE else 0.0

    horizon = fixed[IR_REACH] + HORIZON
    here = cell_at(here_x, here_y, fixed, numbers)
    for m in range(cells[here + 1], cells[here + 2]):
        _see_wall(cells[m] * WALL, here_x, here_y, horizon, fixed, walls, numbers, scratch)
    for m in range(cells[here + 2], cells[here + 3]):
        d = cells[m] * DISC
        dx = discs[d] - here_x
        dy = discs[d + 1] - here_y
        radius = discs[d + DISC_RADIUS]
        limit = horizon + radius
        if dx * dx + dy * dy < limit * limit and discs[d + DISC_TOP] >= SENSOR_HEIGHT:
            _see_disc(dx, dy, radius, discs[d + DISC_ABSORBS], fixed, numbers, scratch)
    count = numbers[ROBOTS]
    if count > 1:
        limit = horizon + ROBOT_RADIUS
        limit *= limit
        near = numbers[NEAR_AT] + robot
        for m in range(numbers[near], numbers[near + 1]):
            s = numbers[m] * ROBOT
            dx = robots[s + X] - here_x
            dy = robots[s + Y] - here_y
            if dx * dx + dy * dy < limit:
                _see_disc(dx, dy, robots[s + RADIUS], 1.0, fixed, numbers, scratch)
    if numbers[BODIES] == 0:
        return
    scale = fixed[GRID_SCALE]
    columns = numbers[GRID_COLUMNS]
    rows = numbers[GRID_ROWS]
    column = cell(here_x, scale, columns)
    row = cell(here_y, scale, rows)
    for v in range(max(row - 1, 0), min(row + 2, rows)):
        for u in range(max(column - 1, 0), min(column + 2, columns)):
            j = numbers[numbers[HEADS_AT] + v * columns + u]
            while j >= 0:
                if j >= count:
                    _see_thing(
                        (j - count) * BODY, here_x, here_y, horizon, fixed, bodies, walls, discs, numbers, scratch
                    )
                j = numbers[numbers[NEXT_AT] + j]


@kernel
def _see_thing(
    b: int,
    here_x: float,
    here_y: float,
    horizon: float,
    fixed: Floats,
    bodies: Floats,
    walls: Floats,
    discs: Floats,
    numbers: Ints,
    scratch: Floats,
) -> None:
    """Look at the pushable thing whose record begins at *b*."""
    dx = bodies[b + X] - here_x
    dy = bodies[b + Y] - here_y
    limit = horizon + bodies[b + REACH]
    if dx * dx + dy * dy >= limit * limit:
        return
    first = int(bodies[b + FIRST])
    if bodies[b + HALF_WIDTH] == 0.0:
        d = first * DISC
        if discs[d + DISC_TOP] >= SENSOR_HEIGHT:
            _see_disc(dx, dy, discs[d + DISC_RADIUS], discs[d + DISC_ABSORBS], fixed, numbers, scratch)
        return
    for side in range(first, first + 4):
        _see_wall(side * WALL, here_x, here_y, horizon, fixed, walls, numbers, scratch)


@kernel
def _see_wall(
    w: int,
    here_x: float,
    here_y: float,
    horizon: float,
    fixed: Floats,
    walls: Floats,
    numbers: Ints,
    scratch: Floats,
) -> None:
    """Look at a wall from a robot that is here."""
    dx = walls[w + WALL_X] - here_x
    dy = walls[w + WALL_Y] - here_y
    tangent_x = walls[w + TANGENT_X]
    tangent_y = walls[w + TANGENT_Y]
    offset = tangent_x * dy - tangent_y * dx
    if not -horizon < offset < horizon:
        return
    start = tangent_x * dx + tangent_y * dy
    end = start + walls[w + LENGTH]
    if start > horizon or end < -horizon or walls[w + WALL_TOP] < SENSOR_HEIGHT:
        return
    absorbs = walls[w + WALL_ABSORBS]
    heading_x = scratch[POSE]
    heading_y = scratch[POSE + 1]
    turn_x = scratch[POSE + 2]
    turn_y = scratch[POSE + 3]
    # What the robot's last step did along the wall and towards it.
    sideways = tangent_x * scratch[POSE + 4] + tangent_y * scratch[POSE + 5]
    nearer = tangent_x * scratch[POSE + 5] - tangent_y * scratch[POSE + 4]
    share = scratch[POSE + 6]
    rays = numbers[RAY_COUNT]
    reach = fixed[IR_REACH]
    away = offset if offset >= 0.0 else -offset
    # Astride the wall's line, beyond its end, any sensor may see it.
    is_beside = away < HORIZON or scratch[CALM] == 0.0
    direction = 0
    count = COUNT
    if not is_beside:
        normal_x = tangent_x * heading_y - tangent_y * heading_x
        normal_y = tangent_x * heading_x + tangent_y * heading_y
        if offset < 0.0:
            normal_x = -normal_x
            normal_y = -normal_y
        direction = LIST * sector(normal_x, normal_y)
        count = numbers[WALL_LISTS + direction]
    for k in range(1, count + 1):
        sensor = k - 1
        if not is_beside:
            if away >= fixed[WALL_FAR + direction + k]:
                return
            sensor = numbers[WALL_LISTS + direction + k]
        age = share * fixed[AGE + sensor]
        then_x = heading_x - age * turn_x
        then_y = heading_y - age * turn_y
        back = age * sideways
        meet_wall(
            sensor,
            rays,
            tangent_x * then_y - tangent_y * then_x,
            tangent_x * then_x + tangent_y * then_y,
            offset + age * nearer,
            start + back,
            end + back,
            absorbs,
            reach,
            fixed,
            scratch,
        )


@kernel
def _see_disc(
    dx: float, dy: float, radius: float, absorbs: float, fixed: Floats, numbers: Ints, scratch: Floats
) -> None:
    """Look at a disc whose centre is (dx, dy) away from the robot's, m."""
    heading_x = scratch[POSE]
    heading_y = scratch[POSE + 1]
    turn_x = scratch[POSE + 2]
    turn_y = scratch[POSE + 3]
    step_x = scratch[POSE + 4]
    step_y = scratch[POSE + 5]
    share = scratch[POSE + 6]
    rays = numbers[RAY_COUNT]
    reach = fixed[IR_REACH]
    listed = DISC_LISTS
    count = COUNT
    square = dx * dx + dy * dy
    # The lists are made for discs of up to a robot's size that do not overlap the robot.
    touching = radius + TOUCHING
    is_listed = radius <= ROBOT_RADIUS and square > touching * touching and scratch[CALM] > 0.0
    if is_listed:
        if square > FAR * FAR:
            listed += LIST * SECTORS
        listed += LIST * sector(dx * heading_x + dy * heading_y, dy * heading_x - dx * heading_y)
        count = numbers[listed]
    for k in range(count):
        sensor = k
        if is_listed:
            sensor = numbers[listed + 1 + k]
        age = share * fixed[AGE + sensor]
        then_x = heading_x - age * turn_x
        then_y = heading_y - age * turn_y
        back_x = dx + age * step_x
        back_y = dy + age * step_y
        meet_disc(
            sensor,
            rays,
            back_x * then_x + back_y * then_y,
            back_y * then_x - back_x * then_y,
            radius,
            absorbs,
            reach,
            fixed,
            scratch,
        )
