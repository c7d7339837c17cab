"""All rays and readings of a robot's eight infrared sensors at once: what the compiled engine runs.

The laws are those of :mod:`elib.physics.sensors.rays` and :mod:`elib.physics.sensors.responding`; the operations are
those of :mod:`elib.physics.sensors.glance`, one by one, so that both engines agree to the last bit. Here each works on
a vector of eight, one a sensor (:mod:`elib.physics.vector`), and every sensor takes part, whether or not it looks that
way: working a ray out in vain costs nothing where it is done for eight, and a branch foreseen wrongly costs more than
all of them.
"""

from __future__ import annotations

from elib.physics.engine import inner_kernel, kernel
from elib.physics.grid import HORIZON, cell, is_listed
from elib.physics.layout import (
    AGE,
    AXIS_X,
    AXIS_Y,
    BEFORE_HEADING_X,
    BEFORE_HEADING_Y,
    BEFORE_X,
    BEFORE_Y,
    BODIES,
    BODY,
    CELL,
    CELL_COLUMNS,
    CELL_ROWS,
    CELL_SCALE,
    DISC,
    DISC_ABSORBS,
    DISC_RADIUS,
    DISC_TOP,
    DISCS,
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
    LIGHTS,
    NEAR_AT,
    NEXT_AT,
    NUMBER,
    PLACE_X,
    PLACE_Y,
    RADIUS,
    RAY_COUNT,
    ROBOT,
    ROBOTS,
    SEEN,
    SIGHT_AT,
    SLATE_AT,
    SLOT,
    STEP,
    TANGENT_X,
    TANGENT_Y,
    TICK,
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
    AHEAD_X,
    AHEAD_Y,
    ASIDE_X,
    ASIDE_Y,
    BEAM,
    BEAMS,
    BLOCK,
    DARK,
    DISC_SEER,
    FROM_X,
    FROM_Y,
    LIGHT,
    LIT,
    MOST,
    OFFSETS,
    PALENESS,
    POSED,
    POSES,
    SEEING,
    SIZES,
    STARTS,
    WALL_SEEN,
    WALL_SEER,
)
from elib.physics.sensors.beams import cast_at_discs, cast_at_walls, measure
from elib.physics.sensors.rays import ABSORBS, NOTHING, SENSOR_HEIGHT
from elib.physics.sensors.readings import look_up_light, look_up_noise, reflect, respond_unlit
from elib.physics.sensors.responding import COUNT, note, respond
from elib.physics.vector import load, spread, store


@kernel
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
    count = numbers[ROBOTS]
    for first in range(0, count, BLOCK):
        last = min(first + BLOCK, count)
        _sweep(first, last, fixed, robots, bodies, walls, discs, cells, numbers, lights, scratch)


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
    """Read the sensors of one robot into its record, once a tick."""
    if numbers[HEAD + robot * NUMBER + SEEN] != numbers[TICK]:
        _sweep(robot, robot + 1, fixed, robots, bodies, walls, discs, cells, numbers, lights, scratch)


