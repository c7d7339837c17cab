"""The action ``Latency``: how long each command took."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from elib.base.rules import Choice
from elib.records.et.action import Paired, Plotted, TableAction
from elib.records.et.arguments import Parameter, Percentiles
from elib.records.et.groups import Groups, box, check_words, describe, names
from elib.records.et.plot import MAX_NAMES, draw_boxes, from_zero
from elib.records.et.rows import Block, text_of
from elib.records.et.table import Cell, Header, Table

DECIMALS = 5
"""Decimals of milliseconds: a log does not have more."""


class _Key(Choice):
    def read(self, text: str) -> object:
        """Return the name of a column that was given by name or number."""
        return {"1": "robot", "3": "command"}.get(text) or Choice.read(self, text)


@dataclass
class Latency(Paired, TableAction, Plotted):
    """Print how long each command took, in ms, like Table 5.1 of the thesis of 2011; only calls with an ok are timed.

    `open` counts the calls without ok or ko: the log ended, or was begun again, before they did.
    """

    by: Annotated[
        str, Parameter("--by COLUMN", _Key(("command", "robot")), "A row of results for each command, or each robot.")
    ] = "command"
    percentiles: Percentiles = (50.0, 95.0)
    latencies: Groups = field(default_factory=Groups, init=False)
    failed: Counter[bytes] = field(default_factory=Counter, init=False)

    def table(self, blocks: Iterable[Block]) -> Table:
        """Return a row for each command or robot, in the order of their names."""
        for block in blocks:
            words, latencies = [], []
            for pair in self.pairing.pairs(block):
                word = pair.command if self.by == "command" else pair.robot
                if pair.event == b"ok":
                    words.append(word)
                    latencies.append(pair.latency)
                else:
                    self.failed[word] += 1
            self.latencies.add(np.array(latencies), words)
            check_words(self.failed)
        unanswered: Counter[bytes] = Counter()
        for (robot, command), count in self.pairing.unanswered.items():
            unanswered[command if self.by == "command" else robot] += count
        headers = [
            Header(self.by, "text"),
            *(Header(name, "whole") for name in ("ok", "ko", "open")),
            *(Header(f"{name}_ms", decimals=3) for name in names(self.percentiles)),
        ]
        words = sorted({*self.latencies.words, *self.failed, *unanswered}, key=text_of)
        return Table(headers, ([text_of(word), *self._cells(word, unanswered[word])] for word in words))

    def draw(self, axes: Any) -> None:
        """Draw a box for each row, with whiskers from 5 % to 95 %."""
        words = sorted(self.latencies.words, key=text_of)[:MAX_NAMES]
        boxes = [box(self.latencies.of(word), 1000) for word in words]
        draw_boxes(axes, list(map(text_of, words)), boxes, "latency, ms")
        from_zero(axes, boxes)

    def _cells(self, word: bytes, unanswered: int) -> list[Cell]:
        values = self.latencies.of(word)
        times = describe(values, self.percentiles, 1000)
        rounded = [round(cell, DECIMALS) if isinstance(cell, float) else cell for cell in times]
        return [len(values), self.failed[word], unanswered, *rounded]
