"""What robots did: their paths in their world, the speeds that they were told, and what they sensed; and the plots."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from os import PathLike, fspath
from typing import Self

from elib.base.body import STEPS_PER_REVOLUTION
from elib.base.pose import advanced, apart
from elib.base.timebase import running_loop
from elib.link.protocol import values as v
from elib.link.session import Ended, TraceEvent
from elib.records.reader import Recording
from elib.records.timeline import timeline
from elib.robot.aio import Epuck
from elib.simulator.emulator.sim_transport import SimTransport
from elib.simulator.emulator.simulation import Simulation
from elib.simulator.physics import Pose, RobotView, Snapshot, World
from elib.simulator.worlds.files import parse
from elib.studies.report import Chart, check_report, draw_report

MARGIN = 0.10
"""m of free floor around a path whose surroundings are unknown."""
MIN_FLOOR = 0.5
"""m, so that a robot that hardly moved is not drawn as large as the picture."""


BETWEEN = 0.1
"""Smallest time from one point of a path to the next, s: a robot moves 13 mm in it at most."""

MAX_PARTS = 1000
"""Points into which one stretch of a path without a world is divided at most."""

Sensed = v.Proximity | v.AmbientLight | v.Ground | v.Microphones
SENSES: dict[str, tuple[str, tuple[str, ...]]] = {
    name: (
        f"{v.in_words(name)}, counts",
        tuple(v.in_words(each) for info in v.describe(kind, v.Role.NUMBER) for each in info.names or (info.name,)),
    )
    for name, kind in v.READING_TYPES.items()
    if issubclass(kind, Sensed)
}
"""The readings that a plot shows, by name: its title for them, and the names of their numbers."""

Speeds = list[tuple[float, tuple[float, float]]]
"""Times, s since the beginning, and the wheel speeds told then, rev/s."""
Numbers = dict[str, list[tuple[float, tuple[float, ...]]]]
"""For the name of each reading: times, s since the beginning, and the numbers read then."""


def simulation_of(robot: Epuck) -> tuple[Simulation | None, int]:
    """Return the simulation in this process that an open robot is in, and its index there; None without a world."""
    transport = robot.session.transport
    if isinstance(transport, SimTransport) and transport.simulation.world is not None:
        return transport.simulation, transport.robot.index
    return None, 0


class RobotReport:
    """The report of what one robot did, from when this is made until the robot is closed.

    Attributes:
        index: Its index in that world.
        contacts: How often it began to touch something; only known in a world.
        contact_time: How long it touched something, s.
    """

    def __init__(self, robot: Epuck, began: float | None = None) -> None:
        self.robot = robot
        self.speeds: Speeds = []  # the speeds that the wheels were told
        self.readings: Numbers = {}  # the readings that a plot shows
        self.contacts, self.contact_time, self._is_touching = 0, 0.0, False
        self.is_closed = False  # whether the report has ended
        self._began = self._last = self._end = robot.time if began is None else began
        self._simulation, self.index = simulation_of(robot)
        self.world = None  # the world that the robot is in, if it is simulated in this process
        if self._simulation is not None:
            self._simulation.catch_up()
            self.world = self._simulation.world
        # the poses of the robot, oldest first: from its world, else from the speeds that its wheels were told
        self.path = [self._true_pose() or Pose(0.0, 0.0)]
        robot.trace(self._note)
        self._unfollow: Callable[[], None] = lambda: None
        if self.world is not None:
            self._unfollow = self.world.follow(self._on_tick)

    @property
    def time(self) -> float:
        """How long the run has lasted, or did, s on the robot's clock."""
        return (self._end if self.is_closed else self.robot.time) - self._began

    @property
    def distance(self) -> float:
        """Length of the path, m."""
        return math.fsum(apart(a, b) for a, b in pairwise(self.path))

    @property
    def wheels(self) -> tuple[float, float]:
        """The speeds that the wheels were told last, rev/s."""
        return self.speeds[-1][1] if self.speeds else (0.0, 0.0)

    def close(self) -> None:
        """End the report. Safe to repeat."""
        if not self.is_closed:
            if self._simulation is not None and self._simulation.loop is running_loop():
                self._simulation.catch_up()
            self._end, self.is_closed = self.robot.time, True
            self._unfollow()

    def _true_pose(self) -> Pose | None:
        return None if self.world is None else self.world.pose(self.index)

    def _on_tick(self) -> None:
        """Take what the world knows after each of its ticks."""
        assert self.world is not None
        step = self.world.scene.step
        was, self._is_touching = self._is_touching, self.world.touching(self.index)
        self.contacts += self._is_touching and not was
        self.contact_time += step * self._is_touching
        if self.world.tick % max(1, round(BETWEEN / step)) == 0:
            self._add(self.world.pose(self.index))

    def _note(self, time: float, event: TraceEvent) -> None:
        """Take an event of the link; a trace hook."""
        if not isinstance(event, Ended) or event.error is not None:
            return
        if isinstance(event.value, Sensed):
            numbers = self.readings.setdefault(v.reading_name(type(event.value)), [])
            numbers.append((time - self._began, tuple(event.value)))
        name = event.request.name
        steps = (0, 0) if name in ("stop", "reset") else event.request.numbers
        if name in ("set_speed", "stop", "reset") and len(steps) == 2:
            self._add_poses(time)
            left, right = steps
            self.speeds.append((time - self._began, (left / STEPS_PER_REVOLUTION, right / STEPS_PER_REVOLUTION)))
        elif time - self._last >= BETWEEN or isinstance(event.value, v.Steps):
            self._add_poses(time)

    def _add_poses(self, time: float) -> None:
        pose = self._true_pose()
        if pose is not None:
            self._add(pose)
        else:
            left, right = self.wheels
            # An arc is drawn as an arc even if the program waited in it.
            parts = min(max(1, math.ceil((time - self._last) / BETWEEN)), MAX_PARTS)
            steps = (time - self._last) * STEPS_PER_REVOLUTION / parts
            for _ in range(parts):
                self._add(advanced(self.path[-1], left * steps, right * steps, time))
        self._last = time

    def _add(self, pose: Pose) -> None:
        if pose != self.path[-1]:
            self.path.append(pose)


