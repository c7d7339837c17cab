"""The result of decoding: lines, the calls in them, and the buffer that lines are cut from."""

from __future__ import annotations

import enum
from collections import deque
from dataclasses import dataclass
from typing import Any, Literal

Direction = Literal["to robot", "to host"]


class Kind(enum.Enum):
    """The kind of the bytes of a line."""

    REQUEST = "request"
    FILLER = "filler"
    """Zeros and line ends that are not a request."""
    ANSWER = "answer"
    GREETING = "greeting"
    BYTES = "bytes"
    """What the robot sent before the capture has a byte of the host: nothing tells what it answers."""
    SURPLUS = "surplus"
    """A whole line of text without a request."""
    MALFORMED = "malformed"
    """An answer with a wrong content or length."""
    HALF = "half"
    """The beginning of something whose end did not come."""
    UNKNOWN = "unknown"
    SWALLOWED = "swallowed"
    """A binary session with bytes that are not a command: the robot drops them, and does not do what they ask for."""

    __hash__ = object.__hash__


FAULTS = (Kind.SURPLUS, Kind.MALFORMED, Kind.HALF, Kind.UNKNOWN, Kind.SWALLOWED)
"""The kinds that do not occur in a capture without errors."""


@dataclass(frozen=True, slots=True)
class Argument:
    """One argument of a call."""

    name: str  # its name in the signature of the command
    value: int | float | str  # its value in *unit*, or the name of a choice
    unit: str = ""  # its unit, or an empty text

    def __str__(self) -> str:
        value = f"{self.value:g}" if isinstance(self.value, float) else str(self.value)
        return f"{self.name}={value}" + (f" {self.unit}" if self.unit else "")


@dataclass(frozen=True, slots=True)
class Call:
    """One command, as the Python call that sends it."""

    name: str
    arguments: tuple[Argument, ...] = ()

    def __str__(self) -> str:
        return f"{self.name}({', '.join(map(str, self.arguments))})"


@dataclass(frozen=True, slots=True)
class Line:
    """Bytes of one direction that belong together, and what they mean. Every byte of a capture is in one line."""

    direction: Direction
    offset: int  # the number of bytes of this direction before them
    time: float | None  # when the first of them came, s; None if the capture does not tell
    data: bytes  # the bytes
    kind: Kind  # what the bytes are
    calls: tuple[Call, ...] = ()  # the commands of a request
    name: str = ""  # the command that is answered, or what the bytes are, in words
    value: object = None  # the value of an answer; None for an acknowledgement and for other kinds
    problem: str = ""  # what is wrong or unusual
    unanswered: tuple[str, ...] = ()  # earlier requests that, as this line shows, get no answer any more


class CaptureBuffer:
    """Bytes of one direction that are not in a line yet, and when they came."""

    def __init__(self, direction: Direction) -> None:
        self.direction = direction
        self.bytes = bytearray()
        self._start = 0
        self._times: deque[tuple[int, float | None]] = deque()

    def append(self, data: bytes, time: float | None) -> None:
        """Append bytes that came at *time*."""
        if not self.bytes:
            self._times.clear()
        if not self._times or self._times[-1][1] != time:
            self._times.append((self._start + len(self.bytes), time))
        self.bytes += data

    def cut(self, count: int, kind: Kind, **about: Any) -> Line:
        """Remove the first *count* bytes and return them as a line, with what it says *about* them."""
        data = bytes(self.bytes[:count])
        offset, time = self._start, self.time
        del self.bytes[:count]
        self._start += count
        while len(self._times) > 1 and self._times[1][0] <= self._start:
            self._times.popleft()
        return Line(self.direction, offset, time, data, kind, **about)

    @property
    def time(self) -> float | None:
        """When the first byte came, s."""
        return self._times[0][1] if self._times else None
