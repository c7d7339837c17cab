"""Where robots start: the places a scene names, then free ones chosen from the seed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

from elib.base.errors import SimulationError
from elib.base.pose import Pose
from elib.base.rules import other_unit
from elib.simulator.physics.assembly import moved_box, thing_record
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.geometry import Box, Polygon, Solid, extent
from elib.simulator.physics.noise import PLACE, numbered_key, seed_key, tick_key, uniform
from elib.simulator.physics.scene import MAX_THINGS, Scene

MARGIN = 0.01  # m. Room around a chosen place, so that no robot starts with a sensor at full scale.
ATTEMPTS = 2000  # For one robot. An arena with 1 % of its floor free is then missed once in a billion times.
MAX_ROBOTS = MAX_THINGS
ROUNDING = 1e-9  # m. Bodies that touch do not overlap.

CELL = 0.1  # m. Side of a cell of the grids: a little more than a robot, so its neighbours lie in the cells around it.
MAX_ENTRIES = 20  # A thing stands in this many cells on average, or the cells are made larger.


@dataclass(frozen=True, slots=True)
class Taken:
    """A named start that is not free."""

    robot: int  # which one, from 0
    what: str  # what is in its way
    hint: str  # how to mend it


def places(scene: Scene, count: int | None, seed: int) -> tuple[Pose, ...]:
    """Return where *count* robots start.

    Args:
        scene: The world; its own starts come first.
        count: How many robots; None means as many as the scene names.
        seed: Chooses the places of the others, the same ones each time; more robots do not move the first
            ones.

    Raises:
        SimulationError: A named start is not free, or there is no room for so many.
    """
    if count is not None and count > MAX_ROBOTS:
        raise SimulationError(
            f"world {scene.name!r} has no room for {count} robots: at most {MAX_ROBOTS} are possible",
            hint="ask for fewer robots",
        )
    ground, poses = _Ground(scene), list(scene.starts[:count])
    taken = next(ground.settle(poses), None)
    if taken is not None:
        pose = poses[taken.robot]
        raise SimulationError(
            f"world {scene.name!r}: robot[{taken.robot}] at ({pose.x}, {pose.y}) {taken.what}", hint=taken.hint
        )
    key = seed_key(seed)
    while count is not None and len(poses) < count:
        pose = _free_place(scene, ground, len(poses), count, key)
        ground.add_robot(pose.x, pose.y)
        poses.append(pose)
    return tuple(poses)


def first_taken(scene: Scene) -> Taken | None:
    """Return the first start that the scene names and that is not free; None if all are."""
    return next(all_taken(scene), None)


def all_taken(scene: Scene) -> Iterator[Taken]:
    """Yield the starts that the scene names and that are not free, also of those that others of them take."""
    return _Ground(scene).settle(scene.starts)


def cleared(scene: Scene, poses: Sequence[Pose]) -> tuple[Pose, ...]:
    """Return *poses* as starts: a robot that touches something is moved off it, by :data:`MARGIN` at most.

    Raises:
        SimulationError: A robot stands in something.
    """
    ground, found = _Ground(scene), []
    for robot, pose in enumerate(poses):
        near = (
            replace(pose, x=pose.x + far * math.cos(angle), y=pose.y + far * math.sin(angle))
            for far in (MARGIN * 2**power for power in range(-13, 1))
            for angle in (math.tau * part / 16 for part in range(16))
        )
        free = next((each for each in (pose, *near) if next(ground.settle([each]), None) is None), None)
        if free is None:
            raise SimulationError(f"robot {robot} stands in something", hint="move it to a free place first")
        found.append(free)
    return tuple(found)


def _free_place(scene: Scene, ground: _Ground, robot: int, count: int, seed_key: int) -> Pose:
    key = numbered_key(seed_key, robot)
    for attempt in range(ATTEMPTS):
        draw = tick_key(key, attempt)
        x = uniform(draw, PLACE) * scene.width
        y = uniform(draw, PLACE + 1) * scene.depth
        if ground.in_the_way(x, y, RADIUS + MARGIN) is None:
            return Pose(x, y, math.tau * uniform(draw, PLACE + 2) - math.pi)
    raise SimulationError(
        f"world {scene.name!r} has no room for {count} robots; {robot} were placed",
        hint="ask for fewer robots, or choose a larger world",
    )


def _at_first(box: Box, scene: Scene) -> Box:
    """Return a box where it is at the start: a door may be open then."""
    is_open = box.switch and scene.zones[scene.zone_number(box.switch)].is_on
    return moved_box(box, thing_record(box, scene)) if is_open else box


class _Ground:
    """The scene's floor, which knows where it is free. Things that can be pushed take up room like all others."""

    REACH = RADIUS + MARGIN
    """m. What is farther away does not matter."""

    def __init__(self, scene: Scene) -> None:
        self._width, self._depth = scene.width, scene.depth
        self._cell = CELL
        self._cells: dict[tuple[int, int], list[tuple[str, Solid | Polygon]]] = {}
        self._robots: list[tuple[float, float]] = []
        self._robots_in: dict[tuple[int, int], list[int]] = {}
        solids: list[tuple[str, Solid | Polygon]] = [
            *((f"wall[{i}]", wall) for i, wall in enumerate(scene.walls)),
            *((f"box[{i}]", _at_first(box, scene)) for i, box in enumerate(scene.boxes)),
            *((f"cylinder[{i}]", cylinder) for i, cylinder in enumerate(scene.cylinders)),
            *((f"polygon[{i}]", polygon) for i, polygon in enumerate(scene.polygons)),
        ]
        areas = [self._area(solid) for _, solid in solids]
        # Without this a few thousand walls across a large arena would stand in millions of cells.
        while sum(self._entries(*area) for area in areas) > 10_000 + MAX_ENTRIES * len(areas):
            self._cell *= 2
        for name, solid in solids:
            self._add(name, solid)

    def add_robot(self, x: float, y: float) -> None:
        """Put the next robot on the floor."""
        self._robots_in.setdefault((int(x // self._cell), int(y // self._cell)), []).append(len(self._robots))
        self._robots.append((x, y))

    def _add(self, name: str, solid: Solid | Polygon) -> None:
        left, right, low, high = self._area(solid)
        for column in range(int(left // self._cell), int(right // self._cell) + 1):
            for row in range(int(low // self._cell), int(high // self._cell) + 1):
                self._cells.setdefault((column, row), []).append((name, solid))

    def _area(self, solid: Solid | Polygon) -> tuple[float, float, float, float]:
        """Return from where to where *solid* matters, m: left, right, low, high; right < left if it stands outside."""
        left, right, low, high = extent(solid)
        return (
            max(0.0, left - self.REACH),
            min(self._width, right + self.REACH),
            max(0.0, low - self.REACH),
            min(self._depth, high + self.REACH),
        )

    def _entries(self, left: float, right: float, low: float, high: float) -> float:
        return max(0.0, (right - left) / self._cell + 1) * max(0.0, (high - low) / self._cell + 1)

    def settle(self, poses: Sequence[Pose]) -> Iterator[Taken]:
        """Put robots on the floor, one after the other; yield those whose place is not free."""
        for robot, pose in enumerate(poses):
            if not (0.0 <= pose.x <= self._width and 0.0 <= pose.y <= self._depth):
                yield Taken(robot, "stands outside the arena", inside_hint(pose.x, pose.y, self._width, self._depth))
                continue
            thing = self.in_the_way(pose.x, pose.y, RADIUS - ROUNDING)
            if thing is None:
                self.add_robot(pose.x, pose.y)
            elif thing.startswith("robot"):
                yield Taken(robot, f"stands on another one: {thing}", f"keep two centres at least {2 * RADIUS} m apart")
            else:
                what = f"stands in a wall or an obstacle: {thing}"
                yield Taken(robot, what, f"keep its centre at least {RADIUS} m from everything")

    def in_the_way(self, x: float, y: float, room: float) -> str | None:
        """Return the name of something nearer to (x, y) than *room*, m, at most :data:`REACH`; None if nothing is."""
        if not (room <= x <= self._width - room and room <= y <= self._depth - room):
            return "the arena's wall"
        column, row = int(x // self._cell), int(y // self._cell)
        for name, solid in self._cells.get((column, row), ()):
            if solid.distance(x, y) < room:
                return name
        for cell in product((column - 1, column, column + 1), (row - 1, row, row + 1)):
            for robot in self._robots_in.get(cell, ()):
                dx, dy = x - self._robots[robot][0], y - self._robots[robot][1]
                if math.sqrt(dx * dx + dy * dy) - RADIUS < room:
                    return f"robot[{robot}]"
        return None


def inside_hint(x: float, y: float, width: float, depth: float) -> str:
    """Return a hint for a place outside of an arena of that size, m."""
    return other_unit(x, "m", 0, width) or other_unit(y, "m", 0, depth) or "x and y run from 0 to the arena's size"