@kernel
def _sweep(
    first: int,
    last: int,
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
    """Read the sensors of a block of robots, step by step for all of them.

    Each step is so short that the processor keeps it decoded, which all of them together are not.
    """
    rays = numbers[RAY_COUNT]
    nothing = 1.0 / fixed[IR_REACH]
    seen = 0
    for robot in range(first, last):
        _prepare(robot, robot - first, rays, nothing, fixed, robots, scratch)
    if is_listed(numbers):
        seen = _see_listed_walls(first, last, seen, fixed, robots, walls, numbers, scratch)
    else:
        seen = _see_cell_walls(first, 0, seen, fixed, robots, walls, cells, numbers, scratch)
    if numbers[BODIES] > 0:
        for robot in range(first, last):
            seen = _see_boxes(robot, robot - first, seen, fixed, robots, bodies, walls, numbers, scratch)
    cast_at_walls(seen, fixed, walls, numbers, scratch)
    for b in range(last - first):
        measure(b, rays, nothing, scratch)
    seen = 0
    for robot in range(first, last):
        b = robot - first
        if numbers[DISCS] > 0:
            seen = _see_posts(robot, b, seen, fixed, robots, discs, cells, numbers, scratch)
        seen = _see_neighbours(robot, b, seen, fixed, robots, numbers, scratch)
        if numbers[BODIES] > 0:
            seen = _see_balls(robot, b, seen, fixed, robots, bodies, discs, numbers, scratch)
    cast_at_discs(seen, fixed, numbers, scratch)
    for robot in range(first, last):
        look_up_noise(robot, robot - first, numbers)
    for b in range(last - first):
        look_up_light(b, rays, fixed, numbers, scratch)
    for b in range(last - first):
        reflect(b, rays, fixed, numbers, scratch)
    if numbers[LIGHTS] > 0:
        for robot in range(first, last):
            light = LIGHT + (robot - first) * LIT
            respond(robot, light, light + DARK, fixed, robots, walls, discs, numbers, lights, scratch)
        return
    for robot in range(first, last):
        respond_unlit(robot, robot - first, fixed, numbers, scratch)
    for robot in range(first, last):
        n = HEAD + robot * NUMBER
        if numbers[n + SEEN] != numbers[TICK]:
            note(n, numbers)


@inner_kernel
def _prepare(robot: int, b: int, rays: int, nothing: float, fixed: Floats, robots: Floats, scratch: Floats) -> None:
    """Let all rays of a robot meet nothing, and note how it stood when its sensors were sampled."""
    at = BEAMS + b * BEAM
    for k in range(at, at + rays * COUNT, COUNT):
        store(scratch, k, spread(nothing))
        store(scratch, ABSORBS + k, spread(NOTHING))
    r = robot * ROBOT
    pose = POSES + b * POSED
    heading_x = robots[r + HEADING_X]
    heading_y = robots[r + HEADING_Y]
    age = load(fixed, AGE) * (robots[r + SLOT] / fixed[STEP])
    then_x = heading_x - age * (heading_x - robots[r + BEFORE_HEADING_X])
    then_y = heading_y - age * (heading_y - robots[r + BEFORE_HEADING_Y])
    axis_x = load(fixed, AXIS_X)
    axis_y = load(fixed, AXIS_Y)
    place_x = load(fixed, PLACE_X)
    place_y = load(fixed, PLACE_Y)
    store(scratch, pose + AHEAD_X, then_x * axis_x - then_y * axis_y)
    store(scratch, pose + AHEAD_Y, then_y * axis_x + then_x * axis_y)
    store(scratch, pose + FROM_X, then_x * place_x - then_y * place_y - age * (robots[r + X] - robots[r + BEFORE_X]))
    store(scratch, pose + FROM_Y, then_y * place_x + then_x * place_y - age * (robots[r + Y] - robots[r + BEFORE_Y]))
    scratch[pose + SEEING] = 0.0


# -- what is in sight --


@inner_kernel
def _see_cell_walls(
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
    scale = fixed[CELL_SCALE]
    columns = numbers[CELL_COLUMNS]
    here = CELL * (cell(y, scale, numbers[CELL_ROWS]) * columns + cell(x, scale, columns))
    horizon = fixed[IR_REACH] + HORIZON
    slate = numbers[SLATE_AT]
    for m in range(cells[here], cells[here + 2]):
        count = _see_wall(cells[m] * WALL, b, x, y, count, horizon, slate, fixed, walls, numbers, scratch)
    return count


@inner_kernel
def _see_listed_walls(
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
def _see_neighbours(
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
def _see_posts(
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
    scale = fixed[CELL_SCALE]
    columns = numbers[CELL_COLUMNS]
    here = CELL * (cell(y, scale, numbers[CELL_ROWS]) * columns + cell(x, scale, columns))
    for m in range(cells[here + 2], cells[here + 3]):
        count = _see_post(cells[m] * DISC, b, x, y, count, fixed, discs, numbers, scratch)
    return count


@kernel
def _see_boxes(
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
def _see_balls(
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
