"""Who may be near what: the grid of moving things, and the lists of each robot's neighbours and of the walls around it.

Every robot and every pushable thing hangs in the chain of the cell in which its centre lay when the grid was last
made, and every robot has a list of the robots, and of the walls, that it may touch or see. All are generous by what
things may move in the meantime, so they hold for many ticks: they are made anew when something has moved by
:data:`STRAY`, and the time for that grows with the number of things alone. Neighbours stand in rising order and walls
as they were built, so that nothing depends on when. A robot alone among fixed things needs neither grid nor
lists (:func:`is_listed`).
"""

from __future__ import annotations

from typing import Final

from elib.physics.body import RADIUS as ROBOT_RADIUS
from elib.physics.body import SENSOR_RADIUS
from elib.physics.engine import inner_kernel, kernel
from elib.physics.layout import (
    BODIES,
    BODY,
    BODY_LISTED_X,
    BODY_LISTED_Y,
    CELL,
    CELL_COLUMNS,
    CELL_ROWS,
    CELL_SCALE,
    EDGE,
    GRID_COLUMNS,
    GRID_ROWS,
    GRID_SCALE,
    HEADS_AT,
    IR_REACH,
    LENGTH,
    LISTED_X,
    LISTED_Y,
    LONGEST_ROLL,
    NEAR_AT,
    NEAR_END,
    NEAR_LACK,
    NEXT_AT,
    PAIRS_AT,
    PAIRS_END,
    PLACE_AT,
    RADIUS,
    ROBOT,
    ROBOTS,
    SIGHT_AT,
    TANGENT_X,
    TANGENT_Y,
    TOUCH_AT,
    TOUCH_END,
    WALL,
    WALL_X,
    WALL_Y,
    Floats,
    Ints,
    X,
    Y,
)

STRAY: Final = 0.02
"""How far anything may be from where it was listed at the end of a tick, m: else the lists are made anew."""

SLACK: Final = 2 * STRAY
"""How much nearer two things may have come meanwhile, m. In the tick under way contacts may bring them nearer still: a
robot sees so much farther than it can touch that its list also covers that."""

HORIZON: Final = SENSOR_RADIUS + 0.004
"""m. All infrared sensors sit within it, also where they were a slot ago."""


@inner_kernel
def cell(coordinate: float, scale: float, count: int) -> int:
    """Return the row or column of a place, 0..count - 1; what lies outside belongs to the outermost cells."""
    index = int(coordinate * scale)
    if index >= count:
        return count - 1
    return index if index > 0 else 0


@inner_kernel
def cell_at(x: float, y: float, fixed: Floats, numbers: Ints) -> int:
    """Return where in the grid of fixed things the numbers of the cell of a place begin."""
    columns = numbers[CELL_COLUMNS]
    scale = fixed[CELL_SCALE]
    return CELL * (cell(y, scale, numbers[CELL_ROWS]) * columns + cell(x, scale, columns))


@inner_kernel
def is_listed(numbers: Ints) -> bool:
    """Return whether there are lists: something besides one robot moves."""
    return numbers[ROBOTS] + numbers[BODIES] > 1


@inner_kernel
def approach(fixed: Floats) -> float:
    """Return how far a robot may be from where it was listed when it has rolled, m."""
    return STRAY + fixed[LONGEST_ROLL]


@kernel
def regrid(
    fixed: Floats, robots: Floats, bodies: Floats, walls: Floats, discs: Floats, cells: Ints, numbers: Ints
) -> None:
    """Hang every moving thing into the chain of its cell, in rising order within it, and list what is near whom.

    It takes the sequences that all kernels take, of which it does not need the discs.
    """
    scale = fixed[GRID_SCALE]
    columns = numbers[GRID_COLUMNS]
    rows = numbers[GRID_ROWS]
    following = numbers[NEXT_AT]
    place = numbers[PLACE_AT]
    heads = numbers[HEADS_AT]
    count = numbers[ROBOTS]
    total = count + numbers[BODIES]
    for k in range(total):
        numbers[heads + numbers[place + k]] = -1
    for k in range(total - 1, -1, -1):
        if k < count:
            x = robots[k * ROBOT + X]
            y = robots[k * ROBOT + Y]
            robots[k * ROBOT + LISTED_X] = x
            robots[k * ROBOT + LISTED_Y] = y
        else:
            x = bodies[(k - count) * BODY + X]
            y = bodies[(k - count) * BODY + Y]
            bodies[(k - count) * BODY + BODY_LISTED_X] = x
            bodies[(k - count) * BODY + BODY_LISTED_Y] = y
        here = cell(y, scale, rows) * columns + cell(x, scale, columns)
        numbers[place + k] = here
        numbers[following + k] = numbers[heads + here]
        numbers[heads + here] = k
    _list(fixed, robots, numbers)
    if not numbers[NEAR_LACK]:
        _list_walls(fixed, robots, walls, cells, numbers)


