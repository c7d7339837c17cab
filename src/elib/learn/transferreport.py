"""A transfer report as rows of a table, as JSON, and as a folder with a page, a plot and all runs."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from elib import __version__
from elib.base.errors import ArgumentError
from elib.base.files import write_file
from elib.learn.transfer import BROKEN, StageResult, TransferReport
from elib.records.et.formats import write_table
from elib.records.et.table import Cell, Header, Table
from elib.studies.report import COLOURS, GRID, INK, PAPER, check_report, figure_of, save, trim

COLUMNS = ("stage", "runs", "fitness", "95 %", "success", "ratio", "95 %")
STAGE = ("name", "about", "runs", "mean", "interval", "ratio", "ratio_interval", "lost", "seeds", "fitness")
RUNS = (*(Header(name, "text") for name in ("part", "stage")), Header("value"), Header("seed", "whole"))
RUNS += (Header("fitness"), Header("solved", "whole"))


def check_folder(folder: Path) -> None:
    """Make the folder of a report, before anything runs for it, and check that a plot can be drawn."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ArgumentError(f"the folder {str(folder)!r} cannot be made: {error.strerror}") from None
    check_report(folder / "transfer.svg")


def row_of(stage: StageResult) -> tuple[str, ...]:
    """Return the cells of a stage, under :data:`COLUMNS`."""
    lost = f", {stage.lost} lost" if stage.lost else ""
    if not stage.fitness:
        return stage.name, str(stage.runs), "not measured", "", "", "", ""
    return (
        stage.name,
        f"{stage.runs}{lost}",
        f"{stage.mean:.3f}",
        _interval(stage.interval, 3),
        f"{stage.solved / stage.runs:.0%}",
        "-" if math.isnan(stage.ratio) else f"{stage.ratio:.2f}",
        _interval(stage.ratio_interval, 2),
    )


def _interval(ends: tuple[float, float], digits: int) -> str:
    return "-" if math.isnan(ends[0]) else f"{ends[0]:.{digits}f}..{ends[1]:.{digits}f}"


def to_json(report: TransferReport) -> dict[str, object]:
    """Return the report for JSON; None stands for what is not a finite number."""
    return {
        "task": report.task,
        "seed": report.seed,
        "version": __version__,
        "stages": [
            {
                **{name: getattr(stage, name) for name in STAGE},
                "success": stage.solved / stage.runs if stage.fitness else None,
            }
            for stage in report.stages
        ],
        "breaks": [
            {
                **{name: getattr(each.trouble, name) for name in ("name", "where", "unit", "usual")},
                **{name: getattr(each, name) for name in ("limit", "margin", "values")},
                "means": [stage.mean for stage in each.stages],
                "ratios": [stage.ratio for stage in each.stages],
            }
            for each in report.sensitivities
        ],
        "left_out": report.left_out,
    }


def write_folder(report: TransferReport, folder: Path, title: str) -> list[Path]:
    """Write ``report.md``, ``transfer.svg`` and all runs, as Parquet if DuckDB is installed, or else as CSV.

    The folder was checked by :func:`check_folder`. Returns the files.
    """
    runs = folder / f"runs.{'parquet' if importlib.util.find_spec('duckdb') else 'csv'}"
    write_table(runs, Table(RUNS, _runs(report)))
    page, plot = folder / "report.md", folder / "transfer.svg"
    write_file(page, _page(report, title).encode("utf-8", "replace"))
    _draw(report, plot, title)
    return [page, plot, runs]


def _runs(report: TransferReport) -> Iterator[tuple[Cell, ...]]:
    stages: list[tuple[str, float | None, StageResult]] = [("stage", None, stage) for stage in report.stages]
    for each in report.sensitivities:
        stages += [(each.trouble.name, *pair) for pair in zip(each.values[1:], each.stages[1:], strict=True)]
    for part, value, stage in stages:
        for k, fitness in enumerate(stage.fitness):
            yield part, stage.name, value, stage.seeds[k] if stage.seeds else None, fitness, int(stage.is_solved[k])


