"""Boxes and cylinders that can be pushed: how they move, and how robots, walls and each other push them.

Friction with the floor holds a thing until it is pushed harder than

    friction x mass x g,    less where it is pushed off its centre, because then it also turns,

and slows it down while it moves. What rolls has so little friction that it rolls on, and comes to rest by itself. A
robot pushes with at most :data:`GRIP`. What needs more stops the robot: its wheels slip, and its encoders count on.

The solver moves positions by pushes in kg m: force x step^2. A thing keeps the speed at which it was pushed. How far a
push at its side moves it, and how far it turns it, follows from its mass and its moment of inertia. The same share
tells how much friction resists: the limit surface of a sliding body is close to an ellipsoid (Howe and Cutkosky, 1996).
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.simulator.physics.body import GRAVITY, MASS
from elib.simulator.physics.engine import kernel, phase
from elib.simulator.physics.neighbours import EDGE, fixed_cell
from elib.simulator.physics.records import Records, Robot, Segment, Thing

TOLERANCE: Final = 1e-7
"""m. What overlaps by less is left alone: far below what a sensor can tell."""

GRIP: Final = 0.7 * MASS * GRAVITY
"""Most that a robot's wheels push with, N: 1.03. ARGoS gives the e-puck a friction of 0.7."""

FASTEST: Final = 0.5
"""m/s. A thing that was pushed moves on no faster: two that were put into each other come apart without flying off."""

DEEPEST: Final = 0.1
"""m. No contact moves a thing farther in a tick: a wall that is farther away cannot have been passed."""

FLAT: Final = 0.02
"""rad. Boxes whose sides are turned by less against each other push on a part of the side, not with one corner."""


@phase
def start_things(world: Records) -> None:
    """Move every thing as far as its speed takes it in this tick, slowed down by friction."""
    step = world.setting[0].step
    for i in range(len(world.robots)):
        world.robots[i].grip = GRIP * step * step
    for k in range(len(world.things)):
        thing = world.things[k]
        thing.before_x = thing.x
        thing.before_y = thing.y
        thing.before_heading_x = thing.heading_x
        thing.before_heading_y = thing.heading_y
        loss = thing.friction * GRAVITY * step
        speed = sqrt(thing.speed_x * thing.speed_x + thing.speed_y * thing.speed_y + spin_energy(thing))
        left = max(speed - loss, 0.0)
        # What friction does not need to slow it down resists to pushes.
        thing.hold = (loss - (speed - left)) * step / thing.lightness
        if left > 0.0:
            share = left / speed
            thing.x += thing.speed_x * share * step
            thing.y += thing.speed_y * share * step
            turn(thing, thing.spin * share * step)
            thing.moved = 1


@phase
def finish_things(world: Records) -> None:
    """Find how fast every thing moved in this tick."""
    step = world.setting[0].step
    for k in range(len(world.things)):
        thing = world.things[k]
        thing.moved = 0
        thing.speed_x = (thing.x - thing.before_x) / step
        thing.speed_y = (thing.y - thing.before_y) / step
        thing.spin = (thing.before_heading_x * thing.heading_y - thing.before_heading_y * thing.heading_x) / step
        speed = sqrt(thing.speed_x * thing.speed_x + thing.speed_y * thing.speed_y + spin_energy(thing))
        if speed > FASTEST:
            thing.speed_x *= FASTEST / speed
            thing.speed_y *= FASTEST / speed
            thing.spin *= FASTEST / speed


@kernel
def spin_energy(thing: Thing) -> float:
    """Return the square of the speed that a thing's turning is worth, m2/s2: its spin times its radius of gyration."""
    if thing.turnable == 0.0:
        return 0.0
    return thing.spin * thing.spin * thing.lightness / thing.turnable


@kernel
def put_back(thing: Thing) -> None:
    """Put a thing back to where it was at the start of the tick."""
    thing.x = thing.before_x
    thing.y = thing.before_y
    thing.heading_x = thing.before_heading_x
    thing.heading_y = thing.before_heading_y


