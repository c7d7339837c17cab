"""The recorder: it writes everything that happens on a link into a file that survives a crash of the program."""

from __future__ import annotations

import glob
import math
import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Protocol, Self, runtime_checkable

from elib.base.errors import ArgumentError, ElibError
from elib.base.pose import Pose
from elib.base.rules import Lines, Number, Text, Whole
from elib.link.session import Ended, Ending, Noted, Pushed, Reconnected, Robot, SessionOpened, TraceEvent
from elib.records.background import CLOSING_TIME, Background
from elib.records.mcapfile import Parts, check_mcap, exists, versions
from elib.records.messages import Event, Located, Observed
from elib.records.topics import FORMAT, MAX_NUMBER

ROBOT_CLOSING_TIME = 0.2
"""s of real time for which closing a robot waits for its recording: closing must be quick, however slow the disk is."""
MAX_EVENTS = 200_000
"""Number of events that may wait for a slow disk; more are lost, and the recording says how many."""
MANY_EVENTS = 20_000
"""Number of events that are written at once, without gathering more."""
GATHERED = 0.3
"""s of real time for which events are gathered into a chunk. With the time it takes to write them, also on a busy
processor, they are in the file within a second."""
PART_BYTES, PART_SECONDS, KEEP = Number(10_000, unit="bytes"), Number(1, unit="s"), Whole(2)
"""Rules for the parts of a recording. A part of less would hold little more than its own header."""
NOTE, KIND, MEASURED = Lines(500_000), Text(), Number(-MAX_NUMBER, MAX_NUMBER)
"""Rules for what a program adds: what they allow, every reader takes."""
OBSERVING_PERIOD = 0.1
"""s of robot time between two recorded states of a simulated world."""
CHECKING_PERIOD = 1.0
"""s of robot time between two recorded states of the link."""


@runtime_checkable
class Observable(Protocol):
    """A transport that leads into a world which can be looked at: a simulation."""

    @property
    def layout(self) -> object:
        """Another object whenever something was added to the world or removed from it."""

    def describe(self) -> Mapping[str, str]:
        """Return the world by name, its seed and its file: ``world``, ``seed``, ``robot``, ``scene``."""
        ...

    def observe(self) -> tuple[Pose, Mapping[str, object]] | None:
        """Return where the robot is and the message of ``/world``; None where there is nothing to see."""
        ...


class Tap:
    """Gives a function everything that a recording holds of an open robot, until :meth:`leave`.

    Args:
        robot: An open robot.
        put: Called with a time, s on the robot's clock, and an event: first by the caller, then in the event loop.
        began: The time of the beginning.
        on_ending: Called when the robot's link has ended for good.
    """

    def __init__(
        self,
        robot: Robot,
        put: Callable[[tuple[float, Event]], object],
        began: float,
        on_ending: Callable[[], object],
    ) -> None:
        self._robot, self._put, self._on_ending = robot, put, on_ending
        self._channel = robot.session
        self._pose = robot.odometry_pose
        self._observed = self._checked = -math.inf
        transport = self._channel.transport
        self._layout = transport.layout if isinstance(transport, Observable) else None
        self._is_in_world = isinstance(transport, Observable) and "world" in transport.describe()
        put((began, SessionOpened(self._channel.opening)))
        self._locate(began, replace(self._pose, time=began))
        self._observe(began)
        self._channel.hooks.append(self._see)

    def leave(self) -> None:
        """Give no more events. Safe to repeat."""
        self._channel.hooks.remove(self._see)

    def _see(self, time: float, event: TraceEvent) -> None:
        self._put((time, event))
        if isinstance(event, Ended | Pushed):
            if event.value is not None and (pose := self._robot.odometry_pose) is not self._pose:
                self._pose = pose
                self._locate(time, pose)
            if time - self._observed >= OBSERVING_PERIOD:
                self._observe(time)
            if time - self._checked >= CHECKING_PERIOD:
                self._checked = time
                self._put((time, self._robot.statistics))
        elif isinstance(event, Reconnected):
            self._observe(time)
        elif isinstance(event, Ending) and self._channel.error is not None:
            self._on_ending()

    def _locate(self, time: float, pose: Pose) -> None:
        self._put((time, Located(pose, is_measured=False, moves_frame=not self._is_in_world)))

    def _observe(self, time: float) -> None:
        transport = self._channel.transport
        if isinstance(transport, Observable) and (seen := transport.observe()) is not None:
            self._observed = time
            pose, state = seen
            is_rebuilt = transport.layout is not self._layout
            self._layout = transport.layout
            self._put((time, Located(pose, is_measured=True, moves_frame=True)))
            self._put((time, Observed(state, transport.describe().get("scene", "") if is_rebuilt else "")))


