"""The infrared sensors of one robot: what the interpreted engine runs instead of asking each surface in turn.

The laws are those of :mod:`elib.physics.sensors.rays`, the operations those of :mod:`elib.physics.sensors.sweep`, one
by one, so that both engines agree to the last bit. Here the work goes sensor by sensor: first each surface goes on the
lists of the sensors that look that way, then each sensor that sees anything casts its rays at what is on its list
(:mod:`elib.physics.sensors.measuring`).
"""

from __future__ import annotations

from elib.physics.body import RADIUS as ROBOT_RADIUS
from elib.physics.engine import interpreted_kernel
from elib.physics.grid import HORIZON, cell, cell_at, is_listed, is_near_wall
from elib.physics.layout import (
    BEFORE_HEADING_X,
    BEFORE_HEADING_Y,
    BEFORE_X,
    BEFORE_Y,
    BODIES,
    BODY,
    CLEAR,
    DISC,
    DISC_ABSORBS,
    DISC_LISTS,
    DISC_RADIUS,
    DISC_TOP,
    DISCS,
    FIRST,
    GRID_COLUMNS,
    GRID_ROWS,
    GRID_SCALE,
    HALF_WIDTH,
    HEADING_X,
    HEADING_Y,
    HEADS_AT,
    IR_REACH,
    LAST,
    LENGTH,
    NEAR_AT,
    NEXT_AT,
    RADIUS,
    RAY_COUNT,
    RESPONSE,
    ROBOT,
    ROBOTS,
    SLOT,
    STEP,
    TANGENT_X,
    TANGENT_Y,
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
from elib.physics.sensors.measuring import Sight, measure
from elib.physics.sensors.proximity import SENSORS
from elib.physics.sensors.rays import DEVIATION, REFLECTED, SENSOR_HEIGHT
from elib.physics.sensors.sectors import FAR, LIST, SECTORS, STRAY, STRAY_ANGLE, TOUCHING, sector


@interpreted_kernel
def glance(
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
    """Find how much light each sensor gets back, counts, and the deviation of its noise there, into *scratch*."""
    r = robot * ROBOT
    here_x = robots[r + X]
    here_y = robots[r + Y]
    heading_x = robots[r + HEADING_X]
    heading_y = robots[r + HEADING_Y]
    turn_x = heading_x - robots[r + BEFORE_HEADING_X]
    turn_y = heading_y - robots[r + BEFORE_HEADING_Y]
    step_x = here_x - robots[r + BEFORE_X]
    step_y = here_y - robots[r + BEFORE_Y]
    share = robots[r + SLOT] / fixed[STEP]
    most = share * (9.0 * share)  # Three slots, squared.
    is_calm = (
        most * (step_x * step_x + step_y * step_y) < STRAY * STRAY
        and most * (turn_x * turn_x + turn_y * turn_y) < STRAY_ANGLE * STRAY_ANGLE
    )
    # What was sampled before the last tick began looks along a vector longer than 1, drawn out by that tick's turn.
    is_drawn = 3.0 * share > 1.0
    horizon = fixed[IR_REACH] + HORIZON
    # For each sensor the walls, and the discs, that it may see; there are no discs for a robot alone among walls.
    is_round = numbers[ROBOTS] > 1 or numbers[DISCS] > 0
    faced: list[list[Sight]] = [[], [], [], [], [], [], [], []]
    passed = faced
    if is_round:
        passed = [[], [], [], [], [], [], [], []]
    here = cell_at(here_x, here_y, fixed, numbers)
    middle = cells[here + 2]
    for m in range(cells[here + 1], middle):
        _face(
            cells[m] * WALL,
            here_x,
            here_y,
            heading_x,
            heading_y,
            is_calm,
            horizon,
            fixed,
            walls,
            numbers,
            faced,
        )
    if numbers[DISCS] > 0:
        for m in range(middle, cells[here + 3]):
            d = cells[m] * DISC
            dx = discs[d] - here_x
            dy = discs[d + 1] - here_y
            _pass_disc(d, dx, dy, heading_x, heading_y, is_calm, horizon, discs, numbers, passed)
    if is_listed(numbers):
        _look_around(
            robot,
            here_x,
            here_y,
            heading_x,
            heading_y,
            is_calm,
            horizon,
            fixed,
            robots,
            bodies,
            walls,
            discs,
            numbers,
            faced,
            passed,
        )
    for sensor, slots, place_x, place_y, ahead_x, ahead_y in SENSORS:
        in_sight = faced[sensor]
        if in_sight or (is_round and passed[sensor]):
            age = share * slots
            # Where the sensor was and looked, seen from where the robot is now.
            then_x = heading_x - age * turn_x
            then_y = heading_y - age * turn_y
            measure(
                sensor,
                then_x * ahead_x - then_y * ahead_y,
                then_y * ahead_x + then_x * ahead_y,
                then_x * place_x - then_y * place_y - age * step_x,
                then_y * place_x + then_x * place_y - age * step_y,
                is_drawn,
                in_sight,
                is_round,
                passed,
                numbers[RAY_COUNT],
                numbers[LAST],
                fixed,
                scratch,
            )
        else:
            scratch[REFLECTED + sensor] = fixed[CLEAR]
            scratch[DEVIATION + sensor] = fixed[RESPONSE + 2 * numbers[LAST] + 1]


@interpreted_kernel
def _look_around(
    robot: int,
    here_x: float,
    here_y: float,
    heading_x: float,
    heading_y: float,
    is_calm: bool,
    horizon: float,
    fixed: Floats,
    robots: Floats,
    bodies: Floats,
    walls: Floats,
    discs: Floats,
    numbers: Ints,
    faced: list[list[Sight]],
    passed: list[list[Sight]],
) -> None:
    """Put the robots and the pushable things around on the lists of the sensors that may see them."""
    count = numbers[ROBOTS]
    if count > 1:
        limit = (horizon + ROBOT_RADIUS) * (horizon + ROBOT_RADIUS)
        near = numbers[NEAR_AT] + robot
        for m in range(numbers[near], numbers[near + 1]):
            s = numbers[m] * ROBOT
            dx = robots[s + X] - here_x
            dy = robots[s + Y] - here_y
            if dx * dx + dy * dy < limit:
                _pass(dx, dy, robots[s + RADIUS], 1.0, heading_x, heading_y, is_calm, numbers, passed)
    if numbers[BODIES] > 0:
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
                        b = (j - count) * BODY
                        first = int(bodies[b + FIRST])
                        if bodies[b + HALF_WIDTH] == 0.0:
                            dx = bodies[b + X] - here_x
                            dy = bodies[b + Y] - here_y
                            _pass_disc(
                                first * DISC, dx, dy, heading_x, heading_y, is_calm, horizon, discs, numbers, passed
                            )
                        else:
                            for w in range(first * WALL, (first + 4) * WALL, WALL):
                                _face(
                                    w,
                                    here_x,
                                    here_y,
                                    heading_x,
                                    heading_y,
                                    is_calm,
                                    horizon,
                                    fixed,
                                    walls,
                                    numbers,
                                    faced,
                                )
                    j = numbers[numbers[NEXT_AT] + j]


@interpreted_kernel
def _face(
    w: int,
    here_x: float,
    here_y: float,
    heading_x: float,
    heading_y: float,
    is_calm: bool,
    horizon: float,
    fixed: Floats,
    walls: Floats,
    numbers: Ints,
    faced: list[list[Sight]],
) -> None:
    """Put a wall on the lists of the sensors that may see it."""
    dx = walls[w + WALL_X] - here_x
    dy = walls[w + WALL_Y] - here_y
    tangent_x = walls[w + TANGENT_X]
    tangent_y = walls[w + TANGENT_Y]
    offset = tangent_x * dy - tangent_y * dx
    away = offset if offset >= 0.0 else -offset
    if away >= horizon:
        return
    start = tangent_x * dx + tangent_y * dy
    end = start + walls[w + LENGTH]
    if start > horizon or end < -horizon or walls[w + WALL_TOP] < SENSOR_HEIGHT:
        return
    absorbs = walls[w + WALL_ABSORBS]
    if not is_calm and not is_near_wall(here_x, here_y, w, horizon, walls):
        return  # A sensor may have been beyond the horizon: what is within it is asked as exactly as in sighting.
    if away < HORIZON or not is_calm:  # Astride its line, beyond its end, any sensor may see it.
        wall = (tangent_x, tangent_y, offset, start, end, absorbs)
        for seen in faced:
            seen.append(wall)
        return
    if offset < 0.0:
        # Turned round, so that all sensors see it from its left: each number of it changes its sign and no other bit.
        tangent_x = -tangent_x
        tangent_y = -tangent_y
        start, end = -end, -start
    wall = (tangent_x, tangent_y, away, start, end, absorbs)
    listed = LIST * sector(tangent_x * heading_y - tangent_y * heading_x, tangent_x * heading_x + tangent_y * heading_y)
    for k in range(listed + 1, listed + 1 + numbers[WALL_LISTS + listed]):
        if away >= fixed[WALL_FAR + k]:
            return
        faced[numbers[WALL_LISTS + k]].append(wall)


@interpreted_kernel
def _pass_disc(
    d: int,
    dx: float,
    dy: float,
    heading_x: float,
    heading_y: float,
    is_calm: bool,
    horizon: float,
    discs: Floats,
    numbers: Ints,
    passed: list[list[Sight]],
) -> None:
    """Put a cylinder, whose centre is (dx, dy) away, on the lists if it is near and tall enough."""
    radius = discs[d + DISC_RADIUS]
    limit = horizon + radius
    if dx * dx + dy * dy < limit * limit and discs[d + DISC_TOP] >= SENSOR_HEIGHT:
        _pass(dx, dy, radius, discs[d + DISC_ABSORBS], heading_x, heading_y, is_calm, numbers, passed)


@interpreted_kernel
def _pass(
    dx: float,
    dy: float,
    radius: float,
    absorbs: float,
    heading_x: float,
    heading_y: float,
    is_calm: bool,
    numbers: Ints,
    passed: list[list[Sight]],
) -> None:
    """Put a disc on the lists of the sensors that may see it."""
    disc = (dx, dy, radius, absorbs)
    square = dx * dx + dy * dy
    # The lists are made for discs of up to a robot's size that do not overlap the robot.
    touching = radius + TOUCHING
    if radius > ROBOT_RADIUS or square <= touching * touching or not is_calm:
        for seen in passed:
            seen.append(disc)
        return
    listed = DISC_LISTS + LIST * sector(dx * heading_x + dy * heading_y, dy * heading_x - dx * heading_y)
    if square > FAR * FAR:
        listed += LIST * SECTORS
    for k in range(listed + 1, listed + 1 + numbers[listed]):
        passed[numbers[k]].append(disc)
