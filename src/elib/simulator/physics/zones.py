"""What has a state in a world: zones, what they give and switch, doors, pucks, pens, and the energy of robots.

Everything here is done once at the end of a tick, in a fixed order: robots, zones, doors, pucks. A zone is looked up in
a map of the floor (:class:`Areas`) that has a bit for each zone, so all shapes cost the same. A world without any of
these never comes here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Final

from elib.base.errors import ArgumentError
from elib.simulator.physics.engine import kernel, phase
from elib.simulator.physics.fittings import Zone
from elib.simulator.physics.floor import opened
from elib.simulator.physics.geometry import Box, Point
from elib.simulator.physics.neighbours import fixed_cell, is_near_wall
from elib.simulator.physics.noise import numbered_key, tick_key, uniform
from elib.simulator.physics.pushing import follow, nearest, shortest_way
from elib.simulator.physics.records import Records, Robot, Setting, Thing, ZoneState
from elib.simulator.physics.scene import Scene

RESOLUTION: Final = 0.0025
"""Side of a cell of the map, m."""

MAX_CELLS: Final = 1_000_000
"""Larger floors get coarser cells."""

DARK: Final = 128
"""Grey, 0..255, below which a pixel of a picture is part of its zone."""

KEPT: Final = 256
"""Events that a world remembers."""

FIRST_INK: Final = 1 + 4 * KEPT
"""Where in the states what pens drew begins."""

KINDS: Final = ("enter", "leave", "on", "off", "open", "closed", "collect", "respawn", "empty")
"""What happens; a kernel tells its number."""
(ENTER, LEAVE, ON, OFF, OPEN, CLOSED, COLLECT, RESPAWN, EMPTY) = range(len(KINDS))

NONE: Final = -1
BY_ROBOTS: Final = -2
"""In the place of a zone's number: robots collect it by touching it."""

LOST: Final = -100.0
"""x and y of a puck that is gone, m: no sensor looks so far."""

FOREVER: Final = 1 << 30
"""Ticks after which a puck comes back that does not."""

RECOVERED: Final = 0.01
"""Energy from which on a robot that was empty can become so again: a weak charger would tell it in every tick."""

TOUCH: Final = 0.001
"""m. A robot this near to a puck touches it."""

SLACK: Final = 1e-4
"""m. What overlaps a door by less is pushed off it by the next tick."""

DRAWS: Final = 8
"""Places that are tried in a tick for a puck that comes back."""

ROOM: Final = 0.01
"""m around a puck that comes back."""

FASTEST: Final = 0.04
"""m. No door moves farther in a tick: lists of neighbours hold for a little more."""

PEN: Final = 0.003
"""Half the width of a pen's line, m."""


@dataclass(frozen=True, slots=True)
class Areas:
    """The map of the zones.

    Attributes:
        columns: Along x; 0 where there is no map.
        rows: Along y.
        scale: Cells a metre.
        cells: Row by row from y = 0: a bit for each zone.
    """

    columns: int = 0
    rows: int = 0
    scale: float = 0.0
    cells: tuple[int, ...] = ()


def areas_of(scene: Scene) -> Areas:
    """Return the map of the zones of *scene*, on which pens draw, too.

    Raises:
        ArgumentError: The picture of a zone cannot be read.
    """
    if not scene.zones and not any(scene.pens):
        return Areas()
    files = [Path(zone.file) for zone in scene.zones if zone.file]
    written = tuple(path.stat().st_mtime_ns if path.exists() else 0 for path in files)
    return _mapped(scene.zones, scene.width, scene.depth, written)


@lru_cache(maxsize=8)
def _mapped(zones: tuple[Zone, ...], width: float, depth: float, written: tuple[int, ...]) -> Areas:
    scale = min(1 / RESOLUTION, math.sqrt(MAX_CELLS / (width * depth)))
    columns, rows = math.ceil(width * scale), math.ceil(depth * scale)
    cells = [0] * (columns * rows)
    for k, zone in enumerate(zones):
        dark = _dark(zone, scale) if zone.file else None
        for row, column in _inside(zone.outline, scale, rows, columns):
            if dark is None or dark(column, row):
                cells[row * columns + column] |= 1 << k
    return Areas(columns, rows, scale, tuple(cells))


