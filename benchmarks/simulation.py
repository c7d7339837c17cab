"""How fast worlds run: robot-steps a second through the public World, against the interpreter's own pace.

One robot-step is one robot sensed, steered and moved for one tick. Scenario: a walled square with 10 robots a square
metre, ticks of 1/32 s, 8 infrared sensors of 3 rays with noise, motor noise of 5 %, firmware speed quantisation, a
Braitenberg law as controller; one thread, process CPU time, the best of several rounds because a shared machine only
ever adds. The same run is repeated on the other engine and must give the same digest, every reading included.

    python benchmarks/simulation.py                              the table
    python benchmarks/simulation.py --robots 100 --engine compiled --json
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable

from elib.errors import SimulationError
from elib.physics import Batch, Controller, EpuckModel, Scene, Wall, World
from elib.physics.noise import robot_key, tick_key, uniform

STEP = 1 / 32
DENSITY = 10  # Robots a square metre.
ROUNDS = 7
CHECKED = 2000  # Robot-steps that both engines run for the digest.


def floor() -> float:
    """Return the seconds of one addition in a loop: the interpreter's pace at this moment."""
    start = time.process_time()
    total = 0
    for k in range(200_000):
        total += k
    return (time.process_time() - start) / 200_000


def scene(robots: int, walls: int = 0) -> Scene:
    """Return the scenario; *walls* is the number of 20 cm segments a square metre."""
    side = math.sqrt(robots / DENSITY)
    segments: list[Wall] = []
    key = robot_key(1, 0)
    for k in range(round(walls * side * side)):
        draw = tick_key(key, k)
        x, y = uniform(draw, 0) * side, uniform(draw, 1) * side
        angle = math.tau * uniform(draw, 2)
        end = x + 0.2 * math.cos(angle), y + 0.2 * math.sin(angle)
        if 0 <= end[0] <= side and 0 <= end[1] <= side:
            segments.append(Wall(x, y, *end))
    return Scene(side, side, tuple(segments), step=STEP, seed=1, model=EpuckModel(motor_noise=0.05))


def make(robots: int, engine: str, walls: int = 0) -> World:
    return World(scene(robots, walls), robots=robots, engine=engine)  # type: ignore[arg-type]


def best(work: Callable[[], object], rounds: int = ROUNDS) -> tuple[float, float]:
    """Return the CPU seconds of *work*, and of an addition beside it, the best of *rounds*."""
    seconds = pace = math.inf
    for _ in range(rounds):
        pace = min(pace, floor())
        start = time.process_time()
        work()
        seconds = min(seconds, time.process_time() - start)
        pace = min(pace, floor())
    return seconds, pace


