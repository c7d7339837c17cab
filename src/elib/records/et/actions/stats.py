"""The action ``Stats``: mean, deviation and percentiles of a column."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from elib.records.et.action import Plotted, TableAction
from elib.records.et.arguments import By, Column, Percentiles
from elib.records.et.groups import Groups, box, describe, grouped, names
from elib.records.et.plot import MAX_NAMES, draw_boxes
from elib.records.et.rows import Block, text_of
from elib.records.et.table import Header, Table


@dataclass
class Stats(TableAction, Plotted):
    """Describe the numbers of a column: count, mean, standard deviation, minimum, percentiles, maximum."""

    column: Column
    by: By = None
    percentiles: Percentiles = (5.0, 50.0, 95.0)
    numbers: Groups = field(init=False)

    def table(self, blocks: Iterable[Block]) -> Table:
        """Return a row for each word, or a single row."""
        self.numbers = grouped(blocks, self.column, self.by)
        headers = [Header("word", "text"), Header("count", "whole"), *map(Header, names(self.percentiles))]
        groups = ((word, self.numbers.of(word)) for word in (self.numbers.words if self.by is not None else [b""]))
        rows = ((text_of(word), len(values), *describe(values, self.percentiles)) for word, values in groups)
        return Table(headers, rows) if self.by is not None else Table(headers[1:], (row[1:] for row in rows))

    def draw(self, axes: Any) -> None:
        """Draw a box for each word, with whiskers from 5 % to 95 %."""
        words = self.numbers.words[:MAX_NAMES]
        draw_boxes(axes, list(map(text_of, words)), [box(self.numbers.of(word)) for word in words], self.column.label)
