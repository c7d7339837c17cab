"""From a scene to the flat sequences that the kernels share (:mod:`elib.physics.layout`)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

from elib.body import METRES_PER_STEP
from elib.physics import layout as at
from elib.physics.body import AXLE, RADIUS, EpuckModel
from elib.physics.floor import packed
from elib.physics.geometry import Box, Cylinder, Wall, infrared_reflectance, unit
from elib.physics.grid import HORIZON, SLACK, STRAY
from elib.physics.layout import Floats
from elib.physics.motion import MAX_TRAVEL, issued
from elib.physics.noise import AXLE_LENGTH, GAIN, OFFSETS, PROXIMITY, STRIDE, WHEEL, gauss, quantiles, robot_key
from elib.physics.room import SLATE
from elib.physics.scene import Scene
from elib.physics.sensors import proximity, sectors
from elib.pose import Pose

SMALLEST_CELL = 0.07
"""m. About half the usual reach of an infrared ray: in a dense maze a cell then holds few walls it does not need."""

FINEST_CELL = 0.05
SMALL_ROOM = 0.25
"""m; m2. In so small a room it pays to know for each place which walls are near."""

TOUCH = RADIUS + 0.005
"""m. A robot whose centre is in a cell touches no wall that is farther from it."""

MOST_CELLS = 40_000
"""Of each grid; larger arenas get larger cells."""

MOST_ENTRIES = 3_000_000
"""Walls in the cells of the grid, all told; more, and the cells are made larger."""

NEIGHBOURS = 6
"""For how many, and for how many walls inside the arena, there is room in the lists of each robot, on an average; State
makes room for more where it is needed."""

MOST_DEVIATIONS = 3.5
"""No number that noise is made of lies farther from its mean, in standard deviations (:mod:`elib.physics.noise`)."""

SLOT = 1 / 256
"""s. An e-puck1 samples one pair of its infrared sensors after the other, 64 times a second each (protocol.md, 5)."""


def wall_record(wall: Wall) -> list[float]:
    """Return *wall* as the kernels take it."""
    dx, dy = wall.x2 - wall.x1, wall.y2 - wall.y1
    length = math.sqrt(dx * dx + dy * dy)
    return [
        *(wall.x1, wall.y1, dx / length, dy / length, length, wall.height),
        1 / _reflectance(wall),
        float(packed(wall.colour)),
    ]


def disc_record(cylinder: Cylinder) -> list[float]:
    """Return *cylinder* as the kernels take it."""
    return [
        *(cylinder.x, cylinder.y, cylinder.radius, cylinder.height),
        1 / _reflectance(cylinder),
        float(packed(cylinder.colour)),
    ]


def _reflectance(thing: Wall | Cylinder) -> float:
    return thing.reflectance if thing.reflectance is not None else infrared_reflectance(thing.colour)


def box_body(box: Box, first: int) -> list[float]:
    """Return the record of a pushable box whose sides begin at wall *first*."""
    half_width, half_depth = box.width / 2, box.depth / 2
    square = half_width * half_width + half_depth * half_depth
    cosine, sine = unit(box.angle)
    # A solid block about its upright axis: m (w^2 + d^2) / 12.
    inertia = box.mass * square / 3
    place = [box.x, box.y, cosine, sine]
    return [
        *place,
        math.sqrt(square),
        half_width,
        half_depth,
        1 / box.mass,
        1 / inertia,
        first,
        *place,
        0.0,
        box.x,
        box.y,
    ]


def cylinder_body(cylinder: Cylinder, first: int) -> list[float]:
    """Return the record of a pushable cylinder whose disc is number *first*."""
    place = [cylinder.x, cylinder.y, 1.0, 0.0]
    return [*place, cylinder.radius, 0.0, 0.0, 1 / cylinder.mass, 0.0, first, *place, 0.0, cylinder.x, cylinder.y]


def moved_box(box: Box, bodies: Floats, b: int) -> Box:
    """Return *box* where its body, whose record begins at *b*, is now."""
    angle = math.atan2(bodies[b + at.HEADING_Y], bodies[b + at.HEADING_X])
    return replace(box, x=float(bodies[b + at.X]), y=float(bodies[b + at.Y]), angle=angle)


def moved_cylinder(cylinder: Cylinder, bodies: Floats, b: int) -> Cylinder:
    """Return *cylinder* where its body, whose record begins at *b*, is now."""
    return replace(cylinder, x=float(bodies[b + at.X]), y=float(bodies[b + at.Y]))


class Solids:
    """Everything solid of a scene, laid out flat.

    Attributes:
        walls: The edge, interior walls, sides of fixed boxes, sides of pushable ones.
        discs: Fixed cylinders, then pushable ones.
        bodies: Pushable things, boxes first.
        cells: The grid of fixed things.
        box_bodies: For each box its body, or -1 if it is fixed.
        cylinder_bodies: The same of the cylinders.
        scale: Cells a metre.
        columns: Of the grid.
        rows: Of the grid.
    """

    def __init__(
        self, scene: Scene, boxes: Sequence[Box], cylinders: Sequence[Cylinder], reach: float, robots: int
    ) -> None:
        """Lay out *scene* for *robots*, its boxes and cylinders where they are now; infrared rays go *reach* m far."""
        firm = [*scene.edge, *scene.walls, *(side for box in boxes if not box.is_pushable for side in box.sides)]
        posts = [cylinder for cylinder in cylinders if not cylinder.is_pushable]
        self.walls = [number for wall in firm for number in wall_record(wall)]
        self.discs = [number for post in posts for number in disc_record(post)]
        self.bodies: list[float] = []
        self.box_bodies, self.cylinder_bodies = [-1] * len(boxes), [-1] * len(cylinders)
        largest = 0.0
        for k, box in enumerate(boxes):
            if box.is_pushable:
                self.box_bodies[k] = len(self.bodies) // at.BODY
                self.bodies += box_body(box, len(self.walls) // at.WALL)
                for side in box.sides:
                    self.walls += wall_record(side)
                largest = max(largest, math.hypot(box.width, box.depth) / 2)
        for k, cylinder in enumerate(cylinders):
            if cylinder.is_pushable:
                self.cylinder_bodies[k] = len(self.bodies) // at.BODY
                self.bodies += cylinder_body(cylinder, len(self.discs) // at.DISC)
                self.discs += disc_record(cylinder)
                largest = max(largest, cylinder.radius)
        # Whoever is not alone has a list of walls, made for where it may stray to.
        stray = STRAY if robots + len(self.bodies) // at.BODY > 1 else 0.0
        self.horizon = max(reach + HORIZON + stray, largest + SLACK)
        self.grid_cell = max(
            reach + HORIZON + max(RADIUS, largest) + SLACK,
            2 * largest + 2 * SLACK,
            math.sqrt(scene.width * scene.depth / MOST_CELLS),
        )
        self._lay_cells(scene, firm, posts)

    def _lay_cells(self, scene: Scene, firm: list[Wall], posts: list[Cylinder]) -> None:
        size = max(SMALLEST_CELL, math.sqrt(scene.width * scene.depth / MOST_CELLS))
        if len(firm) == at.EDGE and not posts:
            # An empty room: fine cells where they are few, or wide ones, which cost little for each robot.
            size = FINEST_CELL if scene.width * scene.depth < SMALL_ROOM else max(size, self.horizon)
        lengths = sum(math.hypot(wall.x2 - wall.x1, wall.y2 - wall.y1) for wall in firm)
        while self._entries(size, lengths, len(firm), posts, scene) > MOST_ENTRIES:
            size *= 2
        self.scale = 1 / size
        self.columns, self.rows = math.ceil(scene.width / size), math.ceil(scene.depth / size)
        inside: list[tuple[list[int], list[int], list[int]]] = [([], [], []) for _ in range(self.columns * self.rows)]
        touch = TOUCH + size * math.sqrt(0.5)
        for k, wall in enumerate(firm):
            for cell, distance in self._near_wall(wall, size):
                inside[cell][1].append(k)
                if distance <= touch:
                    inside[cell][0].append(k)
        for k, post in enumerate(posts):
            for cell in self._near_disc(post, size):
                inside[cell][2].append(k)
        head: list[int] = []
        tail: list[int] = []
        start = 3 * len(inside) + 1
        for touched, seen, discs in inside:
            first = start + len(tail)
            head += [first, first + len(touched), first + len(touched) + len(seen)]
            tail += touched + seen + discs
        self.cells = [*head, start + len(tail), *tail]

    def _entries(self, size: float, lengths: float, walls: int, posts: list[Cylinder], scene: Scene) -> float:
        across = 2 * self.horizon / size + 2
        cells = (scene.width / size + 1) * (scene.depth / size + 1)
        round_ones = (min((across + 2 * post.radius / size) ** 2, cells) for post in posts)
        return (lengths / size + walls * across) * across + sum(round_ones)

    def _near_wall(self, wall: Wall, size: float) -> list[tuple[int, float]]:
        """Return the cells from which a robot may touch or see *wall*, and how far it is from their centres, m."""
        dx, dy = wall.x2 - wall.x1, wall.y2 - wall.y1
        length = math.hypot(dx, dy)
        near = set()
        # Walk along it in steps of a cell: what is near a point of the wall is near its nearest step.
        steps = math.ceil(length / size)
        reach = self.horizon + size
        for n in range(steps + 1):
            x, y = wall.x1 + dx * n / steps, wall.y1 + dy * n / steps
            near.update(self._around(x, y, reach, size))
        ux, uy = dx / length, dy / length
        limit = self.horizon + size * math.sqrt(0.5)
        kept = []
        for cell in near:
            px = (cell % self.columns + 0.5) * size - wall.x1
            py = (cell // self.columns + 0.5) * size - wall.y1
            along = min(max(px * ux + py * uy, 0.0), length)
            distance = math.hypot(px - along * ux, py - along * uy)
            if distance <= limit:
                kept.append((cell, distance))
        return kept

    def _near_disc(self, post: Cylinder, size: float) -> list[int]:
        limit = self.horizon + post.radius + size * math.sqrt(0.5)
        return [
            cell
            for cell in self._around(post.x, post.y, limit, size)
            if math.hypot(
                (cell % self.columns + 0.5) * size - post.x,
                (cell // self.columns + 0.5) * size - post.y,
            )
            <= limit
        ]

    def _around(self, x: float, y: float, reach: float, size: float) -> list[int]:
        low, high = max(int((x - reach) / size), 0), min(int((x + reach) / size), self.columns - 1)
        bottom, top = max(int((y - reach) / size), 0), min(int((y + reach) / size), self.rows - 1)
        return [row * self.columns + column for row in range(bottom, top + 1) for column in range(low, high + 1)]


def fixed_numbers(scene: Scene, solids: Solids, profile: proximity.Profile, robots: int, seed: int) -> list[float]:
    """Return what does not change while the world runs."""
    model = scene.model
    numbers = [0.0] * at.RESPONSE
    numbers[at.STEP] = scene.step
    numbers[at.WIDTH], numbers[at.DEPTH] = scene.width, scene.depth
    numbers[at.MOTOR_NOISE], numbers[at.SENSOR_NOISE] = model.motor_noise, model.sensor_noise
    numbers[at.LONGEST_ROLL] = (
        MAX_TRAVEL * (1.0 + MOST_DEVIATIONS * model.motor_noise) * (1.0 + MOST_DEVIATIONS * model.wheel_spread)
    )
    numbers[at.ROOM] = model.ambient
    numbers[at.IR_REACH] = profile.reach
    numbers[at.GRID_SCALE], numbers[at.CELL_SCALE] = 1 / solids.grid_cell, solids.scale
    numbers[at.WIDEST], numbers[at.SPREAD] = unit(math.radians(proximity.APERTURE)) if model.rays > 1 else (1.0, 0.0)
    for i, slots, *place_and_axis in proximity.SENSORS:
        numbers[at.AGE + i] = slots
        for start, value in zip((at.PLACE_X, at.PLACE_Y, at.AXIS_X, at.AXIS_Y), place_and_axis, strict=True):
            numbers[start + i] = value
    for k, (side, share) in enumerate(proximity.SHARES[model.rays]):
        cosine, sine = unit(math.radians(side * proximity.APERTURE))
        start = at.RAYS + k * at.RAY
        numbers[start : start + at.RAY] = [cosine, sine, cosine / proximity.SPACING, share]
    numbers[at.WALL_FAR : at.SPEEDS] = _lists(scene, profile)[0][1]
    for _, share in proximity.SHARES[model.rays]:
        numbers[at.CLEAR] += share * profile.counts[-1]
    for wanted in range(at.SPEEDS, at.RESPONSE):
        numbers[wanted] = issued(wanted - at.SPEEDS, model.generation) * METRES_PER_STEP
    numbers[at.QUANTILES : at.QUANTILES + 1024] = quantiles()
    numbers += [*profile.counts, *profile.deviation]
    return numbers + (_traits(model, seed, robots) if _is_uneven(model) else [])


def _lists(scene: Scene, profile: proximity.Profile) -> tuple[tuple[list[int], list[float]], list[int]]:
    aperture = math.radians(proximity.APERTURE) if scene.model.rays > 1 else 0.0
    return _all_lists(aperture, profile.reach)


@cache
def _all_lists(aperture: float, reach: float) -> tuple[tuple[list[int], list[float]], list[int]]:
    """Return which sensors look where; computed once for all worlds with the same sensors."""
    numbers = list(proximity.PLACES), list(proximity.AXES), aperture, reach
    return sectors.wall_lists(*numbers), sectors.disc_lists(*numbers)


def robot_records(scene: Scene, starts: Sequence[Pose], seed: int) -> list[float]:
    """Return the records of robots that stand at *starts*."""
    model = scene.model
    records: list[float] = []
    for i, start in enumerate(starts):
        key = robot_key(seed, i)
        cosine, sine = unit(start.heading)
        record = [0.0] * at.ROBOT
        record[at.X] = record[at.BEFORE_X] = record[at.LISTED_X] = start.x
        record[at.Y] = record[at.BEFORE_Y] = record[at.LISTED_Y] = start.y
        record[at.HEADING_X] = record[at.BEFORE_HEADING_X] = cosine
        record[at.HEADING_Y] = record[at.BEFORE_HEADING_Y] = sine
        record[at.LEFT_SCALE] = 1.0 + model.wheel_spread * gauss(key, WHEEL)
        record[at.RIGHT_SCALE] = 1.0 + model.wheel_spread * gauss(key, WHEEL + 1)
        record[at.AXLE] = AXLE * (1.0 + model.axle_spread * gauss(key, AXLE_LENGTH))
        record[at.RADIUS] = RADIUS
        record[at.SLOT] = SLOT
        records += record
    return records


def _is_uneven(model: EpuckModel) -> bool:
    return model.gain_spread > 0.0 or model.offset_spread > 0.0


def _traits(model: EpuckModel, seed: int, robots: int) -> list[float]:
    """Return what the infrared sensors of each robot differ in."""
    traits: list[float] = []
    for i in range(robots):
        key = robot_key(seed, i)
        traits += (1.0 + model.gain_spread * gauss(key, GAIN + k) for k in range(proximity.COUNT))
        traits += (model.offset_spread * gauss(key, OFFSETS + k) for k in range(proximity.COUNT))
    return traits


def whole_numbers(scene: Scene, solids: Solids, profile: proximity.Profile, robots: int, seed: int) -> list[int]:
    """Return the head, the robots' whole numbers and the empty grid of moving things."""
    things = robots + len(solids.bodies) // at.BODY
    columns, rows = math.ceil(scene.width / solids.grid_cell), math.ceil(scene.depth / solids.grid_cell)
    head = [0] * at.HEAD
    head[at.ROBOTS], head[at.BODIES] = robots, things - robots
    head[at.GRID_COLUMNS], head[at.GRID_ROWS] = columns, rows
    head[at.CELL_COLUMNS], head[at.CELL_ROWS] = solids.columns, solids.rows
    head[at.LAST], head[at.RAY_COUNT] = len(profile.counts) - 1, scene.model.rays
    head[at.UNEVEN] = at.RESPONSE + 2 * len(profile.counts) if _is_uneven(scene.model) else 0
    head[at.GENERATION] = scene.model.generation
    head[at.NEXT_AT] = at.HEAD + robots * at.NUMBER
    head[at.PLACE_AT] = head[at.NEXT_AT] + things
    head[at.HEADS_AT] = head[at.PLACE_AT] + things
    walls, discs = _lists(scene, profile)
    head[at.WALL_LISTS : at.DISC_LISTS] = walls[0]
    head[at.DISC_LISTS : at.DISC_LISTS + len(discs)] = discs
    for i in range(proximity.COUNT):  # Three sensors share a word, ten bits each.
        head[at.CHANNELS + i] = (PROXIMITY + i - i % 3) * STRIDE
        head[at.SHIFTS + i] = 10 * (i % 3)
    for i in range(robots):
        head += [robot_key(seed, i), 0, -1, *[0] * proximity.COUNT, 0]
    grid = [-1] * things + [0] * things
    if things > 1 or solids.bodies:
        grid += [-1] * (columns * rows)
    head[at.SLATE_AT] = len(head) + len(grid)
    head[at.NEAR_AT] = head[at.SLATE_AT] + SLATE
    inside = len(solids.walls) // at.WALL - at.EDGE
    room = robots * (min(2 * robots - 2, NEIGHBOURS) + 2 * min(inside, NEIGHBOURS))
    head[at.SIGHT_AT] = head[at.NEAR_AT] + robots + 1
    head[at.PAIRS_AT] = head[at.PAIRS_END] = head[at.SIGHT_AT] + robots + 1
    head[at.NEAR_END] = head[at.SIGHT_AT] + robots + 1 + room
    return head + grid + [0] * (SLATE + 2 * (robots + 1) + room)
