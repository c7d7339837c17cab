"""The last few values of one reading as a row of blocks, for a table on a terminal."""

from __future__ import annotations

import math
from collections import deque

from elib.cli.readings import in_best_unit
from elib.cli.terminal import BLOCKS
from elib.protocol import values as v
from elib.protocol.image import Image

WIDTH = 8
MISSING = "·"


class Sparkline:
    """A row of blocks; their heights go from the lowest to the highest value so far.

    Args:
        span: Smallest difference that has the full height: with a smaller one, noise would look like a change.
        width: Number of values shown, the newest on the right.
    """

    def __init__(self, span: float, width: int = WIDTH) -> None:
        self._values: deque[float] = deque([math.nan] * width, maxlen=width)
        self._span = span
        self._low, self._high = math.inf, -math.inf

    def push(self, value: float) -> None:
        """Add a value; nan if there is none."""
        self._values.append(value)
        if math.isfinite(value):
            self._low, self._high = min(self._low, value), max(self._high, value)

    def __str__(self) -> str:
        # Values that differ by less than the span are drawn in the middle.
        missing = max(0.0, self._span - (self._high - self._low)) if self._high >= self._low else 0.0
        low, high = self._low - missing / 2, self._high + missing / 2
        return "".join(_block(value, low, high) for value in self._values)


def _block(value: float, low: float, high: float) -> str:
    if not math.isfinite(value):
        return MISSING
    share = (value - low) / (high - low) if high > low else 0.5
    return BLOCKS[min(len(BLOCKS) - 1, int(share * len(BLOCKS)))]


def trend(value: v.Reading | Image) -> float:
    """Return the number of a reading that its sparkline shows; nan if there is none.

    It is the nearest sensor, the brightest light, the loudest microphone, the length of a vector, or the mean of the
    numbers; a reading of one number is that number.
    """
    match value:
        case Image():
            return math.nan
        case v.Attitude():
            return value.inclination
        case v.IrCode():
            return float(value.data)
    numbers = [number for _, number, _ in in_best_unit(value)]
    match value:
        case _ if not numbers:
            return math.nan
        case v.Proximity() | v.Microphones():
            return float(max(numbers))
        case v.AmbientLight():
            return float(min(numbers))
        case v.Vector() | v.MagneticField():
            return math.hypot(*numbers)
    return sum(numbers) / len(numbers)


def sparkline_for(value: v.Reading | Image) -> Sparkline:
    """Return an empty sparkline that suits readings like *value*."""
    numbers = [] if isinstance(value, Image) else in_best_unit(value)
    return Sparkline(numbers[-1][2].span if numbers else 1)