@kernel
def nearest(thing: Thing, x: float, y: float, radius: float) -> tuple[float, float, float, float, float]:
    """Return how a disc meets a thing.

    Returns:
        Overlap, m, negative if they are apart; normal x, y from the thing to the disc; the thing's point nearest to
        the disc's centre, x, y, m.
    """
    dx = x - thing.x
    dy = y - thing.y
    square = dx * dx + dy * dy
    far = radius + thing.reach
    if square >= far * far:
        return -1.0, 0.0, 0.0, 0.0, 0.0
    if thing.half_width == 0.0:
        distance = sqrt(square)
        normal_x = 1.0
        normal_y = 0.0
        if distance > 0.0:
            normal_x = dx / distance
            normal_y = dy / distance
        return far - distance, normal_x, normal_y, thing.x + thing.reach * normal_x, thing.y + thing.reach * normal_y
    ahead = dx * thing.heading_x + dy * thing.heading_y
    aside = dy * thing.heading_x - dx * thing.heading_y
    near_ahead = min(max(ahead, -thing.half_width), thing.half_width)
    near_aside = min(max(aside, -thing.half_depth), thing.half_depth)
    gap_ahead = ahead - near_ahead
    gap_aside = aside - near_aside
    distance = sqrt(gap_ahead * gap_ahead + gap_aside * gap_aside)
    if distance > 0.0:
        overlap = radius - distance
        gap_ahead /= distance
        gap_aside /= distance
    else:  # The centre is inside: out by the nearest side.
        deep_ahead = thing.half_width - abs(ahead)
        deep_aside = thing.half_depth - abs(aside)
        if deep_ahead < deep_aside:
            gap_ahead = 1.0 if ahead >= 0.0 else -1.0
            near_ahead = gap_ahead * thing.half_width
            overlap = radius + deep_ahead
        else:
            gap_aside = 1.0 if aside >= 0.0 else -1.0
            near_aside = gap_aside * thing.half_depth
            overlap = radius + deep_aside
    return (
        overlap,
        gap_ahead * thing.heading_x - gap_aside * thing.heading_y,
        gap_ahead * thing.heading_y + gap_aside * thing.heading_x,
        thing.x + near_ahead * thing.heading_x - near_aside * thing.heading_y,
        thing.y + near_ahead * thing.heading_y + near_aside * thing.heading_x,
    )


@kernel
def turn(thing: Thing, angle: float) -> None:
    """Turn a thing by a small angle, rad."""
    if angle != 0.0:
        heading_x = thing.heading_x - angle * thing.heading_y
        heading_y = thing.heading_y + angle * thing.heading_x
        length = sqrt(heading_x * heading_x + heading_y * heading_y)
        thing.heading_x = heading_x / length
        thing.heading_y = heading_y / length


@kernel
def lever_of(thing: Thing, x: float, y: float, normal_x: float, normal_y: float) -> float:
    """Return the lever arm at which a push along a normal at (x, y) turns a thing, m."""
    return (x - thing.x) * normal_y - (y - thing.y) * normal_x


@kernel
def give(thing: Thing, lever: float) -> float:
    """Return how far the point at this lever arm gives way to a push, m for each kg m."""
    return thing.lightness + lever * lever * thing.turnable


@kernel
def held(thing: Thing, lever: float) -> float:
    """Return the push at this lever arm that friction still takes in this tick, kg m."""
    return thing.hold / sqrt(1.0 + lever * lever * thing.turnable / thing.lightness)


@kernel
def shove(thing: Thing, lever: float, push: float, normal_x: float, normal_y: float) -> None:
    """Push a thing along a normal, kg m: friction takes its part, and the rest moves and turns the thing."""
    taken = min(push, held(thing, lever))
    thing.hold = max(thing.hold - taken, 0.0)
    rest = push - taken
    thing.moved = 1
    thing.x += rest * thing.lightness * normal_x
    thing.y += rest * thing.lightness * normal_y
    turn(thing, rest * lever * thing.turnable)


@phase
def press(world: Records, k: int, iteration: int) -> bool:
    """Push thing *k* and the robots that overlap it apart; return whether there were any."""
    count = len(world.robots)
    thing = world.things[k]
    listing = world.listings[count + k]
    has_moved = False
    for m in range(listing.first_near, listing.end_near):
        if world.lists[m] < count:
            robot = world.robots[world.lists[m]]
            if push_by_robot(thing, robot):
                robot.touched = iteration
                has_moved = True
    return has_moved


