"""The base of actions. An action is a dataclass: its fields are its arguments, and its docstring is its help.

A new action is a class in a file of :mod:`elib.records.et.actions`; nothing else names it::

    @dataclass
    class Longest(Figure):
        \"\"\"Print the length of the longest row.\"\"\"

        length: int = field(default=0, init=False)

        def add(self, block: Block) -> None:
            self.length = max(self.length, *map(len, block.rows))

        @property
        def figure(self) -> float:
            return self.length

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
    """Something that et can do with rows.

    Attributes:
        is_streaming: Results come while the rows are read, not only after the last one.
    """

    is_streaming: ClassVar[bool] = False

    @abstractmethod
    def run(self, blocks: Iterable[Block], writer: Writer) -> None:
        """Read all rows and write the results.

        Raises:
            RowError: A row is not what the action needs.
        """

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


class Summary(Action):
    """An action that prints a table when all rows are read."""

    @abstractmethod
    def add(self, block: Block) -> None:
        """Add the rows of *block*."""

    @abstractmethod
    def table(self) -> Table:
        """Return the results."""

    def run(self, blocks: Iterable[Block], writer: Writer) -> None:
        """Print the table."""
        for block in blocks:
            self.add(block)
        writer.write(self.table())


class Figure(Summary):
    """An action that prints one number, with 8 decimals."""

    @property
    @abstractmethod
    def figure(self) -> float:
        """The number."""

    def table(self) -> Table:
        """Return the number."""
        return Table.of_figure(type(self).__name__.lower(), self.figure)


class Plotted(ABC):
    """An action whose results can be drawn as well."""

    @abstractmethod
    def draw(self, axes: Any) -> None:
        """Draw the results on Matplotlib *axes*, after the run."""
