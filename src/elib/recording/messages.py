"""Translates the events of a link into the messages of a recording."""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from elib.errors import LinkClosed, Unsupported
from elib.pose import Pose
from elib.protocol.image import Image
from elib.protocol.table import Request
from elib.protocol.values import Reading, Sensors
from elib.recording.encoding import (
    bytes_message,
    call_message,
    outcome_message,
    picture_fields,
    reading_message,
)
from elib.recording.topics import (
    BYTES,
    CALLS,
    MEASURED,
    NOTES,
    ODOMETRY,
    OUTCOMES,
    PICTURES,
    READINGS,
    SCENE,
    WORLD,
    Topic,
)
from elib.session import (
    Called,
    Disconnected,
    Ended,
    Ending,
    Greeted,
    Received,
    Reconnected,
    ResetNoticed,
    Resynced,
    SessionOpened,
    TraceEvent,
    Wrote,
)

INFORMATION, WARNING = 2, 3
"""Levels of ``foxglove.Log``."""


@dataclass(frozen=True, slots=True)
class Noted:
    """A line that a person or a program wrote into the recording.

    Attributes:
        text: The line.
        kind: ``note``, ``state``, ``link``, ``robot`` or ``recorder``.
        level: 2 information, 3 warning, 4 error.
    """

    text: str
    kind: str = "note"
    level: int = INFORMATION


@dataclass(frozen=True, slots=True)
class Located:
    """A pose of the robot.

    Attributes:
        pose: The pose, with its time.
        is_measured: Whether it was measured from outside; otherwise it comes from the step counters.
    """

    pose: Pose
    is_measured: bool


@dataclass(frozen=True, slots=True)
class Observed:
    """The state of a simulated world.

    Attributes:
        state: The message of ``/world``, without its time.
        scene: The world as TOML if boxes or walls were added, moved or removed since the last one; otherwise empty.
    """

    state: Mapping[str, object]
    scene: str = ""


Event = TraceEvent | Noted | Located | Observed


class Message(NamedTuple):
    """One message.

    Attributes:
        time: s on the robot's clock.
        topic: Topic of the message.
        data: The fields of the topic's schema, or the message as JSON already.
        reading: Name of the reading after ``/readings/``; empty for other topics.
        value: The reading; None for other topics.
    """

    time: float
    topic: Topic
    data: Mapping[str, object] | bytes
    reading: str = ""
    value: Reading | None = None


class Translator:
    """Turns events into messages, and numbers the calls."""

    def __init__(self) -> None:
        self._count = 0
        self._open: dict[int, tuple[Request[object], deque[int]]] = {}
        self._makers: dict[type, Callable[..., Iterable[Message]]] = {
            Called: self._called,
            Ended: self._ended,
            Wrote: lambda time, event: (Message(time, BYTES, bytes_message(time, event.data, to_robot=True)),),
            Received: lambda time, event: (Message(time, BYTES, bytes_message(time, event.data, to_robot=False)),),
            SessionOpened: self._opened,
            Noted: lambda time, event: (_note(time, event.text, event.kind, level=event.level),),
            Located: self._located,
            Observed: self._observed,
            **dict.fromkeys((Resynced, Greeted, ResetNoticed, Disconnected, Reconnected, Ending), self._happened),
        }

    def messages(self, time: float, event: Event) -> Iterable[Message]:
        """Return the messages that are written for an event."""
        maker = self._makers.get(type(event))
        return () if maker is None else maker(time, event)

    def _called(self, time: float, event: Called) -> Iterable[Message]:
        request = event.request
        self._count += 1
        # Calls without arguments share one request object. It is kept here, so that its id() is not given to another.
        self._open.setdefault(id(request), (request, deque()))[1].append(self._count)
        return (Message(time, CALLS, call_message(time, self._count, request)),)

    def _ended(self, time: float, event: Ended) -> Iterable[Message]:
        request = event.request
        number = self._number_of(request)
        found = [Message(time, OUTCOMES, outcome_message(time, number, event))]
        if event.value is not None:
            for name, value in readings_in(request.name, event.value):
                found += _picture(time, value) if isinstance(value, Image) else _reading(time, name, value)
        return found

    def _number_of(self, request: Request[object]) -> int:
        """Return the number of a call that ended; 0 if the call was made before the recording began."""
        if id(request) not in self._open:
            return 0
        _, numbers = self._open[id(request)]
        number = numbers.popleft()
        if not numbers:
            del self._open[id(request)]
        return number

    def _opened(self, time: float, event: SessionOpened) -> Iterable[Message]:
        for when, each in event.opening:
            yield Message(when, BYTES, bytes_message(when, each.data, to_robot=isinstance(each, Wrote)))

    def _observed(self, time: float, event: Observed) -> Iterable[Message]:
        if event.scene:
            yield Message(time, SCENE, {"time": time, "scene": event.scene})
        yield Message(time, WORLD, {"time": time, **event.state})

    def _located(self, time: float, event: Located) -> Iterable[Message]:
        pose = event.pose
        half = pose.heading / 2
        data = {
            "frame_id": "world" if event.is_measured else "start",
            "pose": {
                "position": {"x": pose.x, "y": pose.y, "z": 0.0},
                "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)},
            },
            "time": pose.time,
            "heading": pose.heading,
        }
        return (Message(time, MEASURED if event.is_measured else ODOMETRY, data),)

    def _happened(self, time: float, event: TraceEvent) -> Iterable[Message]:
        match event:
            case Resynced(duration=duration, dropped=dropped):
                yield _note(
                    time,
                    f"the line was out of sync for {duration:.3f} s; {dropped} bytes were dropped",
                    "link",
                    "resynced",
                )
            case Greeted():
                yield _note(time, "the robot greeted unasked: it has restarted", "robot", "greeted", WARNING)
            case ResetNoticed(sign=sign):
                yield _note(time, f"the robot has restarted; its {sign} showed it", "robot", "reset", WARNING)
            case Disconnected(error=error):
                yield _note(time, f"the link is down: {error.message}", "link", "down", WARNING)
            case Reconnected(gap=gap, attempts=attempts):
                yield _note(time, f"the link is back after {gap:.3f} s and {attempts} attempts", "link", "back")
            case Ending(error=error):
                happened = "closed" if isinstance(error, LinkClosed) else "lost"
                yield _note(time, f"the session ended: {error.message}", "link", happened)
            case _:
                return


def readings_in(name: str, value: object) -> Iterator[tuple[str, Reading | Image]]:
    """Yield each reading in an answer with its name; one answer may hold the readings of several commands."""
    if isinstance(value, Sensors):
        for field in dataclasses.fields(value):
            each = getattr(value, field.name)
            if isinstance(each, Reading):
                yield field.name, each
    elif isinstance(value, dict):
        for key, each in value.items():
            yield from readings_in(str(key), each)
    elif isinstance(value, Reading | Image):
        yield name, value


def _reading(time: float, name: str, value: Reading) -> Iterable[Message]:
    if not math.isfinite(value.time):
        value = dataclasses.replace(value, time=time)
    return (Message(value.time, READINGS, reading_message(value), name, value),)


def _picture(time: float, picture: Image) -> Iterable[Message]:
    if not math.isfinite(picture.time):
        picture = dataclasses.replace(picture, time=time)
    try:
        return (Message(picture.time, PICTURES, picture_fields(picture)),)
    except (Unsupported, ValueError):
        return ()  # its bytes are in the recording


def _note(time: float, text: str, kind: str, happened: str = "", level: int = INFORMATION) -> Message:
    data = {"level": level, "message": text, "name": kind, "event": happened, "time": time}
    return Message(time, NOTES, data)
