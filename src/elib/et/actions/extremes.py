"""One number of a column, for scripts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

from elib.et.action import Figure
from elib.et.arguments import Argument, Column, to_percentage
from elib.et.rows import Block
from elib.et.samples import Moments, Samples


@dataclass
class _OfMoments(Figure):
    column: Column
    moments: Moments = field(default_factory=Moments, init=False)

    def add(self, block: Block) -> None:
        """Take the numbers of the column."""
        self.moments.add(block.numbers(self.column))


@dataclass
class Min(_OfMoments):
    """Print the least number of a column; nan without rows."""

    @property
    def figure(self) -> float:
        """The least."""
        found = self.moments.of()
        return found.least if found.count else math.nan


@dataclass
class Max(_OfMoments):
    """Print the greatest number of a column; nan without rows."""

    @property
    def figure(self) -> float:
        """The greatest."""
        found = self.moments.of()
        return found.most if found.count else math.nan


@dataclass
class Sd(_OfMoments):
    """Print the standard deviation of a column (of the sample: n - 1); nan for fewer than two rows."""

    @property
    def figure(self) -> float:
        """The deviation."""
        return self.moments.of().deviation


@dataclass
class Percentile(Figure):
    """Print the number of a column that P percent of its rows do not exceed (the nearest rank)."""

    column: Column
    percentage: Annotated[float, Argument("P", to_percentage, "From 0 to 100; 50 is the median.")]
    samples: Samples = field(default_factory=Samples, init=False)

    def add(self, block: Block) -> None:
        """Take the numbers of the column."""
        self.samples.add(block.numbers(self.column))

    @property
    def figure(self) -> float:
        """The percentile."""
        return self.samples.quantiles([self.percentage / 100])[0]
