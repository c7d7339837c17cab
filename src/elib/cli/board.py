"""The table of ``elib watch``: one line for each reading, with a sparkline of its last values, in 80 columns."""

from __future__ import annotations

import math
from collections import deque

from elib.base.errors import ReplyTimeout
from elib.cli.terminal import BLOCKS, BOLD, DIM, YELLOW
from elib.link.protocol import values as v
from elib.link.protocol.image import Image
from elib.link.protocol.values import FieldInfo
from elib.link.protocol.words import in_best_unit, in_digits
from elib.link.session.statistics import LinkStats
from elib.robot.snapshot import Snapshot

NAME, VALUE, UNIT, AGE, TREND = 13, 39, 6, 9, 8
"""Columns of the table; with the spaces between them they are 79."""
MISSING = "·"
"""What a sparkline shows where a value did not come."""

Styled = tuple[str, str]
"""A line of text, and its SGR colour code or an empty string."""

MICROTESLA = 1e6
SHORT = {"T": "uT", "degrees C": "deg C"}
"""Units that the table abbreviates or scales: the column is narrow, and the field of the earth is 50 uT."""


class Board:
    """Collects snapshots and draws them as a table."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._trends: dict[str, Sparkline] = {}
        self._times: list[float] = []
        self._began = math.nan
        self.snapshot: Snapshot | None = None

    def take(self, snapshot: Snapshot) -> None:
        """Take the next snapshot; a reading that is not new leaves a gap in its sparkline."""
        before = self.snapshot
        if before is None:
            self._began = snapshot.time
        for name, reading in snapshot.readings.items():
            line = self._trends.setdefault(name, sparkline_for(reading))
            is_new = before is None or name not in before.readings or before.readings[name].time != reading.time
            if is_new:
                line.push(trend(reading))
            elif snapshot.is_stale(name):
                line.push(math.nan)
        self._times = [*self._times[-20:], snapshot.time]
        self.snapshot = snapshot

    def lines(self, now: float, statistics: LinkStats | None = None) -> list[Styled]:
        """Return the lines of the table at the time *now*, s on the robot's clock."""
        found: list[Styled] = [(self._title[:79], BOLD)]
        snapshot = self.snapshot
        if snapshot is None:
            lost = statistics.lost if statistics is not None else 0
            return [*found, ("waiting for the first readings" + (f", {lost} answers lost" if lost else ""), DIM)]
        found.append((_row("", "rings: clockwise from the front right", "", "age", "trend"), DIM))
        for name, reading in snapshot.readings.items():
            is_stale = snapshot.is_stale(name, now)
            value, unit = cells(reading)
            age = _age(max(0.0, snapshot.age(name, now)), is_stale)
            found.append((_row(name, value, unit, age, str(self._trends[name])), DIM if is_stale else ""))
        found.append((self._footer(now, statistics), DIM))
        if isinstance(snapshot.error, ReplyTimeout):
            found.append(("The last question had no answer in time; these are the readings before it.", YELLOW))
        elif snapshot.error is not None:
            found.append((snapshot.error.message[:79], YELLOW))
        return found

    def _footer(self, now: float, statistics: LinkStats | None) -> str:
        parts = [f"{now - self._began:.1f} s"]
        if len(self._times) > 1:
            rate = (len(self._times) - 1) / (self._times[-1] - self._times[0])
            parts.append(f"{rate:.3g} snapshots/s")
        if statistics is not None:
            parts.append(f"{statistics.count} answers, {statistics.lost} lost")
            if not math.isnan(statistics.median):
                parts.append(f"round trip {statistics.median * 1000:.1f} ms")
        return ", ".join(parts)


def _row(name: str, value: str, unit: str, age: str, line: str) -> str:
    text = f"{name:<{NAME}} {value[:VALUE]:<{VALUE}} {unit:<{UNIT}} {age:>{AGE}} {line:<{TREND}}"
    return text.rstrip()


def _age(seconds: float, is_stale: bool) -> str:
    if is_stale:
        return f"stale {seconds:.0f}s" if seconds < 1000 else "stale"
    return f"{seconds:.2f} s"


def cells(value: v.Reading | Image) -> tuple[str, str]:
    """Return a reading as text of at most 39 columns, and its unit."""
    match value:
        case Image():
            return f"{value.width} x {value.height} {value.mode.name.lower()}", "pixels"
        case v.Attitude():  # the angles matter most to a person, and there is no room for more
            return f"inclination {value.inclination:.2f}  orientation {value.orientation:.2f}", "rad"
        case v.Battery(raw, volts, fraction):
            if volts is None or fraction is None:
                return ("fine" if raw else "below 3.4 V"), ""
            return f"{volts:.2f}  ({fraction:.0%} full)", "V"
        case v.Button(pressed):
            return ("pressed" if pressed else "released"), ""
        case v.SdCard(present):
            return ("present" if present else "none"), ""
    numbers = in_best_unit(value)
    units = {info.unit for _, _, info in numbers}
    shown = [_number(number, info) for _, number, info in numbers]
    if len(units) > 1:
        shown = [
            f"{number} {SHORT.get(info.unit, info.unit)}".rstrip()
            for number, (_, _, info) in zip(shown, numbers, strict=True)
        ]
    unit = units.pop() if len(units) == 1 else ""
    if len(shown) == 1:
        return shown[0], SHORT.get(unit, unit)
    text = "  ".join(f"{label} {number}" for (label, _, _), number in zip(numbers, shown, strict=True))
    return text if len(text) <= VALUE else " ".join(shown), SHORT.get(unit, unit)


def _number(number: float, info: FieldInfo) -> str:
    if info.unit == "T":
        return f"{number * MICROTESLA:+.1f}"
    return format(number, info.form) if info.form else in_digits(number)


class Sparkline:
    """A row of blocks, the newest on the right; their heights go from the lowest to the highest value so far.

    Values that differ by less than *span* are drawn in the middle: noise would look like a change.
    """

    def __init__(self, span: float) -> None:
        self._values: deque[float] = deque([math.nan] * TREND, maxlen=TREND)
        self._span = span
        self._low, self._high = math.inf, -math.inf

    def push(self, value: float) -> None:
        """Add a value; nan if there is none."""
        self._values.append(value)
        if math.isfinite(value):
            self._low, self._high = min(self._low, value), max(self._high, value)

    def __str__(self) -> str:
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
