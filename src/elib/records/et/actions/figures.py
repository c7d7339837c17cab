"""One number of a column, for scripts."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated

from elib.records.et.action import Figure
from elib.records.et.arguments import PERCENTAGE, Column, Parameter
from elib.records.et.groups import Values, deviation, grouped, mean, quantiles
from elib.records.et.rows import Block


@dataclass
class _ColumnFigure(Figure):
    column: Column

    def figure(self, blocks: Iterable[Block]) -> float:
        """Return what the class computes of the sorted numbers."""
        return self._of(grouped(blocks, self.column).of())

    @abstractmethod
    def _of(self, values: Values) -> float: ...


class Avg(_ColumnFigure):
    """Print the arithmetic mean of a column; 0.00000000 without rows."""

    def _of(self, values: Values) -> float:
        return mean(values)


class Min(_ColumnFigure):
    """Print the least number of a column; nan without rows."""

    def _of(self, values: Values) -> float:
        return quantiles(values, [0])[0]


class Max(_ColumnFigure):
    """Print the greatest number of a column; nan without rows."""

    def _of(self, values: Values) -> float:
        return quantiles(values, [1])[0]


class Sd(_ColumnFigure):
    """Print the standard deviation of a column (of the sample: n - 1); nan for fewer than two rows."""

    def _of(self, values: Values) -> float:
        return deviation(values)


@dataclass
class Percentile(_ColumnFigure):
    """Print the number of a column that P percent of its rows do not exceed (the nearest rank)."""

    percentage: Annotated[float, Parameter("P", PERCENTAGE, "From 0 to 100; 50 is the median.")]

    def _of(self, values: Values) -> float:
        return quantiles(values, [self.percentage / 100])[0]
