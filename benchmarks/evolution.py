"""Evolution: Floreano and Mondada's experiment, tasks solved from random weights, and what the loop itself costs.

``avoid`` repeats the experiment and draws docs/images/evolution-avoid.svg. ``solve TASK ...`` says for how many drawn
seeds a task is solved. ``loop`` measures which share of the processor is not spent on episodes, and ``workers`` how
much faster two workers are than one. ``chaos`` kills an evolution on two workers twice, at drawn moments, and with
``--every 20`` one of its workers every 20 s as well. Then it compares the folder with that of an undisturbed evolution.
"""

from __future__ import annotations

import contextlib
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from harness import ROOT, Tables, in_turns, load, quick, run

from elib.learn.evolution import Evolution
from elib.learn.executor import Executor, open_executor
from elib.learn.results import curves
from elib.learn.study import Evaluation, Generation, Settings, Study, evaluate
from elib.studies.report import save

PICTURE = ROOT / "docs/images/evolution-avoid.svg"
TEST = range(3_000_000, 3_000_100)
"""Seeds of episodes that no training has."""


class Timed(Executor):
    """An executor that notes how long its jobs take, in seconds by the clock and of the processor."""

    def __init__(self, inner: Executor) -> None:
        self.inner = inner
        self.wall = self.processor = 0.0

    @property
    def width(self) -> int:  # type: ignore[override]
        return self.inner.width

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)

    def run(self, function: Callable[..., Any], jobs: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        began = time.perf_counter(), time.process_time()
        done = list(self.inner.run(function, jobs))
        self.wall += time.perf_counter() - began[0]
        self.processor += time.process_time() - began[1]
        yield from done


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


@quick(generations=10)
def loop(*, generations: int = 50) -> Tables:
    """Measure which share of an evolution is not spent on episodes: here, and of the coordinator of two workers.

    With workers each individual plays 40 episodes, so that a generation takes some seconds.
    """
    for algorithm in ("ga", "cma"):
        settings = Settings("avoid", algorithm=algorithm, population=100, scenarios=1, generations=generations)
        warm(settings.evaluation())
        with open_executor() as here:
            timed = Timed(here)
            began = time.process_time()
            _, seconds, _ = evolved(settings, timed)
            processor = time.process_time() - began
        settings = replace(settings, scenarios=40, generations=max(generations // 10, 1))
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        with open_executor(workers=2) as workers:
            began = time.process_time()
            _, of_two, _ = evolved(settings, workers)
            own = time.process_time() - began
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        here_all = {"% of the clock": 100 - 100 * timed.wall / seconds, "s": seconds}
        here_all |= {"% of the processor": 100 - 100 * timed.processor / processor, "s of it": processor}
        of_workers = {"s": of_two, "% of the processor": 100 * own / (own + spent), "s of it": own + spent}
        yield algorithm, {"in this process": here_all, "2 workers": of_workers}


def chunk(settings: Settings, seed: int, individuals: int) -> tuple[float, float]:
    """Evaluate a part of a population; return the sum of its fitness, and how long it took, s."""
    began = time.perf_counter()
    evaluation = settings.evaluation()
    population = np.random.default_rng(seed).normal(size=(individuals, evaluation.controller.size))
    scores = evaluate(evaluation, population, [seed], threads=1)
    return float(scores.fitness.sum()), time.perf_counter() - began


@quick(chunks=2, rounds=1, seconds=0.1)
def workers(*, chunks: int = 8, rounds: int = 2, seconds: float = 2.5) -> Tables:
    """Evaluate a population on one worker and on two, and measure what this process, which gives out the work, takes.

    Args:
        chunks: Parts of the population.
        rounds: The fastest counts.
        seconds: That a chunk takes at least.
    """
    settings = Settings("avoid")
    chunk(settings, 1, 10)  # compile, once, into the cache that the workers use
    individuals = 500
    while (took := chunk(settings, 1, individuals)[1]) < seconds:
        individuals = int(individuals * max(1.2, 1.2 * seconds / took))

    def timed(executor: Executor) -> tuple[float, float, list[tuple[int, float]]]:
        began = time.perf_counter()
        with load() as used:
            jobs = [(settings, seed, individuals) for seed in range(chunks)]
            results = sorted((k, total) for k, (total, _) in executor.run(chunk, jobs))
        return time.perf_counter() - began, used.share, results

    with open_executor(1) as single, open_executor(2) as both:
        runs = in_turns({"1 worker": partial(timed, single), "2 workers": partial(timed, both)}, rounds)
    found = {name: min(each) for name, each in runs.items()}
    one, two = found.values()
    rows = {n: {"s": s, "this process, % of a core": 100 * u} for n, (s, u, _) in found.items()}
    rows["two by one"] = {"times as fast": one[0] / two[0], "equal results": str(one[2] == two[2])}
    yield f"{chunks} chunks of {individuals} individuals", rows


def kill_workers(every: float, is_over: threading.Event) -> None:
    """Kill a worker of the evolution that runs, every so many seconds."""
    draws = random.Random(1)
    while not is_over.wait(every):
        children = psutil.Process().children(recursive=True)
        with contextlib.suppress(psutil.NoSuchProcess, IndexError):
            victim = draws.choice([each for each in children if "spawn_main" in " ".join(each.cmdline())])
            victim.kill()
            print(f"killed worker {victim.pid}", flush=True)


@quick(generations=10, population=4, seconds=2.0)
def chaos(
    *, generations: int = 40, population: int = 50, seconds: float = 20.0, every: float = 0.0, seed: int = 1
) -> Tables:
    """Kill an evolution on two workers twice, at drawn moments, and let it go on; kill its workers too, if asked to.

    Args:
        generations: How many.
        population: How many individuals.
        seconds: Length of an episode.
        every: s between two kills of a worker; 0 kills none.
        seed: Of the moments.
    """
    draws = random.Random(seed)
    is_over = threading.Event()
    with tempfile.TemporaryDirectory() as place:
        command = [sys.executable, "-m", "elib", "evolve", "avoid", "--workers", "2", "--seconds", str(seconds)]
        command += ["--population", str(population), "--generations", str(generations), "--out"]
        whole, killed = Path(place) / "whole", Path(place) / "killed"
        subprocess.run([*command, str(whole)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        if every:
            threading.Thread(target=kill_workers, args=(every, is_over), daemon=True).start()
        for _ in range(2):
            until = draws.randrange(generations // 10, generations // 2)
            before = _recorded(killed)
            driver = subprocess.Popen(
                [*command, str(killed)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
            )
            while _recorded(killed) < before + until and driver.poll() is None:
                time.sleep(0.01)
            time.sleep(draws.uniform(0, 0.1))
            os.kill(driver.pid, signal.SIGKILL)
            driver.wait()
            print(f"killed after generation {_recorded(killed)}", flush=True)
        subprocess.run([*command, str(killed)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        is_over.set()
        names = sorted(path.name for path in whole.iterdir())
        assert names == sorted(path.name for path in killed.iterdir())
        are_same = [(whole / name).read_bytes() == (killed / name).read_bytes() for name in names]
        found = {True: {"bytes": "the same"}, False: {"bytes": "DIFFERENT"}}
        yield "after the kills", {name: found[is_same] for name, is_same in zip(names, are_same, strict=True)}
        if not all(are_same):
            raise SystemExit(1)


def _recorded(folder: Path) -> int:
    path = folder / "generations.jsonl"
    return path.read_bytes().count(b"\n") if path.exists() else 0


if __name__ == "__main__":
    run(__doc__, avoid, solve, loop, workers, chaos)
