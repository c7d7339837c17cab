"""Rays to the nearest surface: for the infrared sensors, the time-of-flight sensor and drawings.

First it is listed what a robot may see, then each sensor casts its rays: one along its axis, and a fan of two more.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.neighbours import fixed_cell
from elib.simulator.physics.records import Disc, Fan, Records, Robot, Scratch, Segment

SENSOR_HEIGHT: Final = 0.033
"""Height of the infrared and the time-of-flight sensors above the floor, m (Webots). What is lower is not seen."""

MISSED: Final = 1e9
"""Length of a ray that does not meet a thing, m."""

PRESSED: Final = 1e-6
"""m. A sensor that rounding or the tolerance of contacts has put so far behind a surface still sees it, at 0."""


@kernel
def see_nothing(world: Records, i: int) -> Scratch:
    """Empty the lists of what robot *i* may see, and return the scratch that holds them."""
    lane = world.robots[i].lane
    scratch = world.scratch[lane]
    scratch.first_wall = lane * len(world.walls)
    scratch.end_wall = scratch.first_wall
    scratch.first_disc = lane * (len(world.discs) + len(world.robots))
    scratch.end_disc = scratch.first_disc
    return scratch


@kernel
def see_wall(robot: Robot, wall: Segment, horizon: float, seen: Segment) -> bool:
    """Return whether a wall is tall enough, and any part of it may be nearer than *horizon*, m.

    It is copied to *seen*, turned so that the robot stands to the left of it.
    """
    dx = wall.x - robot.x
    dy = wall.y - robot.y
    offset = wall.tangent_x * dy - wall.tangent_y * dx
    start = wall.tangent_x * dx + wall.tangent_y * dy
    beyond = max(start, -start - wall.length, 0.0)
    if offset * offset + beyond * beyond >= horizon * horizon or wall.height < SENSOR_HEIGHT:
        return False
    side = 1.0
    seen.x = wall.x
    seen.y = wall.y
    if offset < 0.0:
        side = -1.0
        seen.x += wall.length * wall.tangent_x
        seen.y += wall.length * wall.tangent_y
    seen.tangent_x = side * wall.tangent_x
    seen.tangent_y = side * wall.tangent_y
    seen.length = wall.length
    seen.absorbs = wall.absorbs
    return True


@kernel
def see_disc(robot: Robot, disc: Disc, horizon: float, seen: Disc) -> bool:
    """Return whether a cylinder is tall enough and may be nearer than *horizon*, m; it is copied to *seen*."""
    dx = disc.x - robot.x
    dy = disc.y - robot.y
    limit = horizon + disc.radius
    if dx * dx + dy * dy >= limit * limit or disc.height < SENSOR_HEIGHT:
        return False
    seen.x = disc.x
    seen.y = disc.y
    seen.radius = disc.radius
    seen.absorbs = disc.absorbs
    return True


@kernel
def see_robot(robot: Robot, other: Robot, horizon: float, seen: Disc) -> bool:
    """Return whether another robot may be nearer than *horizon*, m; it is copied to *seen*, white in infrared light."""
    dx = other.x - robot.x
    dy = other.y - robot.y
    limit = horizon + RADIUS
    if dx * dx + dy * dy >= limit * limit:
        return False
    seen.x = other.x
    seen.y = other.y
    seen.radius = other.radius
    seen.absorbs = 1.0
    return True


@kernel
def see_near(world: Records, i: int) -> Scratch:
    """List what the infrared sensors of robot *i* may see; return the scratch that holds the lists."""
    horizon = world.setting[0].horizon
    robot = world.robots[i]
    listing = world.listings[i]
    count = len(world.robots)
    scratch = see_nothing(world, i)
    walls = scratch.first_wall
    discs = scratch.first_disc
    for m in range(listing.first_wall, listing.end_wall):
        walls += see_wall(robot, world.walls[world.lists[m]], horizon, world.visible_walls[walls])
    if len(world.discs) > 0:
        cell = world.cells[fixed_cell(world.setting[0], robot.x, robot.y)]
        for m in range(cell.first_disc, cell.end_disc):
            discs += see_disc(robot, world.discs[world.lists[m]], horizon, world.visible_discs[discs])
    for m in range(listing.first_near, listing.end_near):
        j = world.lists[m]
        if j < count:
            if j == i:
                continue
            discs += see_robot(robot, world.robots[j], horizon, world.visible_discs[discs])
            continue
        thing = world.things[j - count]
        if thing.half_width == 0.0:
            discs += see_disc(robot, world.discs[thing.first], horizon, world.visible_discs[discs])
            continue
        for side in range(thing.first, thing.first + 4):
            walls += see_wall(robot, world.walls[side], horizon, world.visible_walls[walls])
    scratch.end_wall = walls
    scratch.end_disc = discs
    return scratch


@kernel
def see_all(world: Records, i: int, horizon: float) -> Scratch:
    """List everything that robot *i* may see nearer than *horizon*, m; return the scratch that holds the lists."""
    robot = world.robots[i]
    scratch = see_nothing(world, i)
    walls = scratch.first_wall
    discs = scratch.first_disc
    for k in range(len(world.walls)):
        walls += see_wall(robot, world.walls[k], horizon, world.visible_walls[walls])
    for k in range(len(world.discs)):
        discs += see_disc(robot, world.discs[k], horizon, world.visible_discs[discs])
    for k in range(len(world.robots)):
        if k != i:
            discs += see_robot(robot, world.robots[k], horizon, world.visible_discs[discs])
    scratch.end_wall = walls
    scratch.end_disc = discs
    return scratch


@kernel
def hit_wall(nearest: float, near: float, sliding: float, start: float, end: float) -> bool:
    """Return whether a ray meets a wall before anything that it met so far.

    Args:
        nearest: 1 / length of the ray so far, 1/m.
        near: 1 / length at which it crosses the wall's line, 1/m; 0 or less if it leads away.
        sliding: How far it goes along the wall for each metre of its length.
        start: Where the wall begins along itself, seen from the sensor, m.
        end: Where the wall ends, m.
    """
    return near > nearest and start * near <= sliding <= end * near


@kernel
def hit_disc(closing: float, outside: float) -> float:
    """Return the length at which a ray meets a disc, m; :data:`MISSED` if it does not.

    Args:
        closing: How far along the ray its point nearest to the disc's centre lies, m.
        outside: Square of the distance of the centre from the sensor, less the square of the radius, m2.
    """
    if closing > 0.0:
        under = closing * closing - outside
        if under >= 0.0:
            # A sensor that is pressed into its neighbour by the tolerance of the contact sees it at 0.
            return max(closing - sqrt(under), 0.0)
    return MISSED


@kernel
def cast(world: Records, scratch: Scratch, count: int, fan: Fan) -> None:
    """Cast three rays from each of *count* sensors: along the axis, and to the left and right at the fan's angle.

    The scratch says where the sensors are and where they look. It gets the lengths of their rays ahead, left and
    right, m, at most the fan's reach, and 1 / reflectance of what those meet that are shorter. The loops over the
    sensors have no branches, so that Numba can work on several sensors at once: that is quicker than to choose rays.
    """
    cosine = fan.cosine
    sine = fan.sine
    nothing = fan.nothing
    reach = fan.reach
    are_walls = scratch.first_wall < scratch.end_wall
    longest = nothing if are_walls else reach  # For walls 1 / length: it saves most divisions.
    for s in range(count):
        scratch.ahead[s] = longest
        scratch.left[s] = longest
        scratch.right[s] = longest
    for k in range(scratch.first_wall, scratch.end_wall):
        wall = world.visible_walls[k]
        x = wall.x
        y = wall.y
        tangent_x = wall.tangent_x
        tangent_y = wall.tangent_y
        length = wall.length
        absorbs = wall.absorbs
        for s in range(count):
            from_x = x - scratch.place_x[s]
            from_y = y - scratch.place_y[s]
            across = tangent_x * scratch.axis_y[s] - tangent_y * scratch.axis_x[s]
            sliding = tangent_x * scratch.axis_x[s] + tangent_y * scratch.axis_y[s]
            gap = tangent_x * from_y - tangent_y * from_x
            # A sensor beyond the wall's line looks back at it.
            side = -1.0 if gap < -PRESSED else 1.0
            inverse = 1.0 / max(side * gap, PRESSED)
            straight = side * across * cosine
            tilted = side * sliding * sine
            start = tangent_x * from_x + tangent_y * from_y
            end = start + length
            near = side * across * inverse
            is_hit = hit_wall(scratch.ahead[s], near, sliding, start, end)
            scratch.ahead[s] = near if is_hit else scratch.ahead[s]
            scratch.absorbs_ahead[s] = absorbs if is_hit else scratch.absorbs_ahead[s]
            near = (straight + tilted) * inverse
            is_hit = hit_wall(scratch.left[s], near, sliding * cosine - across * sine, start, end)
            scratch.left[s] = near if is_hit else scratch.left[s]
            scratch.absorbs_left[s] = absorbs if is_hit else scratch.absorbs_left[s]
            near = (straight - tilted) * inverse
            is_hit = hit_wall(scratch.right[s], near, sliding * cosine + across * sine, start, end)
            scratch.right[s] = near if is_hit else scratch.right[s]
            scratch.absorbs_right[s] = absorbs if is_hit else scratch.absorbs_right[s]
    if are_walls:
        for s in range(count):
            scratch.ahead[s] = reach if scratch.ahead[s] == nothing else 1.0 / scratch.ahead[s]
            scratch.left[s] = reach if scratch.left[s] == nothing else 1.0 / scratch.left[s]
            scratch.right[s] = reach if scratch.right[s] == nothing else 1.0 / scratch.right[s]
    for k in range(scratch.first_disc, scratch.end_disc):
        disc = world.visible_discs[k]
        x = disc.x
        y = disc.y
        radius = disc.radius
        absorbs = disc.absorbs
        for s in range(count):
            from_x = x - scratch.place_x[s]
            from_y = y - scratch.place_y[s]
            closing = from_x * scratch.axis_x[s] + from_y * scratch.axis_y[s]
            aside = from_y * scratch.axis_x[s] - from_x * scratch.axis_y[s]
            outside = from_x * from_x + from_y * from_y - radius * radius
            straight = closing * cosine
            tilted = aside * sine
            met = hit_disc(closing, outside)
            is_hit = met < scratch.ahead[s]
            scratch.ahead[s] = met if is_hit else scratch.ahead[s]
            scratch.absorbs_ahead[s] = absorbs if is_hit else scratch.absorbs_ahead[s]
            met = hit_disc(straight + tilted, outside)
            is_hit = met < scratch.left[s]
            scratch.left[s] = met if is_hit else scratch.left[s]
            scratch.absorbs_left[s] = absorbs if is_hit else scratch.absorbs_left[s]
            met = hit_disc(straight - tilted, outside)
            is_hit = met < scratch.right[s]
            scratch.right[s] = met if is_hit else scratch.right[s]
            scratch.absorbs_right[s] = absorbs if is_hit else scratch.absorbs_right[s]
