from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated

from elib.et.action import Filter
from elib.et.arguments import Argument, Column, to_number
from elib.et.rows import Block


@dataclass
class FromTo(Filter):
    """Copy the rows whose number in a column is at least X and less than Y."""

    column: Column
    low: Annotated[float, Argument("X", to_number, "The least number that is copied.")]
    high: Annotated[float, Argument("Y", to_number, "The least number above it that is not.")]

    def keep(self, block: Block) -> Iterable[bool]:
        """Compare."""
        values = block.numbers(self.column)
        kept: list[bool] = ((values >= self.low) & (values < self.high)).tolist()
        return kept
