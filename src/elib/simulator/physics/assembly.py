"""From a scene to the records that the kernels share (:mod:`elib.simulator.physics.records`)."""

from __future__ import annotations

import math
import sys
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

from elib.base.body import FASTEST_2, METRES_PER_STEP, step_rate
from elib.simulator.physics import profiles, records
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.faces import Faces
from elib.simulator.physics.fittings import Energy
from elib.simulator.physics.floor import Floor, packed
from elib.simulator.physics.geometry import Box, Cylinder, Wall, infrared_reflectance, unit
from elib.simulator.physics.neighbours import IN_A_TICK, SENSORS_WITHIN, STRAY, is_near_wall
from elib.simulator.physics.noise import quantiles
from elib.simulator.physics.scene import Scene
from elib.simulator.physics.sensors import distance
from elib.simulator.physics.zones import FASTEST, Areas, place_door

MIN_CELL = 0.07
"""m. About half the usual reach of an infrared ray: in a dense maze a cell then holds few walls it does not need."""

MAX_CELLS = 40_000
"""Most cells of each grid; larger arenas get larger cells."""

MAX_CELLS_EACH = 16
"""Most cells of the grid of moving things for each of them: all cells are emptied whenever the grid is filled."""

MAX_EMPTY_ROWS = 16
"""Most rows, and most columns, of the grid of fixed things in a room that has none but its four walls."""

MAX_ENTRIES = 3_000_000
"""Walls in the cells of the grid, all told; more, and the cells are made larger."""


def wall_record(wall: Wall, faces: Faces) -> records.Segment:
    """Return *wall* as the kernels take it; what it shows gets a number in *faces*."""
    dx, dy = wall.x2 - wall.x1, wall.y2 - wall.y1
    length = math.sqrt(dx * dx + dy * dy)
    place = wall.x1, wall.y1, dx / length, dy / length, length
    face = faces.setdefault(wall.face, len(faces))
    return records.Segment(*place, wall.height, 1 / _reflectance(wall), packed(wall.colour), face)


def disc_record(post: Cylinder) -> records.Disc:
    """Return *post* as the kernels take it."""
    return records.Disc(post.x, post.y, post.radius, post.height, 1 / _reflectance(post), packed(post.colour))


def _reflectance(thing: Wall | Cylinder) -> float:
    return thing.reflectance if thing.reflectance is not None else infrared_reflectance(thing.colour)


DOOR_MASS = 1e6
"""kg. A door moves by itself; friction holds it against whatever pushes it."""


def thing_record(thing: Box | Cylinder, scene: Scene, first: int = 0) -> records.Thing:
    """Return the record of a thing that can move, whose first side, or whose disc, is number *first*."""
    made = records.Thing(thing.x, thing.y, first=first, lightness=1 / thing.mass, friction=thing.friction)
    if isinstance(thing, Cylinder):
        made.reach = thing.radius
        made.collect, made.respawn = scene.zone_number(thing.collect), scene.zone_number(thing.respawn)
        made.score, made.gift, made.after = thing.score, thing.energy, thing.after
    else:
        made.half_width, made.half_depth = thing.width / 2, thing.depth / 2
        made.reach = math.hypot(made.half_width, made.half_depth)
        made.heading_x, made.heading_y = unit(thing.angle)
        # A solid block about its upright axis: m (w^2 + d^2) / 12.
        made.turnable = 3 / (thing.mass * made.reach**2)
        if thing.switch:
            made.lightness, made.friction, made.turnable = 1 / DOOR_MASS, 1.0, 3 / (DOOR_MASS * made.reach**2)
            made.switch = scene.zone_number(thing.switch)
            made.open = float(scene.zones[made.switch].is_on)
            made.closed_x, made.closed_y = made.heading_x, made.heading_y
            made.open_x, made.open_y = unit(thing.angle + thing.swing)
            made.slide_x, made.slide_y = thing.slide
            made.arm = made.half_width if thing.swing else 0.0
            made.hinge_x = thing.x - made.arm * made.heading_x
            made.hinge_y = thing.y - made.arm * made.heading_y
            way = math.hypot(*thing.slide) + 2 * abs(thing.swing) * made.reach
            made.pace = min(1 / thing.takes, FASTEST / max(scene.step * way, sys.float_info.min))
            place_door(made)
    made.before_x, made.before_y = made.x, made.y
    made.before_heading_x, made.before_heading_y = made.heading_x, made.heading_y
    return made


