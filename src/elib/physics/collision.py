"""Contacts: overlapping things are pushed apart in a fixed order until nothing overlaps.

Positions are projected: nothing bounces and nothing stores energy, so a robot slides along what it touches and
pushes what can be pushed, at the speed that the masses allow. Two robots give way by half each; a robot and a pushable
thing by the inverse of their masses; what is fixed does not; the arena's edge has the last word. A pair that does
not overlap is left alone to the last bit, so that what happens here does not depend on what happens elsewhere.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.physics.body import MASS
from elib.physics.engine import inner_kernel, kernel
from elib.physics.grid import cell, cell_at, is_listed, is_near_wall
from elib.physics.layout import (
    AWAKE,
    BEFORE_X,
    BEFORE_Y,
    BODIES,
    BODY,
    DEPTH,
    DISC,
    DISC_RADIUS,
    DISCS,
    EDGE,
    GRID_COLUMNS,
    GRID_ROWS,
    GRID_SCALE,
    HEADS_AT,
    LENGTH,
    LIGHTNESS,
    NEAR_AT,
    NEXT_AT,
    PAIRS_AT,
    PAIRS_END,
    RADIUS,
    ROBOT,
    ROBOTS,
    STIRRED,
    TANGENT_X,
    TANGENT_Y,
    TOUCH_AT,
    TOUCH_END,
    TURNABLE,
    WALL,
    WALL_X,
    WALL_Y,
    WALLS,
    WAS,
    WIDTH,
    Floats,
    Ints,
    X,
    Y,
)
from elib.physics.things import TOLERANCE, follow, nearest, settle, shift

PATIENCE: Final = 48
"""Passes in which things are pushed apart; only what still moves takes part. A pair needs 15, a row more.
What overlaps after them is wedged in, and is put back to where it was before the tick, where it did not."""

PASSES: Final = 200
"""Putting one thing back may leave its neighbour no room, and so on; each goes back at most once."""

SWEEPS: Final = 12
"""Between two fixed things a robot is pushed to and fro at most so often: then it is wedged in, and has not moved."""

EASY: Final = 2
"""In the first passes two robots are put side by side. What is not apart by then is held by walls or by others, and
gives way by a few per cent of the overlap a pass: from then on robots are pushed by :data:`ZEAL` times as much and a
:data:`HAIR` farther, which needs a tenth of the passes (successive over-relaxation)."""

ZEAL: Final = 1.7
HAIR: Final = 1e-4  # m

SLIDE: Final = 0.01
"""m. No farther, and no farther than twice its way in this tick, does a robot slide along a fixed thing to come clear
of another: nearly parallel ones would send it past things that it has not looked at."""

ROBOT_LIGHTNESS: Final = 1.0 / MASS


@kernel
def collide(
    fixed: Floats, robots: Floats, bodies: Floats, walls: Floats, discs: Floats, cells: Ints, numbers: Ints
) -> bool:
    """Push overlapping things apart until nothing overlaps by more than :data:`TOLERANCE`; return whether any did."""
    count = numbers[ROBOTS]
    things = numbers[BODIES]
    is_quiet = _wake(fixed, robots, walls, discs, cells, numbers)
    if is_quiet and things == 0:
        return False
    for k in range(things):
        b = k * BODY
        for part in range(4):
            bodies[b + WAS + part] = bodies[b + part]
    has_neighbours = is_listed(numbers)
    has_moved = False
    for turn in range(1, PASSES + 1):
        is_quiet = True
        for i in range(count):
            # In the first pass those are awake that overlap something; later, who was moved in this pass or the last.
            r = i * ROBOT
            if robots[r + AWAKE] < turn - 1:
                continue
            is_pushed = has_neighbours and _leave_robots(i, turn, fixed, robots, bodies, numbers)
            if _leave_fixed(i, turn, fixed, robots, walls, discs, cells, numbers):
                is_pushed = True
            if is_pushed:
                is_quiet = False
                if turn > PATIENCE:
                    robots[r + X] = robots[r + BEFORE_X]
                    robots[r + Y] = robots[r + BEFORE_Y]
        for k in range(things):
            b = k * BODY
            if turn > 1 and bodies[b + STIRRED] == 0.0:
                continue
            bodies[b + STIRRED] = 0.0
            is_pushed = settle(k, turn, fixed, bodies, walls, discs, cells, numbers)
            if _press(k, turn, fixed, robots, bodies, numbers):
                is_pushed = True
            if is_pushed:
                is_quiet = False
                if turn > PATIENCE:
                    for part in range(4):
                        bodies[b + part] = bodies[b + WAS + part]
        if is_quiet:
            break
        has_moved = True
    if has_moved:
        for i in range(count):
            if robots[i * ROBOT + AWAKE] > 0.0:
                _stay_inside(i * ROBOT, fixed, robots)
        for k in range(things):
            follow(k, bodies, walls, discs)
    return has_moved


@kernel
def _wake(fixed: Floats, robots: Floats, walls: Floats, discs: Floats, cells: Ints, numbers: Ints) -> bool:
    """Wake the robots that overlap something else than what can be pushed; return whether there are none.

    Most ticks of most robots end here.
    """
    has_lists = is_listed(numbers)
    has_fixed = numbers[DISCS] > 0 or (numbers[WALLS] > EDGE and not has_lists)
    width = fixed[WIDTH]
    depth = fixed[DEPTH]
    is_quiet = True
    for i in range(numbers[ROBOTS]):
        r = i * ROBOT
        x = robots[r + X]
        y = robots[r + Y]
        radius = robots[r + RADIUS]
        overlaps = x < radius or x > width - radius or y < radius or y > depth - radius
        if has_fixed and not overlaps:
            overlaps = _is_in_fixed(x, y, radius, has_lists, fixed, walls, discs, cells, numbers)
        robots[r + AWAKE] = 0.0 if overlaps else -1.0
        if overlaps:
            is_quiet = False
    if not has_lists:
        return is_quiet
    for m in range(numbers[TOUCH_AT], numbers[TOUCH_END], 2):
        r = numbers[m] * ROBOT
        if is_near_wall(robots[r + X], robots[r + Y], numbers[m + 1] * WALL, robots[r + RADIUS] - TOLERANCE, walls):
            robots[r + AWAKE] = 0.0
            is_quiet = False
    for m in range(numbers[PAIRS_AT], numbers[PAIRS_END], 2):
        r = numbers[m] * ROBOT
        s = numbers[m + 1] * ROBOT
        dx = robots[s + X] - robots[r + X]
        dy = robots[s + Y] - robots[r + Y]
        limit = robots[r + RADIUS] + robots[s + RADIUS] - TOLERANCE
        if dx * dx + dy * dy < limit * limit:
            robots[r + AWAKE] = 0.0
            robots[s + AWAKE] = 0.0
            is_quiet = False
    return is_quiet


@kernel
def _is_in_fixed(
    x: float,
    y: float,
    radius: float,
    has_lists: bool,
    fixed: Floats,
    walls: Floats,
    discs: Floats,
    cells: Ints,
    numbers: Ints,
) -> bool:
    """Return whether a robot overlaps a fixed disc or, if those it may touch are not listed, a wall."""
    here = cell_at(x, y, fixed, numbers)
    if not has_lists:
        for n in range(cells[here], cells[here + 1]):
            if cells[n] >= EDGE and is_near_wall(x, y, cells[n] * WALL, radius - TOLERANCE, walls):
                return True
    for n in range(cells[here + 2], cells[here + 3]):
        d = cells[n] * DISC
        dx = x - discs[d]
        dy = y - discs[d + 1]
        reach = radius + discs[d + DISC_RADIUS] - TOLERANCE
        if dx * dx + dy * dy < reach * reach:
            return True
    return False


@kernel
def _leave_robots(i: int, turn: int, fixed: Floats, robots: Floats, bodies: Floats, numbers: Ints) -> bool:
    """Push robot *i* and the moving things that overlap it apart."""
    r = i * ROBOT
    radius = robots[r + RADIUS]
    has_moved = False
    near = numbers[NEAR_AT] + i
    share = 0.5 if turn <= EASY else 0.5 * ZEAL
    hair = 0.0 if turn <= EASY else HAIR
    for m in range(numbers[near], numbers[near + 1]):
        j = numbers[m]
        s = j * ROBOT
        if j > i or robots[s + AWAKE] < turn - 1:
            dx = robots[s + X] - robots[r + X]
            dy = robots[s + Y] - robots[r + Y]
            reach = radius + robots[s + RADIUS]
            limit = reach - TOLERANCE
            square = dx * dx + dy * dy
            if square < limit * limit:
                distance = sqrt(square)
                if distance > 0.0:
                    push = share * (reach + hair - distance) / distance
                else:
                    push = share * reach
                    dx = 1.0  # On top of each other: any direction will do, if it is always the same.
                robots[r + X] -= push * dx
                robots[r + Y] -= push * dy
                robots[s + X] += push * dx
                robots[s + Y] += push * dy
                robots[r + AWAKE] = turn
                robots[s + AWAKE] = turn
                has_moved = True
    if numbers[BODIES] > 0 and _leave_bodies(r, turn, fixed, robots, bodies, numbers):
        has_moved = True
    return has_moved


@kernel
def _leave_bodies(r: int, turn: int, fixed: Floats, robots: Floats, bodies: Floats, numbers: Ints) -> bool:
    """Push a robot and the pushable things that overlap it apart."""
    count = numbers[ROBOTS]
    columns = numbers[GRID_COLUMNS]
    rows = numbers[GRID_ROWS]
    column = cell(robots[r + X], fixed[GRID_SCALE], columns)
    row = cell(robots[r + Y], fixed[GRID_SCALE], rows)
    has_moved = False
    for v in range(max(row - 1, 0), min(row + 2, rows)):
        for u in range(max(column - 1, 0), min(column + 2, columns)):
            j = numbers[numbers[HEADS_AT] + v * columns + u]
            while j >= 0:
                if j >= count and _push(r, (j - count) * BODY, turn, robots, bodies):
                    has_moved = True
                j = numbers[numbers[NEXT_AT] + j]
    return has_moved


@kernel
def _leave_fixed(
    i: int, turn: int, fixed: Floats, robots: Floats, walls: Floats, discs: Floats, cells: Ints, numbers: Ints
) -> bool:
    """Push robot *i* out of fixed things and back into the arena."""
    r = i * ROBOT
    x = robots[r + X]
    y = robots[r + Y]
    radius = robots[r + RADIUS]
    limit = radius - TOLERANCE
    step_x = x - robots[r + BEFORE_X]
    step_y = y - robots[r + BEFORE_Y]
    longest = min(4.0 * (step_x * step_x + step_y * step_y), SLIDE * SLIDE)
    width = fixed[WIDTH] - radius
    depth = fixed[DEPTH] - radius
    has_moved = False
    contacts = 0
    for _ in range(SWEEPS):
        here = cell_at(x, y, fixed, numbers)
        from_x = x
        from_y = y
        contacts = 0
        # Of the contact before: its normal, and how far along that the robot must be.
        last_x = 0.0
        last_y = 0.0
        level = 0.0
        for n in range(cells[here + 2], cells[here + 3]):
            d = cells[n] * DISC
            dx = x - discs[d]
            dy = y - discs[d + 1]
            reach = radius + discs[d + DISC_RADIUS]
            square = dx * dx + dy * dy
            if square >= (reach - TOLERANCE) * (reach - TOLERANCE):
                continue
            distance = sqrt(square)
            normal_x = 1.0
            normal_y = 0.0
            if distance > 0.0:
                normal_x = dx / distance
                normal_y = dy / distance
            x += (reach - distance) * normal_x
            y += (reach - distance) * normal_y
            x, y, level = _slide(x, y, normal_x, normal_y, last_x, last_y, level, longest)
            last_x = normal_x
            last_y = normal_y
            contacts += 1
        for n in range(cells[here], cells[here + 1]):
            if cells[n] < EDGE:
                continue
            w = cells[n] * WALL
            dx = x - walls[w + WALL_X]
            dy = y - walls[w + WALL_Y]
            tangent_x = walls[w + TANGENT_X]
            tangent_y = walls[w + TANGENT_Y]
            offset = tangent_x * dy - tangent_y * dx
            if offset >= limit or offset <= -limit:
                continue
            side = 1.0 if offset >= 0.0 else -1.0
            distance = side * offset
            normal_x = -side * tangent_y
            normal_y = side * tangent_x
            along = tangent_x * dx + tangent_y * dy
            foot = min(max(along, 0.0), walls[w + LENGTH])
            if foot != along:  # The nearest point is an end of the wall.
                dx -= foot * tangent_x
                dy -= foot * tangent_y
                square = dx * dx + dy * dy
                if square >= limit * limit:
                    continue
                distance = sqrt(square)
                normal_x = dx / distance
                normal_y = dy / distance
            x += (radius - distance) * normal_x
            y += (radius - distance) * normal_y
            x, y, level = _slide(x, y, normal_x, normal_y, last_x, last_y, level, longest)
            last_x = normal_x
            last_y = normal_y
            contacts += 1
        if x < radius or x > width:
            edge = radius if x < radius else width
            contacts += abs(x - edge) > TOLERANCE
            normal_x = 1.0 if x < radius else -1.0
            x, y, level = _slide(edge, y, normal_x, 0.0, last_x, last_y, level, longest)
            last_x = normal_x
            last_y = 0.0
        if y < radius or y > depth:
            edge = radius if y < radius else depth
            contacts += abs(y - edge) > TOLERANCE
            x, y, _ = _slide(x, edge, 0.0, 1.0, last_x, last_y, level, longest)
        if contacts > 0:
            has_moved = True
        # Out of one thing: the next pass sees whether that led into another. Back where it was: it would go on so.
        if contacts < 2 or (x == from_x and y == from_y):
            break
    if contacts > 1:
        x = robots[r + BEFORE_X]
        y = robots[r + BEFORE_Y]
    robots[r + X] = x
    robots[r + Y] = y
    if has_moved:
        robots[r + AWAKE] = turn
    return has_moved


@inner_kernel
def _slide(
    x: float, y: float, normal_x: float, normal_y: float, last_x: float, last_y: float, level: float, longest: float
) -> tuple[float, float, float]:
    """Return where a robot goes that was pushed out of a fixed thing, by this normal, and maybe into the last again.

    It slides along the one until it is clear of the other: so it leaves a corner at once, where pushing it to and fro
    gets nearer by a share of the rest each time. Before the first contact *last* is 0; *longest* is the square of how
    far it may slide. What comes back third is the level of this contact, for the next one.
    """
    lack = level - (x * last_x + y * last_y)
    lean = normal_x * last_y - normal_y * last_x
    if lack > 0.0 and lack * lack < longest * (lean * lean):
        slide = lack / lean
        x -= slide * normal_y
        y += slide * normal_x
    return x, y, x * normal_x + y * normal_y


@kernel
def _stay_inside(r: int, fixed: Floats, robots: Floats) -> None:
    """Keep a robot in the arena, whatever pushed it last."""
    radius = robots[r + RADIUS]
    robots[r + X] = min(max(robots[r + X], radius), fixed[WIDTH] - radius)
    robots[r + Y] = min(max(robots[r + Y], radius), fixed[DEPTH] - radius)


@kernel
def _push(r: int, b: int, turn: int, robots: Floats, bodies: Floats) -> bool:
    """Push a robot and a pushable thing apart, and turn the thing if it is pushed off its centre."""
    x = robots[r + X]
    y = robots[r + Y]
    overlap, normal_x, normal_y, point_x, point_y = nearest(b, x, y, robots[r + RADIUS], bodies)
    if overlap <= TOLERANCE:
        return False
    lever = (point_x - bodies[b + X]) * normal_y - (point_y - bodies[b + Y]) * normal_x
    push = overlap / (ROBOT_LIGHTNESS + bodies[b + LIGHTNESS] + lever * lever * bodies[b + TURNABLE])
    robots[r + X] = x + push * ROBOT_LIGHTNESS * normal_x
    robots[r + Y] = y + push * ROBOT_LIGHTNESS * normal_y
    robots[r + AWAKE] = turn
    shift(b, -push * normal_x, -push * normal_y, -push * lever, bodies)
    return True


@kernel
def _press(k: int, turn: int, fixed: Floats, robots: Floats, bodies: Floats, numbers: Ints) -> bool:
    """Push thing *k* and the robots that overlap it apart: it may have been pushed onto one that sleeps."""
    b = k * BODY
    columns = numbers[GRID_COLUMNS]
    rows = numbers[GRID_ROWS]
    column = cell(bodies[b + X], fixed[GRID_SCALE], columns)
    row = cell(bodies[b + Y], fixed[GRID_SCALE], rows)
    has_moved = False
    for v in range(max(row - 1, 0), min(row + 2, rows)):
        for u in range(max(column - 1, 0), min(column + 2, columns)):
            j = numbers[numbers[HEADS_AT] + v * columns + u]
            while j >= 0:
                if j < numbers[ROBOTS] and _push(j * ROBOT, b, turn, robots, bodies):
                    has_moved = True
                j = numbers[numbers[NEXT_AT] + j]
    return has_moved
