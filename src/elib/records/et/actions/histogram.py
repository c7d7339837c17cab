"""The action ``Histogram``: the numbers of a column in bins of one width."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from elib.base.rules import Whole
from elib.records.et.action import Plotted, TableAction
from elib.records.et.arguments import Column, Parameter
from elib.records.et.groups import Values, grouped
from elib.records.et.plot import COLOURS
from elib.records.et.rows import Block
from elib.records.et.table import Header, Table

BAR = 40
"""Characters of the longest bar."""


@dataclass
class Histogram(TableAction, Plotted):
    """Count the numbers of a column in bins of one width; each bin holds its lower edge, the last one both."""

    column: Column
    bins: Annotated[int, Parameter("--bins N", Whole(1, 1000), "How many bins, 1 to 1000.")] = 20
    counts: NDArray[np.int64] = field(init=False)
    edges: Values = field(init=False)

    def table(self, blocks: Iterable[Block]) -> Table:
        """Return edges, counts and bars."""
        headers = [Header("from"), Header("to"), Header("count", "whole"), Header("bar", "text")]
        self.counts, self.edges = _counted(grouped(blocks, self.column).of(), self.bins)
        most = self.counts.max(initial=1)
        bins = zip(self.edges.tolist(), self.edges[1:].tolist(), self.counts.tolist(), strict=False)
        return Table(headers, [[low, high, count, "#" * round(BAR * count / most)] for low, high, count in bins])

    def draw(self, axes: Any) -> None:
        """Draw the bars."""
        if len(self.counts):
            axes.stairs(self.counts, self.edges, fill=True, color=COLOURS[0])
        axes.set_xlabel(self.column.label)
        axes.set_ylabel("rows")


def _counted(values: Values, bins: int) -> tuple[NDArray[np.int64], Values]:
    """Return the counts of the bins of sorted values, and their edges; nothing without values."""
    if not len(values):
        return np.zeros(0, np.int64), values
    with np.errstate(all="ignore"):
        edges = np.linspace(values[0], values[-1], bins + 1)
        if not (np.diff(edges) > 0).all():  # between the least and the greatest there are not that many floats
            edges = values[[0, -1]]
        inner = edges[1:-1] - 1e-9 * (edges[1] - edges[0])  # a value on an edge may be a little less in binary
    return np.diff(values.searchsorted(inner), prepend=0, append=len(values)), edges