@kernel
def push_by_robot(thing: Thing, robot: Robot) -> bool:
    """Push a thing and a robot apart: the thing goes as far as the robot's grip allows, and the robot the rest."""
    overlap, normal_x, normal_y, x, y = nearest(thing, robot.x, robot.y, robot.radius)
    if overlap <= TOLERANCE:
        return False
    lever = lever_of(thing, x, y, -normal_x, -normal_y)
    gives = give(thing, lever)
    resists = held(thing, lever)
    push = min(resists + overlap / gives, robot.grip)
    robot.grip -= push
    shove(thing, lever, push, -normal_x, -normal_y)
    rest = overlap - max(push - resists, 0.0) * gives
    if rest > TOLERANCE:
        robot.x += rest * normal_x
        robot.y += rest * normal_y
    return True


@phase
def leave_obstacles(world: Records, k: int, iteration: int) -> bool:
    """Push thing *k* and the things that it overlaps apart, and out of what is fixed; return whether it moved.

    In the first iteration each pair is looked at once; later one of the two may rest.
    """
    thing = world.things[k]
    count = len(world.robots)
    listing = world.listings[count + k]
    has_moved = False
    for m in range(listing.first_near, listing.end_near):
        other = world.lists[m] - count
        is_due = other > k or (iteration > 1 and 0 <= other < k)
        if is_due and part(thing, world.things[other]):
            has_moved = True
    if thing.switch >= 0:  # A door may slide into what is fixed, and out of the arena.
        return has_moved
    cell = world.cells[fixed_cell(world.setting[0], thing.x, thing.y)]
    for m in range(cell.first_disc, cell.end_disc):
        disc = world.discs[world.lists[m]]
        overlap, normal_x, normal_y, x, y = nearest(thing, disc.x, disc.y, disc.radius)
        if overlap > TOLERANCE:
            leave(thing, x, y, -normal_x, -normal_y, overlap)
            has_moved = True
    for m in range(cell.first_wall, cell.end_wall):
        if world.lists[m] >= EDGE and leave_wall(thing, world.walls[world.lists[m]]):
            has_moved = True
    return stay_inside(thing, world.setting[0].width, world.setting[0].depth) or has_moved


@kernel
def leave(thing: Thing, x: float, y: float, normal_x: float, normal_y: float, overlap: float) -> None:
    """Push a thing along the normal at the point (x, y), out of something that does not give way."""
    lever = lever_of(thing, x, y, normal_x, normal_y)
    shove(thing, lever, held(thing, lever) + overlap / give(thing, lever), normal_x, normal_y)


@phase
def part(one: Thing, other: Thing) -> bool:
    """Push two things apart; return whether they overlapped."""
    dx = other.x - one.x
    dy = other.y - one.y
    far = one.reach + other.reach
    if dx * dx + dy * dy >= far * far:
        return False
    if other.half_width == 0.0:
        return part_at(one, other, other.x, other.y, other.reach)
    if one.half_width == 0.0:
        return part_at(other, one, one.x, one.y, one.reach)
    return part_boxes(one, other)


@kernel
def part_at(one: Thing, other: Thing, x: float, y: float, radius: float) -> bool:
    """Push thing *one* and the disc around (x, y) that is the *other* apart."""
    overlap, normal_x, normal_y, x, y = nearest(one, x, y, radius)
    if overlap <= TOLERANCE:
        return False
    push_apart(one, other, x, y, normal_x, normal_y, overlap)
    return True


@kernel
def push_apart(one: Thing, other: Thing, x: float, y: float, normal_x: float, normal_y: float, overlap: float) -> None:
    """Push two things apart along the normal from one to the other at (x, y).

    The push is the one for which both moves together, after friction took its part, make up the overlap.
    """
    lever = lever_of(one, x, y, -normal_x, -normal_y)
    other_lever = lever_of(other, x, y, normal_x, normal_y)
    gives = give(one, lever)
    other_gives = give(other, other_lever)
    easy = held(one, lever)
    hard = held(other, other_lever)
    first = gives
    if easy > hard:
        easy, hard = hard, easy
        first = other_gives
    push = easy + overlap / first
    if push > hard:
        total = gives + other_gives
        push = (overlap + easy * first + hard * (total - first)) / total
    shove(one, lever, push, -normal_x, -normal_y)
    shove(other, other_lever, push, normal_x, normal_y)


@kernel
def shortest_way(one: Thing, other: Thing) -> tuple[float, int]:
    """Return by how much two boxes overlap along the shortest way out, m, below 0 if they are apart, and its axis.

    Boxes overlap if they do so along each of their four axes, and least along the shortest way out (separating axis
    theorem).
    """
    best = 1e9
    best_axis = 0
    for axis in range(4):
        axis_x, axis_y = axis_of(one if axis < 2 else other, axis % 2)
        between = (other.x - one.x) * axis_x + (other.y - one.y) * axis_y
        overlap = extent(one, axis_x, axis_y) + extent(other, axis_x, axis_y) - abs(between)
        if overlap <= TOLERANCE:
            return -1.0, axis
        if overlap < best:
            best = overlap
            best_axis = axis
    return best, best_axis


