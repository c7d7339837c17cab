"""The action ``Rate``: rows per second, in windows of time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from elib.base.errors import ArgumentError
from elib.records.et.action import Plotted, Summary
from elib.records.et.arguments import Argument, By, to_number
from elib.records.et.groups import Categories
from elib.records.et.plot import COLOURS, draw_legend, label_of
from elib.records.et.rows import Block
from elib.records.et.table import Header, Table

MAX_WINDOWS = 100_000
"""Windows from the first to the last; more would not be a readable table."""
MAX_ROWS = 200_000
"""Windows of all words together."""


def to_window(text: str) -> float:
    """Return the length of a window, s."""
    try:
        value = to_number(text)
    except ValueError:
        value = 0
    if value <= 0:
        raise ValueError("it must be seconds, more than 0")
    return value


@dataclass
class Rate(Summary, Plotted):
    """Count the rows per second, in windows of time (column 0)."""

    every: Annotated[float, Argument("--every S", to_window, "Length of a window, s.")] = 1.0
    by: By = None
    words: Categories = field(default_factory=Categories, init=False)
    counts: Counter[tuple[int, int]] = field(default_factory=Counter, init=False)
    first: int | None = field(default=None, init=False)
    last: int = field(default=0, init=False)

    def add(self, block: Block) -> None:
        """Count the rows of each window."""
        times = block.numbers(0)
        if not len(times):
            return
        with np.errstate(all="ignore"):
            windows = np.floor(times / self.every)
        low, high = float(windows.min()), float(windows.max())
        low = low if self.first is None else min(low, self.first)
        high = high if self.first is None else max(high, self.last)
        if not high - low < MAX_WINDOWS or max(abs(low), abs(high)) > 2**53:
            raise ArgumentError(
                f"the times are more than {MAX_WINDOWS} windows of {self.every:g} s apart",
                hint="take a longer --every",
            )
        self.first, self.last = int(low), int(high)
        groups = np.zeros(1, np.intp) if self.by is None else self.words.codes(block.words(self.by))
        if len(self.words) * (self.last - self.first) > MAX_ROWS:
            raise ArgumentError(
                f"{len(self.words)} words in {self.last - self.first + 1} windows of {self.every:g} s are too many",
                hint="take a longer --every, or another column",
            )
        start = int(windows.min())
        found, counts = np.unique(groups * MAX_WINDOWS + (windows - start).astype(np.intp), return_counts=True)
        for place, count in zip(found.tolist(), counts.tolist(), strict=True):
            group, window = divmod(place, MAX_WINDOWS)
            self.counts[group, start + window] += count

    def table(self) -> Table:
        """Return a row for each window of each word."""
        headers = [Header("word", "text"), Header("time"), Header("count", "whole"), Header("per_s")]
        rows = (
            (word, self._time(window), self.counts[group, window], self.counts[group, window] / self.every)
            for group, word in enumerate(self._names())
            for window in self._windows()
        )
        if self.by is None:
            return Table(headers[1:], (row[1:] for row in rows))
        return Table(headers, rows)

    def draw(self, axes: Any) -> None:
        """Draw a line for each word."""
        windows = list(self._windows())
        edges = [self._time(window) for window in [*windows, self.last + 1]]
        totals: Counter[int] = Counter()
        for (group, _), count in self.counts.items():
            totals[group] += count
        names = self._names()
        for (group, _), colour in zip(totals.most_common(), COLOURS, strict=False):
            rates = [self.counts[group, window] / self.every for window in windows]
            axes.stairs(rates, edges, color=colour, linewidth=1.2, baseline=None, label=label_of(names[group]))
        axes.set_xlabel("time, s")
        axes.set_ylabel("rows per second")
        axes.set_ylim(bottom=0)
        if self.words:
            draw_legend(axes, len(self.words), "most frequent")

    def _time(self, window: int) -> float:
        """Return the time at which a window begins, without the digits that binary fractions add."""
        return float(f"{window * self.every:.12g}")

    def _names(self) -> list[str]:
        return [""] if self.by is None else self.words.texts()

    def _windows(self) -> Iterator[int]:
        yield from range(self.first, self.last + 1) if self.first is not None else ()
