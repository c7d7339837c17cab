"""The interface of every transport, and its base class: one buffer, one waiting reader, one way to close."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

from elib.base.errors import ElibError, LinkClosed, LinkError, LinkLost

BUFFER_LIMIT = 65536
"""Unread bytes above which the other side must wait: twenty pictures of the largest kind."""

SLICE = 1024
"""Most bytes that a listener gets at once, so that it can say that it is full."""

WRITE_STALL = 5.0
"""Seconds after which a link counts as lost if the other side takes no byte.

A healthy robot is busy for 3.7 s at most, while it calibrates (wire-protocol.md, 5.13).
"""


class Transport(Protocol):
    """An open, ordered, bidirectional stream of bytes to one robot.

    One task reads and one writes. Every error is a :class:`~elib.LinkError`, never one of the system. A
    transport is used once: after :meth:`close` or a lost link it stays dead.
    :func:`elib.testing.check_transport` checks these rules.

    Three attributes may be there: ``codec`` if the bytes are not those of a serial line (:func:`codec_of`);
    ``last_command``, over Wi-Fi, if it goes on with an earlier program; ``tells_counters``, False for a recording in
    which the step counters were not read while the link was opened.
    """

    @property
    def url(self) -> str:
        """The URL that opens the same thing again."""
        ...

    @property
    def origin(self) -> str:
        """Origin of the readings that arrive here: ``robot``, ``simulator`` or ``replay``."""
        ...

    async def read(self) -> bytes:
        """Return the bytes that arrived, at least one.

        Cancelling loses no bytes.

        Raises:
            LinkLost: The other side is gone.
            LinkClosed: :meth:`close` was called.
        """
        ...

    async def write(self, data: bytes) -> None:
        """Send *data*, all of it or none as far as the system allows.

        Raises:
            LinkLost: The other side is gone, or takes no more bytes.
            LinkClosed: :meth:`close` was called.
        """
        ...

    async def close(self) -> None:
        """Free the port at once. It takes a limited time, may be called twice, and never raises."""
        ...


def codec_of(transport: Transport) -> str:
    """Return what a transport carries, its attribute ``codec``.

    Returns:
        ``"serial"``, the usual one, for text and binary commands; ``"wifi"`` for the packets of the e-puck2's Wi-Fi.
    """
    return str(getattr(transport, "codec", "serial"))


class BufferedTransport(ABC):
    """A :class:`~elib.link.transport.base.Transport` that callbacks feed.

    Subclasses call :meth:`feed` and :meth:`lose`, and implement how bytes are handed over. A listener gets arriving
    bytes at once, without a task that waits for them.

    Args:
        url: The URL that opens the same thing again.
        origin: ``robot``, ``simulator`` or ``replay``.
    """

    codec: str = "serial"  # what the bytes are; see codec_of

    def __init__(self, url: str, *, origin: str = "robot") -> None:
        self._url = url
        self._origin = origin
        self._buffer = bytearray()
        self._reader: asyncio.Future[None] | None = None
        self._writer: asyncio.Future[None] | None = None
        self._listener: Callable[[bytes], None] | None = None
        self._on_lost: Callable[[], None] | None = None
        self._loss: tuple[type[LinkLost], str, str] | None = None
        self._closed = False
        # called when the other side has taken bytes that were kept for it
        self.on_room: Callable[[], None] | None = None

    @property
    def url(self) -> str:
        """The URL that opens the same thing again."""
        return self._url

    @property
    def origin(self) -> str:
        """Origin of the readings that arrive here: ``robot``, ``simulator`` or ``replay``."""
        return self._origin

    @property
    def is_open(self) -> bool:
        """Whether bytes can still be written."""
        return not self._closed and self._loss is None

    @property
    def loss(self) -> LinkLost | None:
        """Why the link was lost, or None."""
        if self._loss is None:
            return None
        kind, message, hint = self._loss
        return kind(message, hint=hint)

    @property
    def room(self) -> int:
        """How many bytes can arrive here before the other side has to wait."""
        return SLICE if self._listener else max(0, BUFFER_LIMIT - len(self._buffer))

    @property
    def unread(self) -> int:
        """How many bytes arrived and were not read yet."""
        return len(self._buffer)

    @property
    def unsent(self) -> int:
        """How many bytes are kept here because the other side did not take them yet."""
        return self._unsent()

    async def read(self) -> bytes:
        """Return the bytes that arrived, at least one.

        Cancelling loses no bytes. What arrived before the link was lost is returned first.

        Raises:
            LinkLost: The other side is gone.
            LinkClosed: :meth:`close` was called.
        """
        while not self._buffer:
            self._check_open()
            if self._reader is not None:
                raise LinkError(f"two tasks read {self._url}; a transport has one reader")
            self._reader = asyncio.get_running_loop().create_future()
            try:
                await self._reader
            finally:
                self._reader = None
        return self.take_unread()

    async def write(self, data: bytes) -> None:
        """Send *data*, waiting while the other side takes no more.

        Raises:
            LinkLost: The other side is gone, or took no byte for 5 s.
            LinkClosed: :meth:`close` was called.
        """
        self._check_open()
        if self._writer is not None:
            raise LinkError(f"two tasks write to {self._url}; a transport has one writer")
        self._push(data)
        while before := self._unsent():
            self._writer = asyncio.get_running_loop().create_future()
            try:
                async with asyncio.timeout(WRITE_STALL):
                    await self._writer
            except TimeoutError:
                if self._unsent() >= before:
                    self.lose(
                        f"{self._url}: the other side took no byte for {WRITE_STALL:g} s",
                        hint="is the robot still on and in range? switch it off and on, and connect again",
                    )
            finally:
                self._writer = None
            self._check_open()

    def send_nowait(self, data: bytes) -> bool:
        """Send *data* without waiting; return False if there is no room and all of it is dropped."""
        if not self.is_open or self._unsent() + len(data) > BUFFER_LIMIT:
            return False
        try:
            self._push(data)
        except LinkError:
            return False
        return True

    @abstractmethod
    def abort(self) -> None:
        """Free the port without waiting for anything; unsent bytes are lost."""

    async def close(self) -> None:
        """Free the port at once. It takes a limited time, may be called twice, and never raises."""
        self.abort()

    def listen(self, on_bytes: Callable[[bytes], None] | None, on_lost: Callable[[], None] | None = None) -> None:
        """Give bytes to *on_bytes* as they arrive, instead of keeping them for :meth:`read`.

        Args:
            on_bytes: Called with at least one byte; None keeps bytes again, and a full buffer makes the other side
                wait.
            on_lost: Called once when the other side is gone; at once if it is gone already.
        """
        self._listener = on_bytes
        self._on_lost = on_lost
        while self._listener is not None and self._buffer:
            self._listener(self.take_unread(SLICE))
        if self._loss is not None:
            self._report_loss()

    def deliver(self, data: bytes) -> bool:
        """Give *data* from the other side to the listener at once; return False if it cannot take them."""
        if self._listener is None or self._buffer or not 0 < len(data) <= SLICE:
            return False
        self._listener(data)
        return True

    def feed(self, data: bytes) -> None:
        """Take *data* from the other side."""
        if self._closed or not data or self.deliver(data):
            return
        self._buffer += data
        while self._listener is not None and self._buffer:
            self._listener(self.take_unread(SLICE))
        self._wake_reader()
        if len(self._buffer) >= BUFFER_LIMIT:
            self._pause()

    def take_unread(self, count: int = BUFFER_LIMIT) -> bytes:
        """Return the bytes that arrived and were not read yet, *count* at most."""
        data = bytes(self._buffer[:count])
        del self._buffer[:count]
        self._resume()
        return data

    def lose(self, message: str, *, hint: str = "", kind: type[LinkLost] = LinkLost) -> None:
        """Mark the link as lost: writing ends at once, reading when the buffer is empty."""
        if self._closed or self._loss is not None:
            return
        self._loss = (kind, message, hint)
        self._wake_reader()
        self.wake_writer()
        self._report_loss()

    def wake_writer(self) -> None:
        """Let a waiting writer check again whether it can go on."""
        if self._writer is not None and not self._writer.done():
            self._writer.set_result(None)
        if self.on_room is not None and not self._unsent():
            self.on_room()

    def _mark_closed(self) -> None:
        self._closed = True
        self._listener = self._on_lost = self.on_room = None
        self._buffer.clear()
        self._wake_reader()
        self.wake_writer()

    def _check_open(self) -> None:
        if self._closed:
            raise LinkClosed(f"{self._url} was closed on this side", hint="open it again")
        if self.loss is not None:
            raise self.loss

    def _wake_reader(self) -> None:
        if self._reader is not None and not self._reader.done():
            self._reader.set_result(None)

    def _report_loss(self) -> None:
        on_lost, self._on_lost = self._on_lost, None
        if on_lost is not None:
            on_lost()

    @abstractmethod
    def _push(self, data: bytes) -> None:
        """Hand *data* to the other side. What it does not take yet is kept; :meth:`wake_writer` tells when it did.

        Raises:
            LinkLost: The other side is gone.
        """

    def _unsent(self) -> int:
        """Return how many bytes are kept because the other side did not take them yet."""
        return 0

    def _pause(self) -> None:  # noqa: B027  # nothing to do for one whose other side sends no more than can be kept
        """Take no more bytes from the other side: the buffer is full."""

    def _resume(self) -> None:  # noqa: B027
        """Take bytes from the other side again."""


def buffered(transport: Transport) -> BufferedTransport:
    """Return *transport* itself if it calls back, or else a relay in front of it, on the running loop."""
    return transport if isinstance(transport, BufferedTransport) else Relay(transport)


class Relay(BufferedTransport):
    """Calls back for a transport that can only be read and written; two tasks move the bytes."""

    def __init__(self, inner: Transport) -> None:
        super().__init__(inner.url, origin=inner.origin)
        self.codec = codec_of(inner)
        self._inner = inner
        self._out = bytearray()
        self._has_output = asyncio.Event()
        self._may_read = asyncio.Event()
        self._may_read.set()
        loop = asyncio.get_running_loop()
        self._tasks = [loop.create_task(self._move_in()), loop.create_task(self._move_out())]

    def abort(self) -> None:
        """Stop moving bytes; the inner transport is closed in the background."""
        if self._closed:
            return
        self._mark_closed()
        for task in self._tasks:
            task.cancel()
        self._tasks = [asyncio.get_running_loop().create_task(self._inner.close())]

    async def close(self) -> None:
        """Free the port."""
        self.abort()
        await asyncio.wait(self._tasks)

    async def _move_in(self) -> None:
        try:
            while True:
                await self._may_read.wait()
                self.feed(await self._inner.read())
        except ElibError as error:
            self.lose(error.message, hint=error.hint)

    async def _move_out(self) -> None:
        try:
            while True:
                await self._has_output.wait()
                data = bytes(self._out)
                await self._inner.write(data)
                del self._out[: len(data)]
                if not self._out:
                    self._has_output.clear()
                    self.wake_writer()
        except ElibError as error:
            self.lose(error.message, hint=error.hint)

    def _push(self, data: bytes) -> None:
        self._out += data
        self._has_output.set()

    def _unsent(self) -> int:
        return len(self._out)

    def _pause(self) -> None:
        self._may_read.clear()

    def _resume(self) -> None:
        self._may_read.set()
