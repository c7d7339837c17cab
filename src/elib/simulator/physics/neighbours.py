"""Who may be near whom: lists of each robot's neighbours and of the walls around it.

They are Verlet lists, made from a spatial hash. Each is generous by :data:`STRAY` a side, so it holds until something
has moved that far. Neighbours stand in rising order and walls in the order in which they were built, so the result
does not depend on when the lists were made.
"""

from __future__ import annotations

from typing import Final

from elib.simulator.physics.body import SENSOR_RADIUS
from elib.simulator.physics.engine import kernel, phase
from elib.simulator.physics.records import Records, Segment, Setting

STRAY: Final = 0.02
"""How far anything may be from where it was listed at the end of a tick, m: then the lists are made again."""

IN_A_TICK: Final = 0.06
"""What wheels and contacts move anything in one tick at most, m: 50 mm a thing, 54 mm the worst robot at 0.2 m/s."""

SENSORS_WITHIN: Final = SENSOR_RADIUS + 0.004
"""All infrared sensors sit within this distance of the middle of their robot, also where they were a slot ago, m."""

NEAR_WALLS: Final = 48
"""Room for so many walls in a robot's own list. Where more are near, it takes the list of its cell."""


EDGE: Final = 4
"""The first walls are the arena's edge: robots and things are kept inside it by comparisons instead."""


@kernel
def cell_of(x: float, y: float, scale: float, columns: int, rows: int) -> int:
    """Return the cell of a place in a grid. What lies outside belongs to the outermost cells."""
    return min(max(int(y * scale), 0), rows - 1) * columns + min(max(int(x * scale), 0), columns - 1)


@kernel
def fixed_cell(setting: Setting, x: float, y: float) -> int:
    """Return the cell of a place in the grid of fixed things."""
    return cell_of(x, y, setting.cell_scale, setting.cell_columns, setting.cell_rows)


@kernel
def is_near_wall(x: float, y: float, wall: Segment, limit: float) -> bool:
    """Return whether any part of a wall is nearer to (x, y) than *limit*, m."""
    dx = wall.x - x
    dy = wall.y - y
    offset = wall.tangent_x * dy - wall.tangent_y * dx
    start = wall.tangent_x * dx + wall.tangent_y * dy
    # Along the wall: how far it is to its nearer end, or 0 beside it.
    beyond = max(start, -start - wall.length, 0.0)
    return offset * offset + beyond * beyond < limit * limit


@phase
def list_near(world: Records) -> None:
    """List what is near each robot and thing."""
    fill_hash(world)
    end = world.setting[0].first_near
    for k in range(len(world.listings)):
        listing = world.listings[k]
        listing.first_near = end
        listing.end_near = list_neighbours(world, k, end)
        if listing.end_near < 0:
            listing.first_near = world.setting[0].first_all
            listing.end_near = listing.first_near + len(world.listings)
        else:
            end = listing.end_near
    for i in range(len(world.robots)):
        list_walls(world, i)


@kernel
def fill_hash(world: Records) -> None:
    """Put every robot and thing into the cell of the hash where it is now, in rising order."""
    setting = world.setting[0]
    count = len(world.robots)
    for cell in range(setting.hash_columns * setting.hash_rows):
        world.heads[cell] = -1
    for k in range(len(world.listings) - 1, -1, -1):
        listing = world.listings[k]
        if k < count:
            listing.x = world.robots[k].x
            listing.y = world.robots[k].y
        else:
            listing.x = world.things[k - count].x
            listing.y = world.things[k - count].y
        cell = cell_of(listing.x, listing.y, setting.hash_scale, setting.hash_columns, setting.hash_rows)
        listing.next = world.heads[cell]
        world.heads[cell] = k


@kernel
def list_neighbours(world: Records, k: int, first: int) -> int:
    """List what is near robot or thing *k*, from *first* on; return where the list ends, or -1 if there is no room."""
    setting = world.setting[0]
    here = world.listings[k]
    cell = cell_of(here.x, here.y, setting.hash_scale, setting.hash_columns, setting.hash_rows)
    row = cell // setting.hash_columns
    column = cell - row * setting.hash_columns
    end = first
    for v in range(max(row - 1, 0), min(row + 2, setting.hash_rows)):
        for u in range(max(column - 1, 0), min(column + 2, setting.hash_columns)):
            j = world.heads[v * setting.hash_columns + u]
            while j >= 0:
                other = world.listings[j]
                dx = other.x - here.x
                dy = other.y - here.y
                limit = here.reach + other.rim + 2.0 * STRAY
                if j != k and dx * dx + dy * dy < limit * limit:
                    if end == len(world.lists):
                        return -1
                    at = end
                    while at > first and world.lists[at - 1] > j:
                        world.lists[at] = world.lists[at - 1]
                        at -= 1
                    world.lists[at] = j
                    end += 1
                j = other.next
    return end


@kernel
def list_walls(world: Records, i: int) -> None:
    """List the fixed walls that robot *i* may see or touch; of too many it takes the list of its cell."""
    setting = world.setting[0]
    listing = world.listings[i]
    cell = world.cells[fixed_cell(setting, listing.x, listing.y)]
    first = setting.first_own + i * NEAR_WALLS
    end = first
    for m in range(cell.first_wall, cell.end_wall):
        if is_near_wall(listing.x, listing.y, world.walls[world.lists[m]], setting.horizon + STRAY):
            if end == first + NEAR_WALLS:
                first = cell.first_wall
                end = cell.end_wall
                break
            world.lists[end] = world.lists[m]
            end += 1
    listing.first_wall = first
    listing.end_wall = end


@kernel
def is_stale(world: Records) -> bool:
    """Return whether anything has moved farther than the lists allow."""
    count = len(world.robots)
    for k in range(len(world.listings)):
        listing = world.listings[k]
        if k < count:
            dx = world.robots[k].x - listing.x
            dy = world.robots[k].y - listing.y
        else:
            dx = world.things[k - count].x - listing.x
            dy = world.things[k - count].y - listing.y
        if dx * dx + dy * dy > STRAY * STRAY:
            return True
    return False
