"""The table of ``elib watch``: one line for each reading, in 80 columns."""

from __future__ import annotations

import math

from elib.cli.readings import in_best_unit, in_digits
from elib.cli.sparkline import WIDTH, Sparkline, sparkline_for, trend
from elib.cli.terminal import BOLD, DIM, YELLOW
from elib.errors import ReplyTimeout
from elib.protocol import values as v
from elib.protocol.image import Image
from elib.protocol.values import FieldInfo
from elib.robot.snapshot import Snapshot
from elib.session.statistics import LinkStats

NAME, VALUE, UNIT, AGE = 13, 39, 6, 9
"""Columns of the table; with the sparkline and the spaces between them they are 79."""

Styled = tuple[str, str]
"""A line of text, and its SGR colour code or an empty string."""

MICROTESLA = 1e6
SHORT = {"T": "uT", "degrees C": "deg C"}
"""Units that the table abbreviates or scales: the column is narrow, and the field of the earth is 50 uT."""


class Board:
    """Collects snapshots and draws them as a table.

    Args:
        title: First line of the table.
    """

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
    text = f"{name:<{NAME}} {value[:VALUE]:<{VALUE}} {unit:<{UNIT}} {age:>{AGE}} {line:<{WIDTH}}"
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
