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
    describe,
    in_words,
    reading_name,
)
from elib.robot.aio import Epuck
from elib.session import Ended, TraceEvent
from elib.session.statistics import LinkStats, merged
from elib.view.report import Chart, draw_report

BETWEEN = 0.1
"""Smallest time from one point of a path to the next, s: a robot moves 13 mm in it at most."""

Sensed = Proximity | AmbientLight | Ground | Microphones
SENSES: dict[str, tuple[str, tuple[str, ...]]] = {
    name: (
        f"{in_words(name)}, counts",
        tuple(in_words(each) for info in describe(kind, Role.NUMBER) for each in info.names or (info.name,)),
    )
    for name, kind in READING_TYPES.items()
    if issubclass(kind, Sensed)
}
"""The readings that a plot shows, by name: its title for them, and the names of their numbers."""

Speeds = list[tuple[float, tuple[float, float]]]
"""Times, s since the beginning, and the wheel speeds told then, rev/s."""
Numbers = dict[str, list[tuple[float, tuple[float, ...]]]]
"""For the name of each reading: times, s since the beginning, and the numbers read then."""

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
        robot: The robot.
        world: The world that the robot is in, if it is simulated in this process.
        path: The poses of the robot, oldest first: from its world, else from the speeds that its wheels were told.
        speeds: The speeds that the wheels were told.
        readings: The readings that a plot shows.
    """

    def __init__(self, robot: Epuck, began: float) -> None:
        self.robot = robot
        self.speeds: Speeds = []
        self.readings: Numbers = {}
        self._began = self._last = began
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

    @property
    def wheels(self) -> tuple[float, float]:
        """The speeds that the wheels were told last, rev/s."""
        return self.speeds[-1][1] if self.speeds else (0.0, 0.0)

    def _true_pose(self) -> Pose | None:
        return None if self.world is None else self.world.pose(self._index)

    def _note(self, time: float, event: TraceEvent) -> None:
        """Take an event of the link; a trace hook."""
        if not isinstance(event, Ended) or event.error is not None:
            return
        if isinstance(event.value, Sensed):
            numbers = self.readings.setdefault(reading_name(type(event.value)), [])
            numbers.append((time - self._began, tuple(event.value)))
        steps = (0, 0) if event.request.name == "stop" else event.request.numbers
        if event.request.name in ("set_speed", "stop") and len(steps) == 2:
            self._add_pose(time)
            left, right = steps
            self.speeds.append((time - self._began, (left / STEPS_PER_REVOLUTION, right / STEPS_PER_REVOLUTION)))
        elif time - self._last >= BETWEEN or isinstance(event.value, Steps):
            self._add_pose(time)

    def _add_pose(self, time: float) -> None:
        pose = self._true_pose()
        if pose is None:
            left, right = self.wheels
            steps = (time - self._last) * STEPS_PER_REVOLUTION
            pose = advanced(self.path[-1], left * steps, right * steps, time)
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

    def rows(self, outcome: RunResult | None) -> list[tuple[str, str]]:
        """Return the summary as label and text; *outcome* is None if an error ended the run."""
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
        if self.robots:
            rows += link_rows(merged([each.robot.statistics for each in self.robots]))
        return rows

    def draw(self, path: str, title: str) -> None:
        """Draw paths, states, and the speeds and readings of the first robot.

        Raises:
            ArgumentError: The file cannot be created.
            ElibError: The file cannot be written.
        """
        floor, trails = self._floor()
        charts: list[Chart] = []
        for robot in self.robots[:1]:
            whose = f"{robot.robot.name}: " if len(self.robots) > 1 else ""
            charts = charts_of(robot.speeds, robot.readings, whose)
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


def charts_of(speeds: Speeds, readings: Numbers, whose: str = "") -> list[Chart]:
    """Return the charts of one robot, with *whose* at the beginning of their titles."""
    charts = []
    if speeds:
        lines = list(zip(*(both for _, both in speeds), strict=True))
        charts.append(
            Chart(f"{whose}wheels, rev/s", [time for time, _ in speeds], lines, ("left", "right"), is_stepped=True)
        )
    for key, (name, labels) in SENSES.items():
        if read := readings.get(key):
            # The number of the microphones may change with the firmware in the middle of a recording.
            shown = list(zip(*(numbers for _, numbers in read), strict=False))
            charts.append(Chart(whose + name, [time for time, _ in read], shown, labels[: len(shown)]))
    return charts


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
