"""Faults of single answers, and where they come from: a queue of a test, the control server, a fault script."""

from __future__ import annotations

import random
from dataclasses import dataclass, field, replace
from typing import Literal, Protocol

from elib.base.rules import Number, Whole

SECONDS, MASK, INDEX = Number(0, unit="s"), Whole(1, 255), Whole(0)
"""Rules for a fault. They are made once: each answer over a bad link makes faults."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """The faults of one answer; several things at once are allowed, and ``Fault()`` lets the answer pass.

    Raises:
        ArgumentError: A number is out of its range.
    """

    lose: bool = False  # nothing of the answer arrives
    delay: float = 0.0  # the answer comes this much later, s; those behind it wait, for a line never reorders
    halve: bool = False  # only the first half of its bytes arrives
    # index of a byte whose bits are inverted with *mask*; `"random"` for any of the first 64
    corrupt: int | Literal["random"] | None = None
    mask: int = 0x80  # the bits to invert, 1 to 255. The default makes a character of a text answer invalid.
    # the answer comes once more this much after its end, s; None for never. A copy that comes late does not hold up
    # other answers.
    copy_after: float | None = None

    def __post_init__(self) -> None:
        for name, seconds in (("delay", self.delay), ("copy_after", self.copy_after or 0.0)):
            SECONDS.require(seconds, name)
        MASK.require(self.mask, "mask")
        if self.corrupt not in (None, "random"):
            INDEX.require(self.corrupt, "corrupt")


def both(first: Fault | None, second: Fault) -> Fault:
    """Return two faults of one answer as one."""
    if first is None or second.lose:
        return second
    if first.lose:  # nothing is left of it that could have another fault
        return first
    return replace(
        first,
        delay=first.delay + second.delay,
        halve=first.halve or second.halve,
        corrupt=second.corrupt if first.corrupt is None else first.corrupt,
        mask=second.mask if first.corrupt is None else first.mask,
        copy_after=second.copy_after if first.copy_after is None else first.copy_after,
    )


class Impairment(Protocol):
    """Something that makes a link worse for as long as it is in ``Link.impairments``."""

    def begin(self) -> None:
        """Begin if it has not begun yet; called with every piece of bytes that a program sends."""
        ...

    def fault_at(self, time: float) -> Fault | None:
        """Return what goes wrong with an answer that leaves the robot at *time*, s since the link's origin."""
        ...


class ManualFaults:
    """Faults that are switched by hand, through ``Control``; an :class:`Impairment`.

    Args:
        seed: Seed of losses and jitter.

    Attributes:
        latency: Added delay of answers, s.
        jitter: Standard deviation of the added delay, s.
        loss: Probability that a whole answer is lost.
    """

    def __init__(self, seed: str) -> None:
        self.latency = self.jitter = self.loss = 0.0
        self._rng = random.Random(seed)

    def begin(self) -> None:
        """Do nothing: these faults hold from when they are set."""

    def fault_at(self, time: float) -> Fault | None:
        """Return a loss, a delay, or None."""
        if self.loss and self._rng.random() < self.loss:
            return Fault(lose=True)
        delay = self.latency
        if self.jitter:
            delay = max(0.0, self._rng.gauss(delay, self.jitter))
        return Fault(delay=delay) if delay else None


@dataclass(slots=True)
class FaultyAnswer:
    """One answer with a :class:`Fault`, piece by piece as the robot sends it.

    Args:
        fault: What goes wrong with it.
        rng: Chooses the byte where the fault leaves it open.
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
            # The length of an answer is known only at its end: half of what was seen so far may pass.
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
