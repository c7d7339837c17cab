"""Where robots start: the places a scene names, then free ones chosen from the seed."""

from __future__ import annotations

import math

from elib.errors import SimulationError
from elib.physics.body import RADIUS
from elib.physics.geometry import Box, Pose
from elib.physics.noise import PLACE, robot_key, tick_key, uniform
from elib.physics.scene import Scene, flat_discs, flat_walls

MARGIN = 0.01  # m. Room around a chosen place, so that no robot starts with a sensor at full scale.
ATTEMPTS = 2000  # For one robot. An arena with 1 % of its floor free is then missed once in a billion times.


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
    ground = _Ground(scene)
    chosen: list[Pose] = []
    for pose in scene.starts[:count]:
        if ground.clearance(pose.x, pose.y) < RADIUS - 1e-9:
            raise SimulationError(
                f"world {scene.name!r}: the robot at ({pose.x}, {pose.y}) stands in a wall or an obstacle",
                hint=f"keep its centre at least {RADIUS} m from everything",
            )
        if not _is_apart(pose.x, pose.y, chosen, 2 * RADIUS):
            raise SimulationError(
                f"world {scene.name!r}: the robot at ({pose.x}, {pose.y}) stands on another one",
                hint=f"keep two centres at least {2 * RADIUS} m apart",
            )
        chosen.append(pose)
    while count is not None and len(chosen) < count:
        chosen.append(_free_place(scene, ground, chosen, count, seed))
    return tuple(chosen)


def _free_place(scene: Scene, ground: _Ground, chosen: list[Pose], count: int, seed: int) -> Pose:
    key = robot_key(seed, len(chosen))
    for attempt in range(ATTEMPTS):
        draw = tick_key(key, attempt)
        x = uniform(draw, PLACE) * scene.width
        y = uniform(draw, PLACE + 1) * scene.depth
        if ground.clearance(x, y) >= RADIUS + MARGIN and _is_apart(x, y, chosen, 2 * RADIUS + MARGIN):
            return Pose(x, y, math.tau * uniform(draw, PLACE + 2) - math.pi)
    raise SimulationError(
        f"world {scene.name!r} has no room for {count} robots; {len(chosen)} were placed",
        hint="ask for fewer robots, or choose a larger world",
    )


def _is_apart(x: float, y: float, others: list[Pose], distance: float) -> bool:
    return all((x - other.x) ** 2 + (y - other.y) ** 2 >= distance * distance for other in others)


class _Ground:
    """The scene's floor, to ask where it is free."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._walls = flat_walls(scene.surfaces)
        self._discs = flat_discs(scene.cylinders)

    def clearance(self, x: float, y: float) -> float:
        """Return the distance to the nearest surface, m; below 0 outside the arena or inside a solid."""
        if any(_is_inside(box, x, y) for box in self._scene.boxes):
            return -1.0
        nearest = min(x, self._scene.width - x, y, self._scene.depth - y)
        walls, discs = self._walls, self._discs
        for k in range(0, len(walls), 5):
            dx, dy = x - walls[k], y - walls[k + 1]
            along = min(max(walls[k + 2] * dx + walls[k + 3] * dy, 0.0), walls[k + 4])
            dx, dy = dx - along * walls[k + 2], dy - along * walls[k + 3]
            nearest = min(nearest, math.sqrt(dx * dx + dy * dy))
        for k in range(0, len(discs), 3):
            dx, dy = x - discs[k], y - discs[k + 1]
            nearest = min(nearest, math.sqrt(dx * dx + dy * dy) - discs[k + 2])
        return nearest


def _is_inside(box: Box, x: float, y: float) -> bool:
    corners = box.corners
    return all(
        (corners[(i + 1) % 4][0] - corners[i][0]) * (y - corners[i][1])
        >= (corners[(i + 1) % 4][1] - corners[i][1]) * (x - corners[i][0])
        for i in range(4)
    )