def same_digest(robots: int, engine: str, walls: int) -> bool:
    """Run the scenario on both engines; return whether the digests agree."""
    digests = set()
    for name in {engine, "interpreted"}:
        world = make(robots, name, walls)
        world.run(max(CHECKED // robots, 2), Controller.braitenberg())
        digests.add(world.hash("proximity"))
    return len(digests) == 1


def rate(robots: int, engine: str, walls: int = 0) -> tuple[float, float]:
    """Return robot-steps a second, and the floor beside it."""
    world = make(robots, engine, walls)
    law = Controller.braitenberg()
    ticks = max((300_000 if engine == "compiled" else 6_000) // robots, 3)
    world.run(ticks, law)
    seconds, pace = best(lambda: world.run(ticks, law))
    return robots * ticks / seconds, pace


def one_step_calls(engine: str) -> tuple[float, float]:
    """Return how often a second a Python program reads one robot's sensors, steers it and lets a tick pass."""
    turn = make(1, engine).stepper()
    count = 50_000 if engine == "compiled" else 3_000

    def drive() -> None:
        near = turn(600, 600)
        for _ in range(count):
            left = near[6] + near[7]
            right = near[0] + near[1]
            near = turn(600 - 0.5 * right + 0.3 * left, 600 - 0.5 * left + 0.3 * right)

    drive()
    seconds, pace = best(drive)
    return count / seconds, pace


def two_threads() -> tuple[float, float, float]:
    """Return robot-steps a second of 200 worlds of 10 robots on one and on two threads, by the clock, and the ratio."""
    rates = []
    batches = [Batch(scene(10), 200, robots=10, threads=threads) for threads in (1, 2)]
    law = Controller.braitenberg()
    ticks = 150
    seconds = [math.inf, math.inf]
    for batch in batches:
        batch.run(ticks, law)
    for _ in range(ROUNDS):  # In turns: the machine's pace changes by the minute.
        for k, batch in enumerate(batches):
            start = time.perf_counter()
            batch.run(ticks, law)
            seconds[k] = min(seconds[k], time.perf_counter() - start)
    rates = [200 * 10 * ticks / value for value in seconds]
    return rates[0], rates[1], rates[1] / rates[0]


def bytes_a_robot(robots: int = 10_000) -> float:
    """Return what each of many robots adds to a compiled world, bytes."""
    small, large = make(1, "compiled"), make(robots, "compiled")
    sizes = [
        sum(getattr(world._state, name).nbytes for name in ("fixed", "robots", "numbers", "cells", "walls", "scratch"))
        for world in (small, large)
    ]
    return float((sizes[1] - sizes[0]) / (robots - 1))


def table(engines: list[str]) -> None:
    print(f"{'work':52}{'per second':>14}{'additions each':>16}")

    def row(name: str, per_second: float, pace: float) -> None:
        print(f"{name:52}{per_second:14,.0f}{1 / per_second / pace:16.1f}", flush=True)

    if "compiled" in engines:
        for robots in (1, 10, 100, 1000, 10_000):
            row(f"compiled, {robots} robots", *rate(robots, "compiled"))
        row("compiled, 100 robots, 20 walls a m2", *rate(100, "compiled", 20))
        row("compiled, one-step calls from Python", *one_step_calls("compiled"))
        one, two, ratio = two_threads()
        print(f"{'compiled, 200 worlds x 10 robots, 1 thread':52}{one:14,.0f}")
        print(f"{'compiled, 200 worlds x 10 robots, 2 threads':52}{two:14,.0f}   x {ratio:.2f}")
        print(f"{'compiled, bytes a robot':52}{bytes_a_robot():14,.0f}")
    for robots in (1, 10, 100):
        row(f"interpreted, {robots} robots", *rate(robots, "interpreted"))
    row("interpreted, one-step calls from Python", *one_step_calls("interpreted"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, help="how many; without it the whole table is measured")
    parser.add_argument("--engine", choices=("compiled", "interpreted"), default="compiled")
    parser.add_argument("--walls", type=int, default=0, help="20 cm wall segments a square metre")
    parser.add_argument("--json", action="store_true", help="the result as JSON in the last line")
    options = parser.parse_args()
    try:
        if options.robots is None:
            try:
                make(1, "compiled")
                table(["compiled", "interpreted"])
            except SimulationError as error:
                print(f"{error}\n")
                table(["interpreted"])
            return
        if not same_digest(options.robots, options.engine, options.walls):
            sys.exit(f"the digests of the two engines differ at {options.robots} robots")
        per_second, pace = rate(options.robots, options.engine, options.walls)
    except SimulationError as error:
        sys.exit(str(error))
    print(
        f"{options.engine}, {options.robots} robots, {options.walls} walls a m2: {per_second:,.0f} robot-steps/s,"
        f" {1 / per_second / pace:.1f} additions each; digest as interpreted"
    )
    if options.json:
        figures = {
            "robot_steps_per_s": per_second,
            "robots": options.robots,
            "engine": options.engine,
            "walls_per_m2": options.walls,
            "additions_per_robot_step": 1 / per_second / pace,
        }
        print(json.dumps(figures))


if __name__ == "__main__":
    main()
