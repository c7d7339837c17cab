"""The action ``Count``: rows for each word of a column."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from elib.records.et.action import Plotted, TableAction
from elib.records.et.arguments import Column
from elib.records.et.groups import check_words
from elib.records.et.plot import COLOURS, MAX_NAMES, label_of
from elib.records.et.rows import Block, text_of
from elib.records.et.table import Header, Table


@dataclass
class Count(TableAction, Plotted):
    """Count the rows for each word of a column, the most frequent first."""

    column: Column
    counts: Counter[bytes] = field(default_factory=Counter, init=False)

    def table(self, blocks: Iterable[Block]) -> Table:
        """Return words, counts and shares."""
        for block in blocks:
            self.counts.update(block.words(self.column))
            check_words(self.counts)
        rows = [(text_of(word), count, count / self.counts.total()) for word, count in self.counts.most_common()]
        return Table([Header("word", "text"), Header("count", "whole"), Header("share", decimals=4)], rows)

    def draw(self, axes: Any) -> None:
        """Draw a bar for each word."""
        most = self.counts.most_common(MAX_NAMES)
        axes.barh([label_of(text_of(word)) for word, _ in most], [count for _, count in most], color=COLOURS[0])
        axes.invert_yaxis()
        axes.set_xlabel("rows")
