"""What a decoder says: lines, the calls in them, and how much of a capture they stand for."""

from __future__ import annotations

import enum
from collections import deque
from dataclasses import dataclass
from typing import Literal

Direction = Literal["to robot", "to host"]


class Kind(enum.Enum):
    """What the bytes of a line are."""

    REQUEST = "request"
    FILLER = "filler"
    """Zeros and line ends that ask for nothing."""
    ANSWER = "answer"
    GREETING = "greeting"
    SURPLUS = "surplus"
    """A whole answer to something nobody asked."""
    MALFORMED = "malformed"
    """An answer that breaks its own rules, or is not as long as it should be."""
    HALF = "half"
    """The beginning of something whose end never came."""
    UNKNOWN = "unknown"

    __hash__ = object.__hash__


FAULTS = (Kind.SURPLUS, Kind.MALFORMED, Kind.HALF, Kind.UNKNOWN)
"""The kinds that a sound capture has none of."""


@dataclass(frozen=True, slots=True)
class Argument:
    """One argument of a call.

    Attributes:
        name: As the command's signature calls it.
        value: In its unit, or the name of one of a few choices.
        unit: As a person reads it; may be empty.
    """

    name: str
    value: int | float | str
    unit: str = ""

    def __str__(self) -> str:
        value = f"{self.value:g}" if isinstance(self.value, float) else str(self.value)
        return f"{self.name}={value}" + (f" {self.unit}" if self.unit else "")


@dataclass(frozen=True, slots=True)
class Call:
    """One command, as the Python call that sends the same."""

    name: str
    arguments: tuple[Argument, ...] = ()

    def __str__(self) -> str:
        return f"{self.name}({', '.join(map(str, self.arguments))})"


@dataclass(frozen=True, slots=True)
class Line:
    """Bytes of one direction that belong together, and what they mean. Every byte of a capture is in one line.

    Attributes:
        direction: Whither they went.
        offset: Bytes of this direction that came before.
        time: When the first of them came, s; None where the capture does not tell.
        data: The bytes.
        kind: What they are.
        calls: The commands of a request.
        name: The command answered; what else it is, in words, where there is none.
        value: The answer's value; None for a bare acknowledgement and where there is none.
        candidates: The commands it may answer, where the bytes alone do not tell.
        problem: What is wrong with it, or odd about it.
        unanswered: Earlier requests of which this line shows that no answer comes any more.
    """

    direction: Direction
    offset: int
    time: float | None
    data: bytes
    kind: Kind
    calls: tuple[Call, ...] = ()
    name: str = ""
    value: object = None
    candidates: tuple[str, ...] = ()
    problem: str = ""
    unanswered: tuple[str, ...] = ()


class Tape:
    """Bytes of one direction that are in no line yet, with the times they came at."""

    def __init__(self, direction: Direction) -> None:
        self.direction = direction
        self.bytes = bytearray()
        self._start = 0
        self._times: deque[tuple[int, float | None]] = deque()

    def append(self, data: bytes, time: float | None) -> None:
        """Put bytes behind those that are there."""
        if not self.bytes:
            self._times.clear()
        if not self._times or self._times[-1][1] != time:
            self._times.append((self._start + len(self.bytes), time))
        self.bytes += data

    def cut(
        self,
        count: int,
        kind: Kind,
        *,
        calls: tuple[Call, ...] = (),
        name: str = "",
        value: object = None,
        candidates: tuple[str, ...] = (),
        problem: str = "",
        unanswered: tuple[str, ...] = (),
    ) -> Line:
        """Make a line of the first *count* bytes."""
        data = bytes(self.bytes[:count])
        offset, time = self._start, self.time
        del self.bytes[:count]
        self._start += count
        while len(self._times) > 1 and self._times[1][0] <= self._start:
            self._times.popleft()
        return Line(self.direction, offset, time, data, kind, calls, name, value, candidates, problem, unanswered)

    @property
    def time(self) -> float | None:
        """When the first byte came, s."""
        return self._times[0][1] if self._times else None