def fans(rays: int, profile: profiles.Profile) -> list[records.Fan]:
    """Return the side rays of an infrared sensor, then those of the time-of-flight sensor.

    Args:
        rays: The number of rays of an infrared sensor, 1, 3 or 5. One that has no side rays gets two that do not count.
        profile: The response of the infrared sensors.
    """
    sides = [pair for pair in profiles.SHARES[rays] if pair[0] > 0] or [(0.0, 0.0)]
    angles = [(unit(math.radians(side * profile.aperture)), share) for side, share in sides]
    infrared = [records.Fan(*angle, share, profile.reach, 1 / profile.reach) for angle, share in angles]
    cone = (unit(distance.CONE * part) for part in (0.25, 0.5))
    return [*infrared, *(records.Fan(*angle, 0.0, distance.REACH, 1 / distance.REACH) for angle in cone)]


@dataclass
class Solids:
    """Everything solid of a scene."""

    walls: list[records.Segment]  # the edge, interior walls, sides of fixed boxes, sides of pushable ones
    discs: list[records.Disc]  # fixed cylinders, then pushable ones
    things: list[records.Thing]  # what can be pushed, boxes first
    box_things: list[int]  # for each box its thing, or -1 if it is fixed
    cylinder_things: list[int]  # the same of the cylinders
    fixed_walls: int  # how many walls are fixed
    fixed_discs: int  # how many cylinders are fixed

    @classmethod
    def of(cls, scene: Scene, boxes: Sequence[Box], cylinders: Sequence[Cylinder], faces: Faces) -> Solids:
        """Lay out *scene* with its boxes and cylinders where they are now; what walls show gets numbers in *faces*."""
        firm = [*scene.edge, *scene.fixed_walls, *(side for box in boxes if not box.can_move for side in box.sides)]
        walls = [wall_record(wall, faces) for wall in firm]
        discs = [disc_record(post) for post in cylinders if not post.can_move]
        made = cls(walls, discs, [], [-1] * len(boxes), [-1] * len(cylinders), len(walls), len(discs))
        for k, box in enumerate(boxes):
            if box.can_move:
                made.box_things[k] = len(made.things)
                made.things.append(thing_record(box, scene, len(walls)))
                walls += (wall_record(side, faces) for side in moved_box(box, made.things[-1]).sides)
        for k, cylinder in enumerate(cylinders):
            if cylinder.can_move:
                made.cylinder_things[k] = len(made.things)
                made.things.append(thing_record(cylinder, scene, len(discs)))
                discs.append(disc_record(cylinder))
        return made

    @property
    def largest(self) -> float:
        """Radius of the circle around the largest thing, m; 0 if there are none."""
        return max((thing.reach for thing in self.things), default=0.0)


