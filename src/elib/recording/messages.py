"""From what happens on a link to the messages of a recording."""

from __future__ import annotations

import base64
import dataclasses
import enum
import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeVar

from elib.errors import LinkClosed, Unsupported
from elib.pose import Pose
from elib.protocol.image import Image
from elib.protocol.table import Request
from elib.protocol.values import Acceleration, AngularVelocity, Reading, Sensors
from elib.recording.topics import (
    BYTES,
    CALLS,
    MEASURED,
    NOTES,
    ODOMETRY,
    OUTCOMES,
    PICTURES,
    READINGS,
    WORLD,
    Topic,
)
from elib.session import (
    Called,
    Ended,
    Ending,
    Fenced,
    Greeted,
    LinkBack,
    LinkDown,
    Opened,
    Received,
    ResetNoticed,
    TraceEvent,
    Wrote,
)

R = TypeVar("R", bound=Reading)

INFORMATION, WARNING, ERROR = 2, 3, 4
"""Levels of ``foxglove.Log``."""


@dataclass(frozen=True, slots=True)
class Noted:
    """A line that somebody wrote into the recording.

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
    """Where the robot is.

    Attributes:
        pose: With its time.
        is_measured: From outside, not by its step counters.
    """

    pose: Pose
    is_measured: bool


@dataclass(frozen=True, slots=True)
class Observed:
    """Where everything stands in a simulated world.

    Attributes:
        state: Message of ``/world``, without its time.
    """

    state: Mapping[str, object]


Event = TraceEvent | Noted | Located | Observed


@dataclass(frozen=True, slots=True)
class Message:
    """One message.

    Attributes:
        time: s on the robot's clock.
        topic: Which channel.
        reading: Name of the reading below ``/readings/``, or empty.
        data: What the channel's schema says.
    """

    time: float
    topic: Topic
    data: Mapping[str, object]
    reading: str = ""


class Translator:
    """Makes messages of events; it numbers the calls."""

    def __init__(self) -> None:
        self._count = 0
        self._open: dict[int, tuple[Request[object], deque[int]]] = {}
        self._makers: dict[type, Callable[..., Iterator[Message]]] = {
            Called: self._called,
            Ended: self._ended,
            Wrote: self._wrote,
            Received: self._received,
            Opened: self._opened,
            Noted: self._noted,
            Located: self._located,
            Observed: self._observed,
            **dict.fromkeys((Fenced, Greeted, ResetNoticed, LinkDown, LinkBack, Ending), self._happened),
        }

    def messages(self, time: float, event: Event) -> Iterator[Message]:
        """Yield what is written for an event."""
        maker = self._makers.get(type(event))
        if maker is not None:
            yield from maker(time, event)

    def _called(self, time: float, event: Called) -> Iterator[Message]:
        request = event.request
        self._count += 1
        # Calls without arguments share one request. It is kept so that no other one is given its identity meanwhile.
        self._open.setdefault(id(request), (request, deque()))[1].append(self._count)
        data = {"call": self._count, "command": request.name, "text": request.text, "arguments": request.numbers}
        yield Message(time, CALLS, {"time": time, **data})

    def _ended(self, time: float, event: Ended) -> Iterator[Message]:
        number = self._number_of(event.request)
        error = event.error
        yield Message(
            time,
            OUTCOMES,
            {
                "time": time,
                "call": number,
                "command": event.request.name,
                "ok": error is None,
                "error": "" if error is None else f"{type(error).__name__}: {error}".removesuffix(": "),
                "waited": event.waited,
                "round_trip": None if math.isnan(event.round_trip) else event.round_trip,
            },
        )
        for name, value in readings_in(event.request.name, event.value):
            message = _picture(value) if isinstance(value, Image) else _reading(name, value)
            if message is not None:
                yield message

    def _number_of(self, request: Request[object]) -> int:
        """Return the number of a call that ended; 0 if it was made before the recording began."""
        if id(request) not in self._open:
            return 0
        _, numbers = self._open[id(request)]
        number = numbers.popleft()
        if not numbers:
            del self._open[id(request)]
        return number

    def _wrote(self, time: float, event: Wrote) -> Iterator[Message]:
        yield _bytes(time, event.data, to_robot=True)

    def _received(self, time: float, event: Received) -> Iterator[Message]:
        yield _bytes(time, event.data, to_robot=False)

    def _opened(self, time: float, event: Opened) -> Iterator[Message]:
        for when, each in event.opening:
            yield _bytes(when, each.data, to_robot=isinstance(each, Wrote))

    def _noted(self, time: float, event: Noted) -> Iterator[Message]:
        yield _note(time, event.text, event.kind, level=event.level)

    def _located(self, time: float, event: Located) -> Iterator[Message]:
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
        yield Message(time, MEASURED if event.is_measured else ODOMETRY, data)

    def _observed(self, time: float, event: Observed) -> Iterator[Message]:
        yield Message(time, WORLD, {"time": time, **event.state})

    def _happened(self, time: float, event: TraceEvent) -> Iterator[Message]:
        match event:
            case Fenced(duration=duration, dropped=dropped):
                yield _note(
                    time, f"the line was in doubt for {duration:.3f} s; {dropped} bytes were dropped", "link", "fenced"
                )
            case Greeted():
                yield _note(time, "the robot greeted unasked: it has restarted", "robot", "greeted", WARNING)
            case ResetNoticed(sign=sign):
                yield _note(time, f"the robot has restarted; its {sign} showed it", "robot", "reset", WARNING)
            case LinkDown(error=error):
                yield _note(time, f"the link is down: {error.message}", "link", "down", WARNING)
            case LinkBack(gap=gap, attempts=attempts):
                yield _note(time, f"the link is back after {gap:.3f} s and {attempts} attempts", "link", "back")
            case Ending(error=error):
                happened = "closed" if isinstance(error, LinkClosed) else "lost"
                yield _note(time, f"the session ended: {error.message}", "link", happened)
            case _:
                return


def readings_in(name: str, value: object) -> Iterator[tuple[str, Reading | Image]]:
    """Yield each reading that an answer holds, with its name: of one command, or of several in one request."""
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


def fields_of(value: Reading) -> dict[str, object]:
    """Return a reading by its fields, with time and origin, and in SI units where the firmware sends raw counts."""
    data = {
        field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value) if field.name != "origin"
    }
    if isinstance(value, Acceleration):
        data["g"] = list(value.g)
    elif isinstance(value, AngularVelocity):
        data["rad_per_s"] = list(value.rad_per_s)
    return {**data, "origin": value.origin}


def _reading(name: str, value: Reading) -> Message:
    return Message(value.time, READINGS, fields_of(value), name)


def _picture(picture: Image) -> Message | None:
    try:
        pixels = picture.pixels
    except Unsupported:
        return None  # its bytes are in the recording all the same
    data = {
        "frame_id": "camera",
        "width": picture.width,
        "height": picture.height,
        "encoding": "rgb8" if pixels.ndim == 3 else "mono8",
        "step": pixels.strides[0],
        "data": base64.b64encode(pixels.tobytes()).decode("ascii"),
        "time": picture.time,
    }
    return Message(picture.time, PICTURES, data)


def _bytes(time: float, data: bytes, *, to_robot: bool) -> Message:
    text = base64.b64encode(data).decode("ascii")
    return Message(time, BYTES, {"time": time, "to_robot": to_robot, "data": text})


def _note(time: float, text: str, kind: str, happened: str = "", level: int = INFORMATION) -> Message:
    data = {"level": level, "message": text, "name": kind, "event": happened, "time": time}
    return Message(time, NOTES, data)


def _plain(value: object) -> object:
    if isinstance(value, enum.Enum):
        return value.name
    return list(value) if isinstance(value, tuple) else value


__all__ = ["Event", "Located", "Message", "Noted", "Observed", "Translator", "fields_of", "readings_in"]
