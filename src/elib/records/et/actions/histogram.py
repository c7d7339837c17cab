"""The action ``Histogram``: the numbers of a column in bins of one width."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any

from elib.records.et.action import Plotted, Summary
from elib.records.et.arguments import Argument, Column, to_count
from elib.records.et.plot import COLOURS
from elib.records.et.rows import Block
from elib.records.et.samples import Samples
from elib.records.et.table import Cell, Header, Table

BAR = 40
"""Characters of the longest bar."""


@dataclass
class Histogram(Summary, Plotted):
    """Count the numbers of a column in bins of one width; each bin holds its lower edge, the last one both."""

    column: Column
    bins: Annotated[int, Argument("--bins N", to_count(1, 1000), "How many bins, 1 to 1000.")] = 20
    samples: Samples = field(default_factory=Samples, init=False)

    def add(self, block: Block) -> None:
        """Add the numbers of the column."""
        self.samples.add(block.numbers(self.column))

    def table(self) -> Table:
        """Return edges, counts and bars."""
        headers = [Header("from"), Header("to"), Header("count", "whole"), Header("bar", "text")]
        return Table(headers, self._rows())

    def draw(self, axes: Any) -> None:
        """Draw the bars."""
        if not self.samples.is_empty:
            counts, edges = self.samples.histogram(self.bins)
            axes.stairs(counts, edges, fill=True, color=COLOURS[0])
        axes.set_xlabel(self.column.label)
        axes.set_ylabel("rows")

    def _rows(self) -> list[list[Cell]]:
        if self.samples.is_empty:
            return []
        counts, edges = self.samples.histogram(self.bins)
        most = int(counts.max())
        return [
            [float(low), float(high), int(count), "#" * round(BAR * int(count) / most)]
            for low, high, count in zip(edges[:-1], edges[1:], counts, strict=True)
        ]
