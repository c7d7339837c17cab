from __future__ import annotations

from dataclasses import dataclass, field

from elib.et.action import Figure
from elib.et.arguments import Column
from elib.et.rows import Block
from elib.et.samples import Moments


@dataclass
class Avg(Figure):
    """Print the arithmetic mean of a column; 0.00000000 without rows."""

    column: Column
    moments: Moments = field(default_factory=Moments, init=False)

    def add(self, block: Block) -> None:
        """Take the numbers of the column."""
        self.moments.add(block.numbers(self.column))

    @property
    def figure(self) -> float:
        """The mean."""
        return self.moments.of().mean
