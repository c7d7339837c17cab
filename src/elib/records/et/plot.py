"""Plots of results, drawn by Matplotlib."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from elib.base import plots
from elib.base.errors import ArgumentError
from elib.records.et.action import Action, Plotted

INK, GRID = "#2b2d33", "#c9ced6"
COLOURS = ("#3d7ebf", "#d1495b", "#5a9e52", "#e38b29", "#6a5cb8", "#2a9d8f", "#a64d8f", "#b8a028")
MAX_LINES = len(COLOURS)
"""Lines in one plot: as many as there are colours that can be told apart."""
MAX_NAMES = 40
"""Names on one axis that can be read."""
MAX_LABEL = 40
"""Characters of a label."""
SQUEEZED = 10
"""The axis becomes logarithmic when one median is this many times another."""


def check_plot(action: Action, file: str) -> None:
    """Check that *action* can be drawn into *file*, before anything is read."""
    if not isinstance(action, Plotted):
        raise ArgumentError(f"{type(action).__name__} has no plot", hint="et --help says which actions have one")
    plots.check_plot(file)


def draw_plot(action: Action, file: str, title: str) -> None:
    """Draw the results of *action* to a file; an existing file is replaced."""
    from matplotlib.figure import Figure

    if not isinstance(action, Plotted):
        return
    figure = Figure(figsize=(10, 5.6), dpi=110, facecolor="#ffffff", layout="constrained")
    axes: Any = figure.add_subplot()
    axes.set_title(label_of(title), loc="left", fontsize=11, color=INK)
    axes.grid(color=GRID, linewidth=0.5)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    action.draw(axes)
    plots.save(figure, file)


def draw_boxes(axes: Any, names: Sequence[str], boxes: Iterable[dict[str, float]], label: str) -> None:
    """Draw a box from ``q1`` to ``q3`` for each name, its line at ``med``, whiskers to ``whislo`` and ``whishi``."""
    axes.set_xlabel(f"{label} (box: the middle half; whiskers: 5 % to 95 %)", color=INK)
    if not names:
        return
    axes.bxp(
        [{**box, "label": label_of(name)} for name, box in zip(names, boxes, strict=True)],
        orientation="horizontal",
        showfliers=False,
        patch_artist=True,
        boxprops={"facecolor": COLOURS[0], "alpha": 0.5},
        medianprops={"color": INK},
    )
    axes.invert_yaxis()


def from_zero(axes: Any, boxes: Sequence[dict[str, float]]) -> None:
    """Let the axis begin at 0, or make it logarithmic if the longest box would squeeze the others."""
    medians = [box["med"] for box in boxes]
    if medians and max(medians) > SQUEEZED * min(medians) > 0:
        from matplotlib.ticker import LogLocator

        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_minor_formatter("")
        axes.xaxis.set_major_formatter("{x:g}")
    else:
        axes.set_xlim(left=0)


def draw_legend(axes: Any, count: int, which: str) -> None:
    """Name the lines beside the chart, and say which of *count* lines were drawn."""
    title = f"the {which} {MAX_LINES} of {count}" if count > MAX_LINES else None
    axes.legend(title=title, loc="center left", bbox_to_anchor=(1.005, 0.5), frameon=False, fontsize=8, markerscale=3)


def label_of(text: str) -> str:
    """Return *text* as a label that is not too long."""
    return text if len(text) <= MAX_LABEL else f"{text[: MAX_LABEL - 3]}..."
