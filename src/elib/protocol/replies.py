"""Reply shapes: how much of the incoming bytes is the answer, and what it means.

A shape looks at the bytes that came since the request left and says one of four things: not complete yet (``None``),
complete (end and value), not mine (:class:`Stray`: a line of another command, to be dropped) or mine but malformed
(:class:`~elib.errors.RemoteProtocolError`). It keeps no state, so the same shape serves any number of requests.
"""

from __future__ import annotations

import functools
import re
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from elib.errors import CommandRejected, RemoteProtocolError
from elib.protocol.context import Context, Reply, Stray, Taken

T = TypeVar("T")

LONGEST_LINE = 512
"""Bytes. The longest line a firmware sends has 100; what is longer is noise."""


def next_line(buffer: bytes | bytearray, start: int) -> tuple[int, str] | None:
    """Return the end and the text of the next line that is not blank, or None.

    Raises:
        Stray: What came is too long to be a line.
    """
    while True:
        end = buffer.find(b"\n", start)
        if end < 0:
            if len(buffer) - start > LONGEST_LINE:
                raise Stray(len(buffer))
            return None
        if end - start > LONGEST_LINE:
            raise Stray(end + 1)
        text = buffer[start:end].strip(b"\r")
        if text:
            return end + 1, text.decode("latin-1")
        start = end + 1


def refuse(line: str, end: int, letter: str, expected: str) -> Exception:
    """Return what a line that does not fit means: a refusal, a malformed answer or a stray."""
    if line == "z,Command not found":
        return CommandRejected(
            f"the robot does not know {letter!r}", hint="is it another firmware than the profile says?"
        )
    if line[:1].lower() == letter.lower():
        return RemoteProtocolError(f"the answer to {letter!r} is {line[:80]!r}; expected {expected}")
    return Stray(end)


@functools.cache
def _compiled(pattern: str) -> re.Pattern[str]:
    return re.compile(pattern, re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Line(Generic[T]):
    """One line that matches a pattern; the groups make the value."""

    letter: str
    pattern: str
    expected: str
    build: Callable[[Sequence[str], Context], T]
    is_binary = False

    def take(self, buffer: bytes | bytearray, start: int, context: Context) -> Taken[T] | None:
        """See :class:`Reply`."""
        line = next_line(buffer, start)
        if line is None:
            return None
        end, text = line
        match = _compiled(self.pattern).fullmatch(text)
        if match is None:
            raise refuse(text, end, self.letter, self.expected)
        return end, self.build(match.groups(), context)


def acknowledgement(letter: str) -> Line[None]:
    """Return the shape of a bare letter."""
    return Line(letter, letter, f"{letter.lower()!r} alone", lambda groups, context: None)


def integers(letter: str, least: int, most: int, build: Callable[[Sequence[int], Context], T]) -> Line[T]:
    """Return the shape of a letter and *least* to *most* decimal numbers between commas."""
    count = f"{least}" if least == most else f"{least} to {most}"
    return Line(
        letter,
        rf"{letter}((?:,-?\d{{1,11}}){{{least},{most}}})",
        f"{letter.lower()!r} and {count} numbers",
        lambda groups, context: build([int(text) for text in groups[0][1:].split(",")], context),
    )


@dataclass(frozen=True, slots=True)
class Lines(Generic[T]):
    """Several lines: the first must match *first*; it ends with the line that *is_last* accepts."""

    letter: str
    first: str
    expected: str
    is_last: Callable[[Sequence[str], Context], bool]
    build: Callable[[Sequence[str], Context], T]
    is_binary = False

    def take(self, buffer: bytes | bytearray, start: int, context: Context) -> Taken[T] | None:
        """See :class:`Reply`."""
        lines: list[str] = []
        end = start
        while True:
            line = next_line(buffer, end)
            if line is None:
                return None
            end, text = line
            if not lines and not _compiled(self.first).match(text):
                raise refuse(text, end, self.letter, self.expected)
            lines.append(text)
            if self.is_last(lines, context):
                return end, self.build(lines, context)
            if len(lines) > 256:
                raise RemoteProtocolError(f"the answer to {self.letter!r} has no end; expected {self.expected}")


@dataclass(frozen=True, slots=True)
class Packed(Generic[T]):
    """A fixed number of binary bytes. There is no framing: only the request tells how many."""

    format: str
    build: Callable[[Sequence[int | float], Context], T]
    is_binary = True

    @property
    def length(self) -> int:
        """Bytes in the answer."""
        return struct.calcsize(self.format)

    def take(self, buffer: bytes | bytearray, start: int, context: Context) -> Taken[T] | None:
        """See :class:`Reply`."""
        end = start + self.length
        if len(buffer) < end:
            return None
        return end, self.build(struct.unpack_from(self.format, buffer, start), context)


@dataclass(frozen=True, slots=True)
class Several(Generic[T]):
    """Answers one after the other to requests that left in one write."""

    parts: tuple[Reply[object], ...]
    build: Callable[[Sequence[object], Context], T]

    @property
    def is_binary(self) -> bool:
        """Whether any of the answers has no framing."""
        return any(part.is_binary for part in self.parts)

    def take(self, buffer: bytes | bytearray, start: int, context: Context) -> Taken[T] | None:
        """See :class:`Reply`."""
        values: list[object] = []
        end = start
        for part in self.parts:
            try:
                taken = part.take(buffer, end, context)
            except Stray as stray:
                if not values:
                    raise
                text = buffer[end : stray.end][:80]
                raise RemoteProtocolError(f"{text!r} stands where the answer's next part should") from None
            if taken is None:
                return None
            end, value = taken
            values.append(value)
        return end, self.build(values, context)


GUARD = b"C\r"
"""Behind every binary frame goes a text question, the cheapest there is. Binary answers have no framing, but the line
never reorders: only if the guard's answer stands exactly behind the expected number of bytes are these the answer. It
also is the acknowledgement of setters, which answer nothing."""
_GUARD_ANSWER: Line[None] = Line(
    "C", r"c,\d+", "the selector's answer behind a binary one", lambda groups, context: None
)


@dataclass(frozen=True, slots=True)
class Guarded(Generic[T]):
    """A binary answer and, right behind it, the guard's."""

    reply: Reply[T]
    is_binary = True

    def take(self, buffer: bytes | bytearray, start: int, context: Context) -> Taken[T] | None:
        """See :class:`Reply`."""
        taken = self.reply.take(buffer, start, context)
        if taken is None:
            return None
        end, value = taken
        try:
            guard = _GUARD_ANSWER.take(buffer, end, context)
        except (Stray, RemoteProtocolError):
            raise RemoteProtocolError(
                "the binary answer is out of step: bytes are missing or do not belong to it"
            ) from None
        return None if guard is None else (guard[0], value)


def guarded(reply: Reply[T]) -> Reply[T]:
    """Return *reply* with the guard's answer behind it."""
    return Guarded(reply)


def unguarded(reply: Reply[T]) -> Reply[T]:
    """Return *reply* without the guard's answer, if that stands behind it."""
    return reply.reply if isinstance(reply, Guarded) else reply


@dataclass(frozen=True, slots=True)
class Nothing:
    """No bytes at all: what binary setters answer."""

    is_binary = True

    def take(self, buffer: bytes | bytearray, start: int, context: Context) -> Taken[None]:
        """See :class:`Reply`."""
        return start, None
