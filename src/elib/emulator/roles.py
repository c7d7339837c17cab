"""What a link needs of those at its ends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from elib.emulator.faults import Fault


class Sent(Protocol):
    """Bytes a robot sent."""

    @property
    def time(self) -> float:
        """When the last of them left the robot, s."""
        ...

    @property
    def data(self) -> bytes:
        """The bytes, at least one."""
        ...

    @property
    def answer(self) -> int:
        """Running number of the answer they belong to; 0 if nobody asked."""
        ...


class Robot(Protocol):
    """What a link needs of :class:`~elib.emulator.emulator.Emulator`; times in s since the origin."""

    def receive(self, data: bytes, time: float) -> None:
        """Take *data* that reaches the robot's serial line at *time*."""
        ...

    def advance(self, time: float) -> Sequence[Sent]:
        """Do all that is due up to *time* and return what left the robot, in order."""
        ...

    @property
    def due(self) -> float | None:
        """When :meth:`advance` has something to do next; None if only :meth:`receive` can change that."""
        ...

    def power_cycle(self, time: float) -> None:
        """Forget everything and boot at *time*; called only where a fault script restarts robots."""
        ...

    @property
    def is_idle(self) -> bool:
        """Whether every answer has been sent completely."""
        ...


class Weather(Protocol):
    """What a link needs of a fault script at work."""

    def begin(self) -> None:
        """Begin with the script; called with every piece of bytes that a program sends."""
        ...

    def fate(self, time: float) -> Fault | None:
        """Return what befalls an answer that leaves the robot at *time*, s since the link's origin."""
        ...
