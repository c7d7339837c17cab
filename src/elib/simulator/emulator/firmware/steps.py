"""The steps of a firmware's work: those that take time, send bytes, or end it."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Send:
    """Put bytes on the line."""

    data: bytes  # the bytes
    waits: bool = True  # whether the firmware waits until they have left, as it nearly always does
    unasked: bool = False  # whether they do not answer a command, like the banner


@dataclass(frozen=True, slots=True)
class Busy:
    """Work for *seconds*; bytes that arrive wait in the receive buffer."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Listen:
    """Wait up to *seconds* for one byte from the line. The firmware is sent the byte, or None if none came."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Deaf:
    """Work for *seconds* while the UART is off: bytes that arrive are lost."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Restart:
    """Start again from the bootloader; everything in memory and all bytes on their way in are lost."""


@dataclass(frozen=True, slots=True)
class Hang:
    """Wait for ever. Only a power cycle helps."""


FirmwareStep = Send | Busy | Listen | Deaf | Restart | Hang
FirmwareSteps = Generator[FirmwareStep, int | None, None]
