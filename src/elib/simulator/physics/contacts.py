"""Contacts: overlapping things are pushed apart in a fixed order until nothing overlaps.

The solver moves positions and not speeds (position-based, Gauss-Seidel): nothing bounces, and a robot slides along what
it touches. Two robots give way by half each; what is fixed does not; how things are pushed stands in
``pushing``. The arena's edge has the last word. A pair that does not overlap is left alone to the last
bit, so what happens here does not depend on what happens elsewhere.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.simulator.physics.engine import kernel
from elib.simulator.physics.neighbours import EDGE, fixed_cell, is_near_wall
from elib.simulator.physics.pushing import TOLERANCE, follow, leave_obstacles, press, push_by_robot, put_back
from elib.simulator.physics.records import Records, Scratch, Segment

MAX_ITERATIONS: Final = 48
"""Only what still moves takes part in an iteration. A pair needs 15, a row more. What overlaps after them is wedged in:
it is put back to where it was before the tick, where it did not."""

LAST_ITERATION: Final = 200
"""Putting one thing back may leave its neighbour no room, and so on; each goes back at most once."""

MAX_PUSHES: Final = 12
"""How often two fixed things push a robot back and forth at most. Then it is wedged in, and does not move."""

EVEN_ITERATIONS: Final = 2
"""In the first iterations two robots are put side by side. What is not apart by then is held by walls or by others, and
gives way by a few per cent of the overlap an iteration: from then on robots are pushed by :data:`OVER_RELAXATION` times
as much and by :data:`EXTRA_GAP` farther, which needs a tenth of the iterations (successive over-relaxation)."""

OVER_RELAXATION: Final = 1.7
EXTRA_GAP: Final = 1e-4  # m

SLIDE: Final = 0.01
"""m. A robot slides along a fixed thing to come clear of another: no farther than this, and than twice its way in this
tick. Nearly parallel things would send it past others that it has not looked at."""


@kernel
def collide(world: Records) -> None:
    """Push overlapping things apart until nothing overlaps by more than :data:`TOLERANCE`."""
    is_quiet = wake(world)
    if is_quiet and len(world.things) == 0:
        return
    for iteration in range(1, LAST_ITERATION + 1):
        is_quiet = True
        for i in range(len(world.robots)):
            # In the first iteration robots take part that overlap something; later, those moved since the last one.
            robot = world.robots[i]
            if robot.touched < iteration - 1:
                continue
            is_pushed = leave_robots(world, i, iteration)
            if leave_fixed(world, i):
                robot.touched = iteration
                is_pushed = True
            if is_pushed:
                is_quiet = False
                if iteration > MAX_ITERATIONS:
                    robot.x = robot.before_x
                    robot.y = robot.before_y
        for k in range(len(world.things)):
            thing = world.things[k]
            if (iteration > 1 and thing.moved == 0) or thing.back >= 0:
                continue
            thing.moved = 0
            is_pushed = leave_obstacles(world, k, iteration)
            if press(world, k, iteration):
                is_pushed = True
            if is_pushed:
                is_quiet = False
                if iteration > MAX_ITERATIONS:
                    put_back(thing)
        if is_quiet:
            break
    for i in range(len(world.robots)):
        robot = world.robots[i]
        if robot.touched > 0:  # Whatever pushed it last, it stays in the arena.
            robot.x = min(max(robot.x, robot.radius), world.setting[0].width - robot.radius)
            robot.y = min(max(robot.y, robot.radius), world.setting[0].depth - robot.radius)
    for k in range(len(world.things)):
        follow(world, k)


@kernel
def wake(world: Records) -> bool:
    """Mark the robots that overlap another robot or something fixed; return whether there are none.

    Most ticks of most robots end here.
    """
    setting = world.setting[0]
    count = len(world.robots)
    is_quiet = True
    for i in range(count):
        world.robots[i].touched = -1
    for i in range(count):
        robot = world.robots[i]
        listing = world.listings[i]
        x = robot.x
        y = robot.y
        radius = robot.radius
        if (
            x < radius
            or x > setting.width - radius
            or y < radius
            or y > setting.depth - radius
            or overlaps_fixed(world, i)
        ):
            robot.touched = 0
            is_quiet = False
        for m in range(listing.first_near, listing.end_near):
            j = world.lists[m]
            if i < j < count:
                other = world.robots[j]
                dx = other.x - x
                dy = other.y - y
                limit = radius + other.radius - TOLERANCE
                if dx * dx + dy * dy < limit * limit:
                    robot.touched = 0
                    other.touched = 0
                    is_quiet = False
    return is_quiet


@kernel
def overlaps_fixed(world: Records, i: int) -> bool:
    """Return whether robot *i* overlaps a fixed wall or cylinder."""
    robot = world.robots[i]
    for m in range(world.listings[i].first_wall, world.listings[i].end_wall):
        w = world.lists[m]
        if w >= EDGE and is_near_wall(robot.x, robot.y, world.walls[w], robot.radius - TOLERANCE):
            return True
    if len(world.discs) == 0:
        return False
    cell = world.cells[fixed_cell(world.setting[0], robot.x, robot.y)]
    for m in range(cell.first_disc, cell.end_disc):
        disc = world.discs[world.lists[m]]
        dx = robot.x - disc.x
        dy = robot.y - disc.y
        reach = robot.radius + disc.radius - TOLERANCE
        if dx * dx + dy * dy < reach * reach:
            return True
    return False


@kernel
def leave_robots(world: Records, i: int, iteration: int) -> bool:
    """Push robot *i* and the robots and things that overlap it apart; return whether there were any."""
    count = len(world.robots)
    robot = world.robots[i]
    listing = world.listings[i]
    is_even = iteration <= EVEN_ITERATIONS
    share = 0.5 if is_even else 0.5 * OVER_RELAXATION
    gap = 0.0 if is_even else EXTRA_GAP
    has_moved = False
    for m in range(listing.first_near, listing.end_near):
        j = world.lists[m]
        if j >= count:
            if push_by_robot(world.things[j - count], robot):
                robot.touched = iteration
                has_moved = True
            continue
        other = world.robots[j]
        if j == i or (j < i and other.touched >= iteration - 1):
            continue
        dx = other.x - robot.x
        dy = other.y - robot.y
        reach = robot.radius + other.radius
        limit = reach - TOLERANCE
        square = dx * dx + dy * dy
        if square < limit * limit:
            distance = sqrt(square)
            push = share * reach
            if distance > 0.0:
                push = share * (reach + gap - distance) / distance
            else:
                dx = 1.0  # On top of each other: any direction will do, if it is always the same.
            robot.x -= push * dx
            robot.y -= push * dy
            other.x += push * dx
            other.y += push * dy
            robot.touched = iteration
            other.touched = iteration
            has_moved = True
    return has_moved


@kernel
def leave_fixed(world: Records, i: int) -> bool:
    """Push robot *i* out of fixed things and back into the arena; return whether it was moved."""
    setting = world.setting[0]
    robot = world.robots[i]
    listing = world.listings[i]
    contact = world.scratch[robot.lane]
    contact.exit_x = robot.x
    contact.exit_y = robot.y
    step_x = robot.x - robot.before_x
    step_y = robot.y - robot.before_y
    contact.longest = min(4.0 * (step_x * step_x + step_y * step_y), SLIDE * SLIDE)
    has_moved = False
    for _ in range(MAX_PUSHES):
        from_x = contact.exit_x
        from_y = contact.exit_y
        contact.exit_count = 0
        contact.normal_x = 0.0
        contact.normal_y = 0.0
        contact.level = 0.0
        cell = world.cells[fixed_cell(setting, from_x, from_y)]
        for m in range(cell.first_disc, cell.end_disc):
            disc = world.discs[world.lists[m]]
            leave_disc(contact, disc.x, disc.y, robot.radius + disc.radius)
        for m in range(listing.first_wall, listing.end_wall):
            if world.lists[m] >= EDGE:
                leave_wall(contact, world.walls[world.lists[m]], robot.radius)
        leave_edge(contact, robot.radius, setting.width - robot.radius, setting.depth - robot.radius)
        if contact.exit_count > 0:
            has_moved = True
        # Out of one thing: the next pass sees whether that led into another. Back where it was: it would go on so.
        if contact.exit_count < 2 or (contact.exit_x == from_x and contact.exit_y == from_y):
            break
    robot.x = contact.exit_x
    robot.y = contact.exit_y
    if contact.exit_count > 1:
        robot.x = robot.before_x
        robot.y = robot.before_y
    return has_moved


@kernel
def leave_disc(contact: Scratch, x: float, y: float, reach: float) -> None:
    """Push the robot so far that it is *reach* away from (x, y), m."""
    dx = contact.exit_x - x
    dy = contact.exit_y - y
    square = dx * dx + dy * dy
    if square >= (reach - TOLERANCE) * (reach - TOLERANCE):
        return
    distance = sqrt(square)
    normal_x = 1.0
    normal_y = 0.0
    if distance > 0.0:
        normal_x = dx / distance
        normal_y = dy / distance
    push(contact, normal_x, normal_y, reach - distance)


@kernel
def leave_wall(contact: Scratch, wall: Segment, radius: float) -> None:
    """Push the robot out of a wall, to the side on which its centre lies."""
    limit = radius - TOLERANCE
    dx = contact.exit_x - wall.x
    dy = contact.exit_y - wall.y
    offset = wall.tangent_x * dy - wall.tangent_y * dx
    if offset >= limit or offset <= -limit:
        return
    side = 1.0 if offset >= 0.0 else -1.0
    distance = side * offset
    normal_x = -side * wall.tangent_y
    normal_y = side * wall.tangent_x
    along = wall.tangent_x * dx + wall.tangent_y * dy
    foot = min(max(along, 0.0), wall.length)
    if foot != along:  # The nearest point is an end of the wall.
        dx -= foot * wall.tangent_x
        dy -= foot * wall.tangent_y
        square = dx * dx + dy * dy
        if square >= limit * limit:
            return
        distance = sqrt(square)
        normal_x = dx / distance
        normal_y = dy / distance
    push(contact, normal_x, normal_y, radius - distance)


@kernel
def leave_edge(contact: Scratch, radius: float, width: float, depth: float) -> None:
    """Push the robot back into the arena: its middle to between *radius* and *width*, and *radius* and *depth*, m."""
    if contact.exit_x < radius or contact.exit_x > width:
        edge = radius if contact.exit_x < radius else width
        contact.exit_count += 1 if abs(contact.exit_x - edge) > TOLERANCE else 0
        normal_x = 1.0 if contact.exit_x < radius else -1.0
        contact.exit_x = edge
        slide(contact, normal_x, 0.0)
    if contact.exit_y < radius or contact.exit_y > depth:
        edge = radius if contact.exit_y < radius else depth
        contact.exit_count += 1 if abs(contact.exit_y - edge) > TOLERANCE else 0
        contact.exit_y = edge
        slide(contact, 0.0, 1.0)


@kernel
def push(contact: Scratch, normal_x: float, normal_y: float, overlap: float) -> None:
    """Push the robot along a normal, out of a fixed thing."""
    contact.exit_x += overlap * normal_x
    contact.exit_y += overlap * normal_y
    contact.exit_count += 1
    slide(contact, normal_x, normal_y)


@kernel
def slide(contact: Scratch, normal_x: float, normal_y: float) -> None:
    """Move a robot that was pushed along a normal, and maybe into the thing before again, along the surface.

    It slides along the one until it is clear of the other: so it leaves a corner at once, where pushing it to and fro
    gets nearer by a share of the rest each time.
    """
    lack = contact.level - (contact.exit_x * contact.normal_x + contact.exit_y * contact.normal_y)
    lean = normal_x * contact.normal_y - normal_y * contact.normal_x
    if lack > 0.0 and lack * lack < contact.longest * (lean * lean):
        contact.exit_x -= lack / lean * normal_y
        contact.exit_y += lack / lean * normal_x
    contact.normal_x = normal_x
    contact.normal_y = normal_y
    contact.level = contact.exit_x * normal_x + contact.exit_y * normal_y