def open_cells(areas: Areas, scene: Scene, boxes: Sequence[Box]) -> tuple[int, ...]:
    """Return the cells of a map; zones in which pucks come back have none where a polygon or fixed box stands now."""
    fields = {post.respawn for post in scene.cylinders if post.respawn}
    shut = sum(1 << k for k, zone in enumerate(scene.zones) if zone.name in fields)
    if not shut:
        return areas.cells
    cells = [*areas.cells]
    blocks = (*(box.corners for box in boxes if not box.can_move), *(polygon.points for polygon in scene.polygons))
    for block in blocks:
        for row, column in _inside(block, areas.scale, areas.rows, areas.columns):
            cells[row * areas.columns + column] &= ~shut
    return tuple(cells)


def _inside(outline: Sequence[Point], scale: float, rows: int, columns: int) -> Iterator[tuple[int, int]]:
    """Yield row and column of the cells that have their middles inside of an outline."""
    corners = [(x * scale - 0.5, y * scale - 0.5) for x, y in outline]
    low, high = (find((y for _, y in corners), default=0.0) for find in (min, max))
    for row in range(max(math.ceil(low), 0), min(math.ceil(high), rows)):
        crossings = []
        for (x1, y1), (x2, y2) in pairwise([*corners, *corners[:1]]):
            if (y1 > row) != (y2 > row):
                crossings.append((x1 + (row - y1) / (y2 - y1) * (x2 - x1), 1 if y2 > y1 else -1))
        turns = 0
        for (x, turn), (after, _) in pairwise(sorted(crossings)):
            turns += turn
            if turns:
                for column in range(min(max(math.ceil(x), 0), columns), min(max(math.ceil(after), 0), columns)):
                    yield row, column


def _dark(zone: Zone, scale: float) -> Callable[[int, int], bool]:
    """Return a function that tells whether a zone's picture is dark in a cell."""
    from PIL import Image  # worlds without pictures need no Pillow

    (left, _), _, (right, high), _ = zone.outline
    size = max(1, round((right - left) * scale)), max(1, round((high - zone.outline[0][1]) * scale))
    try:
        with opened(Path(zone.file)) as source:
            paper = Image.new("RGBA", source.size, "white")
            seen = Image.alpha_composite(paper, source.convert("RGBA")).convert("L").resize(size)
    except ArgumentError as error:
        raise ArgumentError(f"the picture {zone.file} cannot be read: {error.message}", hint=error.hint) from error
    grey = seen.tobytes()
    first, top = round(left * scale), round(high * scale) - 1

    def is_dark(column: int, row: int) -> bool:
        across, down = column - first, top - row
        return 0 <= across < size[0] and 0 <= down < size[1] and grey[down * size[0] + across] < DARK

    return is_dark


@kernel
def area_at(world: Records, x: float, y: float) -> int:
    """Return the zones at a place: a bit for each."""
    cell = map_cell(world.setting[0], x, y)
    return world.floor[world.setting[0].first_area + cell] if cell >= 0 else 0


@kernel
def map_cell(setting: Setting, x: float, y: float) -> int:
    """Return the cell of the map at a place; -1 outside of it."""
    column = x * setting.map_scale
    row = y * setting.map_scale
    if 0.0 <= column < setting.map_columns and 0.0 <= row < setting.map_rows:
        return int(row) * setting.map_columns + int(column)
    return -1


@kernel
def tell(world: Records, kind: int, what: int, who: int) -> None:
    """Note that something has happened to a zone, thing or robot."""
    at = 1 + 4 * (world.states[0] % KEPT)
    world.states[at] = world.setting[0].tick
    world.states[at + 1] = kind
    world.states[at + 2] = what
    world.states[at + 3] = who
    world.states[0] += 1


@phase
def act(world: Records) -> None:
    """Let everything with a state go on by a tick."""
    for k in range(len(world.zones)):
        world.zones[k].count = 0
    for i in range(len(world.robots)):
        visit(world, i)
        live(world, i)
        if world.setting[0].has_pens and world.robots[i].pen >= 0:
            draw(world, world.robots[i])
    for k in range(len(world.zones)):
        switch(world, k)
    for k in range(len(world.things)):
        if world.things[k].switch >= 0:
            move_door(world, k)
        elif world.things[k].collect != NONE:
            play(world, k)


@kernel
def visit(world: Records, i: int) -> None:
    """Note in which zones robot *i* is now, and give it what these give."""
    setting = world.setting[0]
    robot = world.robots[i]
    before = robot.zones
    robot.zones = area_at(world, robot.x, robot.y)
    if robot.zones == 0 and before == 0:
        return
    for k in range(len(world.zones)):
        zone = world.zones[k]
        is_in = (robot.zones >> k) & 1
        if is_in != (before >> k) & 1:
            tell(world, ENTER if is_in else LEAVE, k, i)
            robot.score += zone.score * is_in
        if is_in:
            zone.count += 1
            robot.score += zone.rate * setting.step
            if setting.has_energy:
                gift = min(zone.energy * setting.step, 1.0 - robot.energy, zone.store)
                zone.store -= max(gift, 0.0)
                feed(world, i, gift)


