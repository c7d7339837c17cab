"""A battery that a fault script runs down: its voltage, and what it does to the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

from elib.emulator.weather import WEAK, TimedFault


class Discharge:
    """What the battery faults of a script come to. Times are s since the script began.

    Args:
        faults: Of the kind ``battery``.
    """

    def __init__(self, faults: Sequence[TimedFault]) -> None:
        self._faults = sorted(faults, key=lambda fault: fault.when.start)
        self.empty_at = min(map(_empty_at, self._faults), default=math.inf)
        """When the robot dies; infinite if it does not."""

    def volts(self, time: float) -> float | None:
        """Return the voltage, V, by the fault begun last; it stays at its end. None before the first."""
        fault = self._last_begun(time)
        if fault is None:
            return None
        share = fault.when.share(time)
        return fault.level("volts", 1.0 if share is None else share)

    def slowness(self, time: float) -> float:
        """Return how much later answers come, s: from nothing at 3.54 V up to what the fault says when empty."""
        fault, volts = self._last_begun(time), self.volts(time)
        if fault is None or volts is None or volts >= WEAK:
            return 0.0
        slows, empty = fault.level("slows", 0.0), fault.level("empty", 0.0)
        return slows * min(1.0, (WEAK - volts) / (WEAK - empty)) if empty < WEAK else slows

    def _last_begun(self, time: float) -> TimedFault | None:
        return next((fault for fault in reversed(self._faults) if fault.when.start <= time), None)


def _empty_at(fault: TimedFault) -> float:
    start = fault.when.start
    first, last, empty = fault.level("volts", 0.0), fault.level("volts", 1.0), fault.level("empty", 0.0)
    if first <= empty:
        return start
    if last > empty:
        return math.inf
    end = fault.when.next_change(start)
    return start + (end - start) * (first - empty) / (first - last)
