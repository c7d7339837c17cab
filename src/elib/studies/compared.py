"""Two recorded drives on one page: their paths over the floor, their latencies, and what was sensed over time."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import Any

import numpy as np

from elib.simulator.physics import Snapshot
from elib.studies.comparison import Comparison
from elib.studies.report import INK, PAPER, check_report, save, trim
from elib.studies.series import Series

FIRST, SECOND = "#3d7ebf", "#d1495b"
"""Of A and of B."""
MAX_CHARTS = 24
"""Fields that are drawn; more would be a metre of paper."""
MAX_COMMANDS = 12


def draw_comparison(
    path: str | PathLike[str], found: Comparison, labels: Sequence[str], floor: Snapshot | None
) -> None:
    """Write the page, with the *floor* on which both drove, without robots, if there is a map."""
    check_report(path)
    from matplotlib.figure import Figure

    shown = [(each.reading, each.field) for each in found.fields if each.count][:MAX_CHARTS]
    rows = max(len(shown), 5)
    height = max(6.5, 0.85 * rows + 1.4)
    figure = Figure(figsize=(12.5, height), dpi=110, facecolor=PAPER, layout="constrained")
    figure.suptitle(f"A  {labels[0]}\nB  {labels[1]}", color=INK, fontsize=11, x=0.01, ha="left")
    halves: Any = figure.subfigures(1, 2, width_ratios=[1, 1.35])
    left, right = halves
    paths, latencies = left.subplots(2, 1, height_ratios=[1.7, 1])
    _paths(paths, found, floor)
    _latencies(latencies, found)
    grid = right.add_gridspec(rows, 1)
    end = max(found.first.duration, found.second.duration, 1e-3)
    first: Any = None
    for row, (reading, field) in enumerate(shown):
        axes = right.add_subplot(grid[row], sharex=first)
        first = first or axes
        for run, colour in ((found.first, FIRST), (found.second, SECOND)):
            _line(axes, run.readings[reading], field, colour)
        axes.set_title(f"{reading} {field.replace('_', ' ')}", loc="left", fontsize=7.5, color=INK, pad=2)
        axes.set_xlim(0, end)
        _tidy(axes)
        if row < len(shown) - 1:
            axes.tick_params(labelbottom=False)
        else:
            axes.set_xlabel("time, s", color=INK, fontsize=8)
    save(figure, path)


def _line(axes: Any, series: Series, field: str, colour: str) -> None:
    values = series.values[:, series.fields.index(field)].copy()
    times = series.times
    holes = np.flatnonzero((np.diff(times) > series.hole) | series.broken[1:])
    # A line across a hole would be invented.
    times, values = np.insert(times, holes + 1, times[holes]), np.insert(values, holes + 1, np.nan)
    axes.plot(times, values, color=colour, linewidth=0.9, alpha=0.85)


def _paths(axes: Any, found: Comparison, floor: Snapshot | None) -> None:
    is_measured = found.path is not None and found.path.is_measured
    if floor is not None and is_measured:
        _map(axes, floor)
    missing = []
    for letter, run, colour in (("A", found.first, FIRST), ("B", found.second, SECOND)):
        path = run.measured if is_measured else run.odometry
        if path is None:
            missing.append(letter)
        else:
            x, y, _ = path.values.T
            axes.plot(x, y, color=colour, linewidth=1.4, alpha=0.85, label=letter)
            axes.plot(x[-1:], y[-1:], "o", color=colour, markersize=5)
    title = "paths, measured, m" if is_measured else "paths by the step counters, m"
    if missing:
        title = "no paths" if len(missing) == 2 else f"{title}; {missing[0]} has none"
    axes.set_title(title, loc="left", fontsize=9, color=INK)
    if len(missing) < 2:
        axes.legend(fontsize=9, frameon=False, loc="lower right", bbox_to_anchor=(1, 1), ncols=2, borderaxespad=0.1)
    axes.set_aspect("equal", adjustable="box")
    _tidy(axes)


def _map(axes: Any, floor: Snapshot) -> None:
    """Draw what stands there: seen from above, in m."""
    from matplotlib.patches import Circle, Polygon, Rectangle

    axes.add_patch(Rectangle((0, 0), floor.width, floor.depth, facecolor="#fbfbf8", edgecolor=INK, linewidth=1.5))
    for wall in floor.walls:
        axes.plot((wall.x1, wall.x2), (wall.y1, wall.y2), color=INK, linewidth=1.5)
    for box in floor.boxes:
        axes.add_patch(Polygon(box.corners, facecolor=str(box.colour), alpha=0.5))
    for post in floor.cylinders:
        axes.add_patch(Circle((post.x, post.y), post.radius, facecolor=str(post.colour), alpha=0.5))


def _latencies(axes: Any, found: Comparison) -> None:
    names = sorted(found.first.commands.keys() | found.second.commands.keys())[:MAX_COMMANDS]
    places = np.arange(len(names), dtype=float)
    for run, colour, shift in ((found.first, FIRST, -0.19), (found.second, SECOND, 0.19)):
        rows = [run.commands.get(name) for name in names]
        middle = [1000 * row.quantile(0.5) if row else np.nan for row in rows]
        late = [1000 * row.quantile(0.95) if row else np.nan for row in rows]
        axes.barh(places + shift, middle, height=0.34, color=colour, alpha=0.85)
        axes.plot(late, places + shift, "|", color=colour, markersize=9, markeredgewidth=2)
    axes.set_yticks(places, names)
    axes.invert_yaxis()
    axes.set_xlim(left=0)
    axes.set_title("latency, ms: median, | 95 % of the calls", loc="left", fontsize=9, color=INK)
    _tidy(axes)


def _tidy(axes: Any) -> None:
    trim(axes)
    axes.tick_params(labelsize=7)
