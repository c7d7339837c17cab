"""The host's side of a connection: when a request may be sent, and which bytes answer it. No I/O, no clock.

::

    connection = HostConnection(context)
    transport.write(connection.send(request))
    connection.receive(data, time)
    while (event := connection.next_event()) is not None: ...

The states and their transitions are data (:data:`TRANSITIONS`); nothing outside this file changes the state.
"""

from __future__ import annotations

import enum
import re
from collections import deque
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from elib.base.errors import CommandRejected, LocalProtocolError, RemoteProtocolError
from elib.link.protocol.context import Context, Parsed, UnexpectedReply
from elib.link.protocol.replies import Several
from elib.link.protocol.shapes import GREETING, is_gctronic
from elib.link.protocol.table import Request

MAX_TAIL = 1024
"""Bytes kept while the answer to a probe is searched for; the longest one has 60."""
NOISE_LIMIT = 65536
"""Bytes of unexpected lines after which the request is given up."""
_START = re.compile(rb"Selector pos \d+\r?\n|(?:\x0c\x07)?" + re.escape(GREETING))
"""What a robot that starts says: asercom 1.2.2 a line, then every firmware two, of which the first begins like this."""


class State(enum.Enum):
    """The state of the connection."""

    IDLE = "nothing is under way and the line is in sync"
    BUSY = "one request waits for its answer"
    OUT_OF_SYNC = "bytes may still come that answer an earlier request"
    RESYNCING = "a probe is under way; bytes before its answer are dropped"
    CLOSED = "the connection is closed"

    __hash__ = object.__hash__  # identity is enough, and several times as fast


class Trigger(enum.Enum):
    """What changes the state: a call of a method of :class:`HostConnection`, or bytes that it received."""

    SEND = enum.auto()
    ANSWER = enum.auto()
    REFUSAL = enum.auto()
    ABANDON = enum.auto()
    SURPLUS = enum.auto()
    RESYNC = enum.auto()
    RESYNC_ANSWER = enum.auto()
    CLOSE = enum.auto()

    __hash__ = object.__hash__


TRANSITIONS: Mapping[State, Mapping[Trigger, State]] = {
    State.IDLE: {Trigger.SEND: State.BUSY, Trigger.SURPLUS: State.OUT_OF_SYNC},
    State.BUSY: {Trigger.ANSWER: State.IDLE, Trigger.REFUSAL: State.IDLE, Trigger.ABANDON: State.OUT_OF_SYNC},
    State.OUT_OF_SYNC: {Trigger.RESYNC: State.RESYNCING, Trigger.SURPLUS: State.OUT_OF_SYNC},
    State.RESYNCING: {Trigger.RESYNC_ANSWER: State.IDLE, Trigger.RESYNC: State.RESYNCING},
    State.CLOSED: {},
}
"""Every state also takes CLOSE."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The request under way is answered."""

    request: Request[object]
    value: object


@dataclass(frozen=True, slots=True)
class Refusal:
    """The request under way is refused, or its answer is malformed."""

    request: Request[object]
    error: RemoteProtocolError


@dataclass(frozen=True, slots=True)
class RequestLost:
    """The robot restarted and does not know the request under way any more: a question behind it is answered."""


@dataclass(frozen=True, slots=True)
class ResyncAnswer:
    """The probe is answered: the line is in sync again."""


@dataclass(frozen=True, slots=True)
class Greeting:
    """The robot greets without a request: it was switched on, or it has reset itself."""


Event = Answer | Refusal | RequestLost | ResyncAnswer | Greeting


@dataclass(frozen=True, slots=True)
class Probe:
    """A question whose answer cannot be confused with another one."""

    row: str
    data: bytes
    pattern: re.Pattern[bytes]
    first_line: re.Pattern[bytes]


class OutOfQuestions(Exception):
    """Every probe was asked and none was answered."""


