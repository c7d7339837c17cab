"""One number of a column, for scripts."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from elib.records.et.action import Figure
from elib.records.et.arguments import Argument, Column, to_percentage
from elib.records.et.rows import Block
from elib.records.et.samples import RunningStats, Samples


@dataclass
class _ColumnFigure(Figure):
    column: Column
    stats: RunningStats = field(default_factory=RunningStats, init=False)
    kind: ClassVar[str]

    def add(self, block: Block) -> None:
        """Add the numbers of the column."""
        self.stats.add(block.numbers(self.column))

    @property
    def figure(self) -> float:
        """The statistic that :attr:`kind` names."""
        return float(getattr(self.stats.of(), self.kind))


class Avg(_ColumnFigure):
    """Print the arithmetic mean of a column; 0.00000000 without rows."""

    kind = "mean"


class Min(_ColumnFigure):
    """Print the least number of a column; nan without rows."""

    kind = "minimum"


class Max(_ColumnFigure):
    """Print the greatest number of a column; nan without rows."""

    kind = "maximum"


class Sd(_ColumnFigure):
    """Print the standard deviation of a column (of the sample: n - 1); nan for fewer than two rows."""

    kind = "deviation"


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
