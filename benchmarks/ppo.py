"""PPO beside CMA-ES on tasks with one robot: what the page "Learn by PPO" says is measured here, with its own program.

PPO is that of Stable-Baselines3, which elib does not install; CMA-ES is ``elib evolve TASK``. What both found drives
the same new episodes, as champions. A curve is the mean fitness of 20 episodes that no training has, after each part of
a training: of PPO the network so far, of CMA-ES the best individual of each fourth generation. These trials cost no
decisions and no seconds. Draws docs/images/ppo-TASK.svg.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from evolution import TEST, evolved, middle, warm
from harness import ROOT, Table, Tables, quick, run, use_tests

from elib.learn import Champion, Episodes, Task, find_task
from elib.learn.evolution import replay
from elib.learn.executor import open_executor
from elib.learn.study import Settings
from elib.studies.report import COLOURS, GRID, INK, PAPER, save, trim

PAGE = ROOT / "docs/guides/ppo.md"
SHOWN = range(2_000_000, 2_000_020)
"""Seeds of the episodes of the curves."""

Curve = list[tuple[float, float, float]]
"""Decisions, CPU seconds and mean fitness."""


def program() -> dict[str, Any]:
    """Return what the program of the page defines."""
    use_tests("docs")
    from pages import blocks

    names: dict[str, Any] = {"__name__": "ppo"}
    exec(compile(blocks(PAGE, "python")[0].text, str(PAGE), "exec"), names)
    return names


def tried(episodes: Episodes, each: Champion, seeds: range) -> Any:
    """Return the fitness of a champion with each seed."""
    controller = each.network.controller([each.parameters])
    return episodes.play(controller, controller.parameters, seeds).fitness[0]


def by_ppo(task: Task, episodes: Episodes, seed: int, decisions: int) -> tuple[Curve, Champion]:
    import torch
    from stable_baselines3.common.callbacks import BaseCallback

    page, curve = program(), Curve()
    torch.set_num_threads(1)  # The network is small.

    class Watch(BaseCallback):
        def __init__(self) -> None:
            super().__init__()
            self.began, self.rollouts = time.process_time(), 0

        def _on_rollout_start(self) -> None:
            self.rollouts += 1
            if self.rollouts % 3 == 1:
                now = time.process_time()
                fitness = tried(episodes, page["champion"](self.model, task), SHOWN).mean()
                curve.append((self.num_timesteps, now - self.began, float(fitness)))
                self.began += time.process_time() - now

        def _on_step(self) -> bool:
            return True

    watch = Watch()
    model = page["learn"](task, decisions=decisions, seed=seed, callback=watch)
    found = page["champion"](model, task)
    seconds = time.process_time() - watch.began
    curve.append((model.num_timesteps, seconds, float(tried(episodes, found, SHOWN).mean())))
    return curve, found


def by_cma(task: Task, episodes: Episodes, seed: int, generations: int) -> tuple[Curve, Champion]:
    settings = Settings(task.name, algorithm="cma", population=40, generations=generations, seed=seed)
    began = time.process_time()
    with open_executor() as here:
        recorded, _, result = evolved(settings, here)
    seconds = time.process_time() - began
    network = settings.evaluation().controller

    def made(parameters: Any) -> Champion:
        return Champion(task.name, settings.controller, task.sensors, parameters, top_speed=task.top_speed)

    curve, whole = Curve(), task.decisions * settings.population * settings.scenarios
    for each, population in replay(settings, recorded, network.size):
        number = each.generation
        if number % 4 == 1 or number == generations:
            fitness = tried(episodes, made(population[each.best]), SHOWN).mean()
            curve.append((number * whole, seconds * number / generations, float(fitness)))
    return curve, made(result.best.parameters)


@quick(seeds=1, decisions=6400, generations=2)
def measure(tasks: list[str], /, *, seeds: int = 10, decisions: int = 400_000, generations: int = 60) -> Tables:
    """Learn tasks by both.

    Args:
        tasks: Their names.
        seeds: How many.
        decisions: Of PPO in all its worlds.
        generations: Of CMA-ES, 40 individuals in 4 episodes each; at most so many decisions, where episodes may end.
    """
    for name in tasks:
        task = find_task(name)
        episodes = Episodes(task)
        warm(Settings(name).evaluation())
        by_ppo(task, episodes, 0, 6400)  # It compiles and imports.
        rows: dict[str, dict[str, Any]] = {}
        curves: dict[str, list[Curve]] = {"PPO": [], "CMA-ES": []}
        for seed in range(1, seeds + 1):
            for method, learned in (
                ("PPO", by_ppo(task, episodes, seed, decisions)),
                ("CMA-ES", by_cma(task, episodes, seed, generations)),
            ):
                curve, found = learned
                curves[method].append(curve)
                fitness = tried(episodes, found, TEST)
                rows[f"{method}, seed {seed}"] = {
                    "fitness": float(fitness.mean()),
                    "solved, %": 100 * float((fitness >= task.solved).mean()),
                    "decisions": curve[-1][0],
                    "CPU s": curve[-1][1],
                }
        yield name, rows | summary(rows, curves)
        if seeds > 1:
            draw(task, curves)


def summary(rows: dict[str, dict[str, Any]], curves: dict[str, list[Curve]]) -> Table:
    """Return the middle of all seeds, and their range."""
    found: dict[str, dict[str, Any]] = {}
    for method in curves:
        own = {name: row for name, row in rows.items() if name.startswith(method)}
        found |= {f"{method}, {name}": row for name, row in middle(own).items()}
    return found


def draw(task: Task, curves: dict[str, list[Curve]]) -> None:
    """Draw the curves of all seeds, by decisions and by seconds."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4), facecolor=PAPER, layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    for axes, column, label in ((left, 0, "decisions of training"), (right, 1, "CPU seconds of training")):
        axes.grid(color=GRID, linewidth=0.5)
        axes.axhline(task.solved, color=INK, linewidth=0.8, linestyle=":")
        for (method, runs), colour in zip(curves.items(), (COLOURS[5], COLOURS[0]), strict=True):
            for number, each in enumerate(runs):
                points = np.array(each)
                where = points[:, 0] > 0
                name = f"{method}, {len(runs)} seeds" if number == 0 else None
                axes.plot(points[where, column], points[where, 2], color=colour, lw=0.9, alpha=0.8, label=name)
        axes.set_xlabel(label, color=INK)
        axes.set_xscale("log")
        trim(axes)
    left.set_ylabel("fitness, mean of 20 new episodes", color=INK)
    left.annotate("solved", (0.01, task.solved), xycoords=("axes fraction", "data"), va="bottom", fontsize=8, color=INK)
    right.legend(frameon=False, loc="lower right")
    figure.suptitle(f"{task.name}: PPO and CMA-ES", x=0.01, ha="left", fontsize=11, color=INK)
    save(figure, ROOT / f"docs/images/ppo-{task.name}.svg")


if __name__ == "__main__":
    run(__doc__, measure)
