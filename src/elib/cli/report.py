"""Reports of a run, from the traces of the robots' links: for the summary and the plot of ``elib run``."""

from __future__ import annotations

import math

from elib.behaviours import RunResult
from elib.behaviours._run.context import RunContext
from elib.body import STEPS_PER_REVOLUTION
from elib.cli.track import floor_around, length, simulation_of
from elib.physics import Snapshot
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
from elib.session.statistics import LinkStats
from elib.view.report import Chart, draw_report

BETWEEN = 0.1
"""Smallest time from one point of a path to the next, s: a robot moves 13 mm in it at most."""

Sensed = Proximity | AmbientLight | Ground | Microphones
SENSES: dict[type, tuple[str, tuple[str, ...]]] = {
    kind: (
        f"{in_words(name)}, counts",
        tuple(in_words(each) for info in describe(kind, Role.NUMBER) for each in info.names or (info.name,)),
    )
    for name, kind in READING_TYPES.items()
    if issubclass(kind, Sensed)
}
"""The readings that a plot shows, its title for them, and the names of their numbers."""

ENDINGS = {
    "done": "by itself",
    "time": "its time was over",
    "enter": "by Enter",
    "error": "by an error",
    "interrupt": "by Ctrl-C or a signal",
}


class RobotReport:
    """The report of what one robot did.

    Args:
        robot: An open robot.
        began: When the run began, s on the robot's clock.

    Attributes:
        name: Name of the robot.
        world: The world that the robot is in, if it is simulated in this process.
        path: The poses of the robot, oldest first: from its world, else from the speeds that its wheels were told.
        speeds: The speeds that the wheels were told: s since the beginning, rev/s, rev/s.
        readings: The readings of each kind: s since the beginning, and the numbers.
    """

    def __init__(self, robot: Epuck, began: float) -> None:
        self.name = robot.name
        self.speeds: list[tuple[float, float, float]] = []
        self.readings: dict[type, list[tuple[float, tuple[float, ...]]]] = {}
        self._began = self._last = began
        self._told = Wheels(0.0, 0.0)
        simulation, self._index = simulation_of(robot)
        self.world = None if simulation is None else simulation.world
        if simulation is not None:
            simulation.catch_up()
        self.path = [self._true_pose() or Pose(0.0, 0.0)]
        robot.trace(self._note)

    @property
    def distance(self) -> float:
        """Length of the path, m."""
        return length(self.path)

    def _true_pose(self) -> Pose | None:
        return None if self.world is None else self.world.pose(self._index)

    def _note(self, time: float, event: TraceEvent) -> None:
        """Take an event of the link; a trace hook."""
        if not isinstance(event, Ended) or event.error is not None:
            return
        if type(event.value) in SENSES:
            numbers = tuple(map(float, event.value))  # type: ignore[call-overload]  # readings are sequences
            self.readings.setdefault(type(event.value), []).append((time - self._began, numbers))
        steps = (0, 0) if event.request.name == "stop" else event.request.numbers
        if event.request.name in ("set_speed", "stop") and len(steps) == 2:
            self._add_pose(time)
            left, right = (step / STEPS_PER_REVOLUTION for step in steps)
            self._told = Wheels(left, right)
            self.speeds.append((time - self._began, left, right))
        elif time - self._last >= BETWEEN or isinstance(event.value, Steps):
            self._add_pose(time)

    def _add_pose(self, time: float) -> None:
        pose = self._true_pose()
        if pose is None:
            steps = (time - self._last) * STEPS_PER_REVOLUTION
            pose = advanced(self.path[-1], self._told.left * steps, self._told.right * steps, time)
        self._last = time
        if pose != self.path[-1]:
            self.path.append(pose)


