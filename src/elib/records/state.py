"""The state of a robot at one moment of its recording, from which a simulation can continue."""

from __future__ import annotations

import contextlib
import math
from bisect import insort
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from elib.base.body import step_rate
from elib.base.errors import ArgumentError, ElibError
from elib.base.pose import Pose, advanced
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context, LastSet
from elib.link.protocol.profiles import profile_named
from elib.link.protocol.table import Request, Spec
from elib.records.reader import Entry, Recording
from elib.records.topics import CALLS, MEASURED, ODOMETRY, OUTCOMES, READINGS, SCENE, WORLD

TOPICS = (CALLS, OUTCOMES, READINGS, MEASURED, ODOMETRY, WORLD, SCENE)
"""Topics whose messages change the state."""
ROUNDING = 1e-9
"""s. Times that differ by less are equal."""


@dataclass(slots=True)
class RobotState:
    """A robot at one moment of a recording."""

    time: float  # s on the robot's clock
    pose: Pose
    is_measured: bool  # whether the pose was measured
    speed: tuple[int, int] = (0, 0)  # wheel speeds that were set last, steps/s
    steps: tuple[int, int] = (0, 0)  # the step counters
    memory: LastSet = field(default_factory=LastSet)  # the last settings of lamps and camera
    # the last message of `/world` before the moment; None without a simulated world
    world: Mapping[str, Any] | None = None
    # the last message of `/scene` before the moment: the simulated world as TOML; empty if there is none
    scene: str = ""


def state_at(recording: Recording, seconds: float) -> RobotState:
    """Return the robot's state at a moment of a recording.

    Args:
        recording: The recording.
        seconds: The moment, s since the recording began, from its first message to its last message.
    """
    reader = _StateReader(recording, recording.began + seconds)
    first, last = math.inf, -math.inf
    for entry in recording.entries(*(topic.name for topic in TOPICS)):
        first, last = min(first, entry.time), max(last, entry.time)
        reader.take(entry)
    if not (first - recording.began - ROUNDING <= seconds <= last - recording.began + ROUNDING):
        begin, end = max(0.0, first - recording.began), max(0.0, last - recording.began)
        there = f"is {end:.3f} s long" if begin < 1 else f"has {begin:.3f} s to {end:.3f} s of its run"
        raise ArgumentError(f"{recording.name} {there}; {seconds:g} s is not in it")
    return reader.state()


def request_again(spec: Spec[Any], numbers: Sequence[int], context: Context) -> Request[Any]:
    """Return the request of a recorded call, whose *numbers* are whole ones of the wire."""
    if len(numbers) != len(spec.parameters):
        raise ArgumentError(f"{spec.name} takes {len(spec.parameters)} arguments, not {len(numbers)}")
    scales = [parameter.quantity.scale for parameter in spec.parameters]
    values = [number / scale if scale else number for number, scale in zip(numbers, scales, strict=True)]
    return spec.request(context, **{each.name: value for each, value in zip(spec.parameters, values, strict=True)})


def done_at(outcome: Entry) -> float | None:
    """Return when the robot did a command, s; None if it did not do it, as far as is known."""
    data = outcome.data
    trip = data["round_trip"] or 0.0
    is_lost = not data["ok"] and data["round_trip"] is not None and data["error"].startswith("ReplyTimeout")
    if is_lost:  # it may have been done: the time of sending is all that is known
        return outcome.time - trip
    if not data["ok"]:
        return None
    if data["command"] in ("stop", "reset"):  # done as it arrives, however long the confirmation takes
        return outcome.time - trip
    return outcome.time - trip / 2


