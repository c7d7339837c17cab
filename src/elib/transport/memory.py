"""Two transports that are connected in this process."""

from __future__ import annotations

from elib.transport.buffered import BUFFER_LIMIT, BufferedTransport


class MemoryTransport(BufferedTransport):
    """One end of a :func:`memory_pair`. It works on any event loop, in simulated time too."""

    def __init__(self, url: str, *, origin: str = "simulator") -> None:
        super().__init__(url, origin=origin)
        self._peer: MemoryTransport | None = None

    def join(self, peer: MemoryTransport) -> None:
        """Connect both ends, once."""
        self._peer, peer._peer = peer, self

    async def write(self, data: bytes) -> None:
        """Send *data* to the other end; wait while its buffer is full.

        Raises:
            LinkLost: The other end was closed, or read nothing for 5 s.
            LinkClosed: :meth:`close` was called.
        """
        self._check_open()
        rest = memoryview(data)
        while len(rest):
            self._check_open()
            assert self._peer is not None
            taken = min(self._peer.room, len(rest))
            if taken:
                self._peer.feed(bytes(rest[:taken]))
                rest = rest[taken:]
            else:
                await self._wait_to_write(self._missing_room)

    def send_nowait(self, data: bytes) -> bool:
        """Send *data* without waiting; return False if there is no room and all of it is dropped."""
        # A listener takes all slices at once; only bytes that are not read can fill the buffer.
        if not self.is_open or self._peer is None or self._peer.unread + len(data) > BUFFER_LIMIT:
            return False
        self._peer.feed(data)
        return True

    async def close(self) -> None:
        """Disconnect from the other end, which can still read what was sent."""
        self.abort()

    def abort(self) -> None:
        """Disconnect from the other end, which can still read what was sent."""
        if self._closed:
            return
        self._mark_closed()
        peer, self._peer = self._peer, None
        if peer is not None:
            peer.lose(f"{peer.url}: the other end was closed")

    def _missing_room(self) -> int:
        return 0 if self._peer is None else -self._peer.room

    def _pause(self) -> None:
        """Do nothing: the writer checks the room."""

    def _resume(self) -> None:
        if self._peer is not None:
            self._peer.wake_writer()


def memory_pair(url: str = "memory://", *, origin: str = "simulator") -> tuple[MemoryTransport, MemoryTransport]:
    """Return two transports, each of which reads what the other wrote.

    Args:
        url: The URL of both.
        origin: Origin of the readings that arrive at either end.
    """
    left, right = MemoryTransport(url, origin=origin), MemoryTransport(url, origin=origin)
    left.join(right)
    return left, right
