"""What a study leaves for reading: tables in Parquet, and the curve of its fitness."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from elib.base.quantiles import quantile
from elib.learn.evolution import replay
from elib.learn.study import GENERATIONS_TABLE, INDIVIDUALS_TABLE, PLOT, Generation, Settings
from elib.records.et.formats import write_table
from elib.records.et.table import Cell, Header, Table
from elib.studies.report import COLOURS, GRID, INK, PAPER, save, trim


def write_results(folder: Path, settings: Settings, generations: Sequence[Generation], size: int) -> None:
    """Write the tables and the plot of a study with one generation or more; existing ones are replaced."""
    summary = [Header("generation", "whole"), *map(Header, ("best", "mean", "median", "worst"))]
    each = [Header("generation", "whole"), Header("individual", "whole"), *map(Header, ("fitness", "left", "right"))]
    each += [Header(f"p{k}") for k in range(size)]
    write_table(folder / GENERATIONS_TABLE, Table(summary, map(_summary, generations)))
    write_table(folder / INDIVIDUALS_TABLE, Table(each, _individuals(settings, list(generations), size)))
    title = f"{settings.task}, {settings.controller}, {settings.algorithm}, seed {settings.seed}"
    save(curves([generations], title), folder / PLOT)


def _summary(generation: Generation) -> Sequence[Cell]:
    fitness = generation.fitness
    mean = sum(fitness) / len(fitness)
    return generation.generation, max(fitness), mean, quantile(fitness, 0.5), min(fitness)


def _individuals(settings: Settings, generations: list[Generation], size: int) -> Iterator[Sequence[Cell]]:
    for generation, population in replay(settings, generations, size):
        columns = zip(generation.fitness, generation.left, generation.right, population.tolist(), strict=True)
        for k, (fitness, left, right, parameters) in enumerate(columns):
            yield generation.generation, k, fitness, left, right, *parameters


def curves(studies: Sequence[Sequence[Generation]], title: str) -> Any:
    """Return a figure of best and mean fitness of each generation; of several studies the mean, and the range."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.5), facecolor=PAPER, layout="constrained")
    axes: Any = figure.add_subplot()
    axes.grid(color=GRID, linewidth=0.5)
    numbers = [each.generation for each in studies[0]]
    for name, take, colour in (("best", np.max, COLOURS[5]), ("mean", np.mean, COLOURS[0])):
        lines = np.array([[take(each.fitness) for each in study] for study in studies])
        axes.plot(numbers, lines.mean(axis=0), color=colour, label=name)
        if len(lines) > 1:
            axes.fill_between(numbers, lines.min(axis=0), lines.max(axis=0), color=colour, alpha=0.15, lw=0)
    axes.set_xlabel("generation", color=INK)
    axes.set_ylabel("fitness", color=INK)
    axes.set_title(title, loc="left", fontsize=11, color=INK)
    trim(axes)
    axes.legend(frameon=False)
    return figure