class _StateReader:
    """Follows the messages of a recording up to a moment."""

    def __init__(self, recording: Recording, time: float) -> None:
        self._time = time
        self._context = Context(profile_named(recording.about["firmware"]))
        self._arguments: dict[int, tuple[int, ...]] = {}
        self._speeds: list[tuple[float, int, tuple[int, int]]] = [(-math.inf, 0, (0, 0))]
        self._steps: tuple[float, tuple[int, int]] = (recording.began, (0, 0))
        self._poses: dict[str, list[Pose]] = {MEASURED.name: [], ODOMETRY.name: []}
        self._world: Mapping[str, Any] | None = None
        self._scene = ""
        self._half = 0.0

    def take(self, entry: Entry) -> None:
        """Take a message. After the moment only wheel commands and the next pose matter."""
        if entry.topic in self._poses:
            # Only the last pose before the moment matters, and the first pose after it.
            poses = self._poses[entry.topic]
            if len(poses) > 1 and poses[-1].time <= self._time:
                poses.pop(0)
            if not poses or poses[-1].time <= self._time:
                poses.append(entry.pose)
        elif entry.topic == CALLS.name:
            self._arguments[entry.data["call"]] = tuple(entry.data["arguments"])
        elif entry.topic == OUTCOMES.name:
            self._ended(entry)
        elif entry.topic == f"{READINGS.name}encoders":
            # The counters were read half-way between the question and the answer.
            when = entry.time - self._half
            if when <= self._time:
                self._steps = when, (entry.data["left"], entry.data["right"])
        elif entry.topic == WORLD.name and entry.time <= self._time:
            self._world = entry.data
        elif entry.topic == SCENE.name and entry.time <= self._time:
            self._scene = entry.data["scene"]

    def _ended(self, entry: Entry) -> None:
        """Take the end of a call into account, at the time when the robot probably did it."""
        call = entry.data["call"]
        arguments = self._arguments.pop(call, ())
        self._half = (entry.data["round_trip"] or 0.0) / 2
        spec = SPECS.get(entry.data["command"])
        when = None if spec is None else done_at(entry)
        if spec is None or when is None:
            return
        wheels = (arguments[0], arguments[1]) if len(arguments) == 2 else (0, 0)
        if spec.name in ("set_speed", "stop", "reset"):  # also after the moment: needed up to the next pose
            # A call that a newer one replaced before it was sent ends together with that one.
            insort(self._speeds, (when, call, wheels))
        if when >= self._time:
            return
        if spec.remember is not None:
            with contextlib.suppress(ElibError):  # what a damaged call has set is not known
                request_again(spec, arguments, self._context).confirmed(self._context)
        if spec.name in ("set_encoders", "reset"):
            self._steps = when, wheels

    def state(self) -> RobotState:
        """Return the state at the moment."""
        is_measured = bool(self._poses[MEASURED.name])
        since, (left, right) = self._steps
        more = self._turned(since, self._time)
        speed = next(speed for when, _, speed in reversed(self._speeds) if when < self._time)
        return RobotState(
            self._time,
            self._pose(self._poses[MEASURED.name if is_measured else ODOMETRY.name]),
            is_measured,
            speed,
            (left + round(more[0]), right + round(more[1])),
            self._context.last_set,
            self._world,
            self._scene,
        )

    def _pose(self, poses: list[Pose]) -> Pose:
        """Return the pose at the moment: between two recorded poses, or after the last one by the wheel commands."""
        if not poses:
            return Pose(0.0, 0.0, 0.0, time=self._time)
        first, last = poses[0], poses[-1]
        if last.time <= self._time:
            return advanced(last, *self._turned(last.time, self._time), self._time)
        if last is first or first.time > self._time:
            return Pose(first.x, first.y, first.heading, time=self._time)
        # The path by the wheel commands is shifted bit by bit so that it ends at the next recorded pose: the true size
        # of the wheels is not known.
        before = poses[-2]
        here = advanced(before, *self._turned(before.time, self._time))
        goal = advanced(before, *self._turned(before.time, last.time))
        share = (self._time - before.time) / (last.time - before.time)
        return Pose(
            here.x + share * (last.x - goal.x),
            here.y + share * (last.y - goal.y),
            math.remainder(here.heading + share * math.remainder(last.heading - goal.heading, math.tau), math.tau),
            time=self._time,
        )

    def _turned(self, since: float, until: float) -> tuple[float, float]:
        """Return the steps of both wheels between two times, at the rates that the firmware makes of the commands."""
        ends = [time for time, _, _ in self._speeds[1:]] + [math.inf]
        generation = self._context.profile.generation
        left = right = 0.0
        for (begin, _, speed), end in zip(self._speeds, ends, strict=True):
            seconds = min(end, until) - max(begin, since)
            if seconds > 0:
                left += step_rate(speed[0], generation) * seconds
                right += step_rate(speed[1], generation) * seconds
        return left, right
