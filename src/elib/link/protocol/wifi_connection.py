"""The host's side of a Wi-Fi connection: which packet of the stream answers which request. No I/O, no clock.

Nothing in a packet says which command it follows. But a command that asks for nothing, the marker, is answered by
an empty packet in the cycle that takes it, and the robot takes one command a cycle, in order. So every request begins
with a marker, and runs of empty packets answer the markers one by one: the first packet of a run says that the request
was applied, and what comes behind the run was made after it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from elib.base.errors import LocalProtocolError, RemoteProtocolError
from elib.link.protocol.connection import Answer, Greeting, Refusal, ResyncAnswer, State
from elib.link.protocol.context import Context
from elib.link.protocol.image import Image
from elib.link.protocol.table import Request
from elib.link.protocol.values import Sensors
from elib.link.protocol.wifi import (
    COMMAND,
    EMPTY,
    MAX_WAITING,
    NO_REQUEST,
    PAYLOAD,
    REQUEST,
    SENSORS,
    STREAM_IMAGES,
    PacketReply,
    check_sensors,
    packet_value,
    pair,
)


@dataclass(slots=True)
class Marker:
    """A command that asks for nothing, which the robot did not answer yet."""

    request: Request[object] | None  # the request that it begins; None if no caller waits for that any more
    behind: int  # commands that were sent behind it, before the next marker


@dataclass(frozen=True, slots=True)
class Streamed:
    """A packet came with readings, or with a picture."""

    value: Sensors | Image  # all the readings that Wi-Fi has, or the picture


@dataclass(frozen=True, slots=True)
class OutOfStep:
    """The bytes are not packets, or do not follow from what was sent: nothing on this connection can be trusted now."""

    reason: str  # what was found, as a sentence without its subject, the robot


Wanted = Callable[[float], bool]
"""Returns whether the readings of the packet that came at a time, s on the caller's clock, are wanted."""
WifiEvent = Answer | Refusal | ResyncAnswer | Greeting | Streamed | OutOfStep