def _page(report: TransferReport, title: str) -> str:
    """Return the report as a page in Markdown."""
    lines = [f"# Transfer of {title}", "", _row(COLUMNS), _row(["---"] * len(COLUMNS))]
    lines += [_row(row_of(stage)) for stage in report.stages]
    lines += ["", *(f"- {stage.name}: {stage.about}." for stage in report.stages)]
    lines += [f"- Left out: {each}." for each in report.left_out]
    if report.sensitivities:
        lines += ["", "## What breaks it first", ""]
        lines += [f"{number}. {each.text}." for number, each in enumerate(report.sensitivities, 1)]
        usual = (f"{each.trouble.name} {each.trouble.usual:g} {each.trouble.unit}" for each in report.sensitivities)
        lines += ["", f"Usual on a real robot: {'; '.join(usual)}."]
    lines += ["", "![Fitness of each stage, and how it falls as each trouble grows](transfer.svg)", ""]
    lines += [
        f"Intervals are 95 % percentiles of the bootstrap. Seed {report.seed}, elib {__version__}: the same seed gives"
        " the same figures, except on a robot.",
        "",
    ]
    return "\n".join(lines)


def _row(cells: Any) -> str:
    return f"| {' | '.join(cells)} |"


def _draw(report: TransferReport, path: Path, title: str) -> None:
    """Draw the fitness of each stage with its interval, and how it falls as each trouble grows."""
    measured = [stage for stage in report.stages if stage.fitness]
    figure = figure_of(11, max(3.6, 0.36 * len(measured) + 1.6), f"Transfer of {title}")
    axes = figure.subplots(1, 2 if report.sensitivities else 1, squeeze=False)[0]
    _draw_stages(axes[0], measured)
    if report.sensitivities:
        _draw_sensitivities(axes[1], report)
    save(figure, path)


def _draw_stages(axes: Any, stages: list[StageResult]) -> None:
    axes.set_title("fitness: each run, mean and 95 % interval", loc="left", fontsize=9, color=INK)
    for y, stage in enumerate(stages):
        colour = COLOURS[5] if stage.name.startswith(("wire", "poor")) else COLOURS[4] if y < 2 else COLOURS[1]
        axes.plot(stage.fitness, [y] * len(stage.fitness), "|", color=colour, alpha=0.4, markersize=9)
        if not math.isnan(stage.interval[0]):
            axes.plot(stage.interval, (y, y), color=colour, linewidth=6, solid_capstyle="butt")
        axes.plot([stage.mean], [y], "o", color=PAPER, markersize=4, markeredgecolor=colour)
    axes.axvline(BROKEN * stages[0].mean, color=INK, linewidth=0.8, linestyle=":")
    note = {"fontsize": 7.5, "color": INK, "ha": "center", "backgroundcolor": PAPER}
    axes.text(BROKEN * stages[0].mean, -0.75, f"{100 * BROKEN:.0f} % of physics", **note)
    axes.set_yticks(range(len(stages)), [stage.name for stage in stages])
    axes.set_ylim(len(stages) - 0.4, -1.0)
    axes.set_xlim(left=min(0.0, *(min(stage.fitness) for stage in stages)))
    axes.set_xlabel("fitness", color=INK)
    axes.grid(color=GRID, linewidth=0.5)
    trim(axes)


def _draw_sensitivities(axes: Any, report: TransferReport) -> None:
    from matplotlib.ticker import LogLocator, NullLocator

    axes.set_title("mean fitness over that in physics, as each trouble grows", loc="left", fontsize=9, color=INK)
    for number, each in enumerate(report.sensitivities):
        usual, colour = each.trouble.usual, COLOURS[number * len(COLOURS) // len(report.sensitivities)]
        if len(each.values) > 1:
            times = [value / usual for value in each.values[1:]]
            axes.plot(times, [stage.ratio for stage in each.stages[1:]], ".-", color=colour, label=each.trouble.name)
        if 0.0 < each.margin < math.inf:
            axes.plot([each.margin], [BROKEN], "x", color=colour, markersize=8, markeredgewidth=2)
    axes.axhline(BROKEN, color=INK, linewidth=0.8, linestyle=":")
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("how much of it, over what a real robot has", color=INK)
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="lower left", fontsize=8, frameon=False)
    axes.grid(color=GRID, linewidth=0.5)
    trim(axes)
