"""What goes over a simulated line, for a person: time, robot, direction, bytes, and the commands they are."""

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
"""s of silence after which a piece is shown, complete or not: a line at 115200 baud never pauses so long within one."""
MOST_TEXT, MOST_BYTES = 60, 16
"""How much is shown of one text line, and of binary data."""
LINE_END = re.compile(rb"(?<=\n)|(?<=\r)(?!\n)")


@dataclass(slots=True)
class Piece:
    """Bytes in one direction that belong together."""

    time: float
    direction: Direction
    data: bytes
    timer: asyncio.TimerHandle


class TrafficLog:
    """Shows traffic, a line each: of text its lines, of binary data what came without a pause.

    Args:
        firmware: Whose commands the letters are.
        show: Takes each line; it goes to stderr unless given.
    """

    def __init__(self, firmware: str, show: Callable[[str], None] = say) -> None:
        self._context = Context(profile_named(firmware))
        self._show = show
        self._opcodes = {
            form.code: spec.name
            for spec in reversed(SPECS.values())  # where rows share an opcode, the plainest stands first
            if (form := spec.binary) is not None and form.code is not None
        }
        self._pieces: dict[str, Piece] = {}

    def note(self, name: str, time: float, direction: Direction, data: bytes) -> None:
        """Take some bytes: the robot's name, s since the start, direction and the bytes. Needs a running event loop."""
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
        """Show what is still kept."""
        for name in tuple(self._pieces):
            self._end(name)

    def _end(self, name: str) -> None:
        piece = self._pieces.pop(name)
        piece.timer.cancel()
        for data in split(piece.data):
            arrow, known = ("->", self.command(data)) if piece.direction == "to robot" else ("<-", "")
            self._show(f"{piece.time:9.3f} {name} {arrow} {shown(data):<24} {known}".rstrip())

    def command(self, data: bytes) -> str:
        """Return the name of the command that *data* begins with; empty if it begins with none."""
        # Zeros and an empty line bring the line into step; what counts comes behind them.
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
    r"""Return one line of text, its end as ``\r`` and ``\n``, or bytes in hexadecimal; of long ones the beginning."""
    if _is_text(data):
        text, more = data[:MOST_TEXT].decode("ascii").replace("\r", "\\r").replace("\n", "\\n"), len(data) - MOST_TEXT
    else:
        text, more = data[:MOST_BYTES].hex(" "), len(data) - MOST_BYTES
    return f"{text} .. {more} more" if more > 0 else text


def _is_text(data: bytes) -> bool:
    return all(0x20 <= byte < 0x7F or byte in b"\r\n" for byte in data)