class WifiConnection:
    """One Wi-Fi connection to one robot; for a session it is like ``HostConnection``.

    Args:
        context: Profile, origin and memory of this connection.
    """

    is_stream = True
    """Whether bytes come all the time, so that silence says that the link is stuck."""

    def __init__(self, context: Context) -> None:
        self.context = context  # profile, origin and memory of this connection
        # asked for each sensor packet whether it is to be an event; None if none is
        self.wants_sensors: Wanted | None = None
        self.busy_time = 0.0  # longest time that the robot may be busy with what was abandoned, s
        self.received_bytes = 0  # bytes that came so far
        # whether the marker that did not return yet belongs to no call: it changes what is streamed
        self.is_tidying = False
        self._buffer = bytearray()
        self._events: deque[WifiEvent] = deque()
        self._request: Request[object] | None = None
        self._markers: deque[Marker] = deque()
        """The markers that did not return."""
        self._tail = 0
        """Commands behind the newest marker that returned, which may still wait in the robot."""
        self._has_returned = False
        """Whether the marker of the request under way has returned."""
        self._is_in_run = False
        self._is_closed = False

    @property
    def state(self) -> State:
        """The state of the connection; it is out of sync while a marker may return that no caller waits for."""
        if self._is_closed:
            return State.CLOSED
        if self._request is not None:
            return State.BUSY
        return State.OUT_OF_SYNC if self._markers else State.IDLE

    @property
    def waiting_commands(self) -> int:
        """The most commands that may wait in the robot now: which were taken is known only by the markers."""
        return self._tail + sum(1 + marker.behind for marker in self._markers)

    def send(self, request: Request[object]) -> bytes:
        """Return the bytes of *request*. From now on the next run is its own.

        Raises:
            LocalProtocolError: A request is under way, or a marker did not return.
        """
        if self.state is not State.IDLE:
            raise LocalProtocolError(f"SEND is not possible now: {self.state.value}")
        self._request = request
        self._has_returned = False
        data = request.data if request.make is None else request.make(self.context)
        self._note_sent(data, request)
        return data

    def overtaking_bytes(self, request: Request[object]) -> bytes:
        """Return a command that does past the one under way what *request* does, or none if there is no room for it.

        It has no marker, so nothing answers it. One at most may stand behind each marker: with more, the next request
        could be the fifth command in the robot.
        """
        behind = self._markers[-1].behind if self._markers else self._tail
        if self.waiting_commands >= MAX_WAITING or behind > 1:
            return b""
        data = request.data if request.make is None else request.make(self.context)
        return data[COMMAND.size :]

    def overtake(self, data: bytes) -> None:
        """Note that a command without a marker was sent past the request under way."""
        self._note_sent(data, None)

    def abandon(self) -> None:
        """Give up the request under way; its marker still returns, and whatever it asked for is dropped."""
        request, self._request = self._request, None
        assert request is not None
        for marker in self._markers:
            marker.request = None
        self.busy_time = request.service if self._markers else 0.0
        self.is_tidying = False

    def unasked(self) -> bytes:
        """Return commands that make the robot stream what is wanted now, or none if it does.

        Call it when no request is under way. The next request waits until they are taken.
        """
        is_sent = bool(self.context.sent[REQUEST] & STREAM_IMAGES)
        if self.state is not State.IDLE or is_sent == self.context.streams_images:
            return b""
        data = pair(self.context)
        self._note_sent(data, None)
        self.is_tidying = True
        return data

    def close(self) -> None:
        """End the connection; bytes that come are ignored."""
        self._is_closed = True
        self._request = None
        self._markers.clear()
        self._buffer.clear()

    def receive(self, data: bytes, time: float) -> None:
        """Take bytes that arrived at *time*, s on the caller's clock; :meth:`next_event` returns what they mean."""
        if self._is_closed:
            return
        self.context.time = time
        self.received_bytes += len(data)
        self._buffer += data
        start = 0
        try:
            while start < len(self._buffer):
                kind = self._buffer[start]
                size = PAYLOAD.get(kind)
                if size is None:
                    raise RemoteProtocolError(f"a packet of the unknown kind 0x{kind:02x} came")
                if len(self._buffer) < start + 1 + size:
                    break
                self._take(kind, start + 1)
                start += 1 + size
        except RemoteProtocolError as error:
            self.close()
            self._events.append(OutOfStep(error.message))
            return
        del self._buffer[:start]

    def next_event(self) -> WifiEvent | None:
        """Return the next event, or None until more bytes come.

        Returns:
            :class:`~elib.link.protocol.connection.Answer`: The request under way is answered.
            :class:`~elib.link.protocol.connection.ResyncAnswer`: Every marker has returned that no caller waits for.
            :class:`Streamed`: Readings or a picture came.
            :class:`OutOfStep`: The connection is of no more use.
        """
        return self._events.popleft() if self._events else None

    def _note_sent(self, data: bytes, request: Request[object] | None) -> None:
        count = len(data) // COMMAND.size
        if data[REQUEST] == NO_REQUEST:
            self._markers.append(Marker(request, count - 1))
        elif self._markers:
            self._markers[-1].behind += count
        else:
            self._tail += count
        self.context.sent = data[-COMMAND.size :]

    def _take(self, kind: int, payload: int) -> None:
        """Take the packet whose payload begins at *payload* in the buffer."""
        if kind == EMPTY:
            if not self._is_in_run:
                self._is_in_run = True
                self._begin_run()
            return
        if self._is_in_run:
            self._is_in_run = False
            self._tail = max(0, self._tail - 1)  # the robot has taken a command behind the marker
        if kind == SENSORS:
            check_sensors(self._buffer, payload)
        request = self._request
        is_answer = request is not None and self._has_returned and _kind(request) == kind
        if kind == SENSORS:
            is_streamed = self.wants_sensors is not None and self.wants_sensors(self.context.time)
        else:
            is_streamed = self.context.streams_images
        if not (is_answer or is_streamed):
            return
        try:
            value = packet_value(kind, self._buffer, payload, self.context)
        except RemoteProtocolError as error:  # a number is not finite
            if is_answer and request is not None:
                self._request = None
                self._events.append(Refusal(request, error))
            return
        if is_answer and request is not None:
            self._answer(request, value)
        if is_streamed and value is not None:
            self._events.append(Streamed(value))

    def _begin_run(self) -> None:
        if not self._markers:
            raise RemoteProtocolError("an empty packet came that nothing asked for")
        marker = self._markers.popleft()
        request, self._tail = marker.request, marker.behind
        if request is not None:
            self._has_returned = True
            if _kind(request) == EMPTY:
                self._answer(request, None)
        elif self.state is State.IDLE:
            self.is_tidying = False
            self.busy_time = 0.0
            self._events.append(ResyncAnswer())

    def _answer(self, request: Request[object], value: Sensors | Image | None) -> None:
        assert isinstance(request.reply, PacketReply)
        self._request = None
        request.confirmed(self.context)
        self._events.append(Answer(request, request.reply.pick(value)))


def _kind(request: Request[object]) -> int:
    assert isinstance(request.reply, PacketReply)
    return request.reply.kind
