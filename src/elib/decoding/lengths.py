"""Binary answers have no framing: how long one is follows from the request, and from the header of a picture."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from elib.decoding.opcodes import binary_commands
from elib.errors import RemoteProtocolError
from elib.protocol import shapes
from elib.protocol.commands import SPECS
from elib.protocol.context import Context, Profile, Reply
from elib.protocol.profiles import PROFILES
from elib.protocol.quantities import CameraMode
from elib.protocol.replies import Packed

HEADER = 3
"""Bytes before the pixels of a picture: mode, columns, rows (protocol.md, 3.2)."""


@dataclass(frozen=True, slots=True)
class Part:
    """The answer of one command of a binary session, up to *end*."""

    name: str
    end: int
    value: object = None
    problem: str = ""


@dataclass(slots=True)
class Measure:
    """What is known of the answer of a binary session.

    Attributes:
        parts: Those that are there as a whole.
        length: Bytes in all; None while a header, or the bytes before it, are still to come.
        error: Why nobody can say how long it is; then *length* ends with the header that says so.
    """

    parts: list[Part] = field(default_factory=list)
    length: int | None = None
    error: str = ""

    def lacks(self, count: int) -> str:
        """Say that *count* bytes are not what there should be."""
        if self.length is None:
            return f"{count} bytes, and the header of the picture is missing"
        return f"{count} bytes where {self.length} belong"


def measure(parts: Iterable[tuple[str, Reply[object]]], data: bytes | bytearray, context: Context) -> Measure:
    """Return how long the answer that *data* begins with is and, of what is there, the values."""
    found = Measure()
    at = 0
    for name, reply in parts:
        part = (
            _packed(name, reply, data, at, context) if isinstance(reply, Packed) else _picture(name, data, at, context)
        )
        if part is None:
            return found
        if part.end < 0:
            found.length, found.error = at + HEADER, part.problem
            return found
        if len(data) >= part.end:
            found.parts.append(part)
        at = part.end
    found.length = at
    return found


def candidates(data: bytes, profiles: Sequence[Profile]) -> tuple[str, ...]:
    """Return the binary answers that *data* may be by its length: those of one command, and of elib's ``sensors()``."""
    found: dict[str, None] = {}
    for profile in profiles:
        for name, length in _lengths(profile.name):
            if length == len(data):
                found[name] = None
        picture = _picture("image", data, 0, Context(profile))
        if picture is not None and picture.end == len(data) > HEADER and not picture.problem:
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
        taken = reply.take(data, start, context)
    except RemoteProtocolError as error:
        return Part(name, end, None, error.message)
    return Part(name, end, None if taken is None else taken[1])


def _picture(name: str, data: bytes | bytearray, start: int, context: Context) -> Part | None:
    """Return a picture; its end is -1 if its header cannot be. None if there is no header yet."""
    if len(data) < start + HEADER:
        return None
    mode, columns, rows = data[start : start + HEADER]
    profile, settings = context.profile, context.last_set.camera
    wide, high = columns, rows
    if settings is not None:
        sides = (settings.width, settings.height)
        sides = sides[::-1] if profile.mounting.swaps else sides
        if (columns, rows) == (sides[0] % 256, sides[1] % 256):
            wide, high = sides  # the header counts in one byte
    size = wide * high * (1 if mode == CameraMode.GREY else 2)
    if not 0 <= size <= profile.picture_bytes or min(wide, high) < 0:
        said = f"the picture's header says mode {mode}, {columns} x {rows} pixels"
        return Part(name, -1, None, f"{said}, which {profile.name} cannot send")
    end = start + HEADER + size
    if len(data) < end:
        return Part(name, end)
    try:
        taken = shapes.PICTURE.take(data, start, context)
    except RemoteProtocolError:
        return Part(name, end, None, f"no picture that a program can want: mode {mode}, {wide} x {high} pixels")
    return Part(name, end, None if taken is None else taken[1])
