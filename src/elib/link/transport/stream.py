"""A transport on top of an asyncio transport: what TCP, RFCOMM and serial ports have in common."""

from __future__ import annotations

import asyncio
from typing import cast

from elib.link.transport.base import BufferedTransport

CLOSE_GRACE = 0.2
"""Seconds that closing waits for bytes that were written, before it drops them."""


class StreamTransport(BufferedTransport, asyncio.Protocol):
    """Bytes over an :class:`asyncio.Transport`; asyncio calls the lower half of its methods.

    It is an asyncio protocol rather than a pair of asyncio streams, because a ``StreamReader`` throws away what arrived
    before a connection broke.
    """

    def __init__(self, url: str, *, origin: str = "robot") -> None:
        super().__init__(url, origin=origin)
        self._channel: asyncio.Transport | None = None
        self._gone = asyncio.get_running_loop().create_future()

    async def close(self) -> None:
        """Free the port; bytes that the other side does not take within 0.2 s are dropped."""
        if not self._closed:
            self._mark_closed()
            if self._channel is not None:
                self._channel.close()
        if self._channel is None or self._gone.done():
            return
        try:
            await asyncio.wait({self._gone}, timeout=CLOSE_GRACE)
        finally:
            if not self._gone.done():
                self.abort()
        await asyncio.wait({self._gone}, timeout=CLOSE_GRACE)

    def fileno(self) -> int | None:
        """Return the file descriptor of the open line; None if there is none."""
        channel = None if self._closed else self._channel
        line = None if channel is None else channel.get_extra_info("socket")
        return None if line is None or line.fileno() < 0 else int(line.fileno())

    def abort(self) -> None:
        """Free the port without waiting for anything; unsent bytes are lost."""
        if not self._closed:
            self._mark_closed()
        if self._channel is not None and not self._gone.done():
            self._discard_output()
            self._channel.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take over the connection."""
        self._channel = cast("asyncio.Transport", transport)
        if self._closed:
            self._channel.abort()
            return
        # Without a buffer in our own process, write() returns only when the system has every byte.
        self._channel.set_write_buffer_limits(high=0)

    def data_received(self, data: bytes) -> None:
        """Store what arrived."""
        self.feed(data)

    def connection_lost(self, exc: Exception | None) -> None:
        """Tell the reader and the writer."""
        if not self._gone.done():
            self._gone.set_result(None)
        self.lose(f"{self._url}: {_reason(exc)}", hint="is the robot switched on and in range?")

    def resume_writing(self) -> None:
        """Let writers go on, soon: the system has every byte.

        asyncio must not be in the middle of its own write then. A byte that is sent from here to a client that has just
        left would end the connection a second time.
        """
        asyncio.get_running_loop().call_soon(self.wake_writer)

    def _push(self, data: bytes) -> None:
        assert self._channel is not None
        if self._channel.is_closing():
            self.lose(f"{self._url}: the other side hung up", hint="is the robot switched on and in range?")
            self._check_open()
        try:
            self._channel.write(data)
        except OSError as error:
            self.connection_lost(error)
            self._check_open()

    def _unsent(self) -> int:
        return 0 if self._channel is None else self._channel.get_write_buffer_size()

    def _pause(self) -> None:
        if self._channel is not None and not self._channel.is_closing():
            self._channel.pause_reading()

    def _resume(self) -> None:
        if self._channel is not None and not self._channel.is_closing():
            self._channel.resume_reading()

    def _discard_output(self) -> None:
        """Drop what the system has not sent yet, so that closing cannot wait for it."""


def _reason(error: Exception | None) -> str:
    if error is None:
        return "the other side hung up"
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return f"the link broke ({text})"
