"""Where robots start: the places a scene names, then free ones chosen from the seed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from elib.errors import SimulationError
from elib.physics.body import RADIUS
from elib.physics.geometry import Box, Cylinder, Wall, unit
from elib.physics.noise import PLACE, robot_key, tick_key, uniform
from elib.physics.scene import MOST_THINGS, Scene
from elib.pose import Pose

MARGIN = 0.01  # m. Room around a chosen place, so that no robot starts with a sensor at full scale.
ATTEMPTS = 2000  # For one robot. An arena with 1 % of its floor free is then missed once in a billion times.
MOST_ROBOTS = MOST_THINGS
ROUNDING = 1e-9  # m. Bodies that touch do not overlap.

CELL = 0.1  # m. Side of a cell of the grids: a little more than a robot, so its neighbours lie in the cells around it.
MOST_ENTRIES = 20  # A thing stands in this many cells on average, or the cells are made larger.


@dataclass(frozen=True, slots=True)
class Taken:
    """A named start that is not free.

    Attributes:
        robot: Which one, from 0.
        what: What is in its way.
        hint: How to mend it.
    """

    robot: int
    what: str
    hint: str


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
    if count is not None and count > MOST_ROBOTS:
        raise SimulationError(
            f"world {scene.name!r} has no room for {count} robots: at most {MOST_ROBOTS} are possible",
            hint="ask for fewer robots",
        )
    ground, crowd = _Ground(scene), _Crowd()
    for pose in scene.starts[:count]:
        taken = _taken(ground, crowd, pose)
        if taken is not None:
            raise SimulationError(
                f"world {scene.name!r}: robot[{taken.robot}] at ({pose.x}, {pose.y}) {taken.what}", hint=taken.hint
            )
        crowd.add(pose)
    while count is not None and len(crowd.poses) < count:
        crowd.add(_free_place(scene, ground, crowd, count, seed))
    return tuple(crowd.poses)


def first_taken(scene: Scene) -> Taken | None:
    """Return the first start that the scene names and that is not free; None if all are."""
    ground, crowd = _Ground(scene), _Crowd()
    for pose in scene.starts:
        taken = _taken(ground, crowd, pose)
        if taken is not None:
            return taken
        crowd.add(pose)
    return None


def _taken(ground: _Ground, crowd: _Crowd, pose: Pose) -> Taken | None:
    robot = len(crowd.poses)
    if not ground.holds(pose.x, pose.y):
        return Taken(robot, "stands outside the arena", "x and y run from 0 to the arena's size")
    thing = ground.in_the_way(pose.x, pose.y, RADIUS - ROUNDING)
    if thing is not None:
        return Taken(
            robot,
            f"stands in a wall or an obstacle: {thing}",
            f"keep its centre at least {RADIUS} m from everything",
        )
    other = crowd.near(pose.x, pose.y, 2 * RADIUS - ROUNDING)
    if other is not None:
        return Taken(robot, f"stands on another one: robot[{other}]", f"keep two centres at least {2 * RADIUS} m apart")
    return None


def _free_place(scene: Scene, ground: _Ground, crowd: _Crowd, count: int, seed: int) -> Pose:
    key = robot_key(seed, len(crowd.poses))
    for attempt in range(ATTEMPTS):
        draw = tick_key(key, attempt)
        x = uniform(draw, PLACE) * scene.width
        y = uniform(draw, PLACE + 1) * scene.depth
        if crowd.near(x, y, 2 * RADIUS + MARGIN) is None and ground.in_the_way(x, y, RADIUS + MARGIN) is None:
            return Pose(x, y, math.tau * uniform(draw, PLACE + 2) - math.pi)
    raise SimulationError(
        f"world {scene.name!r} has no room for {count} robots; {len(crowd.poses)} were placed",
        hint="ask for fewer robots, or choose a larger world",
    )


class _Crowd:
    """The robots placed so far, to ask who is near."""

    def __init__(self) -> None:
        self.poses: list[Pose] = []
        self._cells: dict[tuple[int, int], list[int]] = {}

    def add(self, pose: Pose) -> None:
        self._cells.setdefault((int(pose.x // CELL), int(pose.y // CELL)), []).append(len(self.poses))
        self.poses.append(pose)

    def near(self, x: float, y: float, distance: float) -> int | None:
        """Return a robot whose centre is nearer than *distance*, at most :data:`CELL`; None if there is none."""
        column, row = int(x // CELL), int(y // CELL)
        for i in (column - 1, column, column + 1):
            for j in (row - 1, row, row + 1):
                for robot in self._cells.get((i, j), ()):
                    other = self.poses[robot]
                    if (x - other.x) ** 2 + (y - other.y) ** 2 < distance * distance:
                        return robot
        return None


@dataclass(frozen=True, slots=True)
class _Solid:
    """A thing on the floor: a rectangle, perhaps of no depth, with rounded edges."""

    name: str
    x: float
    y: float
    along_x: float
    along_y: float
    half_width: float
    half_depth: float
    radius: float

    def distance(self, x: float, y: float) -> float:
        """Return how far (x, y) is from its surface, m; below 0 inside."""
        dx, dy = x - self.x, y - self.y
        u = abs(self.along_x * dx + self.along_y * dy) - self.half_width
        v = abs(self.along_x * dy - self.along_y * dx) - self.half_depth
        if u <= 0.0 or v <= 0.0:
            return max(u, v) - self.radius
        return math.sqrt(u * u + v * v) - self.radius

    @property
    def reach(self) -> tuple[float, float]:
        """Half of what it covers along x and along y, m."""
        cosine, sine = abs(self.along_x), abs(self.along_y)
        return (
            cosine * self.half_width + sine * self.half_depth + self.radius,
            sine * self.half_width + cosine * self.half_depth + self.radius,
        )


class _Ground:
    """The scene's floor, to ask where it is free. What can be pushed takes its place like everything else."""

    REACH = RADIUS + MARGIN
    """m. Nobody asks for what is farther away."""

    def __init__(self, scene: Scene) -> None:
        self._width, self._depth = scene.width, scene.depth
        solids = [
            *(_segment(f"wall[{i}]", wall) for i, wall in enumerate(scene.walls)),
            *(_block(f"box[{i}]", box) for i, box in enumerate(scene.boxes)),
            *(_round(f"cylinder[{i}]", cylinder) for i, cylinder in enumerate(scene.cylinders)),
        ]
        areas = [(solid, area) for solid in solids if (area := self._area(solid)) is not None]
        self._cell = CELL
        # Without this a few thousand walls across a large arena would stand in millions of cells.
        while sum(self._entries(area) for _, area in areas) > 10_000 + MOST_ENTRIES * len(areas):
            self._cell *= 2
        self._cells: dict[tuple[int, int], list[_Solid]] = {}
        for solid, (left, right, low, high) in areas:
            for column in range(int(left // self._cell), int(right // self._cell) + 1):
                for row in range(int(low // self._cell), int(high // self._cell) + 1):
                    self._cells.setdefault((column, row), []).append(solid)

    def _area(self, solid: _Solid) -> tuple[float, float, float, float] | None:
        """Return from where to where *solid* matters, m: left, right, low, high; None if it stands outside."""
        across, along = solid.reach
        left, right = max(0.0, solid.x - across - self.REACH), min(self._width, solid.x + across + self.REACH)
        low, high = max(0.0, solid.y - along - self.REACH), min(self._depth, solid.y + along + self.REACH)
        return (left, right, low, high) if left <= right and low <= high else None

    def _entries(self, area: tuple[float, float, float, float]) -> float:
        left, right, low, high = area
        return ((right - left) / self._cell + 1) * ((high - low) / self._cell + 1)

    def _around(self, x: float, y: float) -> list[_Solid]:
        return self._cells.get((int(x // self._cell), int(y // self._cell)), [])

    def holds(self, x: float, y: float) -> bool:
        """Return whether (x, y) is in the arena."""
        return 0.0 <= x <= self._width and 0.0 <= y <= self._depth

    def in_the_way(self, x: float, y: float, room: float) -> str | None:
        """Return the name of something nearer to (x, y) than *room*, m, at most :data:`REACH`; None if nothing is."""
        if not (room <= x <= self._width - room and room <= y <= self._depth - room):
            return "the arena's wall"
        for solid in self._around(x, y):
            if solid.distance(x, y) < room:
                return solid.name
        return None

    def clearance(self, x: float, y: float) -> float:
        """Return the distance to the nearest surface, m, at most :data:`REACH`; below 0 outside or inside a solid."""
        edge = min(x, self._width - x, y, self._depth - y, self.REACH)
        return min(edge, min((solid.distance(x, y) for solid in self._around(x, y)), default=edge))


def _segment(name: str, wall: Wall) -> _Solid:
    dx, dy = wall.x2 - wall.x1, wall.y2 - wall.y1
    length = math.sqrt(dx * dx + dy * dy)
    # Two ends may differ by so little that the square of it is nothing.
    along_x, along_y = (dx / length, dy / length) if length > 0 else (1.0, 0.0)
    return _Solid(name, (wall.x1 + wall.x2) / 2, (wall.y1 + wall.y2) / 2, along_x, along_y, length / 2, 0.0, 0.0)


def _block(name: str, box: Box) -> _Solid:
    return _Solid(name, box.x, box.y, *unit(box.angle), box.width / 2, box.depth / 2, 0.0)


def _round(name: str, cylinder: Cylinder) -> _Solid:
    return _Solid(name, cylinder.x, cylinder.y, 1.0, 0.0, 0.0, 0.0, cylinder.radius)
