"""Statistics in constant memory: running means and deviations, and exact ranks of numbers in sorted runs on disk."""

from __future__ import annotations

import math
import os
import tempfile
import weakref
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from elib.base.errors import ElibError
from elib.base.quantiles import rank

MAX_IN_MEMORY = 1 << 20
"""Numbers that are kept in memory (12 MiB with their groups); the others are in a temporary file."""
SORTED_AT_ONCE = 1 << 12
"""Numbers that are sorted to find one of them; among more of them it is found by bisection first."""

Values = NDArray[np.float64]
Codes = NDArray[np.intp]
"""The group of each number, counted from 0."""


@dataclass(frozen=True, slots=True)
class GroupStats:
    """Statistics of the numbers of one group.

    Attributes:
        count: How many numbers there are; without any, the mean is 0 and the others are nan.
        mean: The arithmetic mean.
        deviation: Standard deviation of the sample (n - 1); nan for fewer than two numbers.
        minimum: The least number.
        maximum: The greatest number.
    """

    count: int
    mean: float
    deviation: float
    minimum: float
    maximum: float


class RunningStats:
    """Count, mean, deviation and extremes of each group of numbers, which come in batches.

    Batches are merged as Chan, Golub and LeVeque do it (1979). A plain sum of squares would lose the digits of late
    times.
    """

    def __init__(self) -> None:
        self._count: NDArray[np.int64] = np.zeros(0, np.int64)
        self._mean, self._squares, self._minimum, self._maximum = np.zeros((4, 0))

    def add(self, values: Values, groups: Codes | None = None) -> None:
        """Add a batch of numbers to their groups; without *groups*, to group 0."""
        if not len(values):
            return
        groups = np.zeros(len(values), np.intp) if groups is None else groups
        self._grow(int(groups.max()) + 1)
        counts = np.bincount(groups, minlength=len(self._count))
        # Numbers near the end of the range overflow: the result is then inf or nan, and a warning would not help.
        with np.errstate(all="ignore"):
            means = np.bincount(groups, values, len(counts)) / np.maximum(counts, 1)
            squares = np.bincount(groups, (values - means[groups]) ** 2, len(counts))
            total = np.maximum(self._count + counts, 1)
            apart = np.where(counts > 0, means - self._mean, 0)
            self._mean += apart * (counts / total)
            self._squares += squares + apart * apart * (self._count * (counts / total))
        self._count += counts
        np.minimum.at(self._minimum, groups, values)
        np.maximum.at(self._maximum, groups, values)

    def of(self, group: int = 0) -> GroupStats:
        """Return the statistics of a group."""
        count = int(self._count[group]) if group < len(self._count) else 0
        if not count:
            return GroupStats(0, 0.0, math.nan, math.nan, math.nan)
        deviation = math.sqrt(self._squares[group] / (count - 1)) if count > 1 else math.nan
        return GroupStats(
            count, float(self._mean[group]), deviation, float(self._minimum[group]), float(self._maximum[group])
        )

    def _grow(self, size: int) -> None:
        if size > len(self._count):
            more = max(size, 2 * len(self._count)) - len(self._count)
            self._count = np.append(self._count, np.zeros(more, np.int64))
            self._mean, self._squares = np.append(self._mean, np.zeros(more)), np.append(self._squares, np.zeros(more))
            self._minimum = np.append(self._minimum, np.full(more, math.inf))
            self._maximum = np.append(self._maximum, np.full(more, -math.inf))


@dataclass(frozen=True, slots=True)
class _Run:
    """A sorted run: some of the numbers by group and size, in memory or in a file; group g ends before ``ends[g]``."""

    ends: NDArray[np.int64]
    values: Values | None
    file: IO[bytes] | None = None
    place: int = 0

    def span(self, group: int) -> tuple[int, int]:
        """Return the places where the numbers of a group begin and end."""
        if group >= len(self.ends):
            return 0, 0
        return int(self.ends[group - 1]) if group else 0, int(self.ends[group])

    def read(self, first: int, end: int) -> Values:
        """Return some of the numbers."""
        if self.file is None or self.values is not None:
            return np.empty(0) if self.values is None else self.values[first:end]
        self.file.seek(self.place + first * 8)
        return np.frombuffer(self.file.read((end - first) * 8))

    def __len__(self) -> int:
        return int(self.ends[-1])

    def __getitem__(self, index: int) -> float:
        return float(self.read(index, index + 1)[0])


