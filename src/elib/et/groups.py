"""Statistics of a column, for each word of another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from elib.errors import ArgumentError
from elib.et.samples import Codes, Moments, Samples, Values
from elib.et.table import Cell

MOST_WORDS = 100_000
"""Different words that are told apart: a column of names has a handful, and one of numbers would fill the memory."""
MOST_BYTES = 64 << 20
"""Bytes of all these words."""


class Words(dict[bytes, int]):
    """The different words of a column, numbered in order of appearance."""

    def __init__(self) -> None:
        super().__init__()
        self._bytes = 0

    def __missing__(self, word: bytes) -> int:
        self._bytes += len(word)
        if len(self) >= MOST_WORDS or self._bytes > MOST_BYTES:
            raise ArgumentError(
                f"there are more than {len(self)} different words to tell apart",
                hint="take a column of words, such as the command's, which is 3",
            )
        self[word] = code = len(self)
        return code

    def codes(self, words: Sequence[bytes]) -> Codes:
        """Return the number of each word.

        Raises:
            ArgumentError: There are more different ones than memory is for.
        """
        return np.fromiter(map(self.__getitem__, words), np.intp, len(words))

    def texts(self) -> list[str]:
        """Return the words as text."""
        return list(map(text_of, self))


@dataclass(slots=True)
class Described:
    """Numbers of groups, described."""

    moments: Moments = field(default_factory=Moments)
    samples: Samples = field(default_factory=Samples)

    def add(self, values: Values, groups: Codes | None = None) -> None:
        """Take some; all belong to group 0 unless *groups* says more."""
        self.moments.add(values, groups)
        self.samples.add(values, groups)

    def count(self, group: int = 0) -> int:
        """Return how many numbers a group has."""
        return self.moments.of(group).count

    def cells(self, percentages: Sequence[float], scale: float = 1.0, group: int = 0) -> list[Cell]:
        """Return mean, deviation, least, percentiles and greatest of a group; None where there is none."""
        found = self.moments.of(group)
        if not found.count:
            return [None] * (4 + len(percentages))
        ranks = self.samples.quantiles([each / 100 for each in percentages], group)
        spread = found.deviation if found.count > 1 else None
        values = [found.mean, spread, found.least, *ranks, found.most]
        return [None if value is None else value * scale for value in values]

    def box(self, scale: float = 1.0, group: int = 0) -> dict[str, float]:
        """Return what a box plot needs of a group that has numbers."""
        ranks = self.samples.quantiles([0.05, 0.25, 0.5, 0.75, 0.95], group)
        return dict(zip(("whislo", "q1", "med", "q3", "whishi"), (rank * scale for rank in ranks), strict=True))


def text_of(word: bytes) -> str:
    """Return a word of a log as text."""
    return word.decode("utf-8", "replace")
