"""The action ``Histogram``: the numbers of a column in bins of one width."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from elib.base.fields import Whole
from elib.records.et.action import Plotted, Summary
from elib.records.et.arguments import Argument, Column
from elib.records.et.groups import Groups, Values
from elib.records.et.plot import COLOURS
from elib.records.et.rows import Block
from elib.records.et.table import Header, Table

BAR = 40
"""Characters of the longest bar."""


@dataclass
class Histogram(Summary, Plotted):
    """Count the numbers of a column in bins of one width; each bin holds its lower edge, the last one both."""

    column: Column
    bins: Annotated[int, Argument("--bins N", Whole(1, 1000), "How many bins, 1 to 1000.")] = 20
    numbers: Groups = field(default_factory=Groups, init=False)

    def add(self, block: Block) -> None:
        """Add the numbers of the column."""
        self.numbers.add(block.numbers(self.column))

    def table(self) -> Table:
        """Return edges, counts and bars."""
        headers = [Header("from"), Header("to"), Header("count", "whole"), Header("bar", "text")]
        counts, edges = self._counted()
        bins = zip(edges[:-1].tolist(), edges[1:].tolist(), counts.tolist(), strict=True)
        rows = [[low, high, count, "#" * round(BAR * count / int(counts.max()))] for low, high, count in bins]
        return Table(headers, rows)

    def draw(self, axes: Any) -> None:
        """Draw the bars."""
        counts, edges = self._counted()
        if len(counts):
            axes.stairs(counts, edges, fill=True, color=COLOURS[0])
        axes.set_xlabel(self.column.label)
        axes.set_ylabel("rows")

    def _counted(self) -> tuple[NDArray[np.int64], Values]:
        """Return the counts of the bins and their edges; nothing without numbers."""
        values = self.numbers.of()
        if not len(values):
            return np.zeros(0, np.int64), np.zeros(0)
        with np.errstate(all="ignore"):
            edges = np.linspace(values[0], values[-1], self.bins + 1)
            if not (np.diff(edges) > 0).all():  # between the least and the greatest there are not that many floats
                edges = values[[0, -1]]
        below = values.searchsorted(edges[1:-1])
        return np.diff(below, prepend=0, append=len(values)), edges
