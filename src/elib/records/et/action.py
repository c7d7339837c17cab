"""The base of actions. An action is a dataclass: its fields are its arguments, and its docstring is its help.

A new action is a class in a file of :mod:`elib.records.et.actions`; nothing else names it::

    @dataclass
    class Longest(Figure):
        \"\"\"Print the length of the longest row.\"\"\"

        def figure(self, blocks: Iterable[Block]) -> float:
            return max((len(row) for block in blocks for row in block.rows), default=0)

Fields of :mod:`elib.records.et.arguments`, such as ``column: Column``, are given on the command line.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from itertools import compress
from typing import Any, ClassVar

from elib.records.et.formats import Writer
from elib.records.et.rows import Block
from elib.records.et.table import Table


class Action(ABC):
    """Something that et can do with rows."""

    is_streaming: ClassVar[bool] = False  # results come while the rows are read, not only after the last one

    @abstractmethod
    def run(self, blocks: Iterable[Block], writer: Writer) -> None:
        """Read all rows and write the results."""

    @property
    def notes(self) -> list[str]:
        """Notes for the user besides the results."""
        return []


class Filter(Action):
    """An action that copies some of the rows."""

    is_streaming = True

    @abstractmethod
    def keep(self, block: Block) -> Iterable[bool]:
        """Return for each row of *block* whether to copy it."""

    def run(self, blocks: Iterable[Block], writer: Writer) -> None:
        """Copy the rows that :meth:`keep` chooses."""
        for block in blocks:
            writer.copy(block, list(compress(block.rows, self.keep(block))))


class TableAction(Action):
    """An action that prints a table when all rows are read."""

    @abstractmethod
    def table(self, blocks: Iterable[Block]) -> Table:
        """Read all rows and return the results."""

    def run(self, blocks: Iterable[Block], writer: Writer) -> None:
        """Print the table."""
        writer.write(self.table(blocks))


class Figure(TableAction):
    """An action that prints one number, with 8 decimals."""

    @abstractmethod
    def figure(self, blocks: Iterable[Block]) -> float:
        """Read all rows and return the number."""

    def table(self, blocks: Iterable[Block]) -> Table:
        """Return the number as a table."""
        return Table.of_figure(type(self).__name__.lower(), self.figure(blocks))


class Plotted(ABC):
    """An action whose results can be drawn as well."""

    @abstractmethod
    def draw(self, axes: Any) -> None:
        """Draw the results on Matplotlib *axes*, after the run."""
