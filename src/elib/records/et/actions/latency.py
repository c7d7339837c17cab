"""The action ``Latency``: how long each command took."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np

from elib.records.et.action import Plotted, Summary
from elib.records.et.arguments import Argument, Percentiles
from elib.records.et.groups import Categories, Distribution
from elib.records.et.pairing import Pairing
from elib.records.et.plot import MAX_NAMES, draw_boxes, from_zero
from elib.records.et.rows import Block
from elib.records.et.table import Cell, Header, Table

Key = Literal["command", "robot"]
DECIMALS = 5
"""Decimals of milliseconds: a log does not have more."""


def to_key(text: str) -> Key:
    """Return the column whose words get a row each."""
    match text.lower():
        case "command" | "3":
            return "command"
        case "robot" | "1":
            return "robot"
        case _:
            raise ValueError("it must be command or robot")


@dataclass
class Latency(Summary, Plotted):
    """Print how long each command took, in ms, like Table 5.1 of the thesis of 2011; only calls with an ok are timed.

    `open` counts the calls without ok or ko: the log ended, or was begun again, before they did.
    """

    by: Annotated[Key, Argument("--by COLUMN", to_key, "A row of results for each command, or each robot.")] = "command"
    percentiles: Percentiles = (50.0, 95.0)
    pairing: Pairing = field(default_factory=Pairing, init=False)
    words: Categories = field(default_factory=Categories, init=False)
    distribution: Distribution = field(default_factory=Distribution, init=False)
    failed: Counter[int] = field(default_factory=Counter, init=False)

    def add(self, block: Block) -> None:
        """Add the latencies of the calls whose outcome is in *block*."""
        words, latencies = [], []
        for pair in self.pairing.pairs(block):
            word = pair.command if self.by == "command" else pair.robot
            if pair.event == b"ok":
                words.append(word)
                latencies.append(pair.latency)
            else:
                self.failed[self.words[word]] += 1
        self.distribution.add(np.array(latencies), self.words.codes(words))

    def table(self) -> Table:
        """Return a row for each command or robot, in the order of their names."""
        unanswered: Counter[int] = Counter()
        for (robot, command), count in self.pairing.unanswered.items():
            unanswered[self.words[command if self.by == "command" else robot]] += count
        headers = [
            Header(self.by, "text"),
            *(Header(name, "whole") for name in ("ok", "ko", "open")),
            *(Header(f"{name}_ms", decimals=3) for name in self.distribution.names(self.percentiles)),
        ]
        rows: list[list[Cell]] = [
            [word, self.distribution.count(group), self.failed[group], unanswered[group], *self._times(group)]
            for word, group in self._sorted()
        ]
        return Table(headers, rows)

    @property
    def notes(self) -> list[str]:
        """Notes for the user about rows without a partner."""
        return self.pairing.notes

    def draw(self, axes: Any) -> None:
        """Draw a box for each row, with whiskers from 5 % to 95 %."""
        found = [(word, group) for word, group in self._sorted() if self.distribution.count(group)][:MAX_NAMES]
        boxes = [self.distribution.box(1000, group) for _, group in found]
        draw_boxes(axes, [word for word, _ in found], boxes, "latency, ms")
        from_zero(axes, boxes)

    def _times(self, group: int) -> list[Cell]:
        cells = self.distribution.cells(self.percentiles, 1000, group)
        return [round(cell, DECIMALS) if isinstance(cell, float) else cell for cell in cells]

    def _sorted(self) -> list[tuple[str, int]]:
        return sorted(zip(self.words.texts(), self.words.values(), strict=True))
