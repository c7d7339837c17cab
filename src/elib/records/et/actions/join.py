"""The action ``Join``: each call with its outcome and its latency."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

from elib.records.et.action import Paired, Plotted
from elib.records.et.formats import PAIRS, Writer
from elib.records.et.pairing import Pair
from elib.records.et.plot import COLOURS, draw_legend, label_of
from elib.records.et.rows import Block, text_of
from elib.records.et.table import Table

DECIMALS = 8
"""Decimals of the times of a log, and therefore of the latencies."""
MAX_POINTS = 20_000
"""Points in a plot; of more points, every second, fourth, eighth ... is drawn."""


@dataclass
class Join(Paired, Plotted):
    """Join each call with its ok or ko: time of the call, robot, ok or ko, command, latency (s).

    The rows can be read again: `et Join | et Stats latency --by command`. An ok or ko belongs to the oldest call of
    that robot and command without one.
    """

    is_streaming = True
    points: list[Pair] = field(default_factory=list, init=False)
    stride: int = field(default=1, init=False)

    def run(self, blocks: Iterable[Block], writer: Writer) -> None:
        """Write a row for each pair."""
        writer.write(Table(PAIRS, self._rows(blocks), text="rows"))

    def draw(self, axes: Any) -> None:
        """Draw the latencies over time."""
        by_command: dict[str, list[Pair]] = {}
        for pair in sorted(self.points, key=lambda pair: pair.time):
            by_command.setdefault(text_of(pair.command), []).append(pair)
        most = sorted(by_command.items(), key=lambda item: -len(item[1]))
        for (command, pairs), colour in zip(most, COLOURS, strict=False):
            times, latencies = [pair.time for pair in pairs], [1000 * pair.latency for pair in pairs]
            axes.plot(times, latencies, ".", markersize=3, color=colour, label=label_of(command))
        if most:
            draw_legend(axes, len(most), "most frequent")
        axes.set_xlabel("time, s")
        axes.set_ylabel("latency, ms")

    def _rows(self, blocks: Iterable[Block]) -> Iterator[tuple[float, str, str, str, float]]:
        pairs = (pair for block in blocks for pair in self.pairing.pairs(block))
        for number, pair in enumerate(pairs):
            if number % self.stride == 0:
                self._remember(pair)
            words = text_of(pair.robot), text_of(pair.event), text_of(pair.command)
            yield (pair.time, *words, round(pair.latency, DECIMALS))

    def _remember(self, pair: Pair) -> None:
        self.points.append(pair)
        if len(self.points) > MAX_POINTS:
            del self.points[1::2]
            self.stride *= 2
