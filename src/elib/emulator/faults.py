"""What can befall one answer on its way, as values a test or a script can queue."""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from typing import Literal

from elib.errors import ArgumentError


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """The fate of one answer; several harms at once are allowed, and ``Fault()`` lets the answer pass.

    Attributes:
        lose: Nothing of the answer arrives.
        delay: The answer comes this much later, s; those behind it wait, for a line never reorders.
        halve: Only the first half of its bytes arrives.
        corrupt: Index of a byte whose bits are turned over with *mask*; ``"random"`` for any of the first 64.
        mask: The bits to turn over, 1 to 255. The default makes a character of a text answer none.
        copy_after: The answer comes once more this much after its end, s; None for never. A copy that comes
            late does not hold up other answers.

    Raises:
        ArgumentError: A number is out of its range.
    """

    lose: bool = False
    delay: float = 0.0
    halve: bool = False
    corrupt: int | Literal["random"] | None = None
    mask: int = 0x80
    copy_after: float | None = None

    def __post_init__(self) -> None:
        for name, seconds in (("delay", self.delay), ("copy_after", self.copy_after or 0.0)):
            if not 0 <= seconds < float("inf"):
                raise ArgumentError(f"{name} is {seconds} s; it must be 0 or more")
        if not 1 <= self.mask <= 255:
            raise ArgumentError(f"mask is {self.mask}; it must be from 1 to 255, or the byte stays as it is")
        if isinstance(self.corrupt, int) and self.corrupt < 0:
            raise ArgumentError(f"corrupt is {self.corrupt}; the first byte of an answer has the index 0")


@dataclass(slots=True)
class Harm:
    """A :class:`Fault` at work on one answer, piece by piece as the robot sends it.

    Args:
        fault: What to do.
        rng: Chooses the byte when the fault leaves it open.
    """

    fault: Fault
    rng: random.Random
    end: float = 0.0
    arrived: bytearray = field(default_factory=bytearray)
    _held: bytearray = field(default_factory=bytearray)
    _seen: int = 0

    def take(self, data: bytes, time: float) -> tuple[float, bytes]:
        """Return when and what arrives because the robot sent *data* at *time*; maybe nothing."""
        fault = self.fault
        start = self._seen
        self._seen += len(data)
        index = fault.corrupt
        if index == "random":
            index = self.rng.randrange(len(data)) if start == 0 else None
        if index is not None and start <= index < self._seen:
            at = index - start
            data = data[:at] + bytes([data[at] ^ fault.mask]) + data[at + 1 :]
        if fault.lose:
            data = b""
        elif fault.halve:
            # How long the answer is shows only at its end: half of what was seen so far may pass.
            self._held += data
            passing = self._seen // 2 - len(self.arrived)
            data = bytes(self._held[:passing])
            del self._held[:passing]
        self.end = time + fault.delay
        if fault.copy_after is not None or fault.halve:
            self.arrived += data
        return self.end, data

    def copy(self) -> tuple[float, bytes]:
        """Return when and what comes once more after the answer; maybe nothing."""
        if self.fault.copy_after is None:
            return self.end, b""
        return self.end + self.fault.copy_after, bytes(self.arrived)
