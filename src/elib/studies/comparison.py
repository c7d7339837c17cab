"""Comparison of two recordings: durations, commands, latencies, paths and readings.

Time 0 is the beginning of each recording. A reading of the first recording is compared with the linear interpolation
between two readings of the second; where the second has a hole, nothing is compared.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from elib.base.pose import Pose
from elib.base.quantiles import quantile
from elib.records.mcapreader import Health
from elib.records.reader import Entry, Recording
from elib.records.topics import MEASURED, ODOMETRY, OUTCOMES, READINGS
from elib.studies.series import Numbers, Series, common_fields, may_set_counters, path_series, series_of

GRID = 0.05
"""s between the points at which paths are compared."""
MUCH_LONGER = 0.02
"""Share by which the durations may differ without a note."""


@dataclass(frozen=True, slots=True)
class Latencies:
    """How long the calls of one command took."""

    calls: int  # number of calls that ended
    failed: int  # number of these that failed
    trips: tuple[tuple[int, float], ...]  # number and round trip, s, of each call that succeeded

    def quantile(self, share: float) -> float:
        """Return the time, s, that this share of the calls does not exceed (nearest rank); nan without calls."""
        return quantile([trip for _, trip in self.trips], share)


@dataclass(frozen=True, slots=True)
class Run:
    """The parts of a recording that a comparison needs.

    Attributes:
        name: Name of the file.
        firmware: Firmware of the robot.
        origin: ``robot``, ``simulator`` or ``replay``.
        duration: Time to the last message, s.
        is_whole: Whether the file was closed properly; otherwise it was cut off.
        damaged: Number of chunks and messages that could not be read.
        commands: Latencies of the commands, by name.
        readings: Series of the readings, by name.
        measured: Path as measured from outside; None with less than two poses.
        odometry: Path by the step counters; None with less than two poses.
    """

    name: str
    firmware: str
    origin: str
    duration: float
    is_whole: bool
    damaged: int
    commands: dict[str, Latencies]
    readings: dict[str, Series]
    measured: Series | None
    odometry: Series | None

    @property
    def calls(self) -> int:
        """Number of calls that ended."""
        return sum(each.calls for each in self.commands.values())

    @property
    def failed(self) -> int:
        """Number of calls that failed."""
        return sum(each.failed for each in self.commands.values())


@dataclass(frozen=True, slots=True)
class PathComparison:
    """Comparison of two paths over the time that both have."""

    is_measured: bool  # whether both were measured from outside; otherwise both are by the step counters
    first: tuple[float, tuple[float, float, float]]  # length, m, and last pose (m, m, rad) of the first path
    second: tuple[float, tuple[float, float, float]]  # length, m, and last pose (m, m, rad) of the second path
    mean: float  # mean distance of the two robots at the same time, m
    largest: float  # largest distance of the two robots at the same time, m


@dataclass(frozen=True, slots=True)
class FieldComparison:
    """Comparison of one field of a reading."""

    reading: str  # name of the reading, such as `proximity`
    field: str  # name of the field, such as `front_right`
    count: int  # number of readings that could be compared
    means: tuple[float, float]  # mean of the first and of the second recording
    rms: float  # root mean square of the difference; nan without readings
    correlation: float  # correlation, -1..1; nan if one of both is constant


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two recordings side by side.

    Attributes:
        first: The first recording.
        second: The second recording.
        notes: What a person should know before looking at the numbers.
        path: Comparison of the paths; None if one recording has no path.
        fields: Comparison of each field that both have.
    """

    first: Run
    second: Run
    notes: tuple[str, ...]
    path: PathComparison | None
    fields: tuple[FieldComparison, ...]


def run_of(recording: Recording) -> Run:
    """Read a recording as far as possible."""
    health = Health()
    last = recording.began
    outcomes: list[Mapping[str, Any]] = []
    readings: list[Entry] = []
    poses: dict[str, list[Pose]] = {MEASURED.name: [], ODOMETRY.name: []}
    for entry in recording.entries(health=health):
        last = max(last, entry.time)
        if entry.topic.startswith(READINGS.name) or may_set_counters(entry):
            readings.append(entry)
        if entry.topic == OUTCOMES.name:
            outcomes.append(entry.data)
        elif entry.topic in poses:
            poses[entry.topic].append(entry.pose)
    # Each recording begins with one odometry pose, even if the step counters are never read.
    paths = {topic: path_series(each, recording.began) if len(each) > 1 else None for topic, each in poses.items()}
    about = recording.about
    return Run(
        recording.name,
        about["firmware"],
        about.get("origin", "robot"),
        last - recording.began,
        health.is_complete,
        health.damaged,
        _latencies(outcomes),
        series_of(readings, recording.began),
        paths[MEASURED.name],
        paths[ODOMETRY.name],
    )


def latencies_of(recording: Recording) -> dict[str, Latencies]:
    """Return how long the calls of each command took, by the name of the command."""
    return _latencies(entry.data for entry in recording.entries(OUTCOMES.name))


