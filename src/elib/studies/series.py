"""Series: readings and paths of a recording as numbers over time, which can be interpolated at other times."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from elib.base.body import wrapped
from elib.base.pose import Pose
from elib.records.encoding import numbers_in, skipped_fields
from elib.records.reader import Entry, Recording
from elib.records.topics import NOTES, OUTCOMES, READINGS

Numbers: TypeAlias = NDArray[np.float64]

INTERVALS = 3.0
"""A gap longer than so many median intervals is a hole: the value inside it is not known."""
MIN_HOLE = 0.2
"""s. A shorter gap is never a hole."""
FASTEST, LATE = 1200, 600
"""Steps/s that no wheel exceeds (e-puck.md, 1), and steps of a wheel during the half second by which a reading
may be late. Counters that change by more were set."""
SETTING = frozenset({"set_encoders", "reset"})
"""Commands that change the step counters."""
RESTARTS = frozenset({"greeted", "reset"})
"""Events in notes after which the step counters start again."""


@dataclass(frozen=True, slots=True)
class Series:
    """Numbers over time."""

    fields: tuple[str, ...]  # name of each column
    times: Numbers  # s since the recording began, rising
    values: Numbers  # one row for each time; nan where there was no number
    # for each row whether it does not continue the row before, because step counters were set between them
    broken: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))

    def __post_init__(self) -> None:
        if not len(self.broken):
            object.__setattr__(self, "broken", np.zeros(len(self.times), dtype=bool))

    @property
    def hole(self) -> float:
        """Length, s, from which a gap between readings is a hole."""
        if len(self.times) < 2:
            return MIN_HOLE
        return max(INTERVALS * float(np.median(np.diff(self.times))), MIN_HOLE)

    def changes(self) -> Numbers:
        """Return the change from each row to the next; nan if the next row does not continue it."""
        change = np.diff(self.values, axis=0)
        change[self.broken[1:]] = np.nan
        return change

    def at(self, times: Numbers) -> Numbers:
        """Return the values at other times, interpolated linearly; nan in holes, at breaks and outside."""
        if len(self.times) < 2:
            return np.full((len(times), len(self.fields)), np.nan)
        after = np.clip(np.searchsorted(self.times, times), 1, len(self.times) - 1)
        is_known = (times >= self.times[0]) & (times <= self.times[-1])
        is_known &= (self.times[after] - self.times[after - 1] <= self.hole) & ~self.broken[after]
        found: Numbers = np.column_stack([np.interp(times, self.times, column) for column in self.values.T])
        found[~is_known] = np.nan
        return found


def common_fields(*series: Series) -> Iterator[tuple[str, tuple[Numbers, ...]]]:
    """Yield each field that all series have, with its known values in each, at the times of the first series.

    A value is left out if one of the series does not have it at that time.
    """
    tables = [series[0].values, *(each.at(series[0].times) for each in series[1:])]
    for name in series[0].fields:
        if all(name in each.fields for each in series):
            pairs = zip(series, tables, strict=True)
            columns = np.column_stack([table[:, each.fields.index(name)] for each, table in pairs])
            yield name, tuple(columns[~np.isnan(columns).any(axis=1)].T)


def unwrapped_steps(counts: Numbers, broken: NDArray[np.bool_] | None = None) -> Numbers:
    """Return 16-bit counters as they would be without wrapping; one row for each reading, one column for each wheel.

    Args:
        counts: The counters as they were read.
        broken: For each row whether the counters were set before it; counting starts again with that row.
    """
    change = wrapped(np.diff(counts, axis=0))
    if broken is not None:
        change[broken[1:]] = np.nan
    found = counts.astype(float)
    for row, step in enumerate(change, 1):
        if not np.isnan(step).all():
            found[row] = found[row - 1] + step
    return found


def readings_of(recording: Recording) -> dict[str, Series]:
    """Return the series of every reading that holds numbers, by its name; see :func:`series_of`."""
    return series_of(recording.entries(READINGS.name, OUTCOMES.name, NOTES.name), recording.began)


def series_of(entries: Iterable[Entry], began: float) -> dict[str, Series]:
    """Return the series of the readings among some messages, by name.

    Step counters continue beyond 16 bits. They start again where they were set or the robot restarted.

    Args:
        entries: Readings, and at least those outcomes and notes that :func:`may_set_counters` selects.
        began: When the recording began, s on the robot's clock.
    """
    rows: dict[str, list[tuple[float, dict[str, float]]]] = {}
    settings: list[tuple[float, float]] = []
    skipped = skipped_fields()
    last = 0.0
    for entry in entries:
        if not entry.topic.startswith(READINGS.name):
            if may_set_counters(entry):
                # The robot did it at some time between the call and its end. A restart may have happened at any time
                # since the reading before.
                since = last if entry.topic == NOTES.name else entry.time - began - entry.data["waited"]
                settings.append((since, entry.time - began))
            continue
        name = entry.topic.removeprefix(READINGS.name)
        if name == "encoders":
            last = entry.time - began
        rows.setdefault(name, []).append((entry.time - began, numbers_in(entry.data, skipped)))
    found = {}
    for name, kept in rows.items():
        fields = tuple(dict.fromkeys(field for _, numbers in kept for field in numbers))
        if not fields:
            continue
        table = np.array([[numbers.get(field, np.nan) for field in fields] for _, numbers in kept], dtype=float)
        times, table = _rising(np.array([time for time, _ in kept], dtype=float), table)
        if name == "encoders":
            broken = _breaks(times, table, settings)
            found[name] = Series(fields, times, unwrapped_steps(table, broken), broken)
        else:
            found[name] = Series(fields, times, table)
    return found


def may_set_counters(entry: Entry) -> bool:
    """Return whether a message tells of a command or a restart that may have set the step counters."""
    if entry.topic == OUTCOMES.name:  # the robot may have done it even if the answer was lost
        return entry.data["command"] in SETTING and entry.data["round_trip"] is not None
    return entry.topic == NOTES.name and entry.data["name"] == "robot" and entry.data["event"] in RESTARTS


def _breaks(times: Numbers, counts: Numbers, settings: Iterable[tuple[float, float]]) -> NDArray[np.bool_]:
    """Return for each reading whether the counters were set between it and the one before."""
    broken = np.zeros(len(times), dtype=bool)
    change = np.abs(wrapped(np.diff(counts, axis=0)))
    broken[1:] = np.any(change > FASTEST * np.diff(times)[:, None] + LATE, axis=1)
    for since, until in settings:
        broken[1:] |= (times[1:] >= since) & (times[:-1] < until)
    return broken


def path_of(recording: Recording, *, measured: bool) -> Series:
    """Return the series of x, y and heading of the robot; the heading has no jumps of a whole turn."""
    return path_series(recording.path(measured=measured), recording.began)


def path_series(poses: Iterable[Pose], began: float) -> Series:
    """Return poses as a series; see :func:`path_of`."""
    table = np.array([(pose.time - began, pose.x, pose.y, pose.heading) for pose in poses], dtype=float).reshape(-1, 4)
    times, values = _rising(table[:, 0], table[:, 1:])
    values[:, 2] = np.unwrap(values[:, 2])
    return Series(("x", "y", "heading"), times, values)


def _rising(times: Numbers, values: Numbers) -> tuple[Numbers, Numbers]:
    """Return times and values in order of time, without rows that have the time of the row before."""
    order = np.argsort(times, kind="stable")
    times, values = times[order], values[order]
    is_later = np.concatenate([np.ones(min(len(times), 1), dtype=bool), np.diff(times) > 0])
    return times[is_later], values[is_later]
