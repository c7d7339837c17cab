"""What a block of robots may see, put on lists for their rays: a part of :mod:`elib.physics.sensors.sweep`.

A list that is full is looked at in between; the functions return how long it is now.
"""

from __future__ import annotations

from elib.physics.engine import inner_kernel, kernel
from elib.physics.grid import HORIZON, cell, cell_at
from elib.physics.layout import (
    BODY,
    DISC,
    DISC_ABSORBS,
    DISC_RADIUS,
    DISC_TOP,
    FIRST,
    GRID_COLUMNS,
    GRID_ROWS,
    GRID_SCALE,
    HALF_WIDTH,
    HEADS_AT,
    IR_REACH,
    LENGTH,
    NEAR_AT,
    NEXT_AT,
    RADIUS,
    ROBOT,
    ROBOTS,
    SIGHT_AT,
    SLATE_AT,
    TANGENT_X,
    TANGENT_Y,
    WALL,
    WALL_TOP,
    WALL_X,
    WALL_Y,
    Floats,
    Ints,
    X,
    Y,
)
from elib.physics.room import (
    ASIDE_X,
    ASIDE_Y,
    DISC_SEER,
    MOST,
    OFFSETS,
    PALENESS,
    SIZES,
    STARTS,
    WALL_SEEN,
    WALL_SEER,
)
from elib.physics.sensors.beams import cast_at_discs, cast_at_walls
from elib.physics.sensors.rays import SENSOR_HEIGHT


@inner_kernel
def see_cell_walls(
    robot: int,
    b: int,
    count: int,
    fixed: Floats,
    robots: Floats,
    walls: Floats,
    cells: Ints,
    numbers: Ints,
    scratch: Floats,
) -> int:
    """Put the fixed walls that the robot may see on the list; return how long that is now."""
    x = robots[robot * ROBOT + X]
    y = robots[robot * ROBOT + Y]
    here = cell_at(x, y, fixed, numbers)
    horizon = fixed[IR_REACH] + HORIZON
    slate = numbers[SLATE_AT]
    for m in range(cells[here + 1], cells[here + 2]):
        count = _see_wall(cells[m] * WALL, b, x, y, count, horizon, slate, fixed, walls, numbers, scratch)
    return count


@inner_kernel
def see_listed_walls(
    first: int,
    last: int,
    count: int,
    fixed: Floats,
    robots: Floats,
    walls: Floats,
    numbers: Ints,
    scratch: Floats,
) -> int:
    """Put the fixed walls that some robots may see on the list; return how long that is now."""
    horizon = fixed[IR_REACH] + HORIZON
    slate = numbers[SLATE_AT]
    sight = numbers[SIGHT_AT]
    for m in range(numbers[sight + first], numbers[sight + last], 2):
        robot = numbers[m]
        x = robots[robot * ROBOT + X]
        y = robots[robot * ROBOT + Y]
        w = numbers[m + 1] * WALL
        count = _see_wall(w, robot - first, x, y, count, horizon, slate, fixed, walls, numbers, scratch)
    return count


@inner_kernel
def see_neighbours(
    robot: int, b: int, count: int, fixed: Floats, robots: Floats, numbers: Ints, scratch: Floats
) -> int:
    """Put the robots that the robot may see on the list of discs; return how long that is now."""
    if numbers[ROBOTS] == 1:
        return count
    x = robots[robot * ROBOT + X]
    y = robots[robot * ROBOT + Y]
    near = numbers[NEAR_AT] + robot
    for m in range(numbers[near], numbers[near + 1]):
        s = numbers[m] * ROBOT
        count = _see_disc(
            robots[s + X] - x, robots[s + Y] - y, robots[s + RADIUS], 1.0, b, count, fixed, numbers, scratch
        )
    return count


@kernel
def see_posts(
    robot: int,
    b: int,
    count: int,
    fixed: Floats,
    robots: Floats,
    discs: Floats,
    cells: Ints,
    numbers: Ints,
    scratch: Floats,
) -> int:
    """Put the fixed cylinders that the robot may see on the list; return how long that is now."""
    x = robots[robot * ROBOT + X]
    y = robots[robot * ROBOT + Y]
    here = cell_at(x, y, fixed, numbers)
    for m in range(cells[here + 2], cells[here + 3]):
        count = _see_post(cells[m] * DISC, b, x, y, count, fixed, discs, numbers, scratch)
    return count


