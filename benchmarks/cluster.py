"""Workers: how much faster two are than one, what the coordinator costs, and what a kill every 20 s changes.

``speed`` evaluates a population in chunks of over 2 s on one worker and on two, and measures how much of one processor
the coordinating process uses. ``chaos`` evolves controllers on two workers and kills one of them every 20 s; the study
must be that of an undisturbed evolution, bit by bit.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import psutil

from elib.learn.evolution import Evolution
from elib.learn.executor import Executor, open_executor
from elib.learn.study import GENERATIONS, Settings, Study, evaluate


def chunk(settings: Settings, seed: int, individuals: int) -> tuple[float, float]:
    """Evaluate a part of a population; return the sum of its fitness, and how long it took, s."""
    began = time.perf_counter()
    evaluation = settings.evaluation()
    population = np.random.default_rng(seed).normal(size=(individuals, evaluation.controller.size))
    scores = evaluate(evaluation, population, [seed], threads=1)
    return float(scores.fitness.sum()), time.perf_counter() - began


def timed(executor: Executor, jobs: list[tuple[Settings, int, int]]) -> tuple[float, float, list[tuple[int, float]]]:
    """Return the time by the clock, the processor time of this process, s, and the sorted results."""
    began = time.perf_counter(), time.process_time()
    results = sorted((k, total) for k, (total, _) in executor.run(chunk, jobs))
    return time.perf_counter() - began[0], time.process_time() - began[1], results


def speed(options: argparse.Namespace) -> None:
    settings = Settings("avoid")
    chunk(settings, 1, 10)  # compile, once, into the cache that the workers use
    individuals = 500
    while (took := chunk(settings, 1, individuals)[1]) < 2.5:
        individuals = int(individuals * max(1.2, 3.0 / took))
    print(f"a chunk of {individuals} individuals takes {took:.1f} s; load of the machine {os.getloadavg()[0]:.1f}")
    jobs = [(settings, seed, individuals) for seed in range(options.chunks)]
    found: dict[int, tuple[float, float, list[tuple[int, float]]]] = {}
    for count in (1, 2):
        with open_executor(count) as executor:
            list(executor.run(chunk, [(settings, 1, 10)] * (4 * count)))  # every worker loads the compiled code
            for _ in range(options.rounds):
                now = timed(executor, jobs)
                found[count] = min(found.get(count, now), now)
        wall, processor, _ = found[count]
        print(f"{count} workers: {wall:.1f} s for {len(jobs)} chunks, coordinator {100 * processor / wall:.1f} %")
    print(f"two workers are {found[1][0] / found[2][0]:.2f} times as fast; equal results: {found[1][2] == found[2][2]}")


def workers() -> list[psutil.Process]:
    """Return the worker processes, those that start too."""
    return [each for each in psutil.Process().children() if "spawn_main" in " ".join(each.cmdline())]


def kill_now_and_then(interval: float, is_over: threading.Event, killed: list[int]) -> None:
    generator = random.Random(1)
    while not is_over.wait(interval):
        there = workers()
        if there:
            victim = generator.choice(there)
            os.kill(victim.pid, signal.SIGKILL)
            killed.append(victim.pid)
            print(f"killed worker {victim.pid}", flush=True)


def evolve(settings: Settings, folder: Path, executor: Executor) -> bytes:
    with Study(folder, settings) as study:
        evolution = Evolution(study, executor)
        for _ in evolution.run():
            pass
        evolution.finish()
    return (folder / GENERATIONS).read_bytes() + (folder / "best.toml").read_bytes()


def chaos(options: argparse.Namespace) -> None:
    settings = Settings("avoid", population=options.population, generations=options.generations, seconds=60.0)
    with tempfile.TemporaryDirectory() as place:
        with open_executor() as executor:
            undisturbed = evolve(settings, Path(place) / "undisturbed", executor)
        killed: list[int] = []
        is_over = threading.Event()
        with open_executor(2) as executor:
            killer = threading.Thread(target=kill_now_and_then, args=(options.every, is_over, killed))
            began = time.perf_counter()
            killer.start()
            try:
                disturbed = evolve(settings, Path(place) / "disturbed", executor)
            finally:
                is_over.set()
                killer.join()
    took = time.perf_counter() - began
    print(f"{options.generations} generations in {took:.0f} s, {len(killed)} workers killed")
    print(f"equal to the undisturbed evolution, bit by bit: {disturbed == undisturbed}")
    if disturbed != undisturbed or not killed:
        raise SystemExit(1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    modes = parser.add_subparsers(required=True)
    mode = modes.add_parser("speed")
    mode.add_argument("--chunks", type=int, default=8)
    mode.add_argument("--rounds", type=int, default=2, help="the fastest counts")
    mode.set_defaults(work=speed)
    mode = modes.add_parser("chaos")
    mode.add_argument("--every", type=float, default=20.0, help="s between two kills")
    mode.add_argument("--population", type=int, default=400)
    mode.add_argument("--generations", type=int, default=40)
    mode.set_defaults(work=chaos)
    options = parser.parse_args()
    options.work(options)


if __name__ == "__main__":
    main()
