"""The control door: what a panel or a test does to a simulation while it runs.

Things are moved between two ticks of the world, never within one. Faults of the door come on top of those that the
link's own settings and a fault script bring. They belong to the simulation: every door to it sees and changes the same.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

from elib.emulator.switches import CALM, BareLine, Line, LinkState, Trouble
from elib.errors import ArgumentError, SimulationError
from elib.fields import DELAY, PROBABILITY, rule_of
from elib.physics import Box, Cylinder, EpuckModel, Pose, Snapshot, World

if TYPE_CHECKING:
    from elib.emulator.sim import Simulation
    from elib.physics.fittings import Light, Sound

PLACE = rule_of(Box, "x")
AMBIENT = rule_of(EpuckModel, "ambient")
FAULTS = {"latency": DELAY, "jitter": DELAY, "loss": PROBABILITY}

_Thing = TypeVar("_Thing", "Box", "Cylinder", "Light", "Sound")


class Control:
    """The control door of *simulation*, for callers on its event loop.

    Robots go by name (``epuck-1``) or index from 0; boxes, cylinders, lights and sounds by name or index too.

    Args:
        simulation: What is controlled.
        lines: What can be cut, one for each robot; None where programs reach the robots inside their own process.

    Attributes:
        names: Of all robots, in order.
    """

    def __init__(self, simulation: Simulation, *, lines: Sequence[Line] | None = None) -> None:
        self.simulation = simulation
        self._lines = lines
        self.names = simulation.names

    @property
    def world(self) -> World:
        """The world.

        Raises:
            SimulationError: Constant readings stand in its place.
        """
        if self.simulation.world is None:
            raise SimulationError("this simulation has constant readings and no world", hint="leave --hardware out")
        return self.simulation.world

    @property
    def ambient(self) -> float:
        """What the infrared sensors read in the room's light, counts."""
        world = self.simulation.world
        return 0.0 if world is None else world.ambient

    def snapshot(self, *, beams: bool = False) -> Snapshot:
        """Return the world as it is now.

        Args:
            beams: Also cast each robot's infrared sensors.

        Raises:
            SimulationError: There is no world.
        """
        world = self.world
        self.simulation.catch_up()
        return world.snapshot(beams=beams)

    def link(self, robot: int | str) -> LinkState:
        """Return how a robot is connected.

        Raises:
            ArgumentError: There is no such robot.
        """
        index = self.robot(robot)
        virtual = self.simulation.robots.get(index)
        if virtual is None:
            return LinkState(is_connected=False, is_cut=False)
        trouble = virtual.trouble or CALM
        return LinkState(virtual.link.is_connected, self.is_cut(index), trouble.latency, trouble.jitter, trouble.loss)

    def is_cut(self, index: int) -> bool:
        """Return whether nobody can reach a robot, by its index."""
        if self._lines is not None:
            return self._lines[index].is_cut
        return index in self.simulation.robots and self.simulation.robots[index].is_cut

    def robot(self, robot: int | str) -> int:
        """Return the index of a robot.

        Raises:
            ArgumentError: There is none.
        """
        if isinstance(robot, str):
            if robot in self.names:
                return self.names.index(robot)
        elif 0 <= robot < len(self.names):
            return robot
        last = self.names[-1] if self.names else "none"
        raise ArgumentError(f"there is no robot {robot!r}", hint=f"they are called epuck-1 to {last}, or 0 and up")

    def move_robot(self, robot: int | str, x: float, y: float, heading: float | None = None) -> None:
        """Lift a robot and put it down elsewhere; its wheels turn on.

        Args:
            robot: Which one.
            x: m.
            y: m.
            heading: rad; None keeps it.

        Raises:
            ArgumentError: There is no such robot, a number is not finite, or something stands there.
            SimulationError: There is no world.
        """
        index, world = self.robot(robot), self.world
        x, y = _place(x, y)
        self.simulation.catch_up()
        heading = world.pose(index).heading if heading is None else heading
        world.move_robot(index, Pose(x, y, math.remainder(heading, math.tau) if math.isfinite(heading) else heading))

    def move_box(self, box: int | str, x: float, y: float, angle: float | None = None) -> None:
        """Put a box down elsewhere.

        Args:
            box: Which one.
            x: Of its centre, m.
            y: Of its centre, m.
            angle: rad; None keeps it.

        Raises:
            ArgumentError: There is no such box, a number is not finite, or something stands there.
            SimulationError: There is no world.
        """
        snapshot = self.snapshot()
        index = _index("box", box, snapshot.boxes)
        self.world.move_box(index, Pose(*_place(x, y), snapshot.boxes[index].angle if angle is None else angle))

    def move_cylinder(self, cylinder: int | str, x: float, y: float) -> None:
        """Put a cylinder down elsewhere.

        Args:
            cylinder: Which one.
            x: m.
            y: m.

        Raises:
            ArgumentError: There is no such cylinder, a number is not finite, or something stands there.
            SimulationError: There is no world.
        """
        index = _index("cylinder", cylinder, self.snapshot().cylinders)
        self.world.move_cylinder(index, *_place(x, y))

    def set_light(
        self,
        light: int | str,
        *,
        x: float | None = None,
        y: float | None = None,
        height: float | None = None,
        intensity: float | None = None,
    ) -> None:
        """Change a lamp; what is None stays.

        Args:
            light: Which one.
            x: m.
            y: m.
            height: m, more than 0.
            intensity: 0..10; 0 switches it off.

        Raises:
            ArgumentError: There is no such light, or a number is out of its range.
            SimulationError: There is no world.
        """
        snapshot = self.snapshot()
        index = _index("light", light, snapshot.lights)
        changes = _given(x=x, y=y, height=height, intensity=intensity)
        self.world.set_light(index, replace(snapshot.lights[index], **changes))

    def set_sound(
        self,
        sound: int | str,
        *,
        x: float | None = None,
        y: float | None = None,
        volume: float | None = None,
        frequency: float | None = None,
    ) -> None:
        """Change a source of sound; what is None stays.

        Args:
            sound: Which one.
            x: m.
            y: m.
            volume: Counts peak to peak at 0.1 m, 0..4095; 0 silences it.
            frequency: Hz, 20..8000.

        Raises:
            ArgumentError: There is no such sound, or a number is out of its range.
            SimulationError: There is no world.
        """
        snapshot = self.snapshot()
        index = _index("sound", sound, snapshot.sounds)
        changes = _given(x=x, y=y, volume=volume, frequency=frequency)
        self.world.set_sound(index, replace(snapshot.sounds[index], **changes))

    def set_ambient(self, counts: float) -> None:
        """Set what the infrared sensors read in the room's light.

        Args:
            counts: 0..4095, higher is darker.

        Raises:
            ArgumentError: *counts* is out of its range.
            SimulationError: There is no world.
        """
        counts = AMBIENT.require(counts, "ambient")
        world = self.world
        self.simulation.catch_up()
        world.set_ambient(counts)

    def set_faults(
        self,
        robot: int | str,
        *,
        latency: float | None = None,
        jitter: float | None = None,
        loss: float | None = None,
    ) -> None:
        """Make a robot's link worse, on top of its settings and its fault script; what is None stays.

        Args:
            robot: Which one.
            latency: By how much its answers come later, 0..60 s.
            jitter: Standard deviation of that, 0..60 s.
            loss: Probability that a whole answer is lost, 0..1.

        Raises:
            ArgumentError: There is no such robot, nobody can connect to it, or a number is out of its range.
        """
        index = self._connected(robot)
        given = _given(latency=latency, jitter=jitter, loss=loss)
        changes = {name: FAULTS[name].require(value, name) for name, value in given.items()}
        virtual = self.simulation.robots[index]
        if virtual.trouble is None:
            seed = f"{self.simulation.settings.seed or 0} control {index}"
            virtual.trouble = virtual.link.weather = Trouble(virtual.link.weather, random.Random(seed))
        trouble = virtual.trouble
        for name, value in changes.items():
            setattr(trouble, name, value)

    def cut(self, robot: int | str) -> None:
        """Cut a robot's link: its program loses it, and no other can open it until :meth:`mend`.

        Raises:
            ArgumentError: There is no such robot, or nobody can connect to it.
        """
        self._line(robot).cut()

    def mend(self, robot: int | str) -> None:
        """Let programs open a robot again. What a fault script cut stays cut as long as the script says.

        Raises:
            ArgumentError: There is no such robot, or nobody can connect to it.
        """
        self._line(robot).mend()

    def _connected(self, robot: int | str) -> int:
        index = self.robot(robot)
        if index not in self.simulation.robots:
            raise ArgumentError(f"{self.names[index]} has no link: no program ever opened it", hint="open it first")
        return index

    def _line(self, robot: int | str) -> Line:
        index = self._connected(robot)
        return BareLine(self.simulation.robots[index]) if self._lines is None else self._lines[index]


def _place(x: float, y: float) -> tuple[float, float]:
    return PLACE.require(x, "x"), PLACE.require(y, "y")


def _given(**values: float | None) -> dict[str, Any]:
    """Return those values that are not None."""
    return {name: value for name, value in values.items() if value is not None}


def _index(what: str, thing: int | str, things: Sequence[_Thing]) -> int:
    if isinstance(thing, str):
        for index, candidate in enumerate(things):
            if thing and candidate.name == thing:
                return index
    elif 0 <= thing < len(things):
        return thing
    there = f"counted from 0 to {len(things) - 1}" if things else "there is none in this world"
    raise ArgumentError(f"there is no {what} {thing!r}", hint=there)