@kernel
def see_boxes(
    robot: int,
    b: int,
    count: int,
    fixed: Floats,
    robots: Floats,
    bodies: Floats,
    walls: Floats,
    numbers: Ints,
    scratch: Floats,
) -> int:
    """Put the sides of pushable boxes that the robot may see on the list; return how long that is now."""
    x = robots[robot * ROBOT + X]
    y = robots[robot * ROBOT + Y]
    columns = numbers[GRID_COLUMNS]
    rows = numbers[GRID_ROWS]
    column = cell(x, fixed[GRID_SCALE], columns)
    row = cell(y, fixed[GRID_SCALE], rows)
    horizon = fixed[IR_REACH] + HORIZON
    slate = numbers[SLATE_AT]
    for v in range(max(row - 1, 0), min(row + 2, rows)):
        for u in range(max(column - 1, 0), min(column + 2, columns)):
            j = numbers[numbers[HEADS_AT] + v * columns + u]
            while j >= 0:
                t = (j - numbers[ROBOTS]) * BODY
                if t >= 0 and bodies[t + HALF_WIDTH] > 0.0:
                    side = int(bodies[t + FIRST]) * WALL
                    for w in range(side, side + 4 * WALL, WALL):
                        count = _see_wall(w, b, x, y, count, horizon, slate, fixed, walls, numbers, scratch)
                j = numbers[numbers[NEXT_AT] + j]
    return count


@kernel
def see_balls(
    robot: int,
    b: int,
    count: int,
    fixed: Floats,
    robots: Floats,
    bodies: Floats,
    discs: Floats,
    numbers: Ints,
    scratch: Floats,
) -> int:
    """Put the pushable cylinders that the robot may see on the list; return how long that is now."""
    x = robots[robot * ROBOT + X]
    y = robots[robot * ROBOT + Y]
    columns = numbers[GRID_COLUMNS]
    rows = numbers[GRID_ROWS]
    column = cell(x, fixed[GRID_SCALE], columns)
    row = cell(y, fixed[GRID_SCALE], rows)
    for v in range(max(row - 1, 0), min(row + 2, rows)):
        for u in range(max(column - 1, 0), min(column + 2, columns)):
            j = numbers[numbers[HEADS_AT] + v * columns + u]
            while j >= 0:
                t = (j - numbers[ROBOTS]) * BODY
                if t >= 0 and bodies[t + HALF_WIDTH] == 0.0:
                    count = _see_post(int(bodies[t + FIRST]) * DISC, b, x, y, count, fixed, discs, numbers, scratch)
                j = numbers[numbers[NEXT_AT] + j]
    return count


@inner_kernel
def _see_wall(
    w: int,
    b: int,
    x: float,
    y: float,
    count: int,
    horizon: float,
    slate: int,
    fixed: Floats,
    walls: Floats,
    numbers: Ints,
    scratch: Floats,
) -> int:
    """Put a wall on the list, if it is in sight from (x, y); return how long that is now."""
    dx = walls[w + WALL_X] - x
    dy = walls[w + WALL_Y] - y
    tangent_x = walls[w + TANGENT_X]
    tangent_y = walls[w + TANGENT_Y]
    offset = tangent_x * dy - tangent_y * dx
    start = tangent_x * dx + tangent_y * dy
    scratch[OFFSETS + count] = offset
    scratch[STARTS + count] = start
    numbers[slate + WALL_SEEN + count] = w
    numbers[slate + WALL_SEER + count] = b
    # How far the nearest point of the wall is: beside the foot of the perpendicular, or at it.
    beyond = max(start, -start - walls[w + LENGTH], 0.0)
    count += (offset * offset + beyond * beyond < horizon * horizon) & (walls[w + WALL_TOP] >= SENSOR_HEIGHT)
    if count == MOST:
        cast_at_walls(count, fixed, walls, numbers, scratch)
        return 0
    return count


@inner_kernel
def _see_post(
    d: int,
    b: int,
    x: float,
    y: float,
    count: int,
    fixed: Floats,
    discs: Floats,
    numbers: Ints,
    scratch: Floats,
) -> int:
    """Put a cylinder on the list, if it is in sight from (x, y); return how long that is now."""
    if discs[d + DISC_TOP] < SENSOR_HEIGHT:
        return count
    return _see_disc(
        discs[d + X] - x,
        discs[d + Y] - y,
        discs[d + DISC_RADIUS],
        discs[d + DISC_ABSORBS],
        b,
        count,
        fixed,
        numbers,
        scratch,
    )


@inner_kernel
def _see_disc(
    dx: float,
    dy: float,
    radius: float,
    absorbs: float,
    b: int,
    count: int,
    fixed: Floats,
    numbers: Ints,
    scratch: Floats,
) -> int:
    """Put a disc (dx, dy) away on the list, if it is in sight; return how long that is now."""
    limit = fixed[IR_REACH] + HORIZON + radius
    scratch[ASIDE_X + count] = dx
    scratch[ASIDE_Y + count] = dy
    scratch[SIZES + count] = radius
    scratch[PALENESS + count] = absorbs
    numbers[numbers[SLATE_AT] + DISC_SEER + count] = b
    count += dx * dx + dy * dy < limit * limit
    if count == MOST:
        cast_at_discs(count, fixed, numbers, scratch)
        return 0
    return count
