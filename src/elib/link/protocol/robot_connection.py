"""The robot's side of a connection: bytes in, one at a time; text lines and binary opcodes out.

This is the state machine that all firmwares share (wire-protocol.md, 1.3 to 1.5). It does not know what a letter means
or what an answer looks like. No I/O, no clock.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

LINE_LIMIT = 65_535
"""Longest text line that is kept, bytes. Robots have no limit and overrun their memory (wire-protocol.md, 1.5)."""

_NUL = 0x00
_LINE_ENDS = (0x0A, 0x0D)
_FIRST_OPCODE = 0x80  # bytes from here on are negative as a signed char, and open a binary session
_NUMBER = re.compile(rb",[ \t\n\v\f\r]*(?P<sign>[+-]?)0*(?P<digits>[0-9]+)")


@dataclass(frozen=True, slots=True)
class TextLine:
    """A complete text command."""

    line: bytes  # everything from the first byte to the CR or LF that ended it, both included


@dataclass(frozen=True, slots=True)
class Opcode:
    """A binary command with all its parameters; the session stays open."""

    code: int  # the byte on the wire, 0x80..0xFF
    parameters: bytes  # the bytes that followed it


@dataclass(frozen=True, slots=True)
class SessionEnd:
    """The zero that ends a binary session: now the robot sends the collected answer."""


Event = TextLine | Opcode | SessionEnd

_SESSION_END = SessionEnd()


# The states are plain numbers, as they are compared for every byte. SKIPPING: a CR or LF came first, and whatever comes
# next opens a line.
_IDLE, _SKIPPING, _LINE, _SESSION, _PARAMETERS = range(5)


class RobotConnection:
    """Cuts a stream of bytes into the commands that a robot sees.

    Args:
        parameter_lengths: Number of parameter bytes of every binary opcode this firmware knows, keyed by the byte
            on the wire (0x80..0xFF). Other opcodes are swallowed without parameters, as robots do.
    """

    def __init__(self, parameter_lengths: Mapping[int, int]) -> None:
        self._lengths = dict(parameter_lengths)
        self._state = _IDLE
        self._line = bytearray()
        self._code = 0
        self._missing = 0

    @property
    def is_between_commands(self) -> bool:
        """Whether nothing is half received: no line, no session, and no line end before a line."""
        return self._state == _IDLE

    @property
    def is_in_session(self) -> bool:
        """Whether a binary session is open, which would swallow text."""
        return self._state in (_SESSION, _PARAMETERS)

    def feed(self, byte: int) -> Event | None:
        """Take one byte.

        Args:
            byte: 0..255.

        Returns:
            What the byte completed, or None. A byte completes at most one event.
        """
        state = self._state
        if state == _LINE:
            line = self._line
            if byte in _LINE_ENDS:
                line.append(byte)
                self._state = _IDLE
                return TextLine(bytes(line))
            if len(line) < LINE_LIMIT:
                line.append(byte)
            return None
        if state == _IDLE:
            if byte >= _FIRST_OPCODE:
                return self._open_opcode(byte)
            if byte in _LINE_ENDS:
                self._state = _SKIPPING
            elif byte != _NUL:
                self._open_line(byte)
            return None
        if state == _SESSION:
            if byte == _NUL:
                self._state = _IDLE
                return _SESSION_END
            return self._open_opcode(byte)
        if state == _PARAMETERS:
            self._line.append(byte)
            self._missing -= 1
            if self._missing:
                return None
            self._state = _SESSION
            return Opcode(self._code, bytes(self._line))
        if byte not in _LINE_ENDS:
            # Here a zero or an opcode opens a line, too: the robot has looked at the first byte already.
            self._open_line(byte)
        return None

    def _open_line(self, byte: int) -> None:
        self._line = bytearray((byte,))
        self._state = _LINE

    def _open_opcode(self, byte: int) -> Event | None:
        self._state = _SESSION
        missing = self._lengths.get(byte)
        if missing is None:
            return None
        if missing == 0:
            return Opcode(byte, b"")
        self._code, self._missing = byte, missing
        self._line = bytearray()
        self._state = _PARAMETERS
        return None


def scan_integers(line: bytes, count: int, *, long_bits: int = 32) -> list[int]:
    """Scan the numbers of a text command as C's ``sscanf(line, "X,%d,%d...")`` does.

    The letter is matched already. Before each number there must be a comma, directly behind the last number. White
    space is skipped before a number, never before a comma. The scan stops at the first mismatch, and at a zero byte.

    Args:
        line: The line with its letter, with or without its end.
        count: The most numbers wanted.
        long_bits: Width of ``long`` in the C library, which collects the digits. A larger number becomes the largest or
            smallest value (32 on the dsPIC, 64 where the recorded e-puck2 ran).

    Returns:
        The numbers, 0 to *count* of them, not yet cut to the width of the variables.
    """
    high = (1 << (long_bits - 1)) - 1
    numbers: list[int] = []
    position = 1
    while len(numbers) < count and (found := _NUMBER.match(line, position)):
        # int() refuses very long texts; 20 digits are already more than every long.
        value = int(found["sign"] + found["digits"][:20])
        numbers.append(max(-high - 1, min(value, high)))
        position = found.end()
    return numbers
