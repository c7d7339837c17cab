"""A performance on one page: the path over the world, and speeds, readings and states over time."""

from __future__ import annotations

import importlib.util
import io
import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from elib.base.errors import ArgumentError, Unsupported
from elib.base.extras import install
from elib.base.files import write_file
from elib.simulator.drawing.png import png_of
from elib.simulator.drawing.top import Trail
from elib.simulator.physics import Snapshot

SUFFIXES = (".png", ".svg", ".pdf")
HOLE = 2.0
"""s without a reading after which its line is broken."""
INK, PAPER, GRID = "#2b2d33", "#ffffff", "#c9ced6"
COLOURS = ("#d1495b", "#e38b29", "#b8a028", "#5a9e52", "#2a9d8f", "#3d7ebf", "#6a5cb8", "#a64d8f")
"""Of the lines of a chart, in order; eight of one lightness, so that none is louder than another."""
SHADES = ("#eef1f5", "#dde4ee")
"""Of the states, in turn."""


@dataclass(frozen=True, slots=True)
class Chart:
    """Lines over time."""

    title: str  # what they are, with the unit
    times: Sequence[float]  # s; the same for all lines
    lines: Sequence[Sequence[float]]  # their values at these times
    names: Sequence[str]  # what each is called
    is_stepped: bool = False  # a value holds until the next one


def check_report(path: str | PathLike[str]) -> None:
    """Check that a report can be written, before anything runs for it."""
    if Path(path).suffix.lower() not in SUFFIXES:
        raise ArgumentError(f"a plot cannot become {fspath(path)!r}; its name must end in {', '.join(SUFFIXES)}")
    if not Path(path).parent.is_dir():
        raise ArgumentError(f"there is no folder {fspath(Path(path).parent)!r} for the plot {fspath(path)!r}")
    if importlib.util.find_spec("matplotlib") is None:
        raise Unsupported("plots need Matplotlib, which is not installed", hint=install("plot"))


def draw_report(
    path: str | PathLike[str],
    *,
    title: str,
    floor: Snapshot | None,
    trails: Sequence[Trail],
    charts: Sequence[Chart],
    states: Sequence[tuple[float, str]],
    seconds: float,
) -> None:
    """Write the page.

    Args:
        path: Of a file that ends in ``.png``, ``.svg`` or ``.pdf``; an existing one is replaced.
        title: Above all.
        floor: The surroundings, or None where there is no map.
        trails: Each robot's path, oldest first.
        charts: One below the other.
        states: When each state began, s, and its name.
        seconds: When it ended, s.
    """
    check_report(path)
    rows = max(1, len(charts))
    figure = figure_of(12.5, max(5.6, 1.9 * rows + 1.2), title)
    grid = figure.add_gridspec(
        rows, 2 if floor is not None else 1, width_ratios=[1, 1.25] if floor is not None else [1]
    )
    if floor is not None:
        _map(figure.add_subplot(grid[:, 0]), floor, trails)
    first: Any = None
    for row, chart in enumerate(charts):
        axes = figure.add_subplot(grid[row, -1], sharex=first)
        first = first or axes
        _states(axes, states, seconds, is_named=row == 0)
        _lines(axes, chart)
        axes.set_xlim(0, max(seconds, 1e-3))
        if row < rows - 1:
            axes.tick_params(labelbottom=False)
        else:
            axes.set_xlabel("time, s", color=INK)
    save(figure, path)


def figure_of(width: float, height: float, title: str) -> Any:
    """Return an empty figure of Matplotlib of this size, inches, with a title."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=110, facecolor=PAPER, layout="constrained")
    figure.suptitle(title, color=INK, fontsize=13, x=0.01, ha="left")
    return figure


def save(figure: Any, path: str | PathLike[str]) -> None:
    """Write a figure of Matplotlib into a file, in the form that its name says.

    An SVG has the same bytes on every run: the names of its parts are random without a salt.
    """
    from matplotlib import rc_context

    form, page = Path(path).suffix.lower().removeprefix("."), io.BytesIO()
    with rc_context({"svg.hashsalt": "elib"}), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # characters that the font does not have become boxes
        figure.savefig(page, format=form, metadata={"Date": None} if form == "svg" else None)
    write_file(path, page.getvalue())


def trim(axes: Any) -> None:
    """Draw no frame above and on the right, and the rest of it faintly."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color("#9aa0aa")
    axes.tick_params(colors=INK, labelsize=8)


def _map(axes: Any, floor: Snapshot, trails: Sequence[Trail]) -> None:
    from PIL import Image

    axes.imshow(Image.open(io.BytesIO(png_of(floor, trails=trails))))
    axes.set_axis_off()


def _states(axes: Any, states: Sequence[tuple[float, str]], seconds: float, *, is_named: bool) -> None:
    """Shade the spans of the states; name those that are wide enough for a word."""
    ends = [*(since for since, _ in states[1:]), seconds]
    for number, ((since, name), until) in enumerate(zip(states, ends, strict=False)):
        axes.axvspan(since, until, color=SHADES[number % 2], zorder=0, linewidth=0)
        if is_named and until - since > 0.012 * len(name) * seconds:
            axes.annotate(
                name,
                ((since + until) / 2, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 3),
                textcoords="offset points",
                ha="center",
                fontsize=7.5,
                color=INK,
            )


def _broken(times: Sequence[float], values: Sequence[float]) -> tuple[list[float], list[float]]:
    """Return both with a hole where nothing was read for long: a line across it would be invented."""
    shown_times: list[float] = []
    shown_values: list[float] = []
    for time, value in zip(times, values, strict=True):
        if shown_times and time - shown_times[-1] > HOLE:
            shown_times.append(shown_times[-1] + HOLE / 2)
            shown_values.append(math.nan)
        shown_times.append(time)
        shown_values.append(value)
    return shown_times, shown_values


def _lines(axes: Any, chart: Chart) -> None:
    for number, (values, name) in enumerate(zip(chart.lines, chart.names, strict=True)):
        style = {"drawstyle": "steps-post"} if chart.is_stepped else {}
        colour = COLOURS[number * len(COLOURS) // max(len(chart.lines), 1) % len(COLOURS)]
        times, shown = (chart.times, values) if chart.is_stepped else _broken(chart.times, values)
        axes.plot(times, shown, color=colour, linewidth=1.1, label=name, **style)
    axes.set_title(chart.title, loc="left", fontsize=9, color=INK, pad=14)
    axes.grid(axis="y", color=GRID, linewidth=0.5)
    trim(axes)
    if chart.lines:
        axes.legend(loc="center left", bbox_to_anchor=(1.005, 0.5), fontsize=7, frameon=False, handlelength=1.2)