class Grid:
    """What fixed things are near each cell of the floor.

    Attributes:
        scale: Cells a metre.
        columns: Along x.
        rows: Along y.
        walls: The indices of the walls that a robot or thing with its centre in a cell may see or touch, for each cell
            that has some.
        discs: The same of fixed cylinders.
    """

    def __init__(self, scene: Scene, solids: Solids, horizon: float) -> None:
        self._horizon = max(horizon + STRAY, solids.largest + 2 * STRAY)
        walls, discs = solids.walls[: solids.fixed_walls], solids.discs[: solids.fixed_discs]
        self._size = max(MIN_CELL, math.sqrt(scene.width * scene.depth / MAX_CELLS))
        if len(walls) == len(scene.edge) and not discs:
            self._size = max(self._horizon, scene.width / MAX_EMPTY_ROWS, scene.depth / MAX_EMPTY_ROWS)
        while self._entries(scene, walls, discs) > MAX_ENTRIES:
            self._size *= 2
        self.scale = 1 / self._size
        self.columns, self.rows = math.ceil(scene.width / self._size), math.ceil(scene.depth / self._size)
        self.walls: defaultdict[int, list[int]] = defaultdict(list)
        self.discs: defaultdict[int, list[int]] = defaultdict(list)
        for k, wall in enumerate(walls):
            for cell in self._near_wall(wall):
                self.walls[cell].append(k)
        for k, disc in enumerate(discs):
            for cell in self._near(disc.x, disc.y, self._horizon + disc.radius):
                self.discs[cell].append(k)

    def _entries(self, scene: Scene, walls: Sequence[records.Segment], discs: Sequence[records.Disc]) -> float:
        """Return about how many entries all cells have together."""
        across = 2 * self._horizon / self._size + 2
        cells = (scene.width / self._size + 1) * (scene.depth / self._size + 1)
        lengths = sum(wall.length for wall in walls)
        round_ones = (min((across + 2 * disc.radius / self._size) ** 2, cells) for disc in discs)
        return (lengths / self._size + len(walls) * across) * across + sum(round_ones)

    def _near_wall(self, wall: records.Segment) -> list[int]:
        """Return the cells of which any point may be nearer to *wall* than the horizon, m."""
        # Walk along it in steps of a cell: what is near a point of the wall is near its nearest step.
        steps = math.ceil(wall.length / self._size)
        found: set[int] = set()
        for n in range(steps + 1):
            along = wall.length * n / steps
            x, y = wall.x + along * wall.tangent_x, wall.y + along * wall.tangent_y
            found.update(self._near(x, y, self._horizon + self._size))
        limit = self._horizon + self._size * math.sqrt(0.5)
        return [cell for cell in found if is_near_wall(*self._middle(cell), wall, limit)]

    def _near(self, x: float, y: float, reach: float) -> list[int]:
        """Return the cells of which any point may be nearer to (x, y) than *reach*, m."""
        limit = reach + self._size * math.sqrt(0.5)
        low, high = max(int((x - limit) / self._size), 0), min(int((x + limit) / self._size), self.columns - 1)
        bottom, top = max(int((y - limit) / self._size), 0), min(int((y + limit) / self._size), self.rows - 1)
        cells = (row * self.columns + column for row in range(bottom, top + 1) for column in range(low, high + 1))
        return [cell for cell in cells if math.dist(self._middle(cell), (x, y)) <= limit]

    def _middle(self, cell: int) -> tuple[float, float]:
        return (cell % self.columns + 0.5) * self._size, (cell // self.columns + 0.5) * self._size


def listed(grid: Grid) -> tuple[list[records.Cell], list[int]]:
    """Return all cells of a grid, and the lists of walls and cylinders to which they point."""
    cells = [records.Cell()] * (grid.columns * grid.rows)  # one for all cells that have nothing
    entries: list[int] = []
    for cell in sorted({*grid.walls, *grid.discs}):
        walls, discs = grid.walls[cell], grid.discs[cell]
        middle = len(entries) + len(walls)
        cells[cell] = records.Cell(len(entries), middle, middle, middle + len(discs))
        entries += [*walls, *discs]
    return cells, entries


def listings(solids: Solids, robots: int, horizon: float) -> list[records.Listing]:
    """Return the listings of all robots and things, still empty."""
    made = [records.Listing(rim=RADIUS, reach=horizon) for _ in range(robots)]
    return [*made, *(records.Listing(rim=thing.reach, reach=thing.reach + 2 * IN_A_TICK) for thing in solids.things)]


def setting(
    scene: Scene, floor: Floor, areas: Areas, grid: Grid, profile: profiles.Profile, solids: Solids, robots: int
) -> records.Setting:
    """Return the numbers of the world as a whole."""
    model, horizon = scene.model, horizon_of(profile)
    energy = scene.energy or Energy(0.0)
    cells = min(MAX_CELLS, MAX_CELLS_EACH * max(robots + len(solids.things), 1))
    # Any two that may be near each other lie in neighbouring cells of the hash.
    size = max(
        horizon + max(RADIUS, solids.largest) + 2 * STRAY,
        2 * solids.largest + 2 * (IN_A_TICK + STRAY),
        math.sqrt(scene.width * scene.depth / cells),
    )
    return records.Setting(
        step=scene.step,
        width=scene.width,
        depth=scene.depth,
        motor_noise=model.motor_noise,
        sensor_noise=model.sensor_noise,
        spread=model.spread,
        generation=model.generation,
        ambient=model.ambient,
        horizon=horizon,
        place_x=[x for x, _ in profiles.PLACES],
        place_y=[y for _, y in profiles.PLACES],
        axis_x=[x for x, _ in profiles.AXES],
        axis_y=[y for _, y in profiles.AXES],
        # The firmware samples one pair after the other: (0, 4), (1, 5), (2, 6), (3, 7).
        age=[3.0 - sensor % 4 for sensor in range(profiles.COUNT)],
        infrared_fans=max(model.rays // 2, 1),
        middle_share=profiles.SHARES[model.rays][0][1],
        last_response=len(profile.counts) - 1,
        wheel_spread=model.given("wheel_spread"),
        axle_spread=model.given("axle_spread"),
        gain_spread=model.given("gain_spread"),
        offset_spread=model.given("offset_spread"),
        cell_scale=grid.scale,
        cell_columns=grid.columns,
        cell_rows=grid.rows,
        hash_scale=1 / size,
        hash_columns=math.ceil(scene.width / size),
        hash_rows=math.ceil(scene.depth / size),
        floor_colour=floor.colour,
        floor_columns=floor.columns,
        floor_rows=floor.rows,
        floor_scale=floor.scale,
        has_states=int(bool(scene.energy or areas.columns or any(post.collect for post in scene.cylinders))),
        has_energy=int(scene.energy is not None),
        idle=energy.idle,
        driving=energy.driving,
        has_pens=int(any(scene.pens)),
        first_area=max(len(floor.pixels), 1),
        map_columns=areas.columns,
        map_rows=areas.rows,
        map_scale=areas.scale,
    )


def tables(generation: int) -> records.Tables:
    """Return the tables of robots whose step motors are those of this generation."""
    return records.Tables(
        quantiles=quantiles(),
        rim_speeds=[step_rate(wanted, generation) * METRES_PER_STEP for wanted in range(FASTEST_2 + 1)],
    )


def horizon_of(profile: profiles.Profile) -> float:
    """Return how far the infrared sensors of a robot see from its middle at most, m; never less than it must feel."""
    return max(profile.reach + SENSORS_WITHIN, RADIUS + 2 * IN_A_TICK)


def moved_box(box: Box, thing: records.Thing) -> Box:
    """Return *box* where its record says that it is now."""
    angle = math.atan2(thing.heading_y, thing.heading_x)
    return replace(box, x=float(thing.x), y=float(thing.y), angle=angle)


def room_for_neighbours(robots: int, things: int, horizon: float) -> int:
    """Return room for the entries that the neighbours of all robots and things have together.

    The robots near a robot are bounded by their size: their discs lie within a larger one, with room to spare. Things
    may be small, or so large that all robots are near: if there are very many, there is not room for each pair.

    Args:
        robots: How many.
        things: How many.
        horizon: How far a robot sees from its middle, m.
    """
    near = int(1.2 * ((horizon + 2 * RADIUS + 2 * STRAY) / RADIUS) ** 2)
    return robots * min(robots, near) + min(things * (2 * robots + things), MAX_ENTRIES)
