"""The action ``Stats``: mean, deviation and percentiles of a column."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from elib.records.et.action import Plotted, Summary
from elib.records.et.arguments import By, Column, Percentiles
from elib.records.et.groups import Categories, Distribution
from elib.records.et.plot import MAX_NAMES, draw_boxes
from elib.records.et.rows import Block
from elib.records.et.table import Cell, Header, Table


@dataclass
class Stats(Summary, Plotted):
    """Describe the numbers of a column: count, mean, standard deviation, minimum, percentiles, maximum."""

    column: Column
    by: By = None
    percentiles: Percentiles = (5.0, 50.0, 95.0)
    words: Categories = field(default_factory=Categories, init=False)
    distribution: Distribution = field(default_factory=Distribution, init=False)

    def add(self, block: Block) -> None:
        """Add the numbers of the column."""
        groups = None if self.by is None else self.words.codes(block.words(self.by))
        self.distribution.add(block.numbers(self.column), groups)

    def table(self) -> Table:
        """Return a row for each word, or a single row."""
        names = self.distribution.names(self.percentiles)
        headers = [Header("word", "text"), Header("count", "whole"), *map(Header, names)]
        if self.by is None:
            return Table(headers[1:], [self._row(0)])
        return Table(headers, ([word, *self._row(group)] for group, word in enumerate(self.words.texts())))

    def draw(self, axes: Any) -> None:
        """Draw a box for each word, with whiskers from 5 % to 95 %."""
        words = [""] if self.by is None else self.words.texts()
        found = [(word, group) for group, word in enumerate(words) if self.distribution.count(group)][:MAX_NAMES]
        boxes = [self.distribution.box(group=group) for _, group in found]
        draw_boxes(axes, [word for word, _ in found], boxes, self.column.label)

    def _row(self, group: int) -> list[Cell]:
        return [self.distribution.count(group), *self.distribution.cells(self.percentiles, group=group)]
