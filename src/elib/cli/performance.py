"""What is kept of a performance, for its summary and its plot: read off the links' own traces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from elib.behaviours import RunContext
from elib.body import STEPS_PER_REVOLUTION
from elib.cli.track import length
from elib.emulator.sim import SimTransport
from elib.physics import RobotView, Snapshot, World
from elib.pose import Pose, advanced
from elib.protocol.values import (
    READING_TYPES,
    AmbientLight,
    Ground,
    Microphones,
    Proximity,
    Role,
    Steps,
    Wheels,
    describe,
    in_words,
)
from elib.robot.aio import Epuck
from elib.session import Ended, TraceEvent

BETWEEN = 0.1
"""s from one point of a path to the next at least."""
MARGIN, SMALLEST_FLOOR = 0.10, 0.5
"""m of free floor around a path whose surroundings nobody knows, and of the smallest floor that is drawn."""

Sensed = Proximity | AmbientLight | Ground | Microphones
SENSES: dict[type, tuple[str, tuple[str, ...]]] = {
    kind: (
        f"{in_words(name)}, counts",
        tuple(in_words(each) for info in describe(kind, Role.NUMBER) for each in info.names or (info.name,)),
    )
    for name, kind in READING_TYPES.items()
    if issubclass(kind, Sensed)
}
"""Readings that are kept, and what a plot calls them and their numbers."""


@dataclass(slots=True)
class Kept:
    """What is kept of one robot.

    Attributes:
        name: Of the robot.
        path: Where it was, oldest first: by its world if it is simulated here, else by what its wheels were told.
        speeds: When its wheels were told what: s since the beginning, rev/s, rev/s.
        readings: What its sensors read: for each kind the times, s, and the numbers.
    """

    name: str
    path: list[Pose] = field(default_factory=list)
    speeds: list[tuple[float, float, float]] = field(default_factory=list)
    readings: dict[type, list[tuple[float, tuple[float, ...]]]] = field(default_factory=dict)

    @property
    def distance(self) -> float:
        """How far it went, m."""
        return length(self.path)


class Follower:
    """Follows one robot.

    Args:
        robot: It is open.
        began: When it began, s on the robot's clock.
    """

    def __init__(self, robot: Epuck, began: float) -> None:
        self.kept = Kept(robot.name)
        self._began = began
        self._told = Wheels(0.0, 0.0)
        self._last = began
        self._world: World | None = None
        self._index = 0
        transport = robot.session.transport
        if isinstance(transport, SimTransport) and transport.simulation.world is not None:
            transport.simulation.catch_up()
            self._world, self._index = transport.simulation.world, transport.robot.index
        self.kept.path.append(self._here() or Pose(0.0, 0.0))
        robot.trace(self.see)

    @property
    def world(self) -> World | None:
        """The world it is in, if that is simulated here."""
        return self._world

    def _here(self) -> Pose | None:
        return None if self._world is None else self._world.pose(self._index)

    def see(self, time: float, event: TraceEvent) -> None:
        """Take what happens on the link; a trace hook."""
        if not isinstance(event, Ended) or event.error is not None:
            return
        if type(event.value) in SENSES:
            numbers = tuple(map(float, event.value))  # type: ignore[call-overload]  # readings are sequences
            self.kept.readings.setdefault(type(event.value), []).append((time - self._began, numbers))
        if event.request.name in ("set_speed", "stop"):
            self._roll(time)
            steps = event.request.numbers if event.request.name == "set_speed" else (0, 0)
            left, right = (step / STEPS_PER_REVOLUTION for step in steps)
            self._told = Wheels(left, right)
            self.kept.speeds.append((time - self._began, left, right))
        elif time - self._last >= BETWEEN or isinstance(event.value, Steps):
            self._roll(time)

    def _roll(self, time: float) -> None:
        """Add where it is now."""
        here = self._here()
        if here is None:
            seconds = (time - self._last) * STEPS_PER_REVOLUTION
            here = advanced(self.kept.path[-1], self._told.left * seconds, self._told.right * seconds, time)
        self._last = time
        if here != self.kept.path[-1]:
            self.kept.path.append(here)


class Performance:
    """Follows all robots of a performance, and its context.

    Args:
        context: Where it takes place.
        robots: That take part, open.
    """

    def __init__(self, context: RunContext, robots: tuple[Epuck, ...]) -> None:
        self.context = context
        self.followers = [Follower(robot, context.began) for robot in robots]

    @property
    def kept(self) -> list[Kept]:
        """What is kept of each robot."""
        return [follower.kept for follower in self.followers]

    @property
    def distance(self) -> float:
        """How far the robots went, all together, m; nan where nobody knows."""
        return math.fsum(kept.distance for kept in self.kept) if self.followers else math.nan

    @property
    def is_true(self) -> bool:
        """Whether paths are the world's own."""
        return bool(self.followers) and all(follower.world is not None for follower in self.followers)

    def time_in_states(self) -> list[tuple[str, float, int]]:
        """Return each state's name, how long it was in it, s, and how often; in the order of their first time."""
        states = self.context.states
        if not states:
            return []
        spans: dict[str, tuple[float, int]] = {}
        for (since, name), (until, _) in zip(states, [*states[1:], (self.context.time, "")], strict=True):
            seconds, count = spans.get(name, (0.0, 0))
            spans[name] = seconds + until - since, count + 1
        return [(name, seconds, count) for name, (seconds, count) in spans.items()]

    def floor(self) -> tuple[Snapshot, list[list[Pose]]] | None:
        """Return the surroundings as they are now, and each robot's path in them; None without a robot."""
        if not self.followers:
            return None
        world = self.followers[0].world
        paths = [kept.path for kept in self.kept]
        if self.is_true and world is not None:
            return world.snapshot(), paths
        return floor_around(paths, "as the wheels were told")


def floor_around(paths: Sequence[Sequence[Pose]], name: str) -> tuple[Snapshot, list[list[Pose]]]:
    """Return a free floor around paths whose surroundings nobody knows, the robots at their ends, and the paths on it.

    Args:
        paths: Of at least one robot, none of them empty.
        name: Of the floor.
    """
    poses = [pose for path in paths for pose in path]
    left, below = MARGIN - min(pose.x for pose in poses), MARGIN - min(pose.y for pose in poses)
    moved = [[Pose(pose.x + left, pose.y + below, pose.heading) for pose in path] for path in paths]
    width = max(max(pose.x for path in moved for pose in path) + MARGIN, SMALLEST_FLOOR)
    depth = max(max(pose.y for path in moved for pose in path) + MARGIN, SMALLEST_FLOOR)
    views = tuple(RobotView(path[-1]) for path in moved)
    return Snapshot(name, 0, 0.0, width, depth, robots=views), moved
