"""Things put elsewhere from outside, between two ticks: what a hand in the arena does."""

from __future__ import annotations

from dataclasses import replace

from elib.errors import ArgumentError
from elib.physics import layout as at
from elib.physics.geometry import Box, Cylinder, unit
from elib.physics.state import State
from elib.physics.things import TOLERANCE, follow, nearest
from elib.pose import Pose

CLEAR = TOLERANCE * 10  # m. What touches does not overlap, whatever the last bit says.


class Mover:
    """Moves robots, boxes and cylinders of one world, where there is room."""

    def __init__(self, state: State) -> None:
        self._state = state

    def robot(self, index: int, pose: Pose) -> None:
        """Put a robot somewhere else; its wheels go on turning.

        Raises:
            ArgumentError: There is no such robot, or no room for it.
        """
        state = self._state
        _require(index, state.count, "robot")
        r = index * at.ROBOT
        radius = state.robots[r + at.RADIUS]
        self._require_room(f"robot {index}", pose.x, pose.y, radius, robot=index)
        cosine, sine = unit(pose.heading)
        for key, value in (
            (at.X, pose.x),
            (at.BEFORE_X, pose.x),
            (at.Y, pose.y),
            (at.BEFORE_Y, pose.y),
            (at.HEADING_X, cosine),
            (at.BEFORE_HEADING_X, cosine),
            (at.HEADING_Y, sine),
            (at.BEFORE_HEADING_Y, sine),
            (at.LAST_STEP_X, 0.0),
            (at.LAST_STEP_Y, 0.0),
        ):
            state.robots[r + key] = value
        state.regrid()

    def box(self, index: int, pose: Pose) -> None:
        """Put a box somewhere else.

        Raises:
            ArgumentError: There is no such box, or a robot is in the way.
        """
        state = self._state
        _require(index, len(state.boxes), "box")
        new = replace(state.boxes[index], x=pose.x, y=pose.y, angle=pose.heading)
        self._require_inside(f"box {index}", new.corners)
        self._require_no_robot(f"box {index}", new)
        body = state.box_bodies[index]
        state.boxes[index] = new
        if body < 0:
            state.rebuild()
            return
        self._put(body, pose.x, pose.y, pose.heading)

    def cylinder(self, index: int, x: float, y: float) -> None:
        """Put the centre of a cylinder somewhere else.

        Raises:
            ArgumentError: There is no such cylinder, or a robot is in the way.
        """
        state = self._state
        _require(index, len(state.cylinders), "cylinder")
        new = replace(state.cylinder(index), x=x, y=y)
        size = new.radius
        self._require_inside(f"cylinder {index}", ((x - size, y - size), (x + size, y + size)))
        self._require_no_robot(f"cylinder {index}", new)
        body = state.cylinder_bodies[index]
        state.cylinders[index] = new
        if body < 0:
            state.rebuild()
            return
        self._put(body, x, y, 0.0)

    def _put(self, body: int, x: float, y: float, angle: float) -> None:
        state = self._state
        b = body * at.BODY
        state.bodies[b + at.X], state.bodies[b + at.Y] = x, y
        state.bodies[b + at.HEADING_X], state.bodies[b + at.HEADING_Y] = unit(angle)
        follow(body, state.bodies, state.walls, state.discs)
        state.regrid()

    def _require_inside(self, what: str, points: tuple[tuple[float, float], ...]) -> None:
        scene = self._state.scene
        for x, y in points:
            if not (-CLEAR <= x <= scene.width + CLEAR and -CLEAR <= y <= scene.depth + CLEAR):
                raise ArgumentError(
                    f"{what} cannot go there: it would reach ({x:.3g}, {y:.3g})",
                    hint=f"the arena is {scene.width:g} x {scene.depth:g} m",
                )

    def _require_no_robot(self, what: str, thing: Box | Cylinder) -> None:
        state = self._state
        record = _record(thing)
        for i in range(state.count):
            r = i * at.ROBOT
            x, y = state.robots[r + at.X], state.robots[r + at.Y]
            if nearest(0, x, y, state.robots[r + at.RADIUS], record)[0] > CLEAR:
                raise ArgumentError(f"{what} cannot go there: robot {i} is in the way", hint="move the robot first")

    def _require_room(self, what: str, x: float, y: float, radius: float, *, robot: int) -> None:
        state = self._state
        corners = ((x - radius, y - radius), (x + radius, y + radius))
        self._require_inside(what, corners)
        for i in range(state.count):
            dx, dy = state.robots[i * at.ROBOT + at.X] - x, state.robots[i * at.ROBOT + at.Y] - y
            reach = radius + state.robots[i * at.ROBOT + at.RADIUS] - CLEAR
            if i != robot and dx * dx + dy * dy < reach * reach:
                raise ArgumentError(f"{what} cannot go there: robot {i} is in the way", hint="move that one first")
        solids: list[tuple[str, list[Box | Cylinder]]] = [
            ("box", [state.box(k) for k in range(len(state.boxes))]),
            ("cylinder", [state.cylinder(k) for k in range(len(state.cylinders))]),
        ]
        for kind, things in solids:
            for k, thing in enumerate(things):
                if nearest(0, x, y, radius, _record(thing))[0] > CLEAR:
                    raise ArgumentError(f"{what} cannot go there: {kind} {k} is in the way", hint="choose a free place")
        for w in range(at.EDGE * at.WALL, (at.EDGE + len(state.scene.walls)) * at.WALL, at.WALL):
            tangent_x, tangent_y = state.walls[w + at.TANGENT_X], state.walls[w + at.TANGENT_Y]
            dx, dy = x - state.walls[w], y - state.walls[w + at.WALL_Y]
            along = min(max(tangent_x * dx + tangent_y * dy, 0.0), state.walls[w + at.LENGTH])
            dx, dy = dx - along * tangent_x, dy - along * tangent_y
            if dx * dx + dy * dy < (radius - CLEAR) ** 2:
                raise ArgumentError(f"{what} cannot go there: a wall is in the way", hint="choose a free place")


def _record(thing: Box | Cylinder) -> list[float]:
    from elib.physics.assembly import box_body, cylinder_body

    return box_body(thing, 0) if isinstance(thing, Box) else cylinder_body(thing, 0)


def _require(index: int, count: int, what: str) -> None:
    if not 0 <= index < count:
        raise ArgumentError(f"there is no {what} {index}; the world has {count}, counted from 0")