@kernel
def part_boxes(one: Thing, other: Thing) -> bool:
    """Push two boxes apart along the shortest way out; return whether they overlapped.

    Corners that are each pushed out of the nearest side would push against each other.
    """
    best, best_axis = shortest_way(one, other)
    if best < 0.0:
        return False
    owner = one if best_axis < 2 else other
    guest = other if best_axis < 2 else one
    normal_x, normal_y = axis_of(owner, best_axis % 2)
    if (guest.x - owner.x) * normal_x + (guest.y - owner.y) * normal_y < 0.0:
        normal_x = -normal_x
        normal_y = -normal_y
    along = meeting(owner, guest, normal_x, normal_y)
    push_apart(owner, guest, owner.x - along * normal_y, owner.y + along * normal_x, normal_x, normal_y, best)
    return True


@kernel
def axis_of(box: Thing, number: int) -> tuple[float, float]:
    """Return the first or the second axis of a box, a unit vector."""
    if number == 0:
        return box.heading_x, box.heading_y
    return -box.heading_y, box.heading_x


@kernel
def meeting(owner: Thing, guest: Thing, normal_x: float, normal_y: float) -> float:
    """Return where on a side of its *owner* the *guest* presses, m to the left of the side's middle.

    It presses with the corner that is deepest inside, or, with its side flat on the other, in the middle of where the
    two sides touch.

    Args:
        owner: The thing that the side belongs to.
        guest: The other box.
        normal_x: The x part of the side's normal, towards the guest.
        normal_y: The same.
    """
    width = guest.half_depth
    depth = guest.half_width
    facing = guest.heading_x * normal_x + guest.heading_y * normal_y
    slant = guest.heading_x * normal_y - guest.heading_y * normal_x
    if abs(facing) < abs(slant):  # Its other axis looks at the owner.
        width, depth = depth, width
        facing, slant = slant, -facing
    # Seen from the owner, to the left: the middle of the guest's side, and its end that is deeper inside.
    toward = -depth if facing > 0.0 else depth
    middle = (guest.x - owner.x) * -normal_y + (guest.y - owner.y) * normal_x - toward * slant
    end = width * abs(facing) * (-1.0 if slant * facing > 0.0 else 1.0)
    limit = extent(owner, -normal_y, normal_x)
    deep = min(max(middle + end, -limit), limit)
    high = min(max(middle - end, -limit), limit)
    return 0.5 * (deep + high) + 0.5 * (deep - high) * min(abs(slant) / FLAT, 1.0)


@kernel
def extent(box: Thing, axis_x: float, axis_y: float) -> float:
    """Return how far a box reaches from its centre along an axis, m."""
    return box.half_width * abs(box.heading_x * axis_x + box.heading_y * axis_y) + box.half_depth * abs(
        box.heading_x * axis_y - box.heading_y * axis_x
    )


@kernel
def corner_of(box: Thing, corner: int) -> tuple[float, float]:
    """Return one of the four corners of a box, m, counter-clockwise from the one behind on the right."""
    ahead = box.half_width if corner == 1 or corner == 2 else -box.half_width
    aside = box.half_depth if corner >= 2 else -box.half_depth
    return (
        box.x + ahead * box.heading_x - aside * box.heading_y,
        box.y + ahead * box.heading_y + aside * box.heading_x,
    )


