"""Readings and paths of a recording as numbers over time, and two of them brought to the same times."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from elib.pose import Pose
from elib.recording.fitting import unwrapped_steps
from elib.recording.reading import Entry, Recording
from elib.recording.topics import READINGS

Numbers: TypeAlias = NDArray[np.float64]

DERIVED = frozenset({"time", "timestamp", "origin", "g", "rad_per_s"})
"""Fields that are no readings of their own."""
MOST_FIELDS = 16
"""Of a list in a reading: longer ones are samples of sound."""
INTERVALS = 3.0
"""Median intervals of a series beyond which a stretch without readings is a hole, in which nobody knows the value."""
LEAST_HOLE = 0.2
"""s"""


@dataclass(frozen=True, slots=True)
class Series:
    """Numbers over time.

    Attributes:
        fields: Name of each column.
        times: s since the recording began, rising.
        values: One row for each time; not a number where there was none.
    """

    fields: tuple[str, ...]
    times: Numbers
    values: Numbers

    @property
    def hole(self) -> float:
        """Length of a gap between readings from which on it is a hole, s."""
        if len(self.times) < 2:
            return LEAST_HOLE
        return max(INTERVALS * float(np.median(np.diff(self.times))), LEAST_HOLE)

    def at(self, times: Numbers) -> Numbers:
        """Return the values at other times, by straight lines; not a number in holes, and before and behind all."""
        if len(self.times) < 2:
            return np.full((len(times), len(self.fields)), np.nan)
        after = np.clip(np.searchsorted(self.times, times), 1, len(self.times) - 1)
        is_known = (times >= self.times[0]) & (times <= self.times[-1])
        is_known &= self.times[after] - self.times[after - 1] <= self.hole
        found: Numbers = np.column_stack([np.interp(times, self.times, column) for column in self.values.T])
        found[~is_known] = np.nan
        return found


def readings_of(recording: Recording) -> dict[str, Series]:
    """Return every reading that holds numbers, by its name; step counters without their jumps at 16 bits."""
    return series_of(recording.entries(READINGS.name), recording.began)


def series_of(entries: Iterable[Entry], began: float) -> dict[str, Series]:
    """Return the readings among some messages; see :func:`readings_of`."""
    rows: dict[str, list[tuple[float, dict[str, float]]]] = {}
    for entry in entries:
        name = entry.topic.removeprefix(READINGS.name)
        rows.setdefault(name, []).append((entry.time - began, numbers_in(entry.data)))
    found = {}
    for name, kept in rows.items():
        fields = tuple(dict.fromkeys(field for _, numbers in kept for field in numbers))
        if not fields:
            continue
        table = np.array([[numbers.get(field, np.nan) for field in fields] for _, numbers in kept], dtype=float)
        times = np.array([time for time, _ in kept], dtype=float)
        if name == "encoders":
            table = unwrapped_steps(table)
        found[name] = Series(fields, *_rising(times, table))
    return found


def numbers_in(data: Mapping[str, object]) -> dict[str, float]:
    """Return the numbers of a reading by their fields; of a list each by its place."""
    found: dict[str, float] = {}
    for name, value in data.items():
        if name in DERIVED:
            continue
        if isinstance(value, int | float):
            found[name] = float(value)
        elif isinstance(value, list) and len(value) <= MOST_FIELDS:
            found.update({f"{name}[{k}]": float(each) for k, each in enumerate(value) if isinstance(each, int | float)})
    return found


def path_of(recording: Recording, *, measured: bool) -> Series:
    """Return where the robot was: x, y and heading, this without jumps of a turn."""
    return path_series(recording.path(measured=measured), recording.began)


def path_series(poses: Iterable[Pose], began: float) -> Series:
    """Return poses as a series; see :func:`path_of`."""
    table = np.array([(pose.time - began, pose.x, pose.y, pose.heading) for pose in poses], dtype=float).reshape(-1, 4)
    times, values = _rising(table[:, 0], table[:, 1:])
    values[:, 2] = np.unwrap(values[:, 2])
    return Series(("x", "y", "heading"), times, values)


def _rising(times: Numbers, values: Numbers) -> tuple[Numbers, Numbers]:
    """Return both without what is not later than what came before it."""
    order = np.argsort(times, kind="stable")
    times, values = times[order], values[order]
    is_later = np.concatenate([np.ones(min(len(times), 1), dtype=bool), np.diff(times) > 0])
    return times[is_later], values[is_later]
