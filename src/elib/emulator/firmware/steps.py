"""What a firmware does that takes time or leaves the robot, in the order it does it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Send:
    """Put bytes on the line.

    Attributes:
        data: The bytes.
        waits: Whether the firmware waits until they are gone, as it nearly always does.
        unasked: Whether they answer no command: the banner.
    """

    data: bytes
    waits: bool = True
    unasked: bool = False


@dataclass(frozen=True, slots=True)
class Busy:
    """Do something else for *seconds*; bytes that arrive wait in the receive buffer."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Deaf:
    """Stay in the bootloader for *seconds*: bytes that arrive are eaten, the first one ends the wait."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Reset:
    """Start again from the bootloader; everything in memory, and on its way in, is lost."""


@dataclass(frozen=True, slots=True)
class Hang:
    """Wait for something that never comes. Only a reset or a power cycle helps."""


Step = Send | Busy | Deaf | Reset | Hang
Steps = Iterator[Step]
