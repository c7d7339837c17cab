"""The numbers of a column in memory, sorted into groups, and what describes a group."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Sequence, Sized

import numpy as np
from numpy.typing import NDArray

from elib.base.errors import ArgumentError
from elib.base.quantiles import rank
from elib.records.et.rows import Block
from elib.records.et.table import Cell

MAX_WORDS = 100_000
"""Different words that are told apart. A column of names has a handful; a column of numbers would fill the memory."""

Values = NDArray[np.float64]


class Groups:
    """Numbers by the word that their row has in another column; each takes 8 bytes."""

    def __init__(self) -> None:
        self._values: dict[bytes, array[float]] = {}

    def add(self, values: Values, words: Sequence[bytes] | None = None) -> None:
        """Add numbers to the groups of their *words*; without these, to the group of the empty word."""
        if not len(values):
            return
        by_word = {b"": values}
        if words is not None:
            places = {word: place for place, word in enumerate(dict.fromkeys(words))}
            codes = np.fromiter(map(places.__getitem__, words), np.intp, len(words))
            ends = np.cumsum(np.bincount(codes))
            by_word = dict(zip(places, np.split(values[codes.argsort(kind="stable")], ends[:-1]), strict=True))
        for word, part in by_word.items():
            self._values.setdefault(word, array("d")).frombytes(part.tobytes())
        check_words(self._values)

    @property
    def words(self) -> list[bytes]:
        """The words, in the order in which they came."""
        return list(self._values)

    def of(self, word: bytes = b"") -> Values:
        """Return the numbers of a group, sorted; none for a word that did not come."""
        values: Values = np.asarray(self._values.get(word, array("d")))
        values.sort()  # in place: no second copy
        return values


def grouped(blocks: Iterable[Block], column: int, by: int | None = None) -> Groups:
    """Return the numbers of a column by the words of column *by*; without it, in the group of the empty word."""
    groups = Groups()
    for block in blocks:
        groups.add(block.numbers(column), None if by is None else block.words(by))
    return groups


def check_words(words: Sized) -> None:
    """Check that there are not too many different words to tell apart."""
    if len(words) > MAX_WORDS:
        raise ArgumentError(
            f"there are more than {MAX_WORDS} different words to tell apart",
            hint="take a column of words, such as the command's, which is 3",
        )


def mean(values: Values) -> float:
    """Return the arithmetic mean; 0 without numbers."""
    with np.errstate(all="ignore"):  # at the end of the range it becomes inf or nan, and a warning would not help
        return float(values.mean()) if len(values) else 0.0


def deviation(values: Values) -> float:
    """Return the standard deviation of a sample (n - 1); nan for fewer than two numbers."""
    if len(values) < 2:
        return math.nan
    middle, parts = mean(values), np.array_split(values, 1 + len(values) // (1 << 20))  # no copy of them all
    with np.errstate(all="ignore"):
        return math.sqrt(sum(float(np.square(part - middle).sum()) for part in parts) / (len(values) - 1))


def quantiles(values: Values, shares: Iterable[float]) -> list[float]:
    """Return for each share, 0 to 1, the least of sorted *values* that it does not exceed: the nearest rank.

    Without values each is nan.
    """
    return [float(values[rank(share, len(values))]) if len(values) else math.nan for share in shares]


def names(percentages: Sequence[float]) -> list[str]:
    """Return the names of what :func:`describe` returns."""
    return ["mean", "sd", "min", *(f"p{each:g}" for each in percentages), "max"]


def describe(values: Values, percentages: Sequence[float], scale: float = 1.0) -> list[Cell]:
    """Return mean, deviation, minimum, percentiles and maximum of sorted values; None for each that does not exist."""
    if not len(values):
        return [None] * (4 + len(percentages))
    ranks = quantiles(values, [0, *(each / 100 for each in percentages), 1])
    found = [mean(values), deviation(values), *ranks]
    return [None if math.isnan(value) else value * scale for value in found]


def box(values: Values, scale: float = 1.0) -> dict[str, float]:
    """Return what a box plot needs of sorted values."""
    ranks = quantiles(values, [0.05, 0.25, 0.5, 0.75, 0.95])
    return dict(zip(("whislo", "q1", "med", "q3", "whishi"), (rank * scale for rank in ranks), strict=True))
