"""The steps of a firmware's work: those that take time, send bytes, or end it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Send:
    """Put bytes on the line.

    Attributes:
        data: The bytes.
        waits: Whether the firmware waits until they have left, as it nearly always does.
        unasked: Whether they do not answer a command, like the banner.
    """

    data: bytes
    waits: bool = True
    unasked: bool = False


@dataclass(frozen=True, slots=True)
class Busy:
    """Work for *seconds*; bytes that arrive wait in the receive buffer."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Bootloader:
    """Stay in the bootloader for *seconds*; bytes that arrive are lost, and the first one ends the wait."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Reset:
    """Start again from the bootloader; everything in memory and all bytes on their way in are lost."""


@dataclass(frozen=True, slots=True)
class Hang:
    """Wait for ever. Only a power cycle helps."""


FirmwareStep = Send | Busy | Bootloader | Reset | Hang
FirmwareSteps = Iterator[FirmwareStep]