class Samples:
    """All the numbers of each group, for ranks and histograms; more than a million of them are on disk.

    They are sorted before they are written. A rank is then found by bisection, which reads few of them again.
    """

    def __init__(self) -> None:
        self.is_empty = True
        # The system gives memory only to the pages that are used.
        self._values: Values = np.empty(MAX_IN_MEMORY)
        self._groups = np.empty(MAX_IN_MEMORY, np.uint32)
        self._held = 0
        self._runs: list[_Run] = []
        self._file: IO[bytes] | None = None

    def add(self, values: Values, groups: Codes | None = None) -> None:
        """Add a batch of numbers to their groups; without *groups*, to group 0.

        Raises:
            ElibError: The disk is full.
        """
        for place in range(0, len(values), MAX_IN_MEMORY):
            part = values[place : place + MAX_IN_MEMORY]
            if self._held + len(part) > MAX_IN_MEMORY:
                self._spill(on_disk=True)
            end = self._held + len(part)
            self._values[self._held : end] = part
            self._groups[self._held : end] = 0 if groups is None else groups[place : place + MAX_IN_MEMORY]
            self._held, self.is_empty = end, False

    def quantiles(self, shares: Sequence[float], group: int = 0) -> list[float]:
        """Return for each share, 0 to 1, the least value that this share does not exceed: the nearest rank.

        Each is one of the numbers of the group; nan if the group does not have any.
        """
        runs = self._runs_of(group)
        spans = [run.span(group) for run in runs]
        count = sum(end - first for first, end in spans)
        if not count:
            return [math.nan] * len(shares)
        ranks = [rank(share, count) for share in shares]
        if count > MAX_IN_MEMORY:
            return [_ranked(runs, spans, rank) for rank in ranks]
        parts = [run.read(*span) for run, span in zip(runs, spans, strict=True)]
        whole = parts[0] if len(parts) == 1 else np.sort(np.concatenate(parts))
        return [float(whole[rank]) for rank in ranks]

    def histogram(self, bins: int) -> tuple[NDArray[np.int64], Values]:
        """Return counts and edges of *bins* bins of equal width, from the least to the greatest number of group 0."""
        runs = self._runs_of(0)
        count = sum(run.span(0)[1] for run in runs)
        low, high = min(run[0] for run in runs), max(run[run.span(0)[1] - 1] for run in runs)
        # If the numbers are so close together that no floats are left between them for edges, one bin holds them all.
        with np.errstate(all="ignore"):
            edges = np.linspace(low, high, bins + 1)
            is_wide = bool((np.diff(edges) > 0).all())
        if not is_wide:
            return np.array([count]), np.array([low, high])
        below = sum((run.read(*run.span(0)).searchsorted(edges[1:-1]) for run in runs), np.zeros(bins - 1, np.int64))
        return np.diff(below, prepend=0, append=count), edges

    def _runs_of(self, group: int) -> list[_Run]:
        if self._held:
            self._spill(on_disk=bool(self._runs))
        return [run for run in self._runs if len(range(*run.span(group)))]

    def _spill(self, *, on_disk: bool) -> None:
        groups, values = self._groups[: self._held], self._values[: self._held]
        self._held = 0
        values = values[np.argsort(groups, kind="stable")] if groups.any() else values.copy()
        ends = np.cumsum(np.bincount(groups))
        for start, end in zip([0, *ends[:-1]], ends, strict=True):
            values[start:end].sort()
        self._runs.append(self._stored(values, ends) if on_disk else _Run(ends, values))

    def _stored(self, values: Values, ends: NDArray[np.int64]) -> _Run:
        """Write a run to the file and return it."""
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(prefix="et-")  # noqa: SIM115 - closed with the samples
                weakref.finalize(self, self._file.close)
            place = self._file.seek(0, os.SEEK_END)
            self._file.write(values.data)
            self._file.write(ends.data)
            self._file.flush()
        except OSError as error:
            raise ElibError(
                f"there are too many numbers for the memory, and they do not fit into {tempfile.gettempdir()}: "
                f"{error.strerror or error}",
                hint="free some room there, or let TMPDIR name a directory that has more",
            ) from None
        mapped: np.memmap[Any, Any] = np.memmap(self._file, ends.dtype, "r", place + values.nbytes, ends.shape)
        return _Run(mapped, None, self._file, place)


def _ranked(runs: Sequence[_Run], spans: Sequence[tuple[int, int]], rank: int) -> float:
    """Return the number with this rank, from 0, in the *spans* of all the runs together.

    It is the least number for which more than *rank* numbers are not greater. Its bits are found by bisection, until so
    few numbers are left that they can be sorted.
    """
    firsts, ends = [first for first, _ in spans], [end for _, end in spans]
    rank += sum(firsts)
    low = min(_key(run[first]) for run, first in zip(runs, firsts, strict=True))
    high = max(_key(run[end - 1]) for run, end in zip(runs, ends, strict=True))
    while low < high and sum(ends) - sum(firsts) > SORTED_AT_ONCE:
        middle = (low + high) // 2
        value = _number(middle)
        places = [bisect_right(*each) for each in zip(runs, [value] * len(runs), firsts, ends, strict=True)]
        if sum(places) > rank:
            high, ends = middle, places
        else:
            low, firsts = middle + 1, places
    if low == high:
        return _number(low)
    left = [run.read(first, end) for run, first, end in zip(runs, firsts, ends, strict=True)]
    return float(np.sort(np.concatenate(left))[rank - sum(firsts)])


def _key(value: float) -> int:
    """Return an integer that has the same order as *value*: its bits, negated for a negative number."""
    bits = int(np.float64(value + 0.0).view(np.int64))
    return bits if bits >= 0 else -(bits & 0x7FFF_FFFF_FFFF_FFFF)


def _number(key: int) -> float:
    return -_number(-key) if key < 0 else float(np.int64(key).view(np.float64))
