"""The numbers of one column, grouped by the words of another, and their distribution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from elib.base.errors import ArgumentError
from elib.records.et.samples import Codes, RunningStats, Samples, Values
from elib.records.et.table import Cell

MAX_WORDS = 100_000
"""Different words that are told apart. A column of names has a handful; a column of numbers would fill the memory."""
MAX_BYTES = 64 << 20
"""Bytes of all these words together."""


class Categories(dict[bytes, int]):
    """The different words of a column, numbered in the order in which they appear."""

    def __init__(self) -> None:
        super().__init__()
        self._bytes = 0

    def __missing__(self, word: bytes) -> int:
        self._bytes += len(word)
        if len(self) >= MAX_WORDS or self._bytes > MAX_BYTES:
            raise ArgumentError(
                f"there are more than {len(self)} different words to tell apart",
                hint="take a column of words, such as the command's, which is 3",
            )
        self[word] = code = len(self)
        return code

    def codes(self, words: Sequence[bytes]) -> Codes:
        """Return the number of each word.

        Raises:
            ArgumentError: There are more different words than the memory is meant for.
        """
        return np.fromiter(map(self.__getitem__, words), np.intp, len(words))

    def texts(self) -> list[str]:
        """Return the words as text."""
        return list(map(text_of, self))


@dataclass(slots=True)
class Distribution:
    """The distribution of the numbers of each group."""

    stats: RunningStats = field(default_factory=RunningStats)
    samples: Samples = field(default_factory=Samples)

    def add(self, values: Values, groups: Codes | None = None) -> None:
        """Add numbers to their groups; without *groups*, to group 0."""
        self.stats.add(values, groups)
        self.samples.add(values, groups)

    def count(self, group: int = 0) -> int:
        """Return how many numbers a group has."""
        return self.stats.of(group).count

    @staticmethod
    def names(percentages: Sequence[float]) -> list[str]:
        """Return the names of what :meth:`cells` returns."""
        return ["mean", "sd", "min", *(f"p{each:g}" for each in percentages), "max"]

    def cells(self, percentages: Sequence[float], scale: float = 1.0, group: int = 0) -> list[Cell]:
        """Return mean, deviation, minimum, percentiles and maximum of a group; None for each that does not exist."""
        found = self.stats.of(group)
        if not found.count:
            return [None] * (4 + len(percentages))
        ranks = self.samples.quantiles([each / 100 for each in percentages], group)
        deviation = found.deviation if found.count > 1 else None
        values = [found.mean, deviation, found.minimum, *ranks, found.maximum]
        return [None if value is None else value * scale for value in values]

    def box(self, scale: float = 1.0, group: int = 0) -> dict[str, float]:
        """Return what a box plot needs of a group that has numbers."""
        ranks = self.samples.quantiles([0.05, 0.25, 0.5, 0.75, 0.95], group)
        return dict(zip(("whislo", "q1", "med", "q3", "whishi"), (rank * scale for rank in ranks), strict=True))


def text_of(word: bytes) -> str:
    """Return a word of a log as text."""
    return word.decode("utf-8", "replace")
