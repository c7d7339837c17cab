"""The last few values of one reading as a row of blocks, for a table on a terminal."""

from __future__ import annotations

import math
from collections import deque

from elib.cli.terminal import BLOCKS
from elib.protocol import values as v
from elib.protocol.image import Image

WIDTH = 8
MISSING = "·"


class Sparkline:
    """Blocks that rise from the lowest to the highest value seen so far.

    Args:
        span: Smallest difference worth the full height: below it, noise would look like news.
        width: Values shown, the newest on the right.
    """

    def __init__(self, span: float, width: int = WIDTH) -> None:
        self._values: deque[float] = deque([math.nan] * width, maxlen=width)
        self._span = span
        self._low, self._high = math.inf, -math.inf

    def push(self, value: float) -> None:
        """Add a value; nan where there is none."""
        self._values.append(value)
        if math.isfinite(value):
            self._low, self._high = min(self._low, value), max(self._high, value)

    def __str__(self) -> str:
        # What is narrower than the span sits in its middle.
        missing = max(0.0, self._span - (self._high - self._low)) if self._high >= self._low else 0.0
        low, high = self._low - missing / 2, self._high + missing / 2
        return "".join(_block(value, low, high) for value in self._values)


def _block(value: float, low: float, high: float) -> str:
    if not math.isfinite(value):
        return MISSING
    share = (value - low) / (high - low) if high > low else 0.5
    return BLOCKS[min(len(BLOCKS) - 1, int(share * len(BLOCKS)))]


SPANS: dict[type, float] = {
    v.Wheels: 0.1,
    v.Steps: 100,
    v.Proximity: 200,
    v.AmbientLight: 200,
    v.Acceleration: 0.2,
    v.Attitude: 0.2,
    v.AngularVelocity: 0.2,
    v.MagneticField: 5e-6,
    v.Temperature: 2,
    v.Distance: 0.02,
    v.Ground: 100,
    v.Microphones: 100,
    v.Battery: 100,
}
"""Smallest difference that is shown at full height, in the unit of :func:`trend`: some times the noise of a robot that
stands still (robot-model.md, 2)."""


def trend(value: v.Reading | Image) -> float:
    """Return the one number of a reading that its sparkline follows; nan if there is none.

    The nearest sensor, the brightest light, the loudest microphone, the length of a vector, the mean of both wheels; a
    reading of one number is that number.
    """
    match value:
        case v.Proximity() | v.Microphones():
            return float(max(value, default=math.nan))
        case v.AmbientLight():
            return float(min(value))
        case v.Acceleration():
            return math.hypot(*value.g)
        case v.AngularVelocity():
            return math.hypot(*value.rad_per_s)
        case v.MagneticField():
            return math.hypot(*value)
        case v.Wheels() | v.Steps() | v.Ground():
            return sum(value) / len(value) if len(value) else math.nan
        case v.Attitude():
            return value.inclination
        case v.Temperature(celsius=number) | v.Selector(position=number) | v.Battery(raw=number):
            return float(number)
        case v.Distance(metres=metres):
            return metres
        case v.Button(pressed=is_on) | v.SdCard(present=is_on):
            return float(is_on)
        case v.IrCode():
            return float(value.data)
    return math.nan


def sparkline_for(value: v.Reading | Image) -> Sparkline:
    """Return an empty sparkline that suits readings like *value*."""
    return Sparkline(SPANS.get(type(value), 1))
