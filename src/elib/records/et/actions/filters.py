"""Actions that copy some of the rows."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated

from elib.base.rules import Number
from elib.records.et.action import Filter
from elib.records.et.arguments import Column, Parameter, Words
from elib.records.et.rows import NAMES, Block
from elib.records.lognames import synonyms

COMMAND = NAMES["command"]


@dataclass
class FromCollection(Filter):
    """Copy the rows whose word in a column is one of those given, exactly.

    A command has two names, `proximity` and `GetIR(..)` in logs of 2011. In column 3, either finds both.
    """

    column: Column
    words: Annotated[
        tuple[str, ...], Parameter("WORD...", Words(), "Words as in the log; without any, nothing is copied.")
    ] = ()
    wanted: frozenset[bytes] = field(init=False)

    def __post_init__(self) -> None:
        words = set().union(*map(synonyms, self.words)) if self.column == COMMAND else self.words
        self.wanted = frozenset(word.encode("utf-8", "surrogateescape") for word in words)

    def keep(self, block: Block) -> Iterable[bool]:
        """Return for each row whether its word is one of those given."""
        return map(self.wanted.__contains__, block.words(self.column))


@dataclass
class FromTo(Filter):
    """Copy the rows whose number in a column is at least X and less than Y."""

    column: Column
    low: Annotated[float, Parameter("X", Number(), "The least number that is copied.")]
    high: Annotated[float, Parameter("Y", Number(), "All numbers that are copied are less than this.")]

    def keep(self, block: Block) -> Iterable[bool]:
        """Return for each row whether its number is within the bounds."""
        values = block.numbers(self.column)
        kept: list[bool] = ((values >= self.low) & (values < self.high)).tolist()
        return kept
