"""One number of a column, for scripts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

from elib.et.action import Figure
from elib.et.arguments import Argument, Column, to_percentage
from elib.et.rows import Block
from elib.et.samples import RunningStats, Samples


@dataclass
class _ColumnFigure(Figure):
    column: Column
    stats: RunningStats = field(default_factory=RunningStats, init=False)

    def add(self, block: Block) -> None:
        """Add the numbers of the column."""
        self.stats.add(block.numbers(self.column))


@dataclass
class Avg(_ColumnFigure):
    """Print the arithmetic mean of a column; 0.00000000 without rows."""

    @property
    def figure(self) -> float:
        """The mean."""
        return self.stats.of().mean


@dataclass
class Min(_ColumnFigure):
    """Print the least number of a column; nan without rows."""

    @property
    def figure(self) -> float:
        """The least number."""
        found = self.stats.of()
        return found.minimum if found.count else math.nan


@dataclass
class Max(_ColumnFigure):
    """Print the greatest number of a column; nan without rows."""

    @property
    def figure(self) -> float:
        """The greatest number."""
        found = self.stats.of()
        return found.maximum if found.count else math.nan


@dataclass
class Sd(_ColumnFigure):
    """Print the standard deviation of a column (of the sample: n - 1); nan for fewer than two rows."""

    @property
    def figure(self) -> float:
        """The standard deviation."""
        return self.stats.of().deviation


@dataclass
class Percentile(Figure):
    """Print the number of a column that P percent of its rows do not exceed (the nearest rank)."""

    column: Column
    percentage: Annotated[float, Argument("P", to_percentage, "From 0 to 100; 50 is the median.")]
    samples: Samples = field(default_factory=Samples, init=False)

    def add(self, block: Block) -> None:
        """Add the numbers of the column."""
        self.samples.add(block.numbers(self.column))

    @property
    def figure(self) -> float:
        """The percentile."""
        return self.samples.quantiles([self.percentage / 100])[0]
