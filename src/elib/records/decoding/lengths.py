"""The lengths of binary answers. They have no framing: the request tells the length, and the header of a picture."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from elib.base.errors import RemoteProtocolError
from elib.link.protocol import shapes
from elib.link.protocol.context import Context, Parsed, Reply
from elib.link.protocol.replies import Packed


@dataclass(frozen=True, slots=True)
class Part:
    """The answer to one command of a binary session, up to *end*."""

    name: str
    end: int
    value: object = None
    problem: str = ""


@dataclass(slots=True)
class Measure:
    """The known facts about the answer of a binary session."""

    parts: list[Part] = field(default_factory=list)  # the answers to single commands that are there as a whole
    length: int | None = None  # bytes in all; None while the header of a picture, or bytes before it, are missing
    error: str = ""  # why the length cannot be told; *length* then ends with the header that is wrong

    @property
    def is_whole(self) -> bool:
        """Whether every part is there."""
        return bool(self.parts) and self.parts[-1].end == self.length

    def lacks(self, count: int) -> str:
        """Return the message that *count* bytes are not what there should be."""
        if self.length is None:
            return f"{count} bytes, and the header of the picture is missing"
        return f"{count} bytes where {self.length} belong"


def measure(parts: Iterable[tuple[str, Reply[object]]], data: bytes | bytearray, context: Context) -> Measure:
    """Return the length of the answer at the beginning of *data*, and the values of those parts that are there."""
    found = Measure()
    at = 0
    for name, reply in parts:
        try:
            length = _length(reply, data, at, context)
        except RemoteProtocolError as error:
            found.length, found.error = at + shapes.PICTURE_HEADER, error.message
            return found
        if length is None:
            return found
        if len(data) >= at + length:
            found.parts.append(_part(name, reply, data, at, at + length, context))
        at += length
    found.length = at
    return found


def _length(reply: Reply[object], data: bytes | bytearray, start: int, context: Context) -> int | None:
    """Return the bytes of an answer; None while the header of a picture is missing.

    Raises:
        RemoteProtocolError: No robot with this firmware sends such a header.
    """
    if isinstance(reply, Packed):
        return reply.length
    header = data[start : start + shapes.PICTURE_HEADER]
    if len(header) < shapes.PICTURE_HEADER:
        return None
    *_, size = shapes.picture_size(header, context)
    profile, (mode, columns, rows) = context.profile, header
    if size > profile.picture_bytes:
        raise RemoteProtocolError(
            f"the picture's header says mode {mode}, {columns} x {rows} pixels, which {profile.name} cannot send"
        )
    return shapes.PICTURE_HEADER + size


def _part(name: str, reply: Reply[object], data: bytes | bytearray, start: int, end: int, context: Context) -> Part:
    """Return an answer that is there as a whole."""
    try:
        found = reply.parse(data, start, context)
    except RemoteProtocolError as error:
        return Part(name, end, None, error.message)
    return Part(name, end, found.value if isinstance(found, Parsed) else None)