@phase
def leave_wall(thing: Thing, wall: Segment) -> bool:
    """Push a thing out of a fixed wall, to the side on which its centre was before the tick; return whether it moved.

    A thin thing may have been pushed right through: so what counts is where it was.
    """
    dx = thing.x - wall.x
    dy = thing.y - wall.y
    offset = wall.tangent_x * dy - wall.tangent_y * dx
    along = wall.tangent_x * dx + wall.tangent_y * dy
    if along <= -thing.reach or along >= wall.length + thing.reach:
        return False
    was_x = thing.before_x - wall.x
    was_y = thing.before_y - wall.y
    was_offset = wall.tangent_x * was_y - wall.tangent_y * was_x
    side = 1.0 if was_offset >= 0.0 else -1.0
    if side * offset >= thing.reach or side * was_offset > DEEPEST + thing.reach:
        return False
    has_moved = False
    if thing.half_width == 0.0:
        if side * offset < 0.0 and 0.0 <= along <= wall.length:
            overlap = thing.reach - side * offset
            leave(thing, thing.x, thing.y, -side * wall.tangent_y, side * wall.tangent_x, overlap)
            return True
        foot = min(max(along, 0.0), wall.length)
        return leave_point(thing, wall.x + foot * wall.tangent_x, wall.y + foot * wall.tangent_y)
    was_along = wall.tangent_x * was_x + wall.tangent_y * was_y
    normal_x = -side * wall.tangent_y
    normal_y = side * wall.tangent_x
    deepest = 0.0
    total = 0.0
    point_x = 0.0
    point_y = 0.0
    for corner in range(4):
        x, y = corner_of(thing, corner)
        dx = x - wall.x
        dy = y - wall.y
        depth = -(normal_x * dx + normal_y * dy)
        if depth > TOLERANCE:
            # Where the line from the centre, as it was, to the corner crosses the wall's line.
            part = side * was_offset / (side * was_offset + depth)
            crossing = was_along + part * (wall.tangent_x * dx + wall.tangent_y * dy - was_along)
            if 0.0 <= crossing <= wall.length:
                deepest = max(deepest, depth)
                total += depth
                point_x += depth * x
                point_y += depth * y
    if total > 0.0:  # One push for all corners: one after the other would turn a box that lies flat on the wall.
        leave(thing, point_x / total, point_y / total, normal_x, normal_y, deepest)
        has_moved = True
    for end in range(2):
        x = wall.x + end * wall.length * wall.tangent_x
        y = wall.y + end * wall.length * wall.tangent_y
        if leave_point(thing, x, y):
            has_moved = True
    return has_moved


@kernel
def leave_point(thing: Thing, x: float, y: float) -> bool:
    """Push a thing off a fixed point; return whether it moved."""
    overlap, normal_x, normal_y, point_x, point_y = nearest(thing, x, y, 0.0)
    if overlap <= TOLERANCE:
        return False
    leave(thing, point_x, point_y, -normal_x, -normal_y, overlap)
    return True


@kernel
def stay_inside(thing: Thing, width: float, depth: float) -> bool:
    """Push a thing back into the arena; return whether it moved."""
    reach = thing.reach
    x = thing.x
    y = thing.y
    if reach <= x <= width - reach and reach <= y <= depth - reach:
        return False
    if thing.half_width == 0.0:
        thing.x = min(max(x, reach), width - reach)
        thing.y = min(max(y, reach), depth - reach)
        thing.moved = 1
        return abs(thing.x - x) > TOLERANCE or abs(thing.y - y) > TOLERANCE
    has_moved = leave_edge(thing, 1.0, 0.0, 0.0)
    has_moved = leave_edge(thing, -1.0, 0.0, -width) or has_moved
    has_moved = leave_edge(thing, 0.0, 1.0, 0.0) or has_moved
    return leave_edge(thing, 0.0, -1.0, -depth) or has_moved


@kernel
def leave_edge(box: Thing, normal_x: float, normal_y: float, level: float) -> bool:
    """Push a box along a normal until every corner is at *level* along it, m; return whether it moved."""
    deepest = 0.0
    total = 0.0
    point_x = 0.0
    point_y = 0.0
    for corner in range(4):
        x, y = corner_of(box, corner)
        depth = level - normal_x * x - normal_y * y
        if depth > TOLERANCE:
            deepest = max(deepest, depth)
            total += depth
            point_x += depth * x
            point_y += depth * y
    if total == 0.0:
        return False
    leave(box, point_x / total, point_y / total, normal_x, normal_y, deepest)
    return True


@kernel
def follow(world: Records, k: int) -> None:
    """Put the sides, or the disc, of thing *k* where the thing is now."""
    thing = world.things[k]
    if thing.half_width == 0.0:
        world.discs[thing.first].x = thing.x
        world.discs[thing.first].y = thing.y
        return
    tangent_x = thing.heading_x
    tangent_y = thing.heading_y
    for side in range(4):  # Counter-clockwise from the corner behind on the right.
        wall = world.walls[thing.first + side]
        wall.x, wall.y = corner_of(thing, side)
        wall.tangent_x = tangent_x
        wall.tangent_y = tangent_y
        tangent_x, tangent_y = -tangent_y, tangent_x
