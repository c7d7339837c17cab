"""The traffic of a simulated line as text: time, robot, direction, bytes and the commands in them."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from elib.cli.terminal import say
from elib.protocol.commands import SPECS
from elib.protocol.context import Context
from elib.protocol.profiles import profile_named
from elib.protocol.raw import spec_of

Direction = Literal["to robot", "to host"]

QUIET = 0.05
"""s of silence after which bytes are shown: at 115200 baud there is no such pause within a line."""
MOST_TEXT, MOST_BYTES = 60, 16
"""Number of characters of a text line and of bytes of binary data that are shown."""
LINE_END = re.compile(rb"(?<=\n)|(?<=\r)(?!\n)")


@dataclass(slots=True)
class Piece:
    """Bytes in one direction that came without a pause."""

    time: float
    direction: Direction
    data: bytes
    timer: asyncio.TimerHandle


class TrafficLog:
    """Shows each text line, and binary data that came without a pause, on a line of its own.

    Args:
        firmware: Firmware whose commands the letters are.
        show: Called with each line; it goes to stderr unless given.
    """

    def __init__(self, firmware: str, show: Callable[[str], None] = say) -> None:
        self._context = Context(profile_named(firmware))
        self._show = show
        self._opcodes = {
            form.code: spec.name
            for spec in reversed(SPECS.values())  # if rows share an opcode, the first row counts
            if (form := spec.binary) is not None and form.code is not None
        }
        self._pieces: dict[str, Piece] = {}

    def note(self, name: str, time: float, direction: Direction, data: bytes) -> None:
        """Take some bytes; an event loop must be running.

        Args:
            name: Name of the robot.
            time: s since the start.
            direction: Direction of the bytes.
            data: The bytes.
        """
        piece = self._pieces.get(name)
        if piece is not None and piece.direction != direction:
            self._end(name)
            piece = None
        timer = asyncio.get_running_loop().call_later(QUIET, self._end, name)
        if piece is None:
            piece = self._pieces[name] = Piece(time, direction, data, timer)
        else:
            piece.timer.cancel()
            piece.data, piece.timer = piece.data + data, timer
        if _is_text(piece.data) and piece.data.endswith((b"\r", b"\n")):
            self._end(name)

    def flush(self) -> None:
        """Show the bytes that wait."""
        for name in tuple(self._pieces):
            self._end(name)

    def _end(self, name: str) -> None:
        piece = self._pieces.pop(name)
        piece.timer.cancel()
        for data in split(piece.data):
            arrow, known = ("->", self.command(data)) if piece.direction == "to robot" else ("<-", "")
            self._show(f"{piece.time:9.3f} {name} {arrow} {shown(data):<24} {known}".rstrip())

    def command(self, data: bytes) -> str:
        """Return the name of the command at the beginning of *data*; empty if there is none."""
        # Zeros and an empty line only resynchronise; the command comes after them.
        data = data.lstrip(b"\0").lstrip(b"\r\n")
        if not data:
            return ""
        if data[0] >= 0x80:
            return self._opcodes.get(data[0], "")
        spec = spec_of(chr(data[0]), self._context) if chr(data[0]).isalpha() else None
        return "" if spec is None else spec.name


def split(data: bytes) -> list[bytes]:
    """Return the lines of text; binary data as it is."""
    return [part for part in LINE_END.split(data) if part] if _is_text(data) else [data]


def shown(data: bytes) -> str:
    r"""Return a line of text, with its end as ``\r`` and ``\n``, or bytes in hexadecimal; long data are cut off."""
    if _is_text(data):
        text, more = data[:MOST_TEXT].decode("ascii").replace("\r", "\\r").replace("\n", "\\n"), len(data) - MOST_TEXT
    else:
        text, more = data[:MOST_BYTES].hex(" "), len(data) - MOST_BYTES
    return f"{text} .. {more} more" if more > 0 else text


def _is_text(data: bytes) -> bool:
    return all(0x20 <= byte < 0x7F or byte in b"\r\n" for byte in data)
