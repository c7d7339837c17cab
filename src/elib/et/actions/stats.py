from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from elib.et.action import Plotted, Summary
from elib.et.arguments import By, Column, Percentiles
from elib.et.groups import Described, Words
from elib.et.plot import draw_boxes
from elib.et.rows import Block
from elib.et.table import Cell, Heading, Table

MOST_BOXES = 40
"""Boxes whose names can be read."""


@dataclass
class Stats(Summary, Plotted):
    """Describe the numbers of a column: count, mean, standard deviation, least, percentiles, greatest."""

    column: Column
    by: By = None
    percentiles: Percentiles = (5.0, 50.0, 95.0)
    words: Words = field(default_factory=Words, init=False)
    described: Described = field(default_factory=Described, init=False)

    def add(self, block: Block) -> None:
        """Take the numbers of the column."""
        groups = None if self.by is None else self.words.codes(block.words(self.by))
        self.described.add(block.numbers(self.column), groups)

    def table(self) -> Table:
        """Return a row for each word, or one."""
        names = ["mean", "sd", "min", *(f"p{each:g}" for each in self.percentiles), "max"]
        headings = [Heading("word", "text"), Heading("count", "whole"), *map(Heading, names)]
        if self.by is None:
            return Table(headings[1:], [self._row(0)])
        return Table(headings, ([word, *self._row(group)] for group, word in enumerate(self.words.texts())))

    def draw(self, axes: Any) -> None:
        """Draw a box a word, with whiskers from 5 % to 95 %."""
        words = [""] if self.by is None else self.words.texts()
        found = [(word, group) for group, word in enumerate(words) if self.described.count(group)][:MOST_BOXES]
        boxes = [self.described.box(group=group) for _, group in found]
        draw_boxes(axes, [word for word, _ in found], boxes, self.column.label)

    def _row(self, group: int) -> list[Cell]:
        return [self.described.count(group), *self.described.cells(self.percentiles, group=group)]
