"""The action ``Count``: rows for each word of a column."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elib.records.et.action import Plotted, Summary
from elib.records.et.arguments import Column
from elib.records.et.groups import Categories
from elib.records.et.plot import COLOURS, MAX_NAMES, label_of
from elib.records.et.rows import Block
from elib.records.et.table import Header, Table


@dataclass
class Count(Summary, Plotted):
    """Count the rows for each word of a column, the most frequent first."""

    column: Column
    words: Categories = field(default_factory=Categories, init=False)
    counts: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64), init=False)

    def add(self, block: Block) -> None:
        """Count the words."""
        counts = np.bincount(self.words.codes(block.words(self.column)), minlength=len(self.counts))
        counts[: len(self.counts)] += self.counts
        self.counts = counts

    def table(self) -> Table:
        """Return words, counts and shares."""
        total = int(self.counts.sum())
        rows = [(word, count, count / total) for word, count in self._most_common()]
        return Table([Header("word", "text"), Header("count", "whole"), Header("share", decimals=4)], rows)

    def draw(self, axes: Any) -> None:
        """Draw a bar for each word."""
        most = self._most_common()[:MAX_NAMES]
        axes.barh([label_of(word) for word, _ in most], [count for _, count in most], color=COLOURS[0])
        axes.invert_yaxis()
        axes.set_xlabel("rows")

    def _most_common(self) -> list[tuple[str, int]]:
        found = zip(self.words.texts(), self.counts.tolist(), strict=True)
        return sorted(found, key=lambda item: -item[1])