@kernel
def _list(fixed: Floats, robots: Floats, numbers: Ints) -> None:
    """List each robot's neighbours, as far as there is room."""
    columns = numbers[GRID_COLUMNS]
    rows = numbers[GRID_ROWS]
    following = numbers[NEXT_AT]
    place = numbers[PLACE_AT]
    heads = numbers[HEADS_AT]
    count = numbers[ROBOTS]
    near = numbers[NEAR_AT]
    reach = fixed[IR_REACH] + HORIZON + ROBOT_RADIUS + SLACK
    end = numbers[SIGHT_AT] + count + 1
    room = numbers[NEAR_END]
    numbers[NEAR_LACK] = 0
    for i in range(count):
        numbers[near + i] = end
        first = end
        x = robots[i * ROBOT + X]
        y = robots[i * ROBOT + Y]
        row = numbers[place + i] // columns
        column = numbers[place + i] - row * columns
        for v in range(max(row - 1, 0), min(row + 2, rows)):
            for u in range(max(column - 1, 0), min(column + 2, columns)):
                j = numbers[heads + v * columns + u]
                while 0 <= j < count:  # In rising order: behind the robots hang the pushable things.
                    dx = robots[j * ROBOT + X] - x
                    dy = robots[j * ROBOT + Y] - y
                    if j != i and dx * dx + dy * dy < reach * reach:
                        if end == room:
                            numbers[NEAR_LACK] = 1
                            return
                        at = end
                        while at > first and numbers[at - 1] > j:
                            numbers[at] = numbers[at - 1]
                            at -= 1
                        numbers[at] = j
                        end += 1
                    j = numbers[following + j]
    numbers[near + count] = end
    _pair(fixed, robots, numbers)


@kernel
def _pair(fixed: Floats, robots: Floats, numbers: Ints) -> None:
    """List the pairs of neighbours that may touch, as far as there is room."""
    count = numbers[ROBOTS]
    near = numbers[NEAR_AT]
    end = numbers[near + count]
    room = numbers[NEAR_END]
    reach = 2.0 * (ROBOT_RADIUS + approach(fixed))
    numbers[PAIRS_AT] = end
    for i in range(count):
        for m in range(numbers[near + i], numbers[near + i + 1]):
            j = numbers[m]
            dx = robots[j * ROBOT + X] - robots[i * ROBOT + X]
            dy = robots[j * ROBOT + Y] - robots[i * ROBOT + Y]
            if j > i and dx * dx + dy * dy < reach * reach:
                if end + 2 > room:
                    numbers[NEAR_LACK] = 1
                    return
                numbers[end] = i
                numbers[end + 1] = j
                end += 2
    numbers[PAIRS_END] = end


@kernel
def _list_walls(fixed: Floats, robots: Floats, walls: Floats, cells: Ints, numbers: Ints) -> None:
    """List the fixed walls that each robot may see, and those of them that it may touch, as far as there is room."""
    count = numbers[ROBOTS]
    sight = numbers[SIGHT_AT]
    end = numbers[PAIRS_END]
    room = numbers[NEAR_END]
    reach = fixed[IR_REACH] + HORIZON + STRAY
    for i in range(count):
        numbers[sight + i] = end
        x = robots[i * ROBOT + X]
        y = robots[i * ROBOT + Y]
        here = cell_at(x, y, fixed, numbers)
        for n in range(cells[here + 1], cells[here + 2]):
            if is_near_wall(x, y, cells[n] * WALL, reach, walls):
                if end + 2 > room:
                    numbers[NEAR_LACK] = 1
                    return
                numbers[end] = i
                numbers[end + 1] = cells[n]
                end += 2
    numbers[sight + count] = end
    numbers[TOUCH_AT] = end
    for n in range(numbers[sight], numbers[TOUCH_AT], 2):
        r = numbers[n] * ROBOT
        w = numbers[n + 1]
        if w >= EDGE and is_near_wall(
            robots[r + X], robots[r + Y], w * WALL, robots[r + RADIUS] + approach(fixed), walls
        ):
            if end + 2 > room:
                numbers[NEAR_LACK] = 1
                return
            numbers[end] = numbers[n]
            numbers[end + 1] = w
            end += 2
    numbers[TOUCH_END] = end


@inner_kernel
def is_near_wall(x: float, y: float, w: int, limit: float, walls: Floats) -> bool:
    """Return whether any part of a wall is nearer to (x, y) than *limit*."""
    dx = walls[w + WALL_X] - x
    dy = walls[w + WALL_Y] - y
    offset = walls[w + TANGENT_X] * dy - walls[w + TANGENT_Y] * dx
    start = walls[w + TANGENT_X] * dx + walls[w + TANGENT_Y] * dy
    # Along the wall: how far it is to its nearer end, or nothing beside it.
    beyond = max(start, -start - walls[w + LENGTH], 0.0)
    return offset * offset + beyond * beyond < limit * limit


@kernel
def is_stale(robots: Floats, bodies: Floats, numbers: Ints) -> bool:
    """Return whether anything has moved farther than the grid and the lists allow."""
    for i in range(numbers[ROBOTS]):
        r = i * ROBOT
        dx = robots[r + X] - robots[r + LISTED_X]
        dy = robots[r + Y] - robots[r + LISTED_Y]
        if dx * dx + dy * dy > STRAY * STRAY:
            return True
    for k in range(numbers[BODIES]):
        b = k * BODY
        dx = bodies[b + X] - bodies[b + BODY_LISTED_X]
        dy = bodies[b + Y] - bodies[b + BODY_LISTED_Y]
        if dx * dx + dy * dy > STRAY * STRAY:
            return True
    return False
