"""Any transport as one that calls back: what the session needs of it."""

from __future__ import annotations

import asyncio

from elib.errors import ElibError
from elib.transport.base import Transport
from elib.transport.buffered import BUFFER_LIMIT, BufferedTransport


def buffered(transport: Transport) -> BufferedTransport:
    """Return *transport* itself if it calls back already, else a relay in front of it, on the running loop."""
    return transport if isinstance(transport, BufferedTransport) else Relay(transport)


class Relay(BufferedTransport):
    """Calls back for a transport that can only be read and written: two tasks carry the bytes."""

    def __init__(self, inner: Transport) -> None:
        super().__init__(inner.url, origin=inner.origin)
        self._inner = inner
        self._out = bytearray()
        self._has_output = asyncio.Event()
        self._may_read = asyncio.Event()
        self._may_read.set()
        loop = asyncio.get_running_loop()
        self._tasks = [loop.create_task(self._bring()), loop.create_task(self._take_away())]

    async def write(self, data: bytes) -> None:
        """Hand *data* over, waiting while the inner transport takes none.

        Raises:
            LinkLost: The other side is gone, or took no byte for 5 s.
            LinkClosed: :meth:`close` was called.
        """
        self._check_open()
        self._out += data
        self._has_output.set()
        while self._out:
            await self._wait_to_write(lambda: len(self._out))

    def send_nowait(self, data: bytes) -> bool:
        """Send *data* without waiting; return False if there was no room and it was dropped whole."""
        if not self.is_open or len(self._out) + len(data) > BUFFER_LIMIT:
            return False
        self._out += data
        self._has_output.set()
        return True

    def abort(self) -> None:
        """Stop carrying bytes; the inner transport is closed in the background."""
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

    async def _bring(self) -> None:
        try:
            while True:
                await self._may_read.wait()
                self.feed(await self._inner.read())
        except ElibError as error:
            self._lose_with(error)

    async def _take_away(self) -> None:
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
            self._lose_with(error)

    def _lose_with(self, error: ElibError) -> None:
        self.lose(error.message, hint=error.hint)

    def _pause(self) -> None:
        self._may_read.clear()

    def _resume(self) -> None:
        self._may_read.set()
