"""Kernels of the camera: 2.5-D column casting.

Every surface stands upright, so in one column of the picture it has one depth and covers one span of rows. Each
thing is met only in the columns that it can reach. A column keeps its skyline: what it meets from near to far, as
far as each rises above all that stand before it; the rest is hidden and dropped at once. Painting then touches each
pixel once. Depths are kept as their inverse, 1/m, because along a wall that is linear in the column.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.physics.body import HEIGHT
from elib.physics.engine import kernel
from elib.physics.layout import (
    DISC,
    DISC_RADIUS,
    DISC_TOP,
    LENGTH,
    RADIUS,
    ROBOT,
    TANGENT_X,
    TANGENT_Y,
    WALL,
    WALL_TOP,
    Floats,
    Ints,
    X,
    Y,
)
from elib.physics.sensors.optics import (
    ABOVE,
    COLUMNS,
    DISC_COUNT,
    FIRST_ASIDE,
    LAST_ASIDE,
    PER_ASIDE,
    ROBOT_COUNT,
    VIEW,
    WALL_COUNT,
)

NEAREST: Final = 1e-6
"""Nothing is met nearer than this along the axis, m: the lens lies 7 mm within the robot's rim."""

EDGE_ON: Final = 1e-9
"""A wall whose line passes this near the lens shows only its edge, m times its length."""

ROBOT_TOP: Final = HEIGHT

SLOTS: Final = 16
"""Longest skyline. Only things below the lens, or each taller than those before it, make it longer than one."""

# What a column remembers of each thing in its skyline.
NEAR: Final = 0  # Inverse of its depth, 1/m.
RISE: Final = 1  # Tangent of the angle to its upper edge.
FACING: Final = 2  # How much a round thing faces the lens there, 0..1.
HIT: Final = 3

SKYLINE: Final = SLOTS * HIT  # Floats of one column.
MARKS: Final = SLOTS + 1  # Integers of one column: how many things there are in its skyline, and which.


@kernel
def meet_walls(
    eye_x: float,
    eye_y: float,
    heading_x: float,
    heading_y: float,
    walls: Floats,
    view: Floats,
    plan: Ints,
    hits: Floats,
    marks: Ints,
) -> None:
    """Note in which columns each wall is seen.

    Args:
        eye_x: The lens, m.
        eye_y: The lens, m.
        heading_x: Cosine of the direction in which it looks.
        heading_y: Sine of it.
        walls: All walls.
        view: The window's tables.
        plan: The window's numbers.
        hits: In and out: the columns' skylines.
        marks: In and out: the numbers of the things in them.
    """
    final = plan[COLUMNS] - 1
    left = view[FIRST_ASIDE]
    right = view[LAST_ASIDE]
    per = view[PER_ASIDE]
    thing = -1
    for k in range(0, plan[WALL_COUNT] * WALL, WALL):
        thing += 1
        # In the camera's frame: depth along its axis, aside to the right of it.
        dx = walls[k] - eye_x
        dy = walls[k + 1] - eye_y
        depth = dx * heading_x + dy * heading_y
        aside = dx * heading_y - dy * heading_x
        length = walls[k + LENGTH]
        tangent_x = walls[k + TANGENT_X]
        tangent_y = walls[k + TANGENT_Y]
        deeper = length * (tangent_x * heading_x + tangent_y * heading_y)
        wider = length * (tangent_x * heading_y - tangent_y * heading_x)
        far_depth = depth + deeper
        far_aside = aside + wider
        if (
            (depth < NEAREST and far_depth < NEAREST)
            or (aside > right * depth and far_aside > right * far_depth)
            or (aside < left * depth and far_aside < left * far_depth)
        ):
            continue
        offset = aside * deeper - depth * wider
        if -EDGE_ON < offset < EDGE_ON:
            continue
        # 1 / depth = constant + slope * tangent of the column's angle.
        constant = -wider / offset
        slope = deeper / offset
        if depth < NEAREST:
            start = (aside + wider * (NEAREST - depth) / deeper) / NEAREST
            end = far_aside / far_depth
        elif far_depth < NEAREST:
            start = aside / depth
            end = (aside + wider * (NEAREST - depth) / deeper) / NEAREST
        else:
            start = aside / depth
            end = far_aside / far_depth
        if start > end:
            start, end = end, start
        place = (start - left) * per
        first = 0
        if place > 0.0:
            if place > final:
                continue
            first = int(place)
            if first < place:
                first += 1
        place = (end - left) * per
        last = final
        if place < final:
            if place < 0.0:
                continue
            last = int(place)
        rise = walls[k + WALL_TOP] - ABOVE
        for column in range(first, last + 1):
            near = constant + slope * view[VIEW + column]
            top = rise * near
            hit = column * SKYLINE
            mark = column * MARKS
            count = marks[mark]
            if count > 0:
                if near <= hits[hit]:
                    if top <= hits[hit + RISE]:
                        continue
                    _insert(column, near, top, 0.0, thing, hits, marks)
                    continue
                if top < hits[hit + (count - 1) * HIT + RISE]:
                    _insert(column, near, top, 0.0, thing, hits, marks)
                    continue
            # Nothing is there, or it hides everything.
            hits[hit] = near
            hits[hit + RISE] = top
            marks[mark] = 1
            marks[mark + 1] = thing


