"""The host's half of a capture: which commands its bytes are, as the robot reads them, and which answers follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context, Profile, Reply
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.raw import spec_of
from elib.link.protocol.replies import NOT_FOUND, LineReply, LinesReply
from elib.link.protocol.robot_connection import Opcode, RobotConnection, TextLine, scan_integers
from elib.link.protocol.table import Spec
from elib.records.decoding.lines import Argument, Call, CaptureBuffer, Kind, Line
from elib.records.decoding.opcodes import BinaryCommand, binary_commands, named

MAX_LENGTH = 4139
"""Bytes. Longer requests are shown in pieces: no robot's buffer holds them (wire-protocol.md, 1.5)."""
LINE_ENDS = b"\r\n"
_BYTES = [bytes((byte,)) for byte in range(256)]

REFUSED: Reply[object] = LineReply("z", NOT_FOUND, repr(NOT_FOUND), lambda groups, context: None)
SCANNED: Reply[object] = LineReply(
    "", r"(\d+): (-?\d+)", "'address: value'", lambda groups, context: {str(groups[0]): int(groups[1] or 0)}
)
"""One device of an ``i2c_scan``."""
HELP: Reply[object] = LinesReply(
    SPECS["help_text"].letter,
    r'"',
    "lines that begin with a quoted letter",
    lambda lines, context: lines[-1].startswith(context.profile.help_ends_with),
    lambda lines, context: "\n".join(lines),
)
"""A help text up to its last line, which the profile has."""
UNGUARDED = {"i2c_scan": SCANNED, "help_text": HELP}
"""Answers without an end mark, by command: other clients do not send the guard behind these commands."""


def _nothing(context: Context) -> None:
    """Do nothing: most answers confirm nothing that matters here."""


@dataclass(slots=True, eq=False)
class ExpectedAnswer:
    """An answer that should come."""

    name: str  # the command that it answers
    # names and shapes: one pair for text, one pair for each command of a binary session
    parts: tuple[tuple[str, Reply[object]], ...]
    is_binary: bool  # whether the answer has no framing
    request: str  # the request, as text
    may_lack: bool = False  # whether the answer may be missing without a fault
    is_outdated: bool = False  # whether the robot has restarted since the request
    # called to note what the robot has confirmed
    confirm: Callable[[Context], None] = field(default=_nothing, repr=False)

    @property
    def reply(self) -> Reply[object]:
        """The shape of a text answer."""
        return self.parts[0][1]


