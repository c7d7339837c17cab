from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated

from elib.et.action import Filter
from elib.et.arguments import Argument, Column
from elib.et.rows import Block


@dataclass
class FromCollection(Filter):
    """Copy the rows whose word in a column is one of those given, exactly."""

    column: Column
    words: Annotated[tuple[str, ...], Argument("WORD", str, "As in the log; none copies nothing.", is_many=True)] = ()
    wanted: frozenset[bytes] = field(init=False)

    def __post_init__(self) -> None:
        self.wanted = frozenset(word.encode("utf-8", "surrogateescape") for word in self.words)

    def keep(self, block: Block) -> Iterable[bool]:
        """Look the words up."""
        return map(self.wanted.__contains__, block.words(self.column))
