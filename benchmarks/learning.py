"""How fast environments of a task run, beside the engine under them and a Gymnasium loop over single environments.

One robot-step is one robot moved for one tick, with what the task asks for in that tick. All drive by the same law, a
Braitenberg vehicle on the eight infrared sensors, and all take turns in one process, because the pace of a shared
machine changes by the minute:

    engine      worlds that run by themselves, World.run with a compiled controller that decides in every tick
    vector      the native vector environment; NumPy decides for all worlds, and its time is counted
    loop        Gymnasium's SyncVectorEnv over single environments, and the same NumPy
    play        Episodes.play: whole episodes by a compiled controller, as evolution runs them

Then the vector environment and one single environment, each with a memory in the reward and a goal in the observation,
take turns with the same ones without.

The engine's worlds run a whole episode in one call. The vector environment takes as many steps as an episode has
decisions, and one more, in which all worlds begin again.
"""

from __future__ import annotations

import concurrent.futures
import os
import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from gymnasium.vector import SyncVectorEnv, VectorEnv
from harness import Cell, Table, Tables, in_turns, quick, ratio, run

from elib.base.body import METRES_PER_STEP
from elib.learn import Task, find_task, goal
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


def remembering(task: Task) -> Task:
    """Return a task that also counts what each robot earned, and shows the way to the middle of the room."""
    earns = task.reward

    def reward(world: Any, i: int, memory: Any) -> float:
        earned = earns(world, i)
        memory.total[i] += earned
        memory.visited[min(max(int(world.robots[i].y * 10), 0), 9)][min(max(int(world.robots[i].x * 10), 0), 9)] = 1.0
        return float(earned)

    memory = {"visited": [[0.0] * 10] * 10}
    return replace(task, reward=reward, memory=memory, robot_memory={"total": 0.0}, observe=(goal(0.5, 0.5),))


def one(task: Task) -> Work:
    """Return steps of a single environment, which always takes the same action."""
    env, action, steps = TaskEnv(task), np.full(2, 0.5 * task.top_speed), 10 * task.decisions
    env.reset(seed=1)

    def work() -> None:
        for _ in range(steps):
            _, _, is_over, is_late, _ = env.step(action)
            if is_over or is_late:
                env.reset()

    return work, steps * task.ticks_a_period


def costs(task: Task, worlds: int, rounds: int) -> Table:
    """Return how fast environments are with a memory and a goal, and by those without."""
    works = {}
    for name, each in (("", task), (", memory and goal", remembering(task))):
        works[f"vector{name}"] = vector(each, worlds, 1)
        works[f"one{name}"] = one(each)
    measured = in_turns({name: partial(rates, *work) for name, work in works.items()}, rounds)
    found = {}
    for name, each in measured.items():
        cpu, plain = [used for _, used in each], [used for _, used in measured[name.partition(",")[0]]]
        steps = statistics.median(cpu) / task.ticks_a_period
        found[name] = {"env. steps/s of CPU time": steps, "by it without": ratio(cpu, plain)}
    return found


def rates(work: Callable[[], object], count: float) -> tuple[float, float]:
    """Work once, and return the robot-steps a second: of the clock, and of CPU time."""
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return count / (time.perf_counter() - wall), count / (time.process_time() - cpu)


def compared(works: dict[str, Work], rounds: int) -> Table:
    """Return how fast all work, and how many times as fast as each the vector environment is."""
    measured = in_turns({name: partial(rates, *work) for name, work in works.items()}, rounds)
    columns = {name: list(zip(*each, strict=True)) for name, each in measured.items()}
    return {name: figures(by, columns["vector"]) for name, by in columns.items()}


def figures(each: list[tuple[float, ...]], vector: list[tuple[float, ...]]) -> dict[str, Cell]:
    (clock, cpu), (vector_clock, vector_cpu) = each, vector
    return {
        "robot-steps/s of the clock": statistics.median(clock),
        "of CPU time": statistics.median(cpu),
        "vector by it, clock": ratio(vector_clock, clock),
        "CPU time": ratio(vector_cpu, cpu),
    }


@quick(worlds=20, rounds=1)
def measure(*, task: str = "avoid", worlds: int = 1000, threads: tuple[int, ...] = (), rounds: int = 5) -> Tables:
    """Measure.

    Args:
        task: One that senses proximity first, or FILE.py:NAME.
        worlds: How many.
        threads: One, and as many as there are cores, unless told.
        rounds: How many.
    """
    found = find_task(task)
    if found.sensors[0] != "proximity":
        raise SystemExit(f"{task} does not sense proximity first")
    print(f"{found.name}, {worlds:,} worlds, robots in each: {found.robots}, {found.ticks} ticks an episode")
    for count in threads or sorted({1, os.cpu_count() or 1}):
        works = {maker.__name__: maker(found, worlds, count) for maker in (engine, vector, loop, play)}
        yield f"threads: {count}", compared(works, rounds)
    if found.robots == 1 and not found.memory and not found.robot_memory:
        yield "what a memory and a goal cost", costs(found, worlds, rounds)


if __name__ == "__main__":
    run(__doc__, measure)