class RequestReader:
    """Cuts the host's bytes into requests."""

    def __init__(self, context: Context, expect: Callable[[ExpectedAnswer], None]) -> None:
        self._context = context
        self._expect = expect
        self._buffer = CaptureBuffer("to robot")
        self._commands: dict[int, BinaryCommand] = {}
        self._restart: Profile | None = None
        self._calls: list[Call] = []
        self._oddities: list[str] = []
        self._answers: list[tuple[str, Reply[object]]] = []
        self._swallowed = 0
        self._is_complete = False  # the buffer holds a text line; only the LF of a CR LF may still belong to it
        self._start()

    def feed(self, data: bytes, time: float | None) -> list[Line]:
        """Take bytes that went to the robot and return the requests that are complete."""
        lines: list[Line] = []
        for byte in data:
            is_tail = self._is_complete and byte == 0x0A and self._buffer.bytes.endswith(b"\r")
            is_next = self._connection.is_between_commands and not is_tail and (self._is_complete or byte)
            if is_next and self._buffer.bytes:
                lines += self.close()
            event = self._connection.feed(byte)
            self._buffer.append(_BYTES[byte], time)
            if isinstance(event, TextLine):
                self._take_text(event.line)
                self._is_complete = True
            elif isinstance(event, Opcode):
                self._take_opcode(event)
            elif event is not None:
                lines.append(self._session())
            if is_tail:
                lines += self.close()
            elif len(self._buffer.bytes) >= MAX_LENGTH and not self._is_complete:
                lines.append(self._piece())
        return lines

    def close(self) -> list[Line]:
        """Return what is complete if the next byte does not come from the host: a line whose LF may still follow."""
        if not self._buffer.bytes:
            return []
        if self._is_complete:
            self._is_complete = False
            return [self._line()]
        if not self._buffer.bytes.strip(b"\0"):
            return [self._filler("zeros: they end what is half received")]
        return []

    def flush(self) -> list[Line]:
        """Return what is left; no more bytes come."""
        lines = self.close()
        if self._buffer.bytes:
            if not self._buffer.bytes.strip(LINE_ENDS):
                line = self._filler("line end: the next byte opens a line")
            elif self._connection.is_in_session:
                line = self._session(Kind.HALF, "the zero that ends the binary session is missing")
            else:
                problem = "the CR that ends the command is missing"
                line = self._buffer.cut(len(self._buffer.bytes), Kind.HALF, problem=problem)
            lines.append(line)
        return lines

    def restarted(self, profile: Profile | None = None) -> None:
        """Forget what the robot has half received: it has restarted, or it is another firmware than was assumed."""
        if profile is None or self._connection.is_between_commands:
            self._start()
        else:
            self._restart = profile

    def _start(self) -> None:
        self._restart = None
        self._commands = binary_commands(self._context.profile)
        # Bytes that are not a command are swallowed alone (wire-protocol.md, 1.4). With a length they become events.
        lengths = dict.fromkeys(range(1, 256), 0) | {code: known.length for code, known in self._commands.items()}
        self._connection = RobotConnection(lengths)
        self._begin()

    def _begin(self) -> None:
        self._calls, self._oddities, self._answers, self._swallowed = [], [], [], 0
        if self._restart is not None:
            self._start()

    # -- text --

    def _take_text(self, line: bytes) -> None:
        profile = self._context.profile
        letter = chr(line[0]) if line[:1].isalpha() else ""
        spec = spec_of(letter, self._context) if letter else None
        if spec is not None:
            self._calls.append(self._text_call(spec, line))
            reply = UNGUARDED.get(spec.name) or (spec.text.reply if spec.text is not None else REFUSED)
            confirm = self._confirmation(spec, line)
            self._await(spec.name, reply, may_lack=spec.name == "i2c_scan", confirm=confirm)
        elif letter.upper() in profile.unsent_text:
            name, answer = profile.unsent_text[letter.upper()]
            self._calls.append(Call(name))
            if answer is None:
                self._oddities.append(f"{profile.name} takes it and answers nothing")
            else:
                self._await(name, answer)
        else:
            self._oddities.append(f"{profile.name} does not have this command")
            self._await(bytes(line[:1]).decode("latin-1"), REFUSED)

    def _await(
        self,
        name: str,
        reply: Reply[object],
        *,
        may_lack: bool = False,
        confirm: Callable[[Context], None] = _nothing,
    ) -> None:
        request = str(self._calls[-1]) if self._calls else f"the unknown {name!r}"
        self._expect(ExpectedAnswer(name, ((name, reply),), False, request, may_lack, confirm=confirm))

    def _text_call(self, spec: Spec[object], line: bytes) -> Call:
        count = 6 if spec.name == "set_camera" else len(spec.parameters)
        numbers = scan_integers(line, count)
        if len(numbers) < len(spec.parameters):
            given = f"{len(numbers)} of {len(spec.parameters)} numbers" if numbers else "no numbers"
            self._oddities.append(f"{given}: what was given before holds")
        elif not spec.parameters and line.rstrip(b"\r\n \0")[1:]:
            self._oddities.append("only the first letter counts")
        if spec.name == "set_camera":
            return Call(spec.name, self._camera(numbers))
        return Call(spec.name, named(spec.parameters, numbers))

    def _camera(self, numbers: list[int]) -> tuple[Argument, ...]:
        """Return the arguments of ``J,mode,columns,rows,zoom,x,y``, as they hold for the upright picture."""
        sides = ("height", "width") if self._context.profile.mounting.swaps else ("width", "height")
        given: dict[str, int | str] = dict(zip(("mode", *sides, "zoom", "x", "y"), numbers, strict=False))
        if numbers:
            given["mode"] = {int(mode): mode.name for mode in CameraMode}.get(numbers[0], numbers[0])
        order = ("width", "height", "zoom", "mode", "x", "y")
        return tuple(Argument(name, given[name], "pixels" if name in sides else "") for name in order if name in given)

    def _confirmation(self, spec: Spec[object], line: bytes) -> Callable[[Context], None]:
        """Return what notes the settings of the camera: the header of a wide picture cannot say its size."""
        numbers = scan_integers(line, 4) if spec.name == "set_camera" else ()
        if len(numbers) < 4 or spec.remember is None:
            return _nothing
        mode, columns, rows, zoom = numbers
        size = (rows, columns) if self._context.profile.mounting.swaps else (columns, rows)
        remember = spec.remember
        return lambda context: remember((*size, zoom, mode), context)

    def _line(self) -> Line:
        count = len(self._buffer.bytes)
        calls, problem = tuple(self._calls), "; ".join(self._oddities)
        self._begin()
        name = "" if calls else "unknown command"
        return self._buffer.cut(count, Kind.REQUEST, calls=calls, name=name, problem=problem)

    def _filler(self, name: str) -> Line:
        return self._buffer.cut(len(self._buffer.bytes), Kind.FILLER, name=name)

    # -- binary --

    def _take_opcode(self, event: Opcode) -> None:
        command = self._commands.get(event.code)
        if command is None:
            self._swallowed += 1
            if self._swallowed <= 3:
                shown = f"opcode 0x{event.code:02x}" if event.code >= 0x80 else f"{chr(event.code)!r}"
                self._oddities.append(f"{self._context.profile.name} swallows {shown}")
            return
        self._calls.append(command.call(event.parameters, self._context.profile))
        if command.at_once is not None:
            self._expect(ExpectedAnswer(command.name, ((command.name, command.at_once),), True, f"{command.name}()"))
        if command.reply is not None:
            self._answers.append((command.name, command.reply))

    def _session(self, kind: Kind = Kind.REQUEST, problem: str = "") -> Line:
        """Return the session in the buffer; if it has ended, its answers are expected."""
        calls, answers = tuple(self._calls), tuple(self._answers)
        if answers and kind is Kind.REQUEST:
            name = " + ".join(name for name, _ in answers)
            self._expect(ExpectedAnswer(name, answers, True, " + ".join(f"{name}()" for name, _ in answers)))
        if self._swallowed and kind is Kind.REQUEST:
            kind = Kind.SWALLOWED
        more = [f"and {self._swallowed - 3} bytes more"] if self._swallowed > 3 else []
        oddities = [*([problem] if problem else []), *self._oddities, *more]
        self._begin()
        name = "" if calls else "a binary session without a known command"
        return self._buffer.cut(len(self._buffer.bytes), kind, calls=calls, name=name, problem="; ".join(oddities))

    def _piece(self) -> Line:
        """Return what is in the buffer: a request that is too long."""
        what = "a binary session" if self._connection.is_in_session else "a line"
        problem = f"{what} that goes on after {MAX_LENGTH} bytes"
        if not self._connection.is_in_session and not self._buffer.bytes.strip(b"\0\r\n"):
            return self._filler("zeros and line ends")
        calls = tuple(self._calls)
        self._calls, self._oddities, self._swallowed = [], [], 0
        return self._buffer.cut(len(self._buffer.bytes), Kind.HALF, calls=calls, problem=problem)
