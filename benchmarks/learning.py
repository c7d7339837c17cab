"""How fast environments of a task run, beside the engine under them and a Gymnasium loop over single environments.

One robot-step is one robot moved for one tick, with what the task asks for in that tick. All drive by the same law, a
Braitenberg vehicle on the eight infrared sensors, and all take turns in one process, because the pace of a shared
machine changes by the minute:

    engine      worlds that run by themselves, World.run with a compiled controller that decides in every tick
    vector      the native vector environment; NumPy decides for all worlds, and its time is counted
    loop        Gymnasium's SyncVectorEnv over single environments, and the same NumPy
    play        Episodes.play: whole episodes by a compiled controller, as evolution runs them

The engine's worlds run a whole episode in one call. The vector environment takes as many steps as an episode has
decisions, and one more, in which all worlds begin again.

    python benchmarks/learning.py                          avoid, 1,000 worlds, one thread and two
    python benchmarks/learning.py --task wall-following --worlds 100 --json
"""

from __future__ import annotations

import argparse
import concurrent.futures
import json
import os
import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from gymnasium.vector import SyncVectorEnv, VectorEnv

from elib.base.body import METRES_PER_STEP
from elib.learn import Task, find_task
from elib.learn.envs import TaskEnv, TaskVectorEnv
from elib.simulator.physics import Controller, Episodes, World

BRAITENBERG = Controller.braitenberg()
SHORT = 100
"""The loop runs so many times fewer robot-steps than the others."""
LOOPED = 10
"""Environments in the loop. More make it no faster."""

Work = tuple[Callable[[], object], float]
"""What is measured, and how many robot-steps it takes."""


def engine(task: Task, worlds: int, threads: int) -> Work:
    count, robots = len(task.scenes), task.robots
    rooms = [World(task.scenes[k % count], robots=robots, seed=k, engine="compiled") for k in range(worlds)]
    pool = concurrent.futures.ThreadPoolExecutor(threads)

    def work() -> None:
        jobs = [partial(room.run, task.ticks, BRAITENBERG) for room in rooms]
        if threads == 1:
            for job in jobs:
                job()
        else:
            for done in [pool.submit(job) for job in jobs]:
                done.result()

    return work, worlds * robots * task.ticks


def stepped(env: VectorEnv, task: Task, decisions: int) -> Work:
    """Return steps of any vector environment, each with actions made of the observations of the last one."""
    weights = BRAITENBERG.parameters.reshape(2, 9) * METRES_PER_STEP
    state = {"seen": env.reset(seed=1)[0]}

    def work() -> None:
        seen = state["seen"]
        for _ in range(decisions):
            near = seen.reshape(env.num_envs * task.robots, -1)[:, :8]
            speeds = weights[:, 0] + near @ weights[:, 1:].T
            seen = env.step(np.clip(speeds, -task.top_speed, task.top_speed).reshape(env.num_envs, -1))[0]
        state["seen"] = seen

    return work, env.num_envs * task.robots * task.ticks_a_period * decisions


def vector(task: Task, worlds: int, threads: int) -> Work:
    return stepped(TaskVectorEnv(worlds, task, threads=threads), task, task.decisions + 1)


def loop(task: Task, worlds: int, threads: int) -> Work:
    env = SyncVectorEnv([partial(TaskEnv, task)] * LOOPED)
    return stepped(env, task, max(worlds * (task.decisions + 1) // LOOPED // SHORT, 1))


def play(task: Task, worlds: int, threads: int) -> Work:
    episodes = Episodes(task, threads=threads)
    population = np.tile(BRAITENBERG.parameters, (worlds, 1))
    return partial(episodes.play, BRAITENBERG, population, [1]), worlds * task.robots * task.ticks


def measured(works: dict[str, Work], rounds: int) -> dict[str, list[tuple[float, float]]]:
    """Return robot-steps a second of each work in each round: of the clock, and of CPU time."""
    rates: dict[str, list[tuple[float, float]]] = {name: [] for name in works}
    for work, _ in works.values():
        work()  # It is compiled, and in the caches.
    for number in range(rounds):
        for name, (work, count) in list(works.items())[:: 1 if number % 2 else -1]:
            wall, cpu = time.perf_counter(), time.process_time()
            work()
            rates[name].append((count / (time.perf_counter() - wall), count / (time.process_time() - cpu)))
    return rates


def report(rates: dict[str, list[tuple[float, float]]], threads: int) -> dict[str, Any]:
    """Print the figures with so many threads, and return them."""
    found: dict[str, Any] = {}
    print(f"threads: {threads}")
    for name, each in rates.items():
        wall, cpu = (statistics.median(rate[k] for rate in each) for k in (0, 1))
        found[name] = {"robot_steps_per_s": wall, "robot_steps_per_cpu_s": cpu}
        print(f"  {name:8} {wall:14,.0f} robot-steps/s of the clock {cpu:14,.0f} of CPU time")
    for other in ("engine", "loop", "play"):
        ratios = [
            statistics.median(mine[k] / its[k] for mine, its in zip(rates["vector"], rates[other], strict=True))
            for k in (0, 1)
        ]
        found[f"vector_by_{other}"] = {"clock": ratios[0], "cpu": ratios[1]}
        print(f"  vector / {other:7} {ratios[0]:6.2f} by the clock {ratios[1]:6.2f} by CPU time")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", default="avoid", help="a task that senses proximity first, or FILE.py:NAME")
    parser.add_argument("--worlds", type=int, default=1000)
    parser.add_argument("--threads", type=int, nargs="*", default=sorted({1, os.cpu_count() or 1}))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", action="store_true", help="the figures as JSON in the last line")
    options = parser.parse_args()
    task = find_task(options.task)
    if task.sensors[0] != "proximity":
        parser.error(f"{options.task} does not sense proximity first")
    print(f"{task.name}, {options.worlds:,} worlds, robots in each: {task.robots}, {task.ticks} ticks an episode")
    figures = {}
    for threads in options.threads:
        works = {maker.__name__: maker(task, options.worlds, threads) for maker in (engine, vector, loop, play)}
        figures[str(threads)] = report(measured(works, options.rounds), threads)
    if options.json:
        print(json.dumps({"task": task.name, "worlds": options.worlds, "threads": figures}))


if __name__ == "__main__":
    main()
