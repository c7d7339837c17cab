"""The interface every transport keeps."""

from __future__ import annotations

from typing import Protocol


class Transport(Protocol):
    """An open, ordered, bidirectional stream of bytes to one robot.

    One task reads and one writes. Every error is a :class:`~elib.errors.LinkError`; no system error leaks. A
    transport lives once: after :meth:`close` or a lost link it stays dead.
    :func:`elib.testing.transports.check_transport` proves that one keeps these rules.
    """

    @property
    def url(self) -> str:
        """The URL that opens the same thing again."""
        ...

    @property
    def origin(self) -> str:
        """Where readings come from that arrive here: ``robot``, ``simulator`` or ``replay``."""
        ...

    async def read(self) -> bytes:
        """Return whatever arrived, at least one byte.

        Cancelling loses no bytes.

        Raises:
            LinkLost: The other side is gone.
            LinkClosed: :meth:`close` was called.
        """
        ...

    async def write(self, data: bytes) -> None:
        """Hand *data* over, all of it or none as far as the system allows.

        Raises:
            LinkLost: The other side is gone, or takes no bytes any more.
            LinkClosed: :meth:`close` was called.
        """
        ...

    async def close(self) -> None:
        """Free the port at once. Bounded, safe to call twice, and never raises."""
        ...
