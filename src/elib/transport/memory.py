"""Two transports joined in this process: the virtual robot's cable."""

from __future__ import annotations

from elib.transport.buffered import BUFFER_LIMIT, BufferedTransport


class MemoryTransport(BufferedTransport):
    """One end of a :func:`memory_pair`. Works on any event loop, in simulated time too."""

    def __init__(self, url: str, *, origin: str = "simulator") -> None:
        super().__init__(url, origin=origin)
        self._peer: MemoryTransport | None = None

    def join(self, peer: MemoryTransport) -> None:
        """Connect both ends, once."""
        self._peer, peer._peer = peer, self

    async def write(self, data: bytes) -> None:
        """Hand *data* to the other end; wait while its buffer is full.

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
        """Send *data* without waiting; return False if there was no room and it was dropped whole."""
        # A listener takes slices as they are fed to it; only what nobody reads can fill up.
        if not self.is_open or self._peer is None or self._peer.unread + len(data) > BUFFER_LIMIT:
            return False
        self._peer.feed(data)
        return True

    async def close(self) -> None:
        """Part from the other end, which can still read what was sent."""
        self.abort()

    def abort(self) -> None:
        """Part from the other end, which can still read what was sent."""
        if self._closed:
            return
        self._mark_closed()
        peer, self._peer = self._peer, None
        if peer is not None:
            peer.lose(f"{peer.url}: the other end was closed")

    def _missing_room(self) -> int:
        return 0 if self._peer is None else -self._peer.room

    def _pause(self) -> None:
        """Do nothing: the writer asks for room."""

    def _resume(self) -> None:
        if self._peer is not None:
            self._peer.wake_writer()


def memory_pair(url: str = "memory://", *, origin: str = "simulator") -> tuple[MemoryTransport, MemoryTransport]:
    """Return two transports, each of which reads what the other wrote.

    Args:
        url: What both say their URL is.
        origin: Where readings come from that arrive at either end.
    """
    left, right = MemoryTransport(url, origin=origin), MemoryTransport(url, origin=origin)
    left.join(right)
    return left, right