class Plot:
    """A plot of what a robot does from now on: :meth:`elib.Epuck.plot` makes it.

    It is drawn when the robot is closed, or when this is.

    Args:
        robot: An open robot.
        path: File to write, ending in ``.png``, ``.svg`` or ``.pdf``; an existing one is replaced.

    Raises:
        ArgumentError: The name ends otherwise, or there is no such folder.
        Unsupported: Matplotlib is not installed.
    """

    def __init__(self, robot: Epuck, path: str | PathLike[str]) -> None:
        check_report(path)
        self.path = fspath(path)  # the file
        self.report = RobotReport(robot)  # what is drawn
        self.is_closed = False  # whether it was drawn

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Draw it now. Safe to repeat.

        Raises:
            ArgumentError: The file cannot be created.
            ElibError: The disk is full.
        """
        if not self.is_closed:
            self.is_closed = True
            self.report.close()
            draw_drive(self.path, self.report.robot.name, [self.report], seconds=self.report.time)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.path} {'drawn' if self.is_closed else 'not drawn yet'}>"


def draw_drive(
    path: str | PathLike[str],
    title: str,
    robots: Sequence[RobotReport],
    *,
    seconds: float,
    states: Sequence[tuple[float, str]] = (),
) -> None:
    """Draw paths, states, and the speeds and readings of the first robot, in whose world the others on the map are."""
    floor, trails = floor_of(robots)
    first = robots[:1]
    distance = math.fsum(robot.distance for robot in robots) if robots else math.nan
    draw_report(
        path,
        title=f"{title}, {seconds:.1f} s, {distance:.2f} m",
        floor=floor,
        trails=trails,
        charts=[
            chart
            for each in first
            for chart in charts_of(each.speeds, each.readings, f"{each.robot.name}: " if len(robots) > 1 else "")
        ],
        states=states,
        seconds=seconds,
    )


def draw_recording(recording: Recording, path: str | PathLike[str]) -> None:
    """Draw a recording: the path, and speeds, readings and states over time."""
    moments = sorted(timeline(recording), key=lambda moment: moment.time)
    length = max((moment.time for moment in moments), default=0.0)
    floor, trails = _recorded_floor(recording)
    draw_report(
        path,
        title=f"{recording.name}: {recording.about['robot']}, {length:.1f} s",
        floor=floor,
        trails=trails,
        charts=charts_of(
            [(moment.time, moment.speed) for moment in moments if moment.speed is not None],
            {name: [(each.time, each.readings[name]) for each in moments if name in each.readings] for name in SENSES},
        ),
        states=[(moment.time, moment.text) for moment in moments if moment.kind == "state"],
        seconds=length,
    )


def _recorded_floor(recording: Recording) -> tuple[Snapshot | None, list[list[Pose]]]:
    """Return the recorded world with the robot at the end of its path, and the path; None without a path."""
    measured = recording.path(measured=True)
    path = measured or recording.path(measured=False)
    if not path:
        return None, []
    if not (measured and recording.scene):
        return floor_around([path], "by its step counters")
    count, index = int(recording.about.get("robots", "1")), int(recording.about.get("robot_index", "0"))
    snapshot = World(parse(recording.scene.encode(), recording.name, robots=count), robots=count).snapshot()
    robots = tuple(
        dataclasses.replace(robot, pose=path[-1]) if number == index else robot
        for number, robot in enumerate(snapshot.robots)
    )
    return dataclasses.replace(snapshot, robots=robots, time=path[-1].time), [path]


def floor_of(robots: Sequence[RobotReport]) -> tuple[Snapshot | None, list[list[Pose]]]:
    """Return the surroundings as they are now, and each robot's path in them; None without a robot."""
    if not robots:
        return None, []
    world = robots[0].world
    if world is None:
        return floor_around([robot.path for robot in robots if robot.world is None], "as the wheels were told")
    trails: list[list[Pose]] = [[] for _ in range(world.robots)]
    for robot in robots:
        if robot.world is world:
            trails[robot.index] += robot.path
    return world.snapshot(), trails


def floor_around(paths: Sequence[Sequence[Pose]], name: str) -> tuple[Snapshot, list[list[Pose]]]:
    """Return a free floor around paths in unknown surroundings, with the robots at their ends, and the paths on it."""
    poses = [pose for path in paths for pose in path] or [Pose(0.0, 0.0)]
    left, below = MARGIN - min(pose.x for pose in poses), MARGIN - min(pose.y for pose in poses)
    moved = [[dataclasses.replace(pose, x=pose.x + left, y=pose.y + below) for pose in path] for path in paths]
    width = max(left + MARGIN + max(pose.x for pose in poses), MIN_FLOOR)
    depth = max(below + MARGIN + max(pose.y for pose in poses), MIN_FLOOR)
    robots = tuple(RobotView(path[-1]) for path in moved if path)
    return Snapshot(name, 0, 0.0, width, depth, robots=robots), moved


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
