"""The lengths of binary answers. They have no framing: the request tells the length, and the header of a picture."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from elib.decoding.opcodes import binary_commands
from elib.errors import RemoteProtocolError
from elib.protocol import shapes
from elib.protocol.commands import SPECS
from elib.protocol.context import Context, Parsed, Profile, Reply
from elib.protocol.profiles import PROFILES
from elib.protocol.replies import Packed


@dataclass(frozen=True, slots=True)
class Part:
    """The answer to one command of a binary session, up to *end*."""

    name: str
    end: int
    value: object = None
    problem: str = ""


@dataclass(slots=True)
class Measure:
    """The known facts about the answer of a binary session.

    Attributes:
        parts: The answers to single commands that are there as a whole.
        length: Bytes in all; None while the header of a picture, or bytes before it, are missing.
        error: Why the length cannot be told; *length* then ends with the header that is wrong.
    """

    parts: list[Part] = field(default_factory=list)
    length: int | None = None
    error: str = ""

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
        part = (
            _packed(name, reply, data, at, context) if isinstance(reply, Packed) else _picture(name, data, at, context)
        )
        if part is None:
            return found
        if part.end < 0:
            found.length, found.error = at + shapes.PICTURE_HEADER, part.problem
            return found
        if len(data) >= part.end:
            found.parts.append(part)
        at = part.end
    found.length = at
    return found


def candidates(data: bytes, profiles: Sequence[Profile]) -> tuple[str, ...]:
    """Return the names of binary answers with the length of *data*: of one command, and of elib's ``sensors()``."""
    found: dict[str, None] = {}
    for profile in profiles:
        for name, length in _lengths(profile.name):
            if length == len(data):
                found[name] = None
        picture = _picture("image", data, 0, Context(profile))
        if picture is not None and picture.end == len(data) > shapes.PICTURE_HEADER and not picture.problem:
            found["image"] = None
    return tuple(found)


@functools.cache
def _lengths(name: str) -> tuple[tuple[str, int], ...]:
    profile = PROFILES[name]
    commands = binary_commands(profile)
    single = [(each.name, each.reply.length) for each in commands.values() if isinstance(each.reply, Packed)]
    forms = [SPECS[row].binary_form(profile) for row in profile.chain]
    replies = [commands[form.code].reply for form in forms if form is not None and form.code is not None]
    chain = sum(reply.length for reply in replies if isinstance(reply, Packed))
    return (*single, ("sensors", chain + (shapes.PACKET.length if profile.sends_packet else 0)))


def _packed(name: str, reply: Packed[object], data: bytes | bytearray, start: int, context: Context) -> Part:
    end = start + reply.length
    try:
        found = reply.parse(data, start, context)
    except RemoteProtocolError as error:
        return Part(name, end, None, error.message)
    return Part(name, end, found.value if isinstance(found, Parsed) else None)


def _picture(name: str, data: bytes | bytearray, start: int, context: Context) -> Part | None:
    """Return a picture, or None while its header is missing. The end is -1 if no robot sends such a header."""
    if len(data) < start + shapes.PICTURE_HEADER:
        return None
    mode, columns, rows = data[start : start + shapes.PICTURE_HEADER]
    wide, high, size = shapes.picture_size((mode, columns, rows), context)
    if size > context.profile.picture_bytes:
        said = f"the picture's header says mode {mode}, {columns} x {rows} pixels"
        return Part(name, -1, None, f"{said}, which {context.profile.name} cannot send")
    end = start + shapes.PICTURE_HEADER + size
    if len(data) < end:
        return Part(name, end)
    try:
        found = shapes.PICTURE.parse(data, start, context)
    except RemoteProtocolError:
        return Part(name, end, None, f"not a picture that a program can use: mode {mode}, {wide} x {high} pixels")
    return Part(name, end, found.value if isinstance(found, Parsed) else None)