@kernel
def feed(world: Records, i: int, gift: float) -> None:
    """Give a robot energy, or take it."""
    robot = world.robots[i]
    before = robot.energy
    robot.energy = min(max(before + gift, 0.0), 1.0)
    if robot.energy == 0.0 and before > 0.0 and not robot.was_told:
        tell(world, EMPTY, NONE, i)
        robot.was_told = 1
    elif robot.energy > RECOVERED:
        robot.was_told = 0


@kernel
def live(world: Records, i: int) -> None:
    """Take from robot *i* what it used in this tick."""
    setting = world.setting[0]
    robot = world.robots[i]
    if setting.has_energy and robot.energy > 0.0:
        rolled = 0.5 * (abs(robot.left_speed) + abs(robot.right_speed)) * setting.step
        feed(world, i, -(setting.idle * setting.step + setting.driving * rolled))


@kernel
def draw(world: Records, robot: Robot) -> None:
    """Draw a pen's line from where the robot was to where it is."""
    setting = world.setting[0]
    dx = robot.x - robot.before_x
    dy = robot.y - robot.before_y
    dots = int((abs(dx) + abs(dy)) * setting.map_scale) + 1
    reach = PEN * setting.map_scale
    for dot in range(dots):
        column = (robot.x - dx * dot / dots) * setting.map_scale - 0.5
        row = (robot.y - dy * dot / dots) * setting.map_scale - 0.5
        for v in range(max(int(row - reach), 0), min(int(row + reach) + 2, setting.map_rows)):
            for u in range(max(int(column - reach), 0), min(int(column + reach) + 2, setting.map_columns)):
                away = (u - column) * (u - column) + (v - row) * (v - row)
                if away <= max(reach * reach, 0.5):  # coarse cells: the nearest one at least
                    world.states[FIRST_INK + v * setting.map_columns + u] = robot.pen + 1


@kernel
def switch(world: Records, k: int) -> None:
    """Switch a zone on or off, and fill its store."""
    zone = world.zones[k]
    zone.store = min(zone.store + zone.refill * world.setting[0].step, zone.full)
    is_held = zone.count > 0
    if zone.key >= 0:
        thing = world.things[zone.key]
        is_held = (area_at(world, thing.x, thing.y) >> k) & 1 == 1
    elif zone.key == NONE:
        is_held = False
    before = zone.is_on
    if zone.hand != 0:
        zone.is_on = 1 if zone.hand > 0 else 0
    elif is_held:
        zone.is_on = 1
    elif zone.stays == 0:
        zone.is_on = 0
    if zone.is_on != before:
        tell(world, ON if zone.is_on else OFF, k, NONE)


@kernel
def move_door(world: Records, k: int) -> None:
    """Open or close a door a little, unless something is in its way."""
    thing = world.things[k]
    wanted = 1.0 if world.zones[thing.switch].is_on else 0.0
    before = thing.open
    if before == wanted:
        return
    step = min(thing.pace * world.setting[0].step, 1.0)
    thing.open = min(before + step, 1.0) if wanted > before else max(before - step, 0.0)
    place_door(thing)
    if is_blocked(world, k):
        thing.open = before
        place_door(thing)
    elif thing.open == wanted:
        tell(world, OPEN if wanted > 0.0 else CLOSED, k, NONE)
    follow(world, k)


@kernel
def place_door(door: Thing) -> None:
    """Put a door where it is as far open as it is."""
    share = door.open
    heading_x = door.closed_x + share * (door.open_x - door.closed_x)
    heading_y = door.closed_y + share * (door.open_y - door.closed_y)
    length = math.sqrt(heading_x * heading_x + heading_y * heading_y)
    door.heading_x = heading_x / length
    door.heading_y = heading_y / length
    door.x = door.hinge_x + share * door.slide_x + door.arm * door.heading_x
    door.y = door.hinge_y + share * door.slide_y + door.arm * door.heading_y