class RunReport:
    """The report of what all robots of a run did.

    Args:
        context: The run.
        robots: The robots that take part, open.
    """

    def __init__(self, context: RunContext, robots: tuple[Epuck, ...]) -> None:
        self.context = context
        self.robots = [RobotReport(robot, context.began) for robot in robots]

    @property
    def distance(self) -> float:
        """How far the robots went, all together, m; nan without a robot."""
        return math.fsum(robot.distance for robot in self.robots) if self.robots else math.nan

    @property
    def is_true(self) -> bool:
        """Whether the paths are the world's own."""
        return bool(self.robots) and all(robot.world is not None for robot in self.robots)

    def time_in_states(self) -> list[tuple[str, float, int]]:
        """Return each state's name, the time in it, s, and how often it was entered, in the order of first entry."""
        states = self.context.states
        if not states:
            return []
        spans: dict[str, tuple[float, int]] = {}
        for (since, name), (until, _) in zip(states, [*states[1:], (self.context.time, "")], strict=True):
            seconds, count = spans.get(name, (0.0, 0))
            spans[name] = seconds + until - since, count + 1
        return [(name, seconds, count) for name, (seconds, count) in spans.items()]

    def rows(self, statistics: LinkStats | None, outcome: RunResult | None) -> list[tuple[str, str]]:
        """Return the summary as label and text.

        Args:
            statistics: How the links were; None without a link.
            outcome: How the run ended; None if an error ended it.
        """
        reason = self.context.reason if outcome is None else outcome.reason
        duration = self.context.time if outcome is None else outcome.duration
        rows = [("robot time", f"{duration:.1f} s, {ENDINGS.get(reason, reason)}")]
        if self.robots:
            source = "by the simulated world" if self.is_true else "as the wheels were told"
            rows.append(("distance", f"{self.distance:.2f} m, {source}"))
        spans = [
            f"{name} {seconds:.1f} s" + (f" in {count} times" if count > 1 else "")
            for name, seconds, count in self.time_in_states()
        ]
        if spans:
            rows.append(("states", ", ".join(spans)))
        return rows + ([] if statistics is None else link_rows(statistics))

    def draw(self, path: str, title: str) -> None:
        """Draw paths, states, and the speeds and readings of the first robot.

        Raises:
            ArgumentError: The file cannot be created.
            ElibError: The file cannot be written.
        """
        floor, trails = self._floor()
        charts = []
        for robot in self.robots[:1]:
            whose = f"{robot.name}: " if len(self.robots) > 1 else ""
            if robot.speeds:
                times, left, right = zip(*robot.speeds, strict=True)
                charts.append(Chart(f"{whose}wheels, rev/s", times, (left, right), ("left", "right"), is_stepped=True))
            for kind, readings in robot.readings.items():
                name, labels = SENSES[kind]
                lines = list(zip(*(numbers for _, numbers in readings), strict=True))
                charts.append(Chart(whose + name, [time for time, _ in readings], lines, labels[: len(lines)]))
        draw_report(
            path,
            title=f"{title}, {self.context.time:.1f} s, {self.distance:.2f} m",
            floor=floor,
            trails=trails,
            charts=charts,
            states=self.context.states,
            seconds=self.context.time,
        )

    def _floor(self) -> tuple[Snapshot | None, list[list[Pose]]]:
        """Return the surroundings as they are now, and each robot's path in them; None without a robot."""
        paths = [robot.path for robot in self.robots]
        if not self.robots:
            return None, []
        world = self.robots[0].world
        if self.is_true and world is not None:
            return world.snapshot(), paths
        return floor_around(paths, "as the wheels were told")


def link_rows(statistics: LinkStats) -> list[tuple[str, str]]:
    """Return how the link was, as label and text."""
    failed = statistics.refused + statistics.unsent
    share = "99 % below" if statistics.count >= 100 else "at most"  # of fewer, the greatest is the 99th percentile
    answered = f"{statistics.count} answered, {statistics.lost} answers lost"
    return [
        ("commands", answered + (f", {failed} failed otherwise" if failed else "")),
        ("round trip", f"median {_milliseconds(statistics.median)}, {share} {_milliseconds(statistics.p99)}"),
    ]


def _milliseconds(seconds: float) -> str:
    return "unknown" if math.isnan(seconds) else f"{seconds * 1000:.1f} ms"
