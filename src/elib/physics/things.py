"""Boxes and cylinders that give way: their contacts with each other and with what is fixed.

A pushable thing lies where it was left: friction with the floor stops it as soon as nothing pushes. Each contact is an
impulse at a point, along a normal, that moves and turns the thing as its mass and moment of inertia allow.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.physics.engine import kernel
from elib.physics.grid import cell, cell_at
from elib.physics.layout import (
    BODIES,
    BODY,
    DEPTH,
    DISC,
    DISC_RADIUS,
    EDGE,
    FIRST,
    GRID_COLUMNS,
    GRID_ROWS,
    GRID_SCALE,
    HALF_DEPTH,
    HALF_WIDTH,
    HEADING_X,
    HEADING_Y,
    HEADS_AT,
    LENGTH,
    LIGHTNESS,
    NEXT_AT,
    REACH,
    ROBOTS,
    STIRRED,
    TANGENT_X,
    TANGENT_Y,
    TURNABLE,
    WALL,
    WALL_X,
    WALL_Y,
    WAS,
    WIDTH,
    Floats,
    Ints,
    X,
    Y,
)

TOLERANCE: Final = 1e-7
"""m. What overlaps by less is left alone: far below what a sensor can tell."""

DEEPEST: Final = 0.1
"""m. No contact moves a thing further in a tick: a wall that is farther away cannot have been passed."""


@kernel
def nearest(b: int, x: float, y: float, radius: float, bodies: Floats) -> tuple[float, float, float, float, float]:
    """Return how a disc meets the thing whose record begins at *b*.

    Returns:
        Overlap, m, negative if they are apart; normal x, y from the thing to the disc; the thing's point nearest to
        the disc's centre, x, y, m.
    """
    here_x = bodies[b + X]
    here_y = bodies[b + Y]
    dx = x - here_x
    dy = y - here_y
    square = dx * dx + dy * dy
    far = radius + bodies[b + REACH]
    if square >= far * far:
        return -1.0, 0.0, 0.0, 0.0, 0.0
    half_width = bodies[b + HALF_WIDTH]
    half_depth = bodies[b + HALF_DEPTH]
    if half_width == 0.0:
        distance = sqrt(square)
        normal_x = 1.0
        normal_y = 0.0
        if distance > 0.0:
            normal_x = dx / distance
            normal_y = dy / distance
        size = bodies[b + REACH]
        return far - distance, normal_x, normal_y, here_x + size * normal_x, here_y + size * normal_y
    heading_x = bodies[b + HEADING_X]
    heading_y = bodies[b + HEADING_Y]
    ahead = dx * heading_x + dy * heading_y
    aside = dy * heading_x - dx * heading_y
    near_ahead = min(max(ahead, -half_width), half_width)
    near_aside = min(max(aside, -half_depth), half_depth)
    gap_ahead = ahead - near_ahead
    gap_aside = aside - near_aside
    distance = sqrt(gap_ahead * gap_ahead + gap_aside * gap_aside)
    if distance > 0.0:
        overlap = radius - distance
        gap_ahead /= distance
        gap_aside /= distance
    else:  # The centre is inside: out by the nearest side.
        deep_ahead = half_width - abs(ahead)
        deep_aside = half_depth - abs(aside)
        if deep_ahead < deep_aside:
            gap_ahead = 1.0 if ahead >= 0.0 else -1.0
            gap_aside = 0.0
            near_ahead = gap_ahead * half_width
            overlap = radius + deep_ahead
        else:
            gap_ahead = 0.0
            gap_aside = 1.0 if aside >= 0.0 else -1.0
            near_aside = gap_aside * half_depth
            overlap = radius + deep_aside
    return (
        overlap,
        gap_ahead * heading_x - gap_aside * heading_y,
        gap_ahead * heading_y + gap_aside * heading_x,
        here_x + near_ahead * heading_x - near_aside * heading_y,
        here_y + near_ahead * heading_y + near_aside * heading_x,
    )


@kernel
def shift(b: int, push_x: float, push_y: float, twist: float, bodies: Floats) -> None:
    """Move and turn a thing by an impulse and its moment about the centre."""
    bodies[b + STIRRED] = 1.0
    bodies[b + X] += push_x * bodies[b + LIGHTNESS]
    bodies[b + Y] += push_y * bodies[b + LIGHTNESS]
    turn = twist * bodies[b + TURNABLE]
    if turn != 0.0:
        heading_x = bodies[b + HEADING_X] - turn * bodies[b + HEADING_Y]
        heading_y = bodies[b + HEADING_Y] + turn * bodies[b + HEADING_X]
        length = sqrt(heading_x * heading_x + heading_y * heading_y)
        bodies[b + HEADING_X] = heading_x / length
        bodies[b + HEADING_Y] = heading_y / length


@kernel
def follow(k: int, bodies: Floats, walls: Floats, discs: Floats) -> None:
    """Put the sides, or the disc, of thing *k* where the thing is now."""
    b = k * BODY
    x = bodies[b + X]
    y = bodies[b + Y]
    half_width = bodies[b + HALF_WIDTH]
    if half_width == 0.0:
        d = int(bodies[b + FIRST]) * DISC
        discs[d] = x
        discs[d + 1] = y
        return
    half_depth = bodies[b + HALF_DEPTH]
    heading_x = bodies[b + HEADING_X]
    heading_y = bodies[b + HEADING_Y]
    ahead = -half_width
    aside = -half_depth
    tangent_x = heading_x
    tangent_y = heading_y
    for side in range(4):  # Counter-clockwise from the corner behind on the right.
        w = (int(bodies[b + FIRST]) + side) * WALL
        walls[w + WALL_X] = x + ahead * heading_x - aside * heading_y
        walls[w + WALL_Y] = y + ahead * heading_y + aside * heading_x
        walls[w + TANGENT_X] = tangent_x
        walls[w + TANGENT_Y] = tangent_y
        if side % 2 == 0:
            ahead = -ahead
        else:
            aside = -aside
        tangent_x, tangent_y = -tangent_y, tangent_x


@kernel
def settle(
    k: int, turn: int, fixed: Floats, bodies: Floats, walls: Floats, discs: Floats, cells: Ints, numbers: Ints
) -> bool:
    """Push thing *k* and what it overlaps apart; return whether anything moved.

    In the first pass (*turn* 1) each pair is looked at once; later one of the two may sleep.
    """
    b = k * BODY
    has_moved = False
    if numbers[BODIES] > 1:
        scale = fixed[GRID_SCALE]
        columns = numbers[GRID_COLUMNS]
        rows = numbers[GRID_ROWS]
        column = cell(bodies[b + X], scale, columns)
        row = cell(bodies[b + Y], scale, rows)
        for v in range(max(row - 1, 0), min(row + 2, rows)):
            for u in range(max(column - 1, 0), min(column + 2, columns)):
                j = numbers[numbers[HEADS_AT] + v * columns + u]
                while j >= 0:
                    other = j - numbers[ROBOTS]
                    is_due = other > k or (turn > 1 and 0 <= other != k)
                    if is_due and _part(b, other * BODY, bodies):
                        has_moved = True
                    j = numbers[numbers[NEXT_AT] + j]
    here = cell_at(bodies[b + X], bodies[b + Y], fixed, numbers)
    for n in range(cells[here + 2], cells[here + 3]):
        d = cells[n] * DISC
        overlap, normal_x, normal_y, x, y = nearest(b, discs[d], discs[d + 1], discs[d + DISC_RADIUS], bodies)
        if overlap > TOLERANCE:
            _leave(b, x, y, -normal_x, -normal_y, overlap, bodies)
            has_moved = True
    for n in range(cells[here + 1], cells[here + 2]):
        if cells[n] >= EDGE and _leave_wall(b, cells[n] * WALL, bodies, walls):
            has_moved = True
    if _stay_inside(b, fixed[WIDTH], fixed[DEPTH], bodies):
        has_moved = True
    return has_moved


@kernel
def _leave(b: int, x: float, y: float, normal_x: float, normal_y: float, overlap: float, bodies: Floats) -> None:
    """Push a thing along the normal at the point (x, y), out of something that does not give way."""
    lever = (x - bodies[b + X]) * normal_y - (y - bodies[b + Y]) * normal_x
    push = overlap / (bodies[b + LIGHTNESS] + lever * lever * bodies[b + TURNABLE])
    shift(b, push * normal_x, push * normal_y, push * lever, bodies)


@kernel
def _part(b: int, c: int, bodies: Floats) -> bool:
    """Push two things apart."""
    dx = bodies[c + X] - bodies[b + X]
    dy = bodies[c + Y] - bodies[b + Y]
    far = bodies[b + REACH] + bodies[c + REACH]
    if dx * dx + dy * dy >= far * far:
        return False
    if bodies[c + HALF_WIDTH] == 0.0:
        return _yield(b, c, bodies[c + X], bodies[c + Y], bodies[c + REACH], bodies)
    if bodies[b + HALF_WIDTH] == 0.0:
        return _yield(c, b, bodies[b + X], bodies[b + Y], bodies[b + REACH], bodies)
    has_moved = False
    for corner in range(4):
        x, y = _corner(c, corner, bodies)
        if _yield(b, c, x, y, 0.0, bodies):
            has_moved = True
        x, y = _corner(b, corner, bodies)
        if _yield(c, b, x, y, 0.0, bodies):
            has_moved = True
    return has_moved


@kernel
def _yield(b: int, c: int, x: float, y: float, radius: float, bodies: Floats) -> bool:
    """Push thing *b* and a disc or corner at (x, y) that belongs to thing *c* apart."""
    overlap, normal_x, normal_y, point_x, point_y = nearest(b, x, y, radius, bodies)
    if overlap <= TOLERANCE:
        return False
    lever = (point_x - bodies[b + X]) * normal_y - (point_y - bodies[b + Y]) * normal_x
    other = (point_x - bodies[c + X]) * normal_y - (point_y - bodies[c + Y]) * normal_x
    push = overlap / (
        bodies[b + LIGHTNESS]
        + bodies[c + LIGHTNESS]
        + lever * lever * bodies[b + TURNABLE]
        + other * other * bodies[c + TURNABLE]
    )
    shift(b, -push * normal_x, -push * normal_y, -push * lever, bodies)
    shift(c, push * normal_x, push * normal_y, push * other, bodies)
    return True


@kernel
def _corner(b: int, corner: int, bodies: Floats) -> tuple[float, float]:
    """Return one of the four corners of a box, m, counter-clockwise from the one behind on the right."""
    ahead = bodies[b + HALF_WIDTH] if corner == 1 or corner == 2 else -bodies[b + HALF_WIDTH]
    aside = bodies[b + HALF_DEPTH] if corner >= 2 else -bodies[b + HALF_DEPTH]
    heading_x = bodies[b + HEADING_X]
    heading_y = bodies[b + HEADING_Y]
    return (
        bodies[b + X] + ahead * heading_x - aside * heading_y,
        bodies[b + Y] + ahead * heading_y + aside * heading_x,
    )


@kernel
def _leave_wall(b: int, w: int, bodies: Floats, walls: Floats) -> bool:
    """Push a thing out of a fixed wall, to the side on which its centre lies."""
    tangent_x = walls[w + TANGENT_X]
    tangent_y = walls[w + TANGENT_Y]
    length = walls[w + LENGTH]
    dx = bodies[b + X] - walls[w + WALL_X]
    dy = bodies[b + Y] - walls[w + WALL_Y]
    reach = bodies[b + REACH]
    offset = tangent_x * dy - tangent_y * dx
    along = tangent_x * dx + tangent_y * dy
    if along <= -reach or along >= length + reach:
        return False
    # A thin thing may have been pushed right through: what counts is on which side it was before the tick.
    was_x = bodies[b + WAS] - walls[w + WALL_X]
    was_y = bodies[b + WAS + 1] - walls[w + WALL_Y]
    was_offset = tangent_x * was_y - tangent_y * was_x
    was_along = tangent_x * was_x + tangent_y * was_y
    side = 1.0 if was_offset >= 0.0 else -1.0
    if side * offset >= reach or side * was_offset > DEEPEST + reach:
        return False
    has_moved = False
    if bodies[b + HALF_WIDTH] == 0.0:
        if side * offset < 0.0 and 0.0 <= along <= length:
            x = bodies[b + X]
            y = bodies[b + Y]
            _leave(b, x, y, -side * tangent_y, side * tangent_x, reach - side * offset, bodies)
            return True
        foot = min(max(along, 0.0), length)
        x = walls[w + WALL_X] + foot * tangent_x
        y = walls[w + WALL_Y] + foot * tangent_y
        overlap, normal_x, normal_y, x, y = nearest(b, x, y, 0.0, bodies)
        if overlap > TOLERANCE:
            _leave(b, x, y, -normal_x, -normal_y, overlap, bodies)
            has_moved = True
        return has_moved
    for corner in range(4):
        x, y = _corner(b, corner, bodies)
        dx = x - walls[w + WALL_X]
        dy = y - walls[w + WALL_Y]
        depth = -side * (tangent_x * dy - tangent_y * dx)
        if depth > TOLERANCE:
            # Where the line from the centre, as it was, to the corner crosses the wall's line.
            part = side * was_offset / (side * was_offset + depth)
            crossing = was_along + part * (tangent_x * dx + tangent_y * dy - was_along)
            if 0.0 <= crossing <= length:
                _leave(b, x, y, -side * tangent_y, side * tangent_x, depth, bodies)
                has_moved = True
    for end in range(2):
        x = walls[w + WALL_X] + end * length * tangent_x
        y = walls[w + WALL_Y] + end * length * tangent_y
        overlap, normal_x, normal_y, point_x, point_y = nearest(b, x, y, 0.0, bodies)
        if overlap > TOLERANCE:
            _leave(b, point_x, point_y, -normal_x, -normal_y, overlap, bodies)
            has_moved = True
    return has_moved


@kernel
def _stay_inside(b: int, width: float, depth: float, bodies: Floats) -> bool:
    """Push a thing back into the arena."""
    reach = bodies[b + REACH]
    x = bodies[b + X]
    y = bodies[b + Y]
    if reach <= x <= width - reach and reach <= y <= depth - reach:
        return False
    has_moved = False
    if bodies[b + HALF_WIDTH] == 0.0:
        bodies[b + X] = min(max(x, reach), width - reach)
        bodies[b + Y] = min(max(y, reach), depth - reach)
        bodies[b + STIRRED] = 1.0
        return abs(bodies[b + X] - x) > TOLERANCE or abs(bodies[b + Y] - y) > TOLERANCE
    for corner in range(4):
        x, y = _corner(b, corner, bodies)
        if x < -TOLERANCE:
            _leave(b, x, y, 1.0, 0.0, -x, bodies)
            has_moved = True
        elif x > width + TOLERANCE:
            _leave(b, x, y, -1.0, 0.0, x - width, bodies)
            has_moved = True
        x, y = _corner(b, corner, bodies)
        if y < -TOLERANCE:
            _leave(b, x, y, 0.0, 1.0, -y, bodies)
            has_moved = True
        elif y > depth + TOLERANCE:
            _leave(b, x, y, 0.0, -1.0, y - depth, bodies)
            has_moved = True
    return has_moved
