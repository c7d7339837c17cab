"""What every transport shares: one buffer, one waiting reader, one way to die."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Callable

from elib.errors import LinkClosed, LinkError, LinkLost

BUFFER_LIMIT = 65536
"""Bytes that wait unread before the other side is told to wait. Twenty pictures of the largest kind."""

SLICE = 1024
"""Bytes a listener gets at once at most, so that it can say that it is full."""

WRITE_STALL = 5.0
"""Seconds without a byte taken after which a link counts as lost.

The longest deafness of a healthy robot is its calibration, 3.7 s (protocol.md, 5.13).
"""


class BufferedTransport(ABC):
    """A :class:`~elib.transport.base.Transport` that is fed by callbacks.

    Subclasses call :meth:`feed` and :meth:`lose`, and implement sending. A listener takes arriving bytes at
    once, without a task that waits for them; the emulator's link uses that.

    Args:
        url: The URL that opens the same thing again.
        origin: ``robot``, ``simulator`` or ``replay``.
    """

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

    @property
    def url(self) -> str:
        """The URL that opens the same thing again."""
        return self._url

    @property
    def origin(self) -> str:
        """Where readings come from that arrive here: ``robot``, ``simulator`` or ``replay``."""
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
        """Bytes that arrived and were not taken yet."""
        return len(self._buffer)

    async def read(self) -> bytes:
        """Return whatever arrived, at least one byte.

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
        return self._take()

    @abstractmethod
    async def write(self, data: bytes) -> None:
        """Hand *data* over; see :meth:`elib.transport.base.Transport.write`."""

    @abstractmethod
    def send_nowait(self, data: bytes) -> bool:
        """Send *data* without waiting; return False if there was no room and it was dropped whole."""

    @abstractmethod
    def abort(self) -> None:
        """Free the port without waiting for anything; unsent bytes are lost."""

    @abstractmethod
    async def close(self) -> None:
        """Free the port at once. Bounded, safe to call twice, and never raises."""

    def listen(self, on_bytes: Callable[[bytes], None] | None, on_lost: Callable[[], None] | None = None) -> None:
        """Hand bytes to *on_bytes* as they arrive instead of keeping them for :meth:`read`.

        Args:
            on_bytes: Called with at least one byte; None keeps them again, and a full buffer makes the
                other side wait.
            on_lost: Called once when the other side is gone, at once if it is gone already.
        """
        self._listener = on_bytes
        self._on_lost = on_lost
        while self._listener is not None and self._buffer:
            self._listener(self._take(SLICE))
        if self._loss is not None:
            self._report_loss()

    def feed(self, data: bytes) -> None:
        """Take *data* from the other side."""
        if self._closed or not data:
            return
        if self._listener is not None and not self._buffer and len(data) <= SLICE:
            self._listener(data)
            return
        self._buffer += data
        while self._listener is not None and self._buffer:
            self._listener(self._take(SLICE))
        self._wake_reader()
        if len(self._buffer) >= BUFFER_LIMIT:
            self._pause()

    def take_unread(self) -> bytes:
        """Return what arrived and was not taken yet, at most as much as waits before the other side is told to."""
        return self._take()

    def lose(self, message: str, *, hint: str = "", kind: type[LinkLost] = LinkLost) -> None:
        """Mark the link as lost: writing ends at once, reading once the buffer is empty."""
        if self._closed or self._loss is not None:
            return
        self._loss = (kind, message, hint)
        self._wake_reader()
        self.wake_writer()
        self._report_loss()

    def wake_writer(self) -> None:
        """Let a waiting writer look again whether it can go on."""
        if self._writer is not None and not self._writer.done():
            self._writer.set_result(None)

    def _mark_closed(self) -> None:
        self._closed = True
        self._listener = self._on_lost = None
        self._buffer.clear()
        self._wake_reader()
        self.wake_writer()

    async def _wait_to_write(self, waiting: Callable[[], int]) -> None:
        """Wait for :meth:`wake_writer`, as long as *waiting*, a number of bytes, shrinks.

        Raises:
            LinkLost: It did not shrink for 5 s.
        """
        if self._writer is not None:
            raise LinkError(f"two tasks write to {self._url}; a transport has one writer")
        before = waiting()
        self._writer = asyncio.get_running_loop().create_future()
        try:
            async with asyncio.timeout(WRITE_STALL):
                await self._writer
        except TimeoutError:
            if waiting() >= before:
                self.lose(
                    f"{self._url}: the other side took no byte for {WRITE_STALL:g} s",
                    hint="switch the robot off and on, and connect again",
                )
        finally:
            self._writer = None
        self._check_open()

    def _check_open(self) -> None:
        if self._closed:
            raise LinkClosed(f"{self._url} was closed on this side", hint="open it again")
        if self._loss is not None:
            kind, message, hint = self._loss
            raise kind(message, hint=hint)

    def _take(self, count: int = BUFFER_LIMIT) -> bytes:
        data = bytes(self._buffer[:count])
        del self._buffer[:count]
        self._resume()
        return data

    def _wake_reader(self) -> None:
        if self._reader is not None and not self._reader.done():
            self._reader.set_result(None)

    def _report_loss(self) -> None:
        on_lost, self._on_lost = self._on_lost, None
        if on_lost is not None:
            on_lost()

    @abstractmethod
    def _pause(self) -> None:
        """Take no more from the other side: the buffer is full."""

    @abstractmethod
    def _resume(self) -> None:
        """Take from the other side again."""
