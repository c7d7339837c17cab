"""The action ``Rate``: rows per second, in windows of time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from elib.base.errors import ArgumentError
from elib.base.rules import DURATION
from elib.records.et.action import Plotted, TableAction
from elib.records.et.arguments import By, Parameter
from elib.records.et.plot import COLOURS, draw_legend, label_of
from elib.records.et.rows import Block, text_of
from elib.records.et.table import Header, Table

MAX_WINDOWS = 100_000
"""Windows from the first to the last; more would not be a readable table."""
MAX_ROWS = 200_000
"""Windows of all words together."""


@dataclass
class Rate(TableAction, Plotted):
    """Count the rows per second, in windows of time (column 0)."""

    every: Annotated[float, Parameter("--every S", DURATION, "Length of a window, s.")] = 1.0
    by: By = None
    words: dict[bytes, None] = field(default_factory=dict, init=False)
    windows: range = field(default=range(0), init=False)
    counts: Counter[tuple[bytes, int]] = field(default_factory=Counter, init=False)

    def table(self, blocks: Iterable[Block]) -> Table:
        """Return a row for each window of each word."""
        for block in blocks:
            self._add(block)
        headers = [Header("word", "text"), Header("time"), Header("count", "whole"), Header("per_s")]
        counts = ((word, window, self.counts[word, window]) for word in self.words for window in self.windows)
        rows = ((text_of(word), self._time(window), count, count / self.every) for word, window, count in counts)
        return Table(headers, rows) if self.by is not None else Table(headers[1:], (row[1:] for row in rows))

    def draw(self, axes: Any) -> None:
        """Draw a line for each word."""
        edges = [self._time(window) for window in range(self.windows.start, self.windows.stop + 1)]
        totals: Counter[bytes] = Counter()
        for (word, _), count in self.counts.items():
            totals[word] += count
        for (word, _), colour in zip(totals.most_common(), COLOURS, strict=False):
            rates = [self.counts[word, window] / self.every for window in self.windows]
            axes.stairs(rates, edges, color=colour, linewidth=1.2, baseline=None, label=label_of(text_of(word)))
        axes.set_xlabel("time, s")
        axes.set_ylabel("rows per second")
        axes.set_ylim(bottom=0)
        if self.by is not None and totals:
            draw_legend(axes, len(totals), "most frequent")

    def _add(self, block: Block) -> None:
        times = block.numbers(0)
        if not len(times):
            return
        with np.errstate(all="ignore"):
            windows = times / self.every
            # A time on the edge of a window, such as 0.3, may be a little less in binary.
            windows = np.floor(windows + np.maximum(1e-9, 4 * np.spacing(np.abs(windows))))
        low = min([float(windows.min()), *self.windows[:1]])
        high = max([float(windows.max()), *self.windows[-1:]])
        if not high - low < MAX_WINDOWS or max(abs(low), abs(high)) > 2**53:
            raise ArgumentError(
                f"the times are more than {MAX_WINDOWS} windows of {self.every:g} s apart",
                hint="take a longer --every",
            )
        self.windows = range(int(low), int(high) + 1)
        words = [b""] * len(times) if self.by is None else block.words(self.by)
        self.words |= dict.fromkeys(words)
        if len(self.words) * len(self.windows) > MAX_ROWS:
            raise ArgumentError(
                f"{len(self.words)} words in {len(self.windows)} windows of {self.every:g} s are too many",
                hint="take a longer --every, or another column",
            )
        self.counts.update(zip(words, windows.astype(np.int64).tolist(), strict=True))

    def _time(self, window: int) -> float:
        """Return the time at which a window begins, without the digits that binary fractions add."""
        return float(f"{window * self.every:.12g}")
