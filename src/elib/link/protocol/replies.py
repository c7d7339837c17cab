"""The shapes of answers: lines of text, packed binary numbers, several answers in a row.

Each has the method ``parse`` of :class:`~elib.link.protocol.context.Reply`, which lists its outcomes.
"""

from __future__ import annotations

import functools
import re
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from elib.base.errors import CommandRejected, RemoteProtocolError
from elib.link.protocol.context import Context, Parsed, Reply, UnexpectedReply

T = TypeVar("T")

NOT_FOUND = "z,Command not found"
MAX_LINE = 512
"""Bytes. The longest line of a firmware has 100; a longer one is noise."""


def next_line(buffer: bytes | bytearray, start: int) -> tuple[int, str] | UnexpectedReply | None:
    """Return the next line that is not blank, without its end.

    Returns:
        Where it ends and its text, :class:`UnexpectedReply` if what came is too long to be a line, None if the end of
        the line is still missing.
    """
    while True:
        end = buffer.find(b"\n", start)
        if end < 0:
            return UnexpectedReply(len(buffer)) if len(buffer) - start > MAX_LINE else None
        if end - start > MAX_LINE:
            return UnexpectedReply(end + 1)
        text = buffer[start:end].strip(b"\r")
        if text:
            return end + 1, text.decode("latin-1")
        start = end + 1


def mismatch(text: str, end: int, letter: str, expected: str) -> UnexpectedReply:
    """Return :class:`UnexpectedReply` for a line that answers another command.

    Raises:
        CommandRejected: The line says that the robot does not know the command.
        RemoteProtocolError: The line has the command's letter, so it is the answer, but malformed.
    """
    if text == NOT_FOUND:
        raise CommandRejected(
            f"the robot does not know {letter!r}", hint="is it another firmware than the profile says?"
        )
    if text[:1].lower() == letter.lower():
        raise RemoteProtocolError(f"the answer to {letter!r} is {text[:80]!r}; expected {expected}")
    return UnexpectedReply(end)


