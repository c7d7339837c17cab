"""Evolution: Floreano and Mondada's experiment, and tasks solved from random weights.

``avoid`` repeats the experiment and draws docs/images/evolution-avoid.svg. ``solve TASK ...`` says for how many drawn
seeds a task is solved.
"""

from __future__ import annotations

import random
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from harness import ROOT, Tables, quick, run

from elib.learn.evolution import Evolution
from elib.learn.executor import Executor, open_executor
from elib.learn.results import curves
from elib.learn.study import Evaluation, Generation, Settings, Study, evaluate
from elib.studies.report import save

PICTURE = ROOT / "docs/images/evolution-avoid.svg"
TEST = range(3_000_000, 3_000_100)
"""Seeds of episodes that no training has."""


def warm(evaluation: Evaluation) -> None:
    """Compile, and import the package that takes a second, so that neither is measured."""
    import cmaes  # noqa: F401

    began = time.perf_counter()
    evaluate(evaluation, np.zeros((2, evaluation.controller.size)), [0])
    print(f"compiled or loaded in {time.perf_counter() - began:.1f} s", flush=True)


def evolved(settings: Settings, executor: Executor) -> tuple[list[Generation], float, Any]:
    """Return the generations of a study, the seconds by the clock that it took with its final test, and its result."""
    with tempfile.TemporaryDirectory() as folder, Study(Path(folder) / "study", settings) as study:
        began = time.perf_counter()
        evolution = Evolution(study, executor)
        for _ in evolution.run():
            pass
        result = evolution.finish()
        return study.generations, time.perf_counter() - began, result


@quick(seeds=1, generations=2)
def avoid(*, seeds: int = 5, generations: int = 100) -> Tables:
    """Repeat the experiment of 1994 with some seeds: 100 individuals of 60 s, the same algorithm.

    Args:
        seeds: How many.
        generations: How many; the picture is drawn of 100.
    """
    studies = []
    base = Settings("avoid", algorithm="ga", population=100, scenarios=1, seconds=60.0, generations=generations)
    warm(base.evaluation())
    for seed in range(1, seeds + 1):
        with open_executor() as here:
            found, seconds, result = evolved(replace(base, seed=seed), here)
        studies.append(found)
        rows = {
            f"generation {number}": {
                "best": max(found[number - 1].fitness),
                "mean": float(np.mean(found[number - 1].fitness)),
            }
            for number in (1, 10, 20, 50, 100)
            if number <= generations
        }
        yield f"seed {seed}", rows | {"test": {"best": result.fitness, "s": seconds}}
    if generations < 100:
        return
    figure = curves(studies, f"Floreano and Mondada's experiment: mean and range of {seeds} seeds")
    axes = figure.axes[0]
    axes.set_ylim(0, 1)
    axes.axvline(50, color="#2b2d33", linewidth=0.8, linestyle=":")
    note = "1994, on a real robot: from about here on\nthe best drove smoothly and touched nothing"
    axes.text(51, 0.03, note, fontsize=8)
    save(figure, PICTURE)


@quick(seeds=1, population=6, generations=2)
def solve(
    tasks: list[str],
    /,
    *,
    seeds: int = 10,
    controller: str = "recurrent",
    hidden: int = 0,
    algorithm: str = "cma",
    population: int = 40,
    generations: int = 60,
    scenarios: int = 4,
) -> Tables:
    """Evolve controllers for tasks from random weights, and try what was found in 100 new episodes.

    Args:
        tasks: Their names.
        seeds: How many, drawn.
        controller: As for ``elib evolve``, and so are all that follow.
        hidden: Neurons.
        algorithm: Its name.
        population: Individuals.
        generations: How many.
        scenarios: Episodes of an individual.
    """
    for name in tasks:
        rows: dict[str, dict[str, Any]] = {}
        base = Settings(name, controller, hidden, algorithm, population, generations, scenarios)
        evaluation = base.evaluation()
        warm(evaluation)
        for seed in random.Random(name).sample(range(1, 10_000), seeds):
            began = time.process_time()
            with open_executor() as here:
                _, seconds, result = evolved(replace(base, seed=seed), here)
            rows[f"seed {seed}"] = {"s": seconds, "CPU s": time.process_time() - began}
            fitness = evaluate(evaluation, np.array([result.best.parameters]), TEST).fitness[0]
            solved = 100 * float((fitness >= evaluation.task.solved).mean())
            rows[f"seed {seed}"] |= {"fitness": float(fitness.mean()), "solved, %": solved}
            print(f"seed {seed}: {rows[f'seed {seed}']}", file=sys.stderr, flush=True)
        good = sum(row["solved, %"] >= 90 for row in rows.values())
        yield f"{name}: {good} of {seeds} seeds solve 90 %", rows | middle(rows)


def middle(rows: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the middle of all rows, and their range."""
    columns = {column: [row[column] for row in rows.values()] for column in next(iter(rows.values()))}
    return {
        "median": {column: float(np.median(each)) for column, each in columns.items()},
        "range": {column: f"{min(each):.3g} to {max(each):.3g}" for column, each in columns.items()},
    }


if __name__ == "__main__":
    run(__doc__, avoid, solve)