@kernel
def is_blocked(world: Records, k: int) -> bool:
    """Return whether a robot or a thing other than a door stands in door *k*."""
    door = world.things[k]
    for i in range(len(world.robots)):
        robot = world.robots[i]
        overlap, _, _, _, _ = nearest(door, robot.x, robot.y, robot.radius)
        if overlap > SLACK:
            return True
    for j in range(len(world.things)):
        other = world.things[j]
        if other.switch >= 0:
            continue
        if other.half_width == 0.0:
            overlap, _, _, _, _ = nearest(door, other.x, other.y, other.reach)
        else:
            overlap, _ = shortest_way(door, other)
        if overlap > SLACK:
            return True
    return False


@kernel
def play(world: Records, k: int) -> None:
    """Collect a puck, or bring it back."""
    puck = world.things[k]
    tick = world.setting[0].tick
    if puck.back >= 0:
        if tick >= puck.back:
            respawn(world, k)
        return
    near = NONE
    least = 1e18
    for i in range(len(world.robots)):
        robot = world.robots[i]
        dx = puck.x - robot.x
        dy = puck.y - robot.y
        if dx * dx + dy * dy < least:
            least = dx * dx + dy * dy
            near = i
    if puck.collect == BY_ROBOTS:
        reach = world.robots[near].radius + puck.reach + TOUCH if near >= 0 else 0.0
        if least > reach * reach:
            return
    elif (area_at(world, puck.x, puck.y) >> puck.collect) & 1 == 0:
        return
    tell(world, COLLECT, k, near)
    if near >= 0:
        world.robots[near].score += puck.score
        if world.setting[0].has_energy:
            feed(world, near, puck.gift)
    puck.back = tick + int(puck.after / world.setting[0].step) if puck.respawn >= 0 else FOREVER
    put(world, k, LOST, LOST)


@kernel
def put(world: Records, k: int, x: float, y: float) -> None:
    """Put a puck somewhere, at rest."""
    puck = world.things[k]
    puck.x = x
    puck.y = y
    puck.before_x = x
    puck.before_y = y
    puck.speed_x = 0.0
    puck.speed_y = 0.0
    puck.spin = 0.0
    follow(world, k)


@kernel
def respawn(world: Records, k: int) -> None:
    """Bring a puck back to a free place of its zone, one of a few that are drawn; if none is free, wait."""
    setting = world.setting[0]
    puck = world.things[k]
    zone = world.zones[puck.respawn]
    key = tick_key(numbered_key(setting.key, FOREVER + k), setting.tick)
    # No place is free whose cell of the map is partly in a block: a large floor has large cells.
    room = max(puck.reach + ROOM, math.sqrt(0.5) / setting.map_scale)
    for n in range(DRAWS):
        x = zone.left + (zone.right - zone.left) * uniform(key, 2 * n)
        y = zone.low + (zone.high - zone.low) * uniform(key, 2 * n + 1)
        if (area_at(world, x, y) >> puck.respawn) & 1 and is_free(world, x, y, room):
            puck.back = -1
            put(world, k, x, y)
            tell(world, RESPAWN, k, NONE)
            return


@kernel
def is_free(world: Records, x: float, y: float, room: float) -> bool:
    """Return whether nothing stands nearer to a place than so much room, m."""
    setting = world.setting[0]
    if not (room <= x <= setting.width - room and room <= y <= setting.depth - room):
        return False
    for i in range(len(world.robots)):
        robot = world.robots[i]
        reach = room + robot.radius
        if (x - robot.x) * (x - robot.x) + (y - robot.y) * (y - robot.y) < reach * reach:
            return False
    for k in range(len(world.things)):
        overlap, _, _, _, _ = nearest(world.things[k], x, y, room)
        if overlap > 0.0:
            return False
    cell = world.cells[fixed_cell(setting, x, y)]
    for m in range(cell.first_wall, cell.end_wall):
        if is_near_wall(x, y, world.walls[world.lists[m]], room):
            return False
    for m in range(cell.first_disc, cell.end_disc):
        disc = world.discs[world.lists[m]]
        reach = room + disc.radius
        if (x - disc.x) * (x - disc.x) + (y - disc.y) * (y - disc.y) < reach * reach:
            return False
    return True


def zone_state(zone: Zone) -> ZoneState:
    """Return the state in which a zone begins."""
    xs, ys = zip(*zone.outline, strict=True) if zone.outline else ((0.0,), (0.0,))
    full = math.inf if zone.store is None else zone.store
    return ZoneState(
        is_on=int(zone.is_on),
        stays=int(zone.stays or not zone.outline),
        store=full,
        full=full,
        refill=zone.refill,
        energy=zone.energy,
        score=zone.score,
        rate=zone.rate,
        left=min(xs),
        right=max(xs),
        low=min(ys),
        high=max(ys),
    )
