"""Readings and paths of a recording as numbers over time, and two of them brought to the same times."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from elib.body import wrapped
from elib.pose import Pose
from elib.recording import Entry, Recording
from elib.recording.encoding import numbers_in, skipped_fields
from elib.recording.topics import NOTES, OUTCOMES, READINGS

Numbers: TypeAlias = NDArray[np.float64]

INTERVALS = 3.0
"""Median intervals of a series beyond which a stretch without readings is a hole, in which nobody knows the value."""
LEAST_HOLE = 0.2
"""s"""
FASTEST, LATE = 1200, 600
"""Steps/s that no wheel exceeds (robot-model.md, 2.1), and steps that one makes while a reading is late by half a
second: counters that change by more were set."""
SETTING = frozenset({"set_encoders", "reset"})
"""Commands after which step counters are not what the wheels made of them."""
RESTARTS = frozenset({"greeted", "reset"})
"""Events of notes after which they are not either."""


@dataclass(frozen=True, slots=True)
class Series:
    """Numbers over time.

    Attributes:
        fields: Name of each column.
        times: s since the recording began, rising.
        values: One row for each time; not a number where there was none.
        broken: For each row whether it does not follow from the one before: step counters that were set between.
    """

    fields: tuple[str, ...]
    times: Numbers
    values: Numbers
    broken: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))

    def __post_init__(self) -> None:
        if not len(self.broken):
            object.__setattr__(self, "broken", np.zeros(len(self.times), dtype=bool))

    @property
    def hole(self) -> float:
        """Length of a gap between readings from which on it is a hole, s."""
        if len(self.times) < 2:
            return LEAST_HOLE
        return max(INTERVALS * float(np.median(np.diff(self.times))), LEAST_HOLE)

    def changes(self) -> Numbers:
        """Return the change from each row to the next; not a number where the next row does not follow."""
        change = np.diff(self.values, axis=0)
        change[self.broken[1:]] = np.nan
        return change

    def at(self, times: Numbers) -> Numbers:
        """Return values at other times, by straight lines; not a number in holes, in breaks, and outside."""
        if len(self.times) < 2:
            return np.full((len(times), len(self.fields)), np.nan)
        after = np.clip(np.searchsorted(self.times, times), 1, len(self.times) - 1)
        is_known = (times >= self.times[0]) & (times <= self.times[-1])
        is_known &= (self.times[after] - self.times[after - 1] <= self.hole) & ~self.broken[after]
        found: Numbers = np.column_stack([np.interp(times, self.times, column) for column in self.values.T])
        found[~is_known] = np.nan
        return found


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
    """Return every reading that holds numbers, by its name; see :func:`series_of`."""
    return series_of(recording.entries(READINGS.name, OUTCOMES.name, NOTES.name), recording.began)


def series_of(entries: Iterable[Entry], began: float) -> dict[str, Series]:
    """Return the readings among some messages.

    Step counters go on over their 16 bits, and begin anew where they were set or the robot restarted.

    Args:
        entries: Readings, and of outcomes and notes at least those that :func:`may_set_counters`.
        began: When the recording did, s on the robot's clock.
    """
    rows: dict[str, list[tuple[float, dict[str, float]]]] = {}
    settings: list[tuple[float, float]] = []
    skipped = skipped_fields()
    last = 0.0
    for entry in entries:
        if not entry.topic.startswith(READINGS.name):
            if may_set_counters(entry):
                # Nobody knows when between a call and its end it was done. A restart is noticed by the reading
                # before, at the earliest.
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
    """Whether the step counters may have been set by what a message tells: by a command, or a restart."""
    if entry.topic == OUTCOMES.name:  # one whose answer was lost may have been done, too
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
