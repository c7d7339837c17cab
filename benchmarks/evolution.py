"""Evolution: Floreano and Mondada's experiment, tasks solved from random weights, and what the loop itself costs.

``avoid`` repeats the experiment and draws docs/images/evolution-avoid.svg. ``solve TASK ...`` says for how many seeds a
task is solved. ``loop`` measures which share of the processor is not spent on episodes. ``chaos`` kills an evolution
on two workers twice, at drawn moments, and with ``--every 20`` one of its workers every 20 s as well. Then it compares
the folder with that of an undisturbed evolution.
"""

from __future__ import annotations

import argparse
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
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from elib.learn.evolution import Evolution
from elib.learn.executor import Executor, open_executor
from elib.learn.results import curves
from elib.learn.study import Evaluation, Generation, Settings, Study, evaluate
from elib.studies.report import save

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "evolution-avoid.svg"


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


def avoid(options: argparse.Namespace) -> None:
    """Repeat the experiment of 1994 with some seeds: 100 individuals of 60 s, 100 generations, the same algorithm."""
    studies = []
    base = Settings("avoid", algorithm="ga", population=100, scenarios=1, seconds=60.0)
    warm(base.evaluation())
    for seed in range(1, options.seeds + 1):
        settings = replace(base, seed=seed)
        with open_executor() as here:
            generations, seconds, result = evolved(settings, here)
        studies.append(generations)
        shown = ", ".join(
            f"{number}: {max(generations[number - 1].fitness):.2f} {np.mean(generations[number - 1].fitness):.2f}"
            for number in (1, 10, 20, 50, 100)
        )
        print(
            f"seed {seed}: {seconds:.1f} s; best and mean of generation {shown}; test {result.fitness:.3f}", flush=True
        )
    figure = curves(studies, f"Floreano and Mondada's experiment: mean and range of {options.seeds} seeds")
    axes = figure.axes[0]
    axes.set_ylim(0, 1)
    axes.axvline(50, color="#2b2d33", linewidth=0.8, linestyle=":")
    note = "1994, on a real robot: from about here on\nthe best drove smoothly and touched nothing"
    axes.text(51, 0.03, note, fontsize=8)
    save(figure, PICTURE)


def solve(options: argparse.Namespace) -> None:
    """Evolve controllers for tasks from random weights, and say how many seeds solve them."""
    for name in options.tasks:
        solved = []
        for seed in range(1, options.seeds + 1):
            settings = Settings(
                name,
                options.controller,
                options.hidden,
                options.algorithm,
                options.population,
                options.generations,
                options.scenarios,
                seed=seed,
            )
            if seed == 1:
                warm(settings.evaluation())
            with open_executor() as here:
                _, seconds, result = evolved(settings, here)
            solved.append(result.solved)
            print(
                f"{name} seed {seed}: fitness {result.fitness:.3f}, {result.solved:.0%} of 20 new episodes solved, "
                f"best of generation {result.best.generation}, {seconds:.1f} s",
                flush=True,
            )
        good = sum(each >= 0.9 for each in solved)
        print(f"{name}: {good} of {len(solved)} seeds solve at least 90 % of new episodes; mean {np.mean(solved):.0%}")


def loop(options: argparse.Namespace) -> None:
    """Measure which share of an evolution is not spent on episodes: here, and of the coordinator of two workers.

    With workers each individual plays 40 episodes, so that a generation takes some seconds.
    """
    for algorithm in ("ga", "cma"):
        settings = Settings("avoid", algorithm=algorithm, population=100, scenarios=1, generations=options.generations)
        warm(settings.evaluation())
        with open_executor() as here:
            timed = Timed(here)
            began = time.process_time()
            _, seconds, _ = evolved(settings, timed)
            processor = time.process_time() - began
        print(
            f"{algorithm}, in this process: {1 - timed.wall / seconds:.1%} of {seconds:.1f} s by the clock,"
            f" {1 - timed.processor / processor:.1%} of {processor:.1f} s of the processor",
            flush=True,
        )
        settings = replace(settings, scenarios=40, generations=options.generations // 10)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        with open_executor(workers=2) as workers:
            began = time.process_time()
            _, seconds, _ = evolved(settings, workers)
            own = time.process_time() - began
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        print(
            f"{algorithm}, 2 workers: this process used {own:.2f} s of the processor, {own / (own + spent):.1%} of all,"
            f" in {seconds:.1f} s by the clock",
            flush=True,
        )


def kill_workers(every: float, is_over: threading.Event) -> None:
    """Kill a worker of the evolution that runs, every so many seconds."""
    draws = random.Random(1)
    while not is_over.wait(every):
        children = psutil.Process().children(recursive=True)
        with contextlib.suppress(psutil.NoSuchProcess, IndexError):
            victim = draws.choice([each for each in children if "spawn_main" in " ".join(each.cmdline())])
            victim.kill()
            print(f"killed worker {victim.pid}", flush=True)


def chaos(options: argparse.Namespace) -> None:
    """Kill an evolution on two workers twice, at drawn moments, and let it go on; kill its workers too, if asked to."""
    draws = random.Random(options.seed)
    is_over = threading.Event()
    with tempfile.TemporaryDirectory() as place:
        command = [sys.executable, "-m", "elib", "evolve", "avoid", "--workers", "2"]
        for name in ("seconds", "population", "generations"):
            command += [f"--{name}", str(getattr(options, name))]
        command.append("--out")
        whole, killed = Path(place) / "whole", Path(place) / "killed"
        subprocess.run([*command, str(whole)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        if options.every:
            threading.Thread(target=kill_workers, args=(options.every, is_over), daemon=True).start()
        for _ in range(2):
            until = draws.randrange(options.generations // 10, options.generations // 2)
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
        for name, is_same in zip(names, are_same, strict=True):
            print(f"{name}: {'the same bytes' if is_same else 'DIFFERENT'}")
        if not all(are_same):
            raise SystemExit(1)


def _recorded(folder: Path) -> int:
    path = folder / "generations.jsonl"
    return path.read_bytes().count(b"\n") if path.exists() else 0


def main() -> None:
    """Run what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    modes = parser.add_subparsers(required=True)
    mode = modes.add_parser("avoid")
    mode.add_argument("--seeds", type=int, default=5)
    mode.set_defaults(run=avoid)
    mode = modes.add_parser("solve")
    mode.add_argument("tasks", nargs="+")
    mode.add_argument("--seeds", type=int, default=10)
    mode.add_argument("--controller", default="recurrent")
    mode.add_argument("--hidden", type=int, default=0)
    mode.add_argument("--algorithm", default="cma")
    mode.add_argument("--population", type=int, default=40)
    mode.add_argument("--generations", type=int, default=60)
    mode.add_argument("--scenarios", type=int, default=4)
    mode.set_defaults(run=solve)
    mode = modes.add_parser("loop")
    mode.add_argument("--generations", type=int, default=50)
    mode.set_defaults(run=loop)
    mode = modes.add_parser("chaos")
    mode.add_argument("--generations", type=int, default=40)
    mode.add_argument("--population", type=int, default=50)
    mode.add_argument("--seconds", type=float, default=20.0, help="length of an episode")
    mode.add_argument("--every", type=float, default=0.0, help="s between two kills of a worker; 0 kills none")
    mode.add_argument("--seed", type=int, default=1)
    mode.set_defaults(run=chaos)
    options = parser.parse_args()
    options.run(options)


if __name__ == "__main__":
    main()