@kernel
def meet_discs(
    eye_x: float,
    eye_y: float,
    heading_x: float,
    heading_y: float,
    discs: Floats,
    view: Floats,
    plan: Ints,
    hits: Floats,
    marks: Ints,
) -> None:
    """Note in which columns each cylinder is seen; arguments as of :func:`meet_walls`."""
    thing = plan[WALL_COUNT]
    for k in range(0, plan[DISC_COUNT] * DISC, DISC):
        dx = discs[k] - eye_x
        dy = discs[k + 1] - eye_y
        _meet_disc(
            dx * heading_x + dy * heading_y,
            dx * heading_y - dy * heading_x,
            discs[k + DISC_RADIUS],
            discs[k + DISC_TOP],
            thing,
            view,
            plan,
            hits,
            marks,
        )
        thing += 1


@kernel
def meet_robots(
    robot: int,
    eye_x: float,
    eye_y: float,
    heading_x: float,
    heading_y: float,
    robots: Floats,
    view: Floats,
    plan: Ints,
    hits: Floats,
    marks: Ints,
) -> None:
    """Note in which columns each robot but *robot* is seen."""
    thing = plan[WALL_COUNT] + plan[DISC_COUNT] - 1
    here = robot * ROBOT
    right = view[LAST_ASIDE]
    left = view[FIRST_ASIDE]
    for k in range(0, plan[ROBOT_COUNT] * ROBOT, ROBOT):
        thing += 1
        dx = robots[k + X] - eye_x
        dy = robots[k + Y] - eye_y
        depth = dx * heading_x + dy * heading_y
        radius = robots[k + RADIUS]
        if depth < -radius or k == here:
            continue
        aside = dx * heading_y - dy * heading_x
        # Most of a crowd is beside the picture. Here a little too much is kept, without a root.
        if aside > right * depth + radius * (1.0 + right * right):
            continue
        if aside < left * depth - radius * (1.0 + left * left):
            continue
        _meet_disc(depth, aside, radius, ROBOT_TOP, thing, view, plan, hits, marks)


@kernel
def _meet_disc(
    depth: float,
    aside: float,
    radius: float,
    height: float,
    thing: int,
    view: Floats,
    plan: Ints,
    hits: Floats,
    marks: Ints,
) -> None:
    outside = depth * depth + aside * aside - radius * radius
    if depth < -radius or outside <= 0.0:  # Behind, or the lens is within it.
        return
    columns = plan[COLUMNS]
    final = columns - 1
    left = view[FIRST_ASIDE]
    per = view[PER_ASIDE]
    # Its two tangents through the lens; one that points backwards lies beyond every picture.
    tangent = sqrt(outside)
    first = 0
    last = final
    ahead = depth * tangent + aside * radius
    across = aside * tangent - depth * radius
    if ahead > 0.0:
        place = (across - left * ahead) * per
        if place > 0.0:
            if place > final * ahead:
                return
            place /= ahead
            first = int(place)
            if first < place:
                first += 1
    elif across > 0.0:
        return
    ahead = depth * tangent - aside * radius
    across = aside * tangent + depth * radius
    if ahead > 0.0:
        place = (across - left * ahead) * per
        if place < 0.0:
            return
        if place < final * ahead:
            last = int(place / ahead)
    elif across < 0.0:
        return
    rise = height - ABOVE
    for column in range(first, last + 1):
        square = view[VIEW + columns + column]
        middle = depth + aside * view[VIEW + column]
        under = middle * middle - square * outside
        half = 0.0
        if under > 0.0:
            half = sqrt(under)
        distance = middle - half
        if distance < NEAREST:
            distance = NEAREST
        near = square / distance
        top = rise * near
        hit = column * SKYLINE
        mark = column * MARKS
        count = marks[mark]
        if count > 0 and near <= hits[hit] and top <= hits[hit + RISE]:
            continue
        facing = half / (radius * view[VIEW + columns + columns + column])
        if count > 0 and (near <= hits[hit] or top < hits[hit + (count - 1) * HIT + RISE]):
            _insert(column, near, top, facing, thing, hits, marks)
        else:  # Nothing is there, or it hides everything.
            hits[hit] = near
            hits[hit + RISE] = top
            hits[hit + FACING] = facing
            marks[mark] = 1
            marks[mark + 1] = thing


@kernel
def _insert(column: int, near: float, top: float, facing: float, thing: int, hits: Floats, marks: Ints) -> None:
    """Put a thing into a column's skyline unless it is hidden, and drop what it hides."""
    start = column * SKYLINE
    mark = column * MARKS
    count = marks[mark]
    place = 0
    while place < count and hits[start + place * HIT] >= near:
        if hits[start + place * HIT + RISE] >= top:
            return
        place += 1
    beyond = place
    while beyond < count and hits[start + beyond * HIT + RISE] <= top:
        beyond += 1
    if beyond == place:
        if place == SLOTS:
            return
        if count == SLOTS:
            count -= 1
        for k in range(count, place, -1):
            to = start + k * HIT
            hits[to] = hits[to - HIT]
            hits[to + RISE] = hits[to - HIT + RISE]
            hits[to + FACING] = hits[to - HIT + FACING]
            marks[mark + 1 + k] = marks[mark + k]
        count += 1
    elif beyond > place + 1:
        shift = beyond - place - 1
        for k in range(place + 1, count - shift):
            to = start + k * HIT
            source = to + shift * HIT
            hits[to] = hits[source]
            hits[to + RISE] = hits[source + RISE]
            hits[to + FACING] = hits[source + FACING]
            marks[mark + 1 + k] = marks[mark + 1 + k + shift]
        count -= shift
    to = start + place * HIT
    hits[to] = near
    hits[to + RISE] = top
    hits[to + FACING] = facing
    marks[mark] = count
    marks[mark + 1 + place] = thing
