"""What goes over a simulated line, for a person: time, robot, direction, bytes, and the commands they are."""

from __future__ import annotations

from typing import Literal

from elib.cli.terminal import say
from elib.protocol.commands import SPECS
from elib.protocol.context import Context
from elib.protocol.profiles import profile_named
from elib.protocol.raw import spec_of

Direction = Literal["to robot", "to host"]

LONGEST = 48
"""Bytes of text shown of one piece; of other bytes a third, since each takes three columns."""


class TrafficLog:
    """Writes traffic to stderr, a line each.

    Bytes arrive in the pieces the line delivers; a text piece is kept until its line ends, the other side speaks, or the log is
    flushed.

    Args:
        firmware: Whose commands the letters are.
    """

    def __init__(self, firmware: str) -> None:
        self._context = Context(profile_named(firmware))
        self._opcodes = {
            form.code: spec.name
            for spec in SPECS.values()
            if (form := spec.binary) is not None and form.code is not None
        }
        self._kept: dict[str, tuple[float, Direction, bytes]] = {}

    def note(self, name: str, time: float, direction: Direction, data: bytes) -> None:
        """Take one piece: the robot's name, s since the start, direction and bytes."""
        kept = self._kept.pop(name, None)
        if kept is not None:
            if kept[1] == direction:
                time, data = kept[0], kept[2] + data
            else:
                self._write(name, *kept)
        if _is_text(data) and not data.endswith((b"\r", b"\n")) and len(data) < LONGEST:
            self._kept[name] = (time, direction, data)
            return
        self._write(name, time, direction, data)

    def flush(self) -> None:
        """Write what is still kept."""
        for name, kept in self._kept.items():
            self._write(name, *kept)
        self._kept.clear()

    def _write(self, name: str, time: float, direction: Direction, data: bytes) -> None:
        arrow = "->" if direction == "to robot" else "<-"
        known = self._commands(data) if direction == "to robot" else ""
        say(f"{time:9.3f} {name} {arrow} {shown(data):<32} {known}".rstrip())

    def _commands(self, data: bytes) -> str:
        """Return the names of the commands in *data*, as far as their first bytes tell."""
        if data[0] >= 0x80:
            return " ".join(self._opcodes.get(byte, "?") for byte in data[:1])
        names = []
        for line in data.lstrip(b"\0").replace(b"\n", b"\r").split(b"\r"):
            spec = spec_of(chr(line[0]), self._context) if line else None
            if spec is not None:
                names.append(spec.name)
        return " ".join(names)


def shown(data: bytes) -> str:
    """Return bytes as text, with CR and LF as ``\\\\r`` and ``\\\\n``, or in hexadecimal; long ones cut off with their number."""
    if _is_text(data):
        text = data[:LONGEST].decode("ascii").replace("\r", "\\r").replace("\n", "\\n")
        left = len(data) - LONGEST
    else:
        text = data[: LONGEST // 3].hex(" ")
        left = len(data) - LONGEST // 3
    return f"{text} .. {left} more" if left > 0 else text


def _is_text(data: bytes) -> bool:
    return all(0x20 <= byte < 0x7F or byte in b"\r\n" for byte in data)
