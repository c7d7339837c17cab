"""Results as rows and named columns."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

Cell = str | int | float | None
Kind = Literal["text", "whole", "number", "any"]


@dataclass(frozen=True, slots=True)
class Heading:
    """A column of results.

    Attributes:
        name: With the unit behind an underscore.
        kind: What its cells are; ``any`` where only each cell can tell.
        decimals: Of its numbers where people read them; None for eight significant digits.
    """

    name: str
    kind: Kind = "number"
    decimals: int | None = None

    def shown(self, cell: Cell) -> str:
        """Return how people read a cell."""
        if cell is None or (isinstance(cell, float) and math.isnan(cell)):
            return "-"
        if isinstance(cell, float):
            return f"{cell:.8g}" if self.decimals is None else f"{cell:.{self.decimals}f}"
        return str(cell)


@dataclass(frozen=True, slots=True)
class Table:
    """Results.

    Attributes:
        headings: Its columns.
        rows: Its rows; they can be read once.
        text: As text it is a table with ``aligned`` columns, more ``rows`` for et, or one ``bare`` cell.
    """

    headings: Sequence[Heading]
    rows: Iterable[Sequence[Cell]]
    text: Literal["aligned", "rows", "bare"] = "aligned"

    @classmethod
    def of_figure(cls, name: str, value: float) -> Table:
        """Return a table of one number."""
        return cls([Heading(name, decimals=8)], [(value,)], text="bare")


def aligned(table: Table) -> str:
    """Return a table for people: words to the left, numbers to the right."""
    cells = [[heading.name for heading in table.headings]]
    cells += [[heading.shown(cell) for heading, cell in zip(table.headings, row, strict=True)] for row in table.rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = []
    for row in cells:
        padded = [
            cell.ljust(width) if heading.kind == "text" else cell.rjust(width)
            for cell, width, heading in zip(row, widths, table.headings, strict=True)
        ]
        lines.append("  ".join(padded).rstrip())
    return "".join(f"{line}\n" for line in lines)