class HostConnection:
    """One connection to one robot, from the recognised firmware to the end.

    Args:
        context: Profile, origin and memory of this connection.
        version: The robot's answer to ``V``, its first line without ``v,``: the first probe waits for exactly this.
    """

    is_stream = False
    """Whether bytes come all the time; here only answers do."""
    is_tidying = False

    def __init__(self, context: Context, version: str = "") -> None:
        self.context = context  # profile, origin and memory of this connection
        self.state = State.IDLE
        # whether a resync has to wait until the line is quiet: what may still come has no framing
        self.needs_silence = False
        self.is_overtaken = False  # whether something was sent past the request or probe under way
        self.has_greeted = False  # whether the robot has restarted since the request under way was sent
        self.busy_time = 0.0  # longest time that the robot may be busy with what was abandoned, s
        self.received_bytes = 0  # bytes that came so far
        self.probe_answer_bytes = 0  # bytes of the answer to the last probe
        self._request: Request[object] | None = None
        self._buffer = bytearray()
        self._events: deque[Event] = deque()
        self._unexpected_bytes = 0
        self._greeting_tail = b""
        self._copy = b""
        self._copy_row = ""
        self._sent = b""
        self._unsettled = b""
        self._asked: list[str] = []
        self._probe: Probe | None = None
        self._behind: Probe | None = None
        self._lines_to_skip = 0
        text = re.escape(version.encode("latin-1")) if version else rb"[^\r\n]+"
        hardware = rb"HW version:[^\r\n]*\r?\n" if is_gctronic(version) else rb""
        self._probes = [
            Probe(row, data, *(re.compile(answer + rb"\r?\n" + rest, re.IGNORECASE) for rest in (more, rb"")))
            for row, data, answer, more in (
                ("version", b"V\r", rb"v," + text, hardware),
                ("encoders", b"Q\r", rb"q(?:,-?\d+){2}", b""),
                ("speed", b"E\r", rb"e(?:,-?\d+){2}", b""),
                ("selector", b"C\r", rb"c,\d+", b""),
                ("proximity", b"N\r", rb"n(?:,-?\d+){8,10}", b""),
                ("ambient_light", b"O\r", rb"o(?:,-?\d+){8,10}", b""),
            )
        ]

    @property
    def probes_asked(self) -> int:
        """The number of probes that this resync has sent."""
        return len(self._asked)

    @property
    def needs_pause(self) -> bool:
        """Whether a probe right behind a stop would overrun the receive ring of a robot that is still busy."""
        profile = self.context.profile
        return profile.receive_ring < len(profile.line_end) + len(b"\rS\rV\r")

    def send(self, request: Request[object]) -> bytes:
        """Return the bytes of *request*. From now on bytes that come are matched with its answer.

        Raises:
            LocalProtocolError: A request is under way, or the line is out of sync.
        """
        self._change_state(Trigger.SEND)
        self._request = request
        if request.name == self._copy_row:
            self._copy = b""  # the answer may look like the copy
        self._buffer.clear()
        self._unexpected_bytes = 0
        self.has_greeted = False
        self._behind, self._lines_to_skip = None, 0
        self._sent = request.data if request.make is None else request.make(self.context)
        return self._sent

    def abandon(self) -> None:
        """Give up the request under way; its answer is no longer wanted."""
        request = self._request
        self._change_state(Trigger.ABANDON)
        assert request is not None
        self._request = None
        self._drop()
        self._lose_sync(self._sent, request.service, needs_silence=request.reply.is_binary)

    def overtaking_bytes(self, request: Request[object]) -> bytes:
        """Return the bytes that send *request* past all that is under way."""
        # Without the zeros of a probe: while the robot is busy, its receive ring must hold this and the probe.
        return b"\r" + (request.data if request.make is None else request.make(self.context))

    def ask_behind(self) -> bytes:
        """Return the bytes of a question behind the request under way, of a robot that has restarted.

        The robot may have taken the request after its restart, and then answers it first. If the question is answered
        first, the request was lost, and :class:`RequestLost` follows.
        """
        if self._behind is None:
            self._behind = next(probe for probe in self._probes if probe.data not in self._sent)
            self._sent += self._behind.data
            if self._behind.row == self._copy_row:
                self._copy = b""  # the answer may look like the copy
        self.is_overtaken = True
        return self.context.profile.line_end + self._behind.data

    def unasked(self) -> bytes:
        """Return what to send when no request is under way: nothing."""
        return b""

    def overtake(self, data: bytes) -> None:
        """Note that *data* was sent past the request under way; nothing waits for its answer.

        The answer comes behind that of the request or probe under way, so a resync follows before the next request.
        """
        if self.state is State.IDLE:
            self.lose_sync(data)
        else:
            self.is_overtaken = True

    def resync(self, avoid: Collection[str] = ()) -> bytes:
        """Return the bytes of the next probe.

        They begin with what ends a half-received command. A probe is never a question that was abandoned, not even as
        part of a longer request, and never one that this resync has asked already: two answers could not be told
        apart. The question of a row in *avoid*, which is sent next, comes last.

        Raises:
            OutOfQuestions: All probes were asked.
            LocalProtocolError: The line is not out of sync.
        """
        self._change_state(Trigger.RESYNC)
        left = [probe for probe in self._probes if probe.row not in self._asked and probe.data not in self._unsettled]
        if not left:
            raise OutOfQuestions
        self._probe = next((probe for probe in left if probe.row not in avoid), left[0])
        # The next resync begins with another question: a late copy of this one's answer must not open it.
        self._probes.remove(self._probe)
        self._probes.append(self._probe)
        self._asked.append(self._probe.row)
        self._buffer.clear()
        self.needs_silence = self.is_overtaken = False
        return self.context.profile.line_end + self._probe.data

    def lose_sync(self, data: bytes) -> None:
        """Mark an idle line as out of sync: an answer to *data*, sent past this connection, may still come."""
        self._surplus(data, b"", needs_silence=False)

    def close(self) -> None:
        """End the connection; bytes that come are ignored."""
        self.state = State.CLOSED
        self._request = self._probe = None
        self._buffer.clear()

    def receive(self, data: bytes, time: float) -> None:
        """Take bytes that arrived at *time*, s on the caller's clock; :meth:`next_event` returns what they mean."""
        self.context.time = time
        self.received_bytes += len(data)
        match self.state:
            case State.BUSY:
                self._buffer += data
                self._look_for_answer()
            case State.RESYNCING:
                self._buffer += data
                self._look_for_probe(len(data))
            case State.IDLE | State.OUT_OF_SYNC:
                self._take_unasked(data)
            case State.CLOSED:
                pass

    def next_event(self) -> Event | None:
        """Return the next event, or None until more bytes come.

        Returns:
            :class:`Answer`: The request under way is answered.
            :class:`Refusal`: The robot refused it, or its answer is malformed.
            :class:`RequestLost`: The robot has restarted and will not answer the request under way.
            :class:`ResyncAnswer`: The probe is answered; the line is in sync again.
            :class:`Greeting`: The robot has restarted by itself.
        """
        return self._events.popleft() if self._events else None

    def _change_state(self, trigger: Trigger) -> None:
        target = TRANSITIONS[self.state].get(trigger)
        if target is None:
            raise LocalProtocolError(f"{trigger.name} is not possible now: {self.state.value}")
        self.state = target

    def _lose_sync(self, asked: bytes, busy_time: float, *, needs_silence: bool) -> None:
        self._unsettled = asked
        self.busy_time = max(busy_time, 0.0)
        self._asked.clear()
        self._copy = b""
        self.needs_silence = needs_silence

    def _look_for_answer(self) -> None:
        request = self._request
        assert request is not None
        while True:
            if self._copy and not self._drop_copy():
                return
            # No answer reaches across a start of the robot, or past the answer to a question behind the request.
            behind = None if self._behind is None else self._behind.first_line.search(self._buffer)
            if self._lines_to_skip and behind is None and not self._skip_greeting():
                return
            start = None if request.name == "reset" else self._find_start()
            part = self._buffer
            if start or behind:
                part = part[: min(match.start() for match in (start, behind) if match)]
            found: Parsed[object] | UnexpectedReply | None
            try:
                found = request.reply.parse(part, 0, self.context)
            except RemoteProtocolError as error:
                is_refusal = isinstance(error, CommandRejected)
                if not self.has_greeted if is_refusal else part is self._buffer:
                    self._refuse(request, error)
                    return
                # The bootloader took the first bytes, and the program that then started did not know the rest.
                found = UnexpectedReply(len(part))
            if isinstance(found, UnexpectedReply):
                self._unexpected_bytes += found.end
                self._drop(found.end)
                if self._unexpected_bytes <= NOISE_LIMIT:
                    continue
                self._refuse(
                    request,
                    RemoteProtocolError(f"{NOISE_LIMIT} bytes came that do not answer it", hint="is the line noisy?"),
                )
            elif found is not None:
                self._accept(request, found)
            elif start is not None and start.start() == len(part):
                self._unexpected_bytes += start.end()
                self._lines_to_skip = 2 if start[0].endswith(GREETING) else 0
                self._drop(start.end())
                continue
            elif behind is not None:
                self.abandon()
                self._events.append(RequestLost())
            return

    def _find_start(self) -> re.Match[bytes] | None:
        """Return where the robot says that it starts, in the bytes that came."""
        buffer = self._buffer
        is_there = GREETING in buffer or b"Selector pos" in buffer  # much faster than the pattern
        return _START.search(buffer) if is_there else None

    def _skip_greeting(self) -> bool:
        """Drop what is left of a greeting; return False while more of it may come."""
        while self._lines_to_skip:
            end = self._buffer.find(b"\n") + 1
            if not end:
                return False
            self._lines_to_skip -= 1
            self._drop(end)
        return True

    def _accept(self, request: Request[object], found: Parsed[object]) -> None:
        rest = bytes(self._buffer[found.end :])
        self._buffer.clear()
        self._request = None
        self._change_state(Trigger.ANSWER)
        request.confirmed(self.context)
        self._events.append(Answer(request, found.value))
        self._copy = b""
        is_explained = not rest if request.reply.is_binary else not rest.strip(b"\r\n")
        if self._unexpected_bytes or self.is_overtaken or not is_explained:
            self._surplus(self._sent, rest, needs_silence=request.reply.is_binary)

    def _refuse(self, request: Request[object], error: RemoteProtocolError) -> None:
        self._request = None
        self._change_state(Trigger.REFUSAL)
        self._events.append(Refusal(request, error))
        rest = bytes(self._buffer)
        self._buffer.clear()
        if isinstance(error, CommandRejected) and not isinstance(request.reply, Several):
            rest = rest.partition(b"\n")[2].strip(b"\r\n")
        if rest or self.is_overtaken:
            # Malformed, or there is more behind the refusal: more may be on its way.
            self._surplus(self._sent, rest, needs_silence=request.reply.is_binary)

    def _drop_copy(self) -> bool:
        """Drop a repeated answer to a probe; return False while the bytes may still become one."""
        copy = self._copy
        if self._buffer.startswith(copy):
            del self._buffer[: len(copy)]
            self._copy = b""
            return True
        return not copy.startswith(self._buffer)

    def _look_for_probe(self, new: int) -> None:
        assert self._probe is not None
        begin = len(self._buffer) - new
        found = self._probe.pattern.search(self._buffer)
        if found is None:
            self._see_greeting(bytes(self._buffer[begin:]))  # at once: its time tells when the robot restarted
            del self._buffer[:-MAX_TAIL]
            return
        self._copy, rest = bytes(found[0]), bytes(self._buffer[found.end() :])
        self._see_greeting(bytes(self._buffer[begin : found.start()]))
        self._buffer.clear()
        self._copy_row = self._probe.row
        self.probe_answer_bytes = len(self._copy)
        self._probe = None
        self._change_state(Trigger.RESYNC_ANSWER)
        self._events.append(ResyncAnswer())
        self._unsettled = b""
        self._asked.clear()
        if self.is_overtaken:
            self._surplus(b"", b"", needs_silence=False)
        if rest:
            self._take_unasked(rest)

    def _take_unasked(self, data: bytes) -> None:
        if self.state is State.IDLE and self._copy:
            if self._copy.startswith(data):
                self._copy = self._copy[len(data) :]
                return
            if data.startswith(self._copy):
                data = data[len(self._copy) :]
                self._copy = b""
        if self.state is State.IDLE and data.strip(b"\r\n"):
            self._surplus(b"", data, needs_silence=not data.isascii())
        elif self.state is State.OUT_OF_SYNC:
            self._see_greeting(data)

    def _surplus(self, asked: bytes, data: bytes, *, needs_silence: bool) -> None:
        """Mark the line as out of sync: *data* came, which does not answer *asked*, the last request."""
        self._change_state(Trigger.SURPLUS)
        self._lose_sync(asked, 0.0, needs_silence=needs_silence)
        self._see_greeting(data)

    def _drop(self, end: int | None = None) -> None:
        """Drop what came before *end*, everything without it; a greeting may be in it."""
        self._see_greeting(bytes(self._buffer[:end]))
        del self._buffer[:end]

    def _see_greeting(self, data: bytes) -> None:
        tail = self._greeting_tail + data
        if GREETING in tail:
            self._events.append(Greeting())
            self.has_greeted = True
            tail = b""
        self._greeting_tail = tail[-len(GREETING) :]