@functools.cache
def _compiled(pattern: str) -> re.Pattern[str]:
    return re.compile(pattern, re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class LineReply(Generic[T]):
    """One line that matches a pattern; its groups make the value."""

    letter: str
    pattern: str
    expected: str
    build: Callable[[Sequence[str], Context], T]
    is_binary = False

    def parse(self, buffer: bytes | bytearray, start: int, context: Context) -> Parsed[T] | UnexpectedReply | None:
        """See :class:`Reply`."""
        line = next_line(buffer, start)
        if line is None or isinstance(line, UnexpectedReply):
            return line
        end, text = line
        match = _compiled(self.pattern).fullmatch(text)
        if match is None:
            return mismatch(text, end, self.letter, self.expected)
        return Parsed(end, self.build(match.groups(), context))


def acknowledgement(letter: str) -> LineReply[None]:
    """Return the shape of a bare letter."""
    return LineReply(letter, letter, f"{letter.lower()!r} alone", lambda groups, context: None)


GUARD = b"C\r"
"""The text question behind every binary frame, the cheapest one. Binary answers have no framing, but the line keeps the
order: bytes are the answer only if the guard's answer stands exactly behind their expected number. It is also the
acknowledgement of setters, which have no answer, and the end of text answers without an end mark."""
_GUARD_ANSWER: LineReply[None] = LineReply(
    "C", r"c,\d+", "the selector's answer behind another one", lambda groups, context: None
)


@dataclass(frozen=True, slots=True)
class LinesReply(Generic[T]):
    """Several lines: the first must match *first*, and *is_last* says which one is the last.

    If *is_guarded*, it is that of the guard, which is sent behind the command.
    """

    letter: str
    first: str
    expected: str
    is_last: Callable[[Sequence[str], Context], bool]
    build: Callable[[Sequence[str], Context], T]
    is_guarded: bool = False
    is_binary = False

    def parse(self, buffer: bytes | bytearray, start: int, context: Context) -> Parsed[T] | UnexpectedReply | None:
        """See :class:`Reply`."""
        lines: list[str] = []
        end = start
        while True:
            line = next_line(buffer, end)
            if line is None or isinstance(line, UnexpectedReply):
                return line
            end, text = line
            if not lines and not _compiled(self.first).match(text):
                return mismatch(text, end, self.letter, self.expected)
            lines.append(text)
            if self.is_last(lines, context):
                return Parsed(end, self.build(lines, context))
            if len(lines) > 256:
                raise RemoteProtocolError(f"the answer to {self.letter!r} has no end; expected {self.expected}")


def guarded_lines(
    letter: str, first: str, expected: str, build: Callable[[Sequence[str], Context], T]
) -> LinesReply[T]:
    """Return the shape of lines without an end mark. The answer of the guard ends them, and *build* does not get it."""

    def is_last(lines: Sequence[str], context: Context) -> bool:
        return _compiled(_GUARD_ANSWER.pattern).fullmatch(lines[-1]) is not None

    return LinesReply(letter, first, expected, is_last, lambda lines, context: build(lines[:-1], context), True)


@dataclass(frozen=True, slots=True)
class Packed(Generic[T]):
    """A fixed number of binary bytes. There is no framing: only the request tells the number."""

    format: str
    build: Callable[[Sequence[int | float], Context], T]
    length: int = field(init=False)
    """Bytes in the answer."""
    is_binary = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", struct.calcsize(self.format))

    def parse(self, buffer: bytes | bytearray, start: int, context: Context) -> Parsed[T] | UnexpectedReply | None:
        """See :class:`Reply`."""
        end = start + self.length
        if len(buffer) < end:
            return None
        return Parsed(end, self.build(struct.unpack_from(self.format, buffer, start), context))


NOTHING: Packed[None] = Packed("", lambda numbers, context: None)
"""The answer of binary setters: no bytes."""


@dataclass(frozen=True, slots=True)
class Several(Generic[T]):
    """Several answers in a row, to requests that were sent in one write."""

    parts: tuple[Reply[object], ...]
    build: Callable[[Sequence[object], Context], T]
    is_binary: bool = field(init=False)
    """Whether one of the answers has no framing."""
    least: int = field(init=False)
    """The fewest bytes that are worth a look."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "is_binary", any(part.is_binary for part in self.parts))
        object.__setattr__(self, "least", sum(part.length for part in self.parts if isinstance(part, Packed)))

    def parse(self, buffer: bytes | bytearray, start: int, context: Context) -> Parsed[T] | UnexpectedReply | None:
        """See :class:`Reply`."""
        if len(buffer) - start < self.least:
            return None
        values: list[object] = []
        end = start
        for part in self.parts:
            found = part.parse(buffer, end, context)
            if isinstance(found, UnexpectedReply) and values:
                text = buffer[end : found.end][:80]
                raise RemoteProtocolError(f"{text!r} stands where the answer's next part should")
            if not isinstance(found, Parsed):
                return found
            end = found.end
            values.append(found.value)
        return Parsed(end, self.build(values, context))


@dataclass(frozen=True, slots=True)
class Guarded(Generic[T]):
    """A binary answer and, right behind it, that of the guard."""

    reply: Reply[T]
    is_binary = True

    def parse(self, buffer: bytes | bytearray, start: int, context: Context) -> Parsed[T] | UnexpectedReply | None:
        """See :class:`Reply`."""
        found = self.reply.parse(buffer, start, context)
        if not isinstance(found, Parsed):
            return found
        try:
            guard = _GUARD_ANSWER.parse(buffer, found.end, context)
        except RemoteProtocolError:
            guard = UnexpectedReply(found.end)
        if isinstance(guard, UnexpectedReply):
            raise RemoteProtocolError("the binary answer is out of step: bytes are missing or do not belong to it")
        return None if guard is None else Parsed(guard.end, found.value)
