"""The plot of a sweep."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

from elib.learn.sweep import Row, Sweep, check_metric, kind_of
from elib.studies.report import COLOURS, GRID, INK, PAPER, save, trim

BINS = 8
"""Parts into which a parameter with more values than :data:`MAX_TICKS` is divided for the line of a plot."""
MAX_TICKS = 12


def draw_sweep(path: Path, sweep: Sweep, rows: Sequence[Row], metric: str = "") -> None:
    """Draw a metric against each parameter that is varied.

    Every run is a dot, the line joins the medians, and the band holds the middle half of the runs. The metric is a
    column of the table; by default the first one that is measured.
    """
    from matplotlib.figure import Figure

    metric = check_metric(sweep, metric)
    names = [name for name in sweep.varied if kind_of([row[name] for row in rows]) != "text"]
    others = [name for name in ("world", "fault", *sweep.varied) if name not in names]
    kind_of_row = itemgetter(*others)  # others holds two names or more
    kinds = {kind_of_row(row): None for row in rows}
    varying = [n for n, name in enumerate(others) if len({kind[n] for kind in kinds}) > 1]
    labels = [", ".join(str(kind[n]) for n in varying) for kind in kinds]
    panels = names or [""]
    figure = Figure(figsize=(1.2 + 4.6 * len(panels), 4.2), facecolor=PAPER, layout="constrained")
    figure.suptitle(f"{sweep.target}: {len(rows)} runs", color=INK, fontsize=12, x=0.01, ha="left")
    shared: Any = None
    for k, name in enumerate(panels):
        axes = shared = figure.add_subplot(1, len(panels), k + 1, sharey=shared)
        for n, kind in enumerate(kinds):
            of_kind = [row for row in rows if kind_of_row(row) == kind and row[metric] is not None]
            points = [(float(row[name]) if name else float(n), float(row[metric])) for row in of_kind]
            _draw_kind(axes, points, COLOURS[(5 + 3 * n) % len(COLOURS)], labels[n])
        axes.set_xlabel(name.replace("_", " ") if name else ", ".join(others[n] for n in varying), color=INK)
        if not name:
            axes.set_xticks(range(len(kinds)), labels)
            axes.set_xlim(-0.6, len(kinds) - 0.4)
        axes.grid(axis="y", color=GRID, linewidth=0.5)
        axes.set_axisbelow(True)
        trim(axes)
        if k == 0:
            axes.set_ylabel(sweep.metrics[metric], color=INK)
    if names and varying:
        shared.legend(frameon=False, fontsize=9, labelcolor=INK)
    save(figure, path)


def _draw_kind(axes: Any, points: Sequence[tuple[float, float]], colour: str, label: str) -> None:
    """Draw the runs of one world, fault and so on."""
    if not points:
        return
    low, high = min(x for x, _ in points), max(x for x, _ in points)
    groups: dict[float, list[float]] = {}
    are_binned = len({x for x, _ in points}) > MAX_TICKS
    for x, y in points:
        part = min(BINS - 1, int((x - low) / (high - low) * BINS)) if are_binned else 0
        groups.setdefault(low + (part + 0.5) * (high - low) / BINS if are_binned else x, []).append(y)
    middle = sorted(groups)
    quartiles = [
        statistics.quantiles(groups[x], n=4, method="inclusive") if len(groups[x]) > 1 else groups[x] * 3
        for x in middle
    ]
    axes.scatter(*zip(*points, strict=True), s=14, color=colour, alpha=0.3, linewidths=0)
    if len(middle) > 1:
        axes.fill_between(middle, [q[0] for q in quartiles], [q[2] for q in quartiles], color=colour, alpha=0.15, lw=0)
        axes.plot(middle, [q[1] for q in quartiles], color=colour, lw=2, marker="o", ms=4, label=label)
    else:
        ((low, median, high),) = quartiles
        line = {"color": colour, "marker": "o", "lw": 2, "capsize": 5, "label": label}
        axes.errorbar(middle, [median], yerr=[[median - low], [high - median]], **line)
