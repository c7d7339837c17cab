"""Things put elsewhere from outside, between two ticks: what a hand in the arena does.

A program may put things where a file may: their centres inside the arena, and into each other. Fixed things are one
shape then, such as a door that slides into its wall, and the next steps of the physics part things that can be pushed.
Only a robot needs room, as at its start: inside a thing it would sense and do what no robot can.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain

from elib.base.errors import ArgumentError
from elib.base.pose import Pose
from elib.base.rules import rule_of
from elib.simulator.physics.geometry import Box, Cylinder, Polygon, Solid, Wall, unit
from elib.simulator.physics.pushing import follow
from elib.simulator.physics.spawning import stand
from elib.simulator.physics.state import State

SLACK = 0.0005
"""m. Things that overlap less than this touch: the next steps of the physics part them by themselves."""

EDGE = "the edge of the arena"

PLACE = rule_of(Box, "x")


class Mover:
    """Moves robots, boxes and cylinders of one world, where there is room.

    Attributes:
        robot_names: What messages call the robots.
    """

    def __init__(self, state: State) -> None:
        self._state = state
        self.robot_names = [f"robot {i}" for i in range(len(state.world.robots))]

    def robot(self, index: int, pose: Pose) -> None:
        """Put a robot somewhere else; its wheels go on turning.

        Raises:
            ArgumentError: There is no room for it.
        """
        robots = self._state.world.robots
        here = robots[index]
        x, y = PLACE.require(pose.x, "x"), PLACE.require(pose.y, "y")
        name, disc = self.robot_names[index], Cylinder(x, y, float(here.radius))
        solids = (other for other, solid in self._solids() if solid.distance(x, y) < disc.radius - SLACK)
        self._require_room(name, disc, chain(self._robots_in(disc, name), solids))
        cosine, sine = unit(pose.heading)
        stand(here, pose.x, pose.y, cosine, sine)
        self._state.list_near()

    def box(self, index: int, pose: Pose) -> None:
        """Put a box somewhere else.

        Raises:
            ArgumentError: There is no room for it.
        """
        state = self._state
        new = replace(state.boxes[index], x=pose.x, y=pose.y, angle=pose.heading)
        self._require_room(_called("box", index, new), new, self._robots_in(new))
        state.boxes[index] = new
        if new.switch:  # it is closed where it was put, and opens from there
            state.put_door(index)
            return
        self._put(state.solids.box_things[index], pose)

    def cylinder(self, index: int, x: float, y: float) -> None:
        """Put the centre of a cylinder somewhere else.

        Raises:
            ArgumentError: There is no room for it.
        """
        state = self._state
        new = replace(state.cylinders[index], x=x, y=y)
        self._require_room(_called("cylinder", index, new), new, self._robots_in(new))
        state.cylinders[index] = new
        self._put(state.solids.cylinder_things[index], Pose(x, y))

    def add_box(self, box: Box) -> None:
        """Put another box into the world.

        Raises:
            ArgumentError: There is no room for it, or the world has too many.
        """
        index = len(self._state.boxes)
        self._require_room(_called("box", index, box), box, self._robots_in(box))
        self._state.add_box(box)

    def wall(self, index: int, wall: Wall) -> None:
        """Put a wall in the place of another one, or behind the last one.

        Raises:
            ArgumentError: A robot is in its way, or the world has too many.
        """
        self._require_room(f"wall {index}", wall, self._robots_in(wall))
        walls = self._state.scene.walls
        self._state.set_walls((*walls[:index], wall, *walls[index + 1 :]))

    def _put(self, index: int, pose: Pose) -> None:
        """Put the pushable thing of this number somewhere else; below 0 a fixed one was moved."""
        if index < 0:
            self._state.rebuild()
            return
        world = self._state.world
        thing = world.things[index]
        thing.x, thing.y = pose.x, pose.y
        thing.heading_x, thing.heading_y = unit(pose.heading)
        thing.speed_x = thing.speed_y = thing.spin = 0.0
        follow(world, index)
        self._state.list_near()

    def _require_room(self, name: str, thing: Solid, blockers: Iterator[str]) -> None:
        """Raise ArgumentError if *thing* stands outside of the arena, or there is a name in *blockers*."""
        scene = self._state.scene
        x, y = (thing.x1, thing.y1) if isinstance(thing, Wall) else (thing.x, thing.y)
        is_outside = not isinstance(thing, Wall) and not (0 <= x <= scene.width and 0 <= y <= scene.depth)
        blocked = EDGE if is_outside else next(blockers, None)
        if blocked is not None:
            size = f"the arena is {scene.width:g} x {scene.depth:g} m"
            raise ArgumentError(
                f"{name} has no room at ({x:.3f}, {y:.3f}): {blocked} is in the way",
                hint=size if blocked == EDGE else "choose a free place",
            )

    def _robots_in(self, thing: Solid, but: str = "") -> Iterator[str]:
        """Yield the names of the robots that *thing* would stand in, without *but*."""
        for name, robot in zip(self.robot_names, self._state.world.robots, strict=True):
            if name != but and thing.distance(float(robot.x), float(robot.y)) < float(robot.radius) - SLACK:
                yield name

    def _solids(self) -> Iterator[tuple[str, Solid | Polygon]]:
        """Yield what else a robot cannot stand in, by the names that messages use."""
        state = self._state
        for edge in state.scene.edge:
            yield EDGE, edge
        for k, box in enumerate(map(state.box, range(len(state.boxes)))):
            yield _called("box", k, box), box
        for k, cylinder in enumerate(map(state.cylinder, range(len(state.cylinders)))):
            yield _called("cylinder", k, cylinder), cylinder
        for k, wall in enumerate(state.scene.walls):
            yield f"wall {k}", wall
        for k, polygon in enumerate(state.scene.polygons):
            yield f"polygon {k}", polygon


def _called(kind: str, index: int, thing: Box | Cylinder) -> str:
    return f"{kind} {index} ({thing.name})" if thing.name else f"{kind} {index}"
