"""Two recordings side by side: how long they took, what was asked, how fast, along which paths, and what was sensed.

Both begin at 0 s, where their recording began. A reading of the first is compared with the second by straight lines
between two of its readings; where the second has a hole, it is not compared.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from elib.calibration.series import Numbers, Series, may_set_counters, path_series, series_of
from elib.pose import Pose
from elib.quantiles import quantile
from elib.recording import Entry, Health, Recording
from elib.recording.topics import MEASURED, ODOMETRY, OUTCOMES, READINGS

GRID = 0.05
"""s between the points at which paths are compared."""
MUCH_LONGER = 0.02
"""Share by which lengths may differ without a word."""


@dataclass(frozen=True, slots=True)
class Latencies:
    """How long the calls of one command took.

    Attributes:
        calls: How many ended.
        failed: How many of these with an error.
        trips: From sending to end of the others, s, with the number of each call.
    """

    calls: int
    failed: int
    trips: tuple[tuple[int, float], ...]

    def quantile(self, share: float) -> float:
        """Return the time, s, that this share of the calls does not exceed: the nearest rank; nan without any."""
        return quantile([trip for _, trip in self.trips], share)


NONE = Latencies(0, 0, ())


@dataclass(frozen=True, slots=True)
class Run:
    """One recording, read.

    Attributes:
        name: Of its file.
        firmware: Which one the robot ran.
        origin: ``robot``, ``simulator`` or ``replay``.
        duration: To its last message, s.
        is_whole: It ends as a recording ends; otherwise it was cut.
        damaged: Pieces that could not be read.
        commands: By name.
        readings: By name.
        measured: Path as measured from outside; None without, or of one pose alone.
        odometry: Path by the step counters; None where they were read less than twice.
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
        """How many calls ended."""
        return sum(each.calls for each in self.commands.values())

    @property
    def failed(self) -> int:
        """How many of these with an error."""
        return sum(each.failed for each in self.commands.values())


@dataclass(frozen=True, slots=True)
class PathComparison:
    """Two paths over the time that both have.

    Attributes:
        is_measured: From outside; otherwise by the step counters.
        first: Length, m, and the pose at the end (m, m, rad) of the first.
        second: The same of the second.
        mean: Distance of both robots at the same time, on average, m.
        largest: The same at most, m.
    """

    is_measured: bool
    first: tuple[float, tuple[float, float, float]]
    second: tuple[float, tuple[float, float, float]]
    mean: float
    largest: float


@dataclass(frozen=True, slots=True)
class FieldComparison:
    """One field of one reading.

    Attributes:
        reading: Such as ``proximity``.
        field: Such as ``front_right``.
        count: Readings that could be compared.
        means: Of the first and of the second.
        rms: Root mean square of the difference; nan without any.
        correlation: -1..1; nan where one of both is constant.
    """

    reading: str
    field: str
    count: int
    means: tuple[float, float]
    rms: float
    correlation: float


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two recordings side by side.

    Attributes:
        first: One.
        second: The other.
        notes: What a person should know of both before looking at the figures.
        path: Their paths; None where one has none.
        fields: What both read.
    """

    first: Run
    second: Run
    notes: tuple[str, ...]
    path: PathComparison | None
    fields: tuple[FieldComparison, ...]


def run_of(recording: Recording) -> Run:
    """Read a recording, as far as it can be read."""
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
    # A recording begins with one pose by the step counters, whether or not anybody ever reads them.
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
    """Return how long the calls of each command took, by its name."""
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
    """Compare one reading of two recordings, field by field; fields that one has not are left out."""
    common = [field for field in first.fields if field in second.fields]
    mine = first.values[:, [first.fields.index(field) for field in common]]
    theirs = second.at(first.times)[:, [second.fields.index(field) for field in common]]
    found = []
    for k, field in enumerate(common):
        is_known = ~(np.isnan(mine[:, k]) | np.isnan(theirs[:, k]))
        ours, others = mine[is_known, k], theirs[is_known, k]
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
    """Compare the paths: measured ones where both have them, else those by the step counters."""
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
    """Return how far apart two robots are, m, every :data:`GRID` seconds of the time that both have."""
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
            notes.append(f"{letter} was cut: it is compared up to where it can be read, {run.duration:.1f} s")
        if run.damaged:
            notes.append(f"{letter} is damaged: {run.damaged} pieces of it could not be read")
        if not run.calls:
            notes.append(f"{letter} has no command in it")
    if first.firmware != second.firmware:
        notes.append(
            f"A ran {first.firmware} and B {second.firmware}: the same reading may count otherwise, and take longer"
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
