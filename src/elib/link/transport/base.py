"""The interface of every transport."""

from __future__ import annotations

from typing import Protocol


class Transport(Protocol):
    """An open, ordered, bidirectional stream of bytes to one robot.

    One task reads and one writes. Every error is a :class:`~elib.LinkError`, never one of the system. A
    transport is used once: after :meth:`close` or a lost link it stays dead. Its attribute ``codec`` says what
    the bytes are, if they are not those of a serial line (:func:`codec_of`).
    Its attribute ``last_command`` is there if it goes on with an earlier program (:func:`last_command_of`).
    :func:`elib.testing.check_transport` checks these rules.
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


def last_command_of(transport: Transport) -> bytes:
    """Return the command over Wi-Fi with which an earlier program was left, the attribute ``last_command``.

    Returns:
        The command from which the first one is made, if the transport goes on with a recorded program. Nothing if it
        does not: the first command then stops the robot.
    """
    return bytes(getattr(transport, "last_command", b""))


def tells_counters(transport: Transport) -> bool:
    """Return whether the step counters may be read while a link is opened, the attribute ``tells_counters``.

    Returns:
        False for a recording in which they were not read then: its replay would differ.
    """
    return bool(getattr(transport, "tells_counters", True))
