"""Results as a table: named columns and rows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

Cell = str | int | float | None
Kind = Literal["text", "whole", "number", "truth", "any"]


@dataclass(frozen=True, slots=True)
class Header:
    """The header of a column of results."""

    name: str
    kind: Kind = "number"  # what the cells are; `any` if they may differ
    decimals: int | None = None  # how many decimals the numbers have in text; None for eight significant digits

    def shown(self, cell: Cell) -> str:
        """Return a cell as text."""
        if cell is None or (isinstance(cell, float) and math.isnan(cell)):
            return "-"
        if isinstance(cell, float):
            return f"{cell:.8g}" if self.decimals is None else f"{cell:.{self.decimals}f}"
        return str(cell)


@dataclass(frozen=True, slots=True)
class Table:
    """A table of results."""

    headers: Sequence[Header]  # the columns
    rows: Iterable[Sequence[Cell]]  # the rows; they can be read once
    # the form as text: `aligned` columns, `rows` that et can read again, or one `bare` cell
    text: Literal["aligned", "rows", "bare"] = "aligned"

    @classmethod
    def of_figure(cls, name: str, value: float) -> Table:
        """Return a table of one number."""
        return cls([Header(name, decimals=8)], [(value,)], text="bare")


def aligned(table: Table) -> str:
    """Return a table as text with aligned columns: words to the left, numbers to the right."""
    cells = [[header.name for header in table.headers]]
    cells += [[header.shown(cell) for header, cell in zip(table.headers, row, strict=True)] for row in table.rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = []
    for row in cells:
        padded = [
            cell.ljust(width) if header.kind == "text" else cell.rjust(width)
            for cell, width, header in zip(row, widths, table.headers, strict=True)
        ]
        lines.append("  ".join(padded).rstrip())
    return "".join(f"{line}\n" for line in lines)