class Recorder:
    """Records a robot until the recorder or the robot is closed. Any thread may use it; no method waits for the disk.

    Everything older than a second of real time is in the file, even if the program is killed.

    Args:
        robot: An open robot.
        path: Path of the file, ``.mcap``; it must not exist. Later parts are called ``NAME.part2.mcap`` and so on.
        part_bytes: Size after which the next part begins, bytes, 10 000 at least; None for one file.
        part_seconds: Robot time after which the next part begins, s, 1 at least; None for one file.
        keep: Number of newest parts that are kept, 2 at least; None for all.

    Raises:
        ArgumentError: The file exists, its name does not end in ``.mcap``, or a number is out of range.
        Unsupported: The package mcap is not installed.
        OSError: The file cannot be opened.
    """

    def __init__(
        self,
        robot: Robot,
        path: str | os.PathLike[str],
        *,
        part_bytes: int | None = None,
        part_seconds: float | None = None,
        keep: int | None = None,
    ) -> None:
        check_new(path, part_bytes=part_bytes, part_seconds=part_seconds, keep=keep)
        self.path = Path(path)
        self._robot = robot
        began = robot.time
        about = _about(robot, began)
        self._parts = Parts(self.path, about, began, about.pop("scene", ""), part_bytes, part_seconds, keep)
        self._work: Background[tuple[float, Event]] = Background(
            f"the recording {self.path}",
            self._parts.write,
            self._parts.finish,
            most=MAX_EVENTS,
            many=MANY_EVENTS,
            gathered=GATHERED,
        )
        self._put = self._work.put
        self._tap = Tap(robot, self._put, began, self._end)

    @property
    def is_closed(self) -> bool:
        """Whether the recording has ended."""
        return self._work.is_closed

    @property
    def is_whole(self) -> bool:
        """Whether everything could be written so far."""
        return self._work.error is None

    @property
    def messages(self) -> int:
        """Number of messages in the file, or in all parts together."""
        return self._parts.messages

    @property
    def size(self) -> int:
        """Size of the file, or of all parts together, bytes."""
        return self._parts.size

    def note(self, text: str, *, kind: str = "note") -> None:
        """Write a line into the recording.

        Args:
            text: The line, at most 500,000 characters.
            kind: Kind of note: ``note``, or ``state`` for the state of a behaviour.

        Raises:
            ArgumentError: One of them is no such text.
            ElibError: The recording is closed or cannot be written.
        """
        self._check_open()
        self._put((self._robot.time, Noted(NOTE.require(text, "the note"), KIND.require(kind, "kind"))))

    def measured(self, x: float, y: float, heading: float) -> None:
        """Record the true pose of the robot, measured with a ruler or with a camera above it.

        Args:
            x: Position along the x axis, m.
            y: Position along the y axis, m.
            heading: Angle from the x axis, positive to the left, rad.

        Raises:
            ArgumentError: A number is not finite, or beyond all lengths.
            ElibError: The recording is closed or cannot be written.
        """
        self._check_open()
        now, named = self._robot.time, (("x", x), ("y", y), ("heading", heading))
        pose = Pose(*(MEASURED.require(value, name) for name, value in named), time=now)
        self._put((now, Located(pose, is_measured=True)))

    def close(self) -> None:
        """Write what is left and the index, and close the file. It is safe to call this again.

        Raises:
            ElibError: The recording could not be written.
        """
        self._tap.leave()
        if not self._work.end():
            raise ElibError(
                f"the recording {self.path} did not take its last events within {CLOSING_TIME:g} s",
                hint="what is in it can be read: elib record repair FILE",
            )
        self._check()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.path} {'closed' if self.is_closed else 'running'}>"

    def _end(self) -> None:
        """End with the robot."""
        self._tap.leave()
        self._work.end(ROBOT_CLOSING_TIME)

    def _check_open(self) -> None:
        self._check()
        if self._work.is_closed:
            raise ElibError(
                f"the recording {self.path} is closed",
                hint="robot.record(...) begins another one; a recording ends with its robot",
            )

    def _check(self) -> None:
        error = self._work.error
        if error is not None:
            raise ElibError(
                f"the recording {self.path} could not be written: {error}",
                hint="is there room on the disk? what is in it can be read: elib record repair FILE",
            ) from error


def check_new(
    path: str | os.PathLike[str],
    *,
    part_bytes: int | None = None,
    part_seconds: float | None = None,
    keep: int | None = None,
) -> None:
    """Check the arguments of a recording before a robot is opened for it."""
    check_mcap()
    path = Path(path)
    if path.suffix.lower() != ".mcap":
        raise ArgumentError(f"a recording cannot be called {os.fspath(path)!r}; its name must end in .mcap")
    parts = {"part_bytes": (part_bytes, PART_BYTES), "part_seconds": (part_seconds, PART_SECONDS), "keep": (keep, KEEP)}
    for name, (number, rule) in parts.items():
        if number is not None:
            rule.require(number, name)
    if keep is not None and part_bytes is None and part_seconds is None:
        raise ArgumentError("keep counts parts, but the recording has one file", hint="set part_bytes or part_seconds")
    there_are = path.parent.glob(f"{glob.escape(path.stem)}.part*{path.suffix}")
    for there in (path, *sorted(there_are)):
        if there.exists():
            raise exists(there)


def _about(robot: Robot, began: float) -> dict[str, str]:
    """Return the facts about a recording, with the file of the simulated world as ``scene``."""
    session = robot.session
    transport = session.transport
    about = {
        "format": FORMAT,
        **versions(),
        "robot": robot.name,
        "url": robot.url,
        "origin": transport.origin,
        "firmware": session.context.profile.name,
        "version": session.version.text,
        "hardware": session.version.hardware,
        "began": repr(began),
        "calls_before": str(robot.call_count),
        "program": " ".join(sys.argv),
    }
    return {**about, **transport.describe()} if isinstance(transport, Observable) else about
