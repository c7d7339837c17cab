"""Text commands as a person types them."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from elib.base.errors import ArgumentError, Unsupported
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context, Parsed, Reply, UnexpectedReply
from elib.link.protocol.replies import GUARD, LinesReply, next_line
from elib.link.protocol.table import Request, Spec

MAX_COMMAND = 3400
"""Bytes. A longer line overruns the memory of the smallest firmware (wire-protocol.md, 1.5)."""
MAX_SERVICE = 4.0
"""s, for a letter that has no row. The slowest command is the calibration on BTcom 1.1.3 (wire-protocol.md, 5.13)."""
NUMBER = re.compile(r"-?[0-9]{1,9}")
"""A whole number as firmwares read it, bounded so that nonsense stays small."""


@dataclass(frozen=True, slots=True)
class Verbatim:
    """The lines of an answer as they came."""

    shape: Reply[object] | None
    is_binary = False

    @property
    def is_guarded(self) -> bool:
        """Whether the last line answers the guard, which is sent behind the command; it is left out."""
        return isinstance(self.shape, LinesReply) and self.shape.is_guarded

    def parse(self, buffer: bytes | bytearray, start: int, context: Context) -> Parsed[str] | UnexpectedReply | None:
        """See :class:`~elib.link.protocol.context.Reply`."""
        found = next_line(buffer, start) if self.shape is None else self.shape.parse(buffer, start, context)
        if found is None or isinstance(found, UnexpectedReply):
            return found
        end, _ = found
        text = bytes(buffer[start:end]).decode("latin-1").replace("\r", "\n")
        lines = [line for line in text.split("\n") if line]
        return Parsed(end, "\n".join(lines[:-1] if self.is_guarded else lines))


def text_request(context: Context, command: str) -> Request[str]:
    """Return the request for a text command.

    Raises:
        ArgumentError: *command* is not one line of printable ASCII.
        Unsupported: The firmware does not take text commands.
    """
    if not isinstance(command, str):
        raise ArgumentError(f"a text command is a str, not {command!r}")
    line = command.rstrip("\r\n")
    if not line or not line.isascii() or not line.isprintable() or line[0] == " ":
        raise ArgumentError(
            f"{command!r} is not a text command", hint="one line of ASCII that begins with the letter: 'D,100,-100'"
        )
    if len(line) > MAX_COMMAND:
        raise ArgumentError(f"the command has {len(line)} characters; the robot's buffer holds {MAX_COMMAND}")
    reason = context.profile.absent.get("text")
    if reason is not None:
        raise Unsupported(
            f"text() does not exist on {context.profile.name}: {reason}",
            hint="call the method of the command, or connect over Bluetooth (rfcomm://)",
        )
    spec = spec_of(line[0], context)
    reply = Verbatim(spec.text.reply if spec is not None and spec.text is not None else None)
    data = line.encode("ascii") + b"\r" + (GUARD if reply.is_guarded else b"")
    name = spec.name if spec is not None else "text"
    numbers = numbers_of(line[1:], spec)
    service = MAX_SERVICE if spec is None else context.profile.service.get(name, 0.0)
    request = Request(f"text({command!r})", name, data, reply, numbers, service=service)
    return request if spec is None else replace(request, timeout=spec.timeout, wheels=spec.wheels)


def numbers_of(arguments: str, spec: Spec[object] | None) -> tuple[int, ...]:
    """Return the numbers behind the letter of a command, as ``,100,-100`` has them; none if they do not fit *spec*."""
    words = arguments.split(",")[1:]
    if spec is None or len(words) != len(spec.parameters) or not all(NUMBER.fullmatch(word) for word in words):
        return ()
    return tuple(map(int, words))


def spec_of(letter: str, context: Context) -> Spec[object] | None:
    """Return the row of a letter, made upper case as firmwares do (wire-protocol.md, 1.5); None if it has none."""
    folded = letter if letter in context.profile.kept_letters else letter.upper()
    for spec in SPECS.values():
        if spec.letter == folded and spec.text is not None and spec.name not in context.profile.absent:
            return spec
    return None