def _latencies(outcomes: Iterable[Mapping[str, Any]]) -> dict[str, Latencies]:
    ends: dict[str, list[tuple[int, bool, float]]] = {}
    for data in outcomes:
        trip = math.nan if data["round_trip"] is None else float(data["round_trip"])
        ends.setdefault(data["command"], []).append((data["call"], data["ok"], trip))
    return {
        name: Latencies(
            len(each),
            sum(not ok for _, ok, _ in each),
            tuple((call, trip) for call, ok, trip in each if ok and not math.isnan(trip)),
        )
        for name, each in sorted(ends.items())
    }


def compare(first: Run, second: Run) -> Comparison:
    """Compare two recordings."""
    fields = [
        each
        for name in sorted(first.readings.keys() & second.readings.keys())
        for each in compare_series(name, first.readings[name], second.readings[name])
    ]
    return Comparison(first, second, tuple(_notes(first, second)), compare_paths(first, second), tuple(fields))


def compare_series(name: str, first: Series, second: Series) -> list[FieldComparison]:
    """Compare the fields that both series of a reading have."""
    found = []
    for field, (ours, others) in common_fields(first, second):
        count = len(ours)
        found.append(
            FieldComparison(
                name,
                field,
                count,
                (float(ours.mean()), float(others.mean())) if count else (math.nan, math.nan),
                float(np.sqrt(np.mean((ours - others) ** 2))) if count else math.nan,
                _correlation(ours, others),
            )
        )
    return found


def compare_paths(first: Run, second: Run) -> PathComparison | None:
    """Compare the measured paths if both recordings have one, otherwise the paths by the step counters."""
    is_measured = first.measured is not None and second.measured is not None
    mine = first.measured if is_measured else first.odometry
    theirs = second.measured if is_measured else second.odometry
    if mine is None or theirs is None:
        return None
    apart = distances(mine, theirs)
    is_known = len(apart) > 0
    return PathComparison(
        is_measured,
        _summary(mine),
        _summary(theirs),
        float(apart.mean()) if is_known else math.nan,
        float(apart.max()) if is_known else math.nan,
    )


def distances(first: Series, second: Series) -> Numbers:
    """Return the distances of two robots, m, every :data:`GRID` seconds of the time that both have."""
    start, end = max(first.times[0], second.times[0]), min(first.times[-1], second.times[-1])
    grid = np.arange(start, end, GRID)
    apart = np.hypot(*(first.at(grid) - second.at(grid))[:, :2].T)
    known: Numbers = apart[~np.isnan(apart)]
    return known


def _summary(path: Series) -> tuple[float, tuple[float, float, float]]:
    length = float(np.hypot(*np.diff(path.values[:, :2], axis=0).T).sum())
    x, y, heading = (float(each) for each in path.values[-1])
    return length, (x, y, math.remainder(heading, math.tau))


def _correlation(first: Numbers, second: Numbers) -> float:
    if len(first) < 2 or first.std() == 0 or second.std() == 0:
        return math.nan
    return float(np.corrcoef(first, second)[0, 1])


def _notes(first: Run, second: Run) -> list[str]:
    notes = []
    for letter, run in zip("AB", (first, second), strict=True):
        if not run.is_whole:
            notes.append(f"{letter} was cut off: it is compared up to {run.duration:.1f} s, where it can be read")
        if run.damaged:
            notes.append(f"{letter} is damaged: {run.damaged} pieces of it could not be read")
        if not run.calls:
            notes.append(f"{letter} has no command in it")
    if first.firmware != second.firmware:
        notes.append(
            f"A ran {first.firmware} and B {second.firmware}: a reading may have other numbers and another latency"
        )
    shorter, longer = sorted((first, second), key=lambda run: run.duration)
    if longer.duration - shorter.duration > MUCH_LONGER * longer.duration:
        letter = "A" if shorter is first else "B"
        notes.append(f"{letter} is shorter: paths and readings are compared over its {shorter.duration:.1f} s")
    for letter, run, other in (("A", first, second), ("B", second, first)):
        alone = sorted(run.readings.keys() - other.readings.keys())
        if alone:
            notes.append(f"only {letter} has {', '.join(alone)}")
    return notes + _notes_on_paths(first, second)


def _notes_on_paths(first: Run, second: Run) -> list[str]:
    if first.measured is not None and second.measured is not None:
        return []
    runs = (("A", first), ("B", second))
    unmeasured = " and ".join(letter for letter, run in runs if run.measured is None)
    seldom = "the step counters were read less than twice"
    if first.odometry is not None and second.odometry is not None:
        because = f"{unmeasured} has no measured poses, so the paths are those of the step counters"
        return [because] if unmeasured in ("A", "B") else []
    return [
        f"{letter} has no path: it has no measured poses, and {seldom}"
        if run.measured is None
        else f"{letter} has no path like that of {unmeasured}, which has no measured poses: {seldom}"
        for letter, run in runs
        if run.odometry is None
    ]
