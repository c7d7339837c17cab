from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np

from elib.et.action import Plotted, Summary
from elib.et.arguments import Argument, Percentiles
from elib.et.groups import Described, Words
from elib.et.pairing import Pairing
from elib.et.plot import draw_boxes, from_zero
from elib.et.rows import Block
from elib.et.table import Cell, Heading, Table

Key = Literal["command", "robot"]
DECIMALS = 5
"""Of milliseconds: a log has no more."""
MOST_BOXES = 40
"""Boxes whose names can be read."""


def to_key(text: str) -> Key:
    """Return what latencies are told apart by."""
    match text.lower():
        case "command" | "3":
            return "command"
        case "robot" | "1":
            return "robot"
        case _:
            raise ValueError("it must be command or robot")


@dataclass
class Latency(Summary, Plotted):
    """Say how long each command took, in ms, as Table 5.1 of the thesis of 2011; only what ended with ok is timed.

    `open` is the calls without ok or ko: the log ended, or was begun again, before they did.
    """

    by: Annotated[Key, Argument("--by COLUMN", to_key, "A row of results for each command, or each robot.")] = "command"
    percentiles: Percentiles = (50.0, 95.0)
    pairing: Pairing = field(default_factory=Pairing, init=False)
    words: Words = field(default_factory=Words, init=False)
    described: Described = field(default_factory=Described, init=False)
    failed: Counter[int] = field(default_factory=Counter, init=False)

    def add(self, block: Block) -> None:
        """Time the calls that ended in *block*."""
        words, latencies = [], []
        for pair in self.pairing.pairs(block):
            word = pair.command if self.by == "command" else pair.robot
            if pair.event == b"ok":
                words.append(word)
                latencies.append(pair.latency)
            else:
                self.failed[self.words[word]] += 1
        self.described.add(np.array(latencies), self.words.codes(words))

    def table(self) -> Table:
        """Return a row for each command, in order of names."""
        unanswered: Counter[int] = Counter()
        for (robot, command), count in self.pairing.unanswered.items():
            unanswered[self.words[command if self.by == "command" else robot]] += count
        names = ["mean", "sd", "min", *(f"p{each:g}" for each in self.percentiles), "max"]
        headings = [
            Heading(self.by, "text"),
            *(Heading(name, "whole") for name in ("ok", "ko", "open")),
            *(Heading(f"{name}_ms", decimals=3) for name in names),
        ]
        rows: list[list[Cell]] = [
            [word, self.described.count(group), self.failed[group], unanswered[group], *self._times(group)]
            for word, group in self._sorted()
        ]
        return Table(headings, rows)

    @property
    def notes(self) -> list[str]:
        """What is in no pair."""
        return self.pairing.notes

    def draw(self, axes: Any) -> None:
        """Draw a box a command, with whiskers from 5 % to 95 %."""
        found = [(word, group) for word, group in self._sorted() if self.described.count(group)][:MOST_BOXES]
        boxes = [self.described.box(1000, group) for _, group in found]
        draw_boxes(axes, [word for word, _ in found], boxes, "latency, ms")
        from_zero(axes, boxes)

    def _times(self, group: int) -> list[Cell]:
        cells = self.described.cells(self.percentiles, 1000, group)
        return [round(cell, DECIMALS) if isinstance(cell, float) else cell for cell in cells]

    def _sorted(self) -> list[tuple[str, int]]:
        return sorted(zip(self.words.texts(), self.words.values(), strict=True))
