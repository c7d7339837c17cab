"""Two transports that are connected in this process."""

from __future__ import annotations

import asyncio

from elib.link.transport.base import BUFFER_LIMIT, BufferedTransport


class MemoryTransport(BufferedTransport):
    """One end of a :func:`memory_pair`. It works on any event loop, in simulated time too."""

    def __init__(self, url: str, *, origin: str = "simulator") -> None:
        super().__init__(url, origin=origin)
        self._peer: MemoryTransport | None = None
        self._out = bytearray()

    def join(self, peer: MemoryTransport) -> None:
        """Connect both ends, once."""
        self._peer, peer._peer = peer, self

    def send_nowait(self, data: bytes) -> bool:
        """Send *data* without waiting; return False if there is no room and all of it is dropped."""
        peer = self._peer
        if peer is None or self._closed or self._loss is not None:
            return False
        if not self._out and peer.deliver(data):
            return True
        if len(self._out) + peer.unread + len(data) > BUFFER_LIMIT:
            return False
        self._out += data
        self.flush()
        return True

    def abort(self) -> None:
        """Disconnect from the other end, which can still read what was sent."""
        if self._closed:
            return
        self._mark_closed()
        self._out.clear()
        peer, self._peer = self._peer, None
        if peer is not None:
            peer.lose(f"{peer.url}: the other end was closed")

    def _push(self, data: bytes) -> None:
        self._out += data
        self.flush()
        if self._out:
            self._check_open()

    def _unsent(self) -> int:
        return len(self._out)

    def flush(self) -> None:
        """Hand over as much as the other end has room for."""
        while self.is_open and self._out and self._peer is not None and (room := self._peer.room):
            piece = bytes(self._out[:room])
            del self._out[:room]
            self._peer.feed(piece)
        self.wake_writer()

    def _resume(self) -> None:
        # The bytes that made room are still on their way to the reader, so none may overtake them now.
        if self._peer is not None:
            asyncio.get_running_loop().call_soon(self._peer.flush)


def memory_pair(url: str = "memory://", *, origin: str = "simulator") -> tuple[MemoryTransport, MemoryTransport]:
    """Return two transports, each of which reads what the other wrote.

    Args:
        url: The URL of both.
        origin: Origin of the readings that arrive at either end.
    """
    left, right = MemoryTransport(url, origin=origin), MemoryTransport(url, origin=origin)
    left.join(right)
    return left, right
