"""How fast worlds run, through the public API; beside another checkout and stock Enki, if asked.

One robot-step is one robot sensed, steered and moved for one tick. Scenario: a walled square with 10 robots a square
metre, ticks of 1/32 s, 8 infrared sensors of 3 rays with noise, motor noise of 5 %, firmware speed quantisation, a
Braitenberg controller. CPU time, except in rows that say "clock".

Each contender measures in a process of its own. They take turns, round by round, because the pace of a shared machine
changes by the minute, and start anew every few rounds: where a process has its memory is worth up to 10 %, and a crowd
takes longer the more its robots lean on each other.

Shown is the best of the rounds. Ratios are this tree's speed by the other's: over 1 is faster. "median" is the median
of each round's ratio, "best" is best against best. Enki comes as Debian's libenki-dev; ``enki.cpp`` is compiled into
``build/``. Stock Enki simulates a turret on each e-puck; "sensors" is Enki with its eight infrared sensors only, as
elib has them.
"""

from __future__ import annotations

import math
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from harness import ROOT, Cell, Table, Tables, calling, python_in, quick, ratio, run

CHECKED = 2000  # Robot-steps that both engines run for the digest.
BEHAVED = 30.0  # Simulated seconds of the behaviour.
ROUNDS_A_PROCESS = 5

Work: TypeAlias = tuple[Callable[[], object], float]
"""What is measured, and how often a call does it."""


# What a worker does. It runs in every checkout, so it imports elib only when asked.


def world(robots: int, engine: str, walls: int = 0, threads: int = 1, seed: int = 1) -> Any:
    """Return the scenario; *walls* is the number of 20 cm segments a square metre."""
    from elib.simulator.physics import Colour, EpuckModel, Scene, Wall, World

    side = math.sqrt(robots / 10)
    draw = random.Random(seed)
    segments = []
    for _ in range(round(walls * side * side)):
        x, y, angle = draw.uniform(0, side), draw.uniform(0, side), draw.uniform(0, math.tau)
        end = x + 0.2 * math.cos(angle), y + 0.2 * math.sin(angle)
        colour = Colour(draw.randrange(60, 240), draw.randrange(60, 240), draw.randrange(60, 240))
        if 0 <= end[0] <= side and 0 <= end[1] <= side:
            segments.append(Wall(x, y, *end, colour=colour, reflectance=1.0))
    scene = Scene(side, side, tuple(segments), step=1 / 32, seed=seed, model=EpuckModel(motor_noise=0.05))
    more: Any = {} if threads == 1 else {"threads": threads}
    return World(scene, robots=robots, engine=engine, **more)  # type: ignore[arg-type]


def braitenberg() -> Any:
    from elib.simulator.physics import Controller

    return Controller.braitenberg()


def drive(engine: str, robots: int, walls: int, threads: int) -> Work:
    """Count robot-steps of the scenario."""
    crowd, controller = world(robots, engine, walls, threads), braitenberg()
    ticks = max((300_000 if engine == "compiled" else 6_000) // robots, 3)
    return lambda: crowd.run(ticks, controller), robots * ticks


def batch(threads: int) -> Work:
    """Count robot-steps of 200 worlds of 10 robots."""
    from elib.simulator.physics import Batch

    worlds, controller = Batch(world(10, "compiled").scene, 200, robots=10, threads=threads), braitenberg()
    return lambda: worlds.run(150, controller), 200 * 10 * 150


def calls(engine: str) -> Work:
    """Count ticks in which a Python program reads one robot's sensors and steers it."""
    turn = world(1, engine).stepper()
    count = 50_000 if engine == "compiled" else 3_000

    def work() -> None:
        near = turn(600, 600)
        for _ in range(count):
            left = near[6] + near[7]
            right = near[0] + near[1]
            near = turn(600 - 0.5 * right + 0.3 * left, 600 - 0.5 * left + 0.3 * right)

    return work, count


def behave() -> Work:
    """Count simulated seconds of a behaviour that avoids walls, through the ordinary API."""
    import elib

    async def avoid(robot: elib.Epuck) -> None:
        end = robot.time + BEHAVED
        while robot.time < end:
            near = await robot.proximity()
            right = (near.front_right + near.diagonal_right) / 800
            left = (near.front_left + near.diagonal_left) / 800
            await robot.set_speed(max(-0.4, 0.4 - right), max(-0.4, 0.4 - left))
            await robot.sleep(0.05)

    return lambda: elib.run(avoid, robot="sim://?speed=max"), BEHAVED


def pictures(engine: str, in_one_call: int) -> Work:
    """Count pictures of 40 x 40 at zoom 8, from each of 10 robots among 20 walls, in 5 rooms."""
    rooms = [world(10, engine, 20, seed=seed) for seed in range(1, 6)]
    right = tuple(8 * (k - 19.5) for k in range(40))
    up = tuple(-offset for offset in right)
    if in_one_call:  # None stands for all robots.
        return lambda: [room.pictures(None, right, up) for room in rooms], 50
    return lambda: [room.picture(robot, right, up) for room in rooms for robot in range(10)], 50


def scored(robot: Any, parameters: Any, memory: Any) -> None:
    """Drive like Braitenberg's vehicle, and add to the fitness of Floreano and Mondada (1996) in each tick."""
    robot.left = parameters[0]
    robot.right = parameters[9]
    most = 0
    for s in range(8):
        robot.left += parameters[1 + s] * robot.proximity[s]
        robot.right += parameters[10 + s] * robot.proximity[s]
        most = max(most, robot.proximity[s])
    speed = (abs(robot.left) + abs(robot.right)) / 2000.0
    difference = abs(robot.left - robot.right) / 2000.0
    robot.fitness += speed * (1.0 - math.sqrt(min(difference, 1.0))) * (1.0 - most / 4095.0)


def fitness(each_tick: int) -> Work:
    """Count robot-steps of 100 individuals, each alone in a world, with or without a fitness of every tick."""
    from elib.simulator.physics import Controller

    worlds, controller = [world(1, "compiled", seed=k) for k in range(100)], braitenberg()
    if each_tick:
        controller = Controller(scored, controller.parameters)
    return (lambda: [room.run(1920, controller) for room in worlds]), 1920 * 100


def reset(anew: int) -> Work:
    """Count robots that begin again with another seed, or in a new world."""
    crowd, seeds = world(100, "compiled"), iter(range(2, 1 << 30))
    if anew:
        return lambda: [world(100, "compiled", seed=next(seeds)) for _ in range(10)], 10 * 100
    return lambda: [crowd.reset(next(seeds)) for _ in range(10)], 10 * 100


def cross(side: int) -> Work:
    """Count simulated seconds of one robot that crosses a room without walls, opening the room included."""
    from elib.simulator.physics import EpuckModel, Pose, Scene, World

    scene = Scene(side, side, starts=(Pose(side / 2, side / 2),), model=EpuckModel())

    def opened() -> None:
        room = World(scene, engine="interpreted")
        room.set_step_rates(0, 1000, 1000)
        room.run(round(30 / scene.step))

    return opened, 30.0


def first_run() -> None:
    """Do what a program does at first: run with a controller, run without, read a sensor."""
    crowd = world(10, "compiled", 20)
    crowd.run(2, braitenberg())
    crowd.step()
    crowd.proximity(0)


def compile_time() -> float:
    """Return the CPU seconds of a whole process that runs first_run() with an empty cache."""
    with tempfile.TemporaryDirectory() as folder:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        empty = os.environ | {"XDG_CACHE_HOME": folder}
        subprocess.run(calling(first_run), env=empty, check=True, stderr=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def digest(engine: str, robots: int, walls: int) -> str:
    crowd = world(robots, engine, walls)
    crowd.run(max(CHECKED // robots, 2), braitenberg())
    return str(crowd.hash("proximity"))


def addition() -> float:
    """Return the CPU seconds of an addition in a loop: the interpreter's pace at this moment."""
    began, total = time.process_time(), 0
    for k in range(100_000):
        total += k
    return (time.process_time() - began) / 100_000


@cache
def prepared(maker: Callable[..., Work], *given: str | int) -> Work:
    """Return a work that was done once, so that it is compiled."""
    work, count = maker(*given)
    work()
    return work, count


def answer(verb: str, *words: str) -> str:
    given = [int(word) if word.isdecimal() else word for word in words]
    if verb == "where":
        return str(__import__("elib").__file__)
    if verb == "digest":
        return digest(*given)  # type: ignore[arg-type]
    if verb == "compile":
        return f"{compile_time()} 0 1 0"
    work, count = prepared(globals()[verb], *given)
    pace, wall, cpu = addition(), time.perf_counter(), time.process_time()
    work()
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    return f"{cpu} {wall} {count} {min(pace, addition())}"


def serve() -> None:
    """Answer each line with CPU seconds, wall seconds, count and pace, or with "- " and the reason for none."""
    for line in sys.stdin:
        try:
            reply = answer(*line.split())
        except Exception as error:
            reply = f"- {type(error).__name__}: {error}".partition("\n")[0]
        print(reply, flush=True)


# What the parent process does: it asks the workers.


class Row(NamedTuple):
    """A line of the table."""

    name: str
    request: str
    rival: str = ""  # What the others are asked instead.
    unit: str = ""  # Empty for rates; otherwise what the cost of one is given in.
    units: float = 1.0  # In a second.


def rows() -> list[Row]:
    sizes = (1, 10, 100, 1000, 10_000)
    one = "drive compiled {} 0 1".format
    return [
        *(Row(f"compiled, N = {n:,}", one(n)) for n in sizes),
        Row("compiled, N = 100, 20 walls a m2", "drive compiled 100 20 1"),
        *(Row(f"compiled, N = {n:,}, threads: 1, clock", one(n)) for n in sizes[3:]),
        *(Row(f"compiled, N = {n:,}, threads: 2, clock", f"drive compiled {n} 0 2", one(n)) for n in sizes[3:]),
        *(Row(f"compiled, 200 worlds x 10, threads: {t}, clock", f"batch {t}") for t in (1, 2)),
        Row("compiled, one-step calls from Python", "calls compiled"),
        *(Row(f"interpreted, N = {n}", f"drive interpreted {n} 0 1") for n in sizes[:3]),
        Row("interpreted, one-step calls from Python", "calls interpreted"),
        Row("behaviour at speed=max, simulated s", "behave"),
        *(Row(f"pictures one at a time, {e}", f"pictures {e} 0") for e in ("interpreted", "compiled")),
        Row("pictures in one call, compiled", "pictures compiled 1", "pictures compiled 0"),
        Row("evolution, 100 worlds x 1, no fitness", "fitness 0"),
        Row("evolution, 100 worlds x 1, fitness each tick", "fitness 1"),
        Row("a room of 1 m opened and crossed, simulated s", "cross 1"),
        Row("a room of 40 m opened and crossed, simulated s", "cross 40"),
        Row("a new world, each robot", "reset 1", "", "us", 1e6),
        Row("reset(seed), each robot", "reset 0", "reset 1", "us", 1e6),
        Row("first run with an empty cache", "compile", "", "s"),
    ]


class Contender:
    """A program that measures, and what it measured."""

    def __init__(self, name: str, command: list[str], tree: Path | None = None) -> None:
        self.name, self._command = name, command
        # A cache of its own: others of this user may clear theirs away meanwhile.
        cache_folder = ROOT / "build" / f"cache-{name}"
        self._environment = os.environ | {"XDG_CACHE_HOME": str(cache_folder)}
        if tree:
            self._environment["PYTHONPATH"] = str(tree / "src")
        self._samples: dict[Row, list[list[float]]] = {}
        self.reasons: dict[Row, str] = {}
        self._process = self._start()
        if tree and not Path(self.ask("where")).is_relative_to(tree):
            sys.exit(f"{command[0]} does not find elib in {tree}: {self.ask('where')}")

    def _start(self) -> subprocess.Popen[str]:
        pipe = subprocess.PIPE
        return subprocess.Popen(self._command, stdin=pipe, stdout=pipe, text=True, env=self._environment)

    def restart(self) -> None:
        self._process.communicate()
        self._process = self._start()

    def ask(self, request: str) -> str:
        print(request, file=self._process.stdin, flush=True)
        return (self._process.stdout.readline() if self._process.stdout else "").strip() or "- its process ended"

    def measure(self, row: Row, request: str) -> None:
        reply = self.ask(request)
        if reply.startswith("-"):
            self.reasons[row] = reply[2:]
        else:
            self._samples.setdefault(row, []).append([float(word) for word in reply.split()])

    def rates(self, row: Row) -> list[float]:
        is_clock = row.name.endswith("clock")
        return [count / (wall if is_clock else cpu) for cpu, wall, count, _ in self._samples.get(row, [])]

    def additions(self, row: Row) -> float:
        return 1 / max(self.rates(row)) / min(pace for *_, pace in self._samples[row])


def contenders(beside: Path | None, with_enki: bool) -> list[Contender]:
    """Start the processes, this tree's first."""
    found = [Contender("this", calling(serve), ROOT)]
    if beside:
        found.append(Contender("other", calling(serve, python=python_in(beside)), beside.resolve()))
    if with_enki:
        program = ROOT / "build/enki"
        program.parent.mkdir(exist_ok=True)
        source = Path(__file__).with_name("enki.cpp")
        build = [shutil.which("g++") or "false", "-O3", str(source), "-o", str(program), "-lenki"]
        if subprocess.run(build).returncode == 0:
            found += [Contender("enki", [str(program)]), Contender("sensors", [str(program), "--sensors-only"])]
        else:
            print("Enki is left out: it needs g++ and Debian's libenki-dev.")
    return found


def check_digests(found: list[Contender], robots: int, walls: int) -> None:
    """Compare the digests of both engines, which must agree, and of the other tree, which may."""
    told = {name: found[0].ask(f"digest {name} {robots} {walls}") for name in ("interpreted", "compiled")}
    if told["compiled"].startswith("-"):
        print(f"compiled: {told['compiled'][2:]}")
    elif told["compiled"] != told["interpreted"]:
        sys.exit(f"the digests of the two engines differ at {robots} robots, {walls} walls a m2: {told}")
    for one in found[1:]:
        reply = one.ask(f"digest interpreted {robots} {walls}")
        if not reply.startswith("-") and reply != told["interpreted"]:
            print(f"{one.name}: other digest than this at {robots} robots, {walls} walls a m2")


def let_all_measure(found: list[Contender], wanted: list[Row], rounds: int) -> None:
    """Let all measure each row in turns, so many rounds; but the first run, which is long, once a process."""
    for first in range(0, rounds, ROUNDS_A_PROCESS):
        for one in found:
            one.restart()
        for row in wanted:
            for k in range(first, first + 1 if row.request == "compile" else min(first + ROUNDS_A_PROCESS, rounds)):
                for one in found if k % 2 else reversed(found):
                    if row not in one.reasons and row not in found[0].reasons:
                        one.measure(row, row.request if one is found[0] else row.rival or row.request)


def report(row: Row, found: list[Contender]) -> dict[str, Cell]:
    """Return the figures of a row."""
    ours, figures = found[0].rates(row), {}
    for one in found:
        rates = one.rates(row)
        if not rates or not ours:
            figures[one.name] = one.reasons.get(row, "-")
            continue
        figures[one.name] = row.units / max(rates) if row.unit else max(rates)
        if one is not found[0]:
            ratios = {"median": ratio(ours, rates), "best": max(ours) / max(rates)}
            figures |= {f"by {one.name}, {name}": value for name, value in ratios.items()}
    if len(found) == 1 and ours and not row.unit:
        figures["additions each"] = found[0].additions(row)
    return figures | {"unit": row.unit or "1/s"}


def table(found: list[Contender], wanted: list[Row]) -> Table:
    """Return what was measured."""
    figures = {row.name: report(row, found) for row in wanted}
    pair = [row for row in wanted if row.request.startswith("fitness")]
    if len(pair) == 2 and all(found[0].rates(row) for row in pair):
        costs = {one.name: ratio(*map(one.rates, pair)) - 1 for one in found if one.rates(pair[1])}
        figures["a fitness each tick adds to a run"] = {**costs, "unit": "of it"}
    return figures


@quick(rounds=1, only="interpreted")
def measure(*, beside: Path | None = None, enki: bool = False, rounds: int = 0, only: str = "") -> Tables:
    """Measure.

    Args:
        beside: Another checkout of elib, with its ``.venv``, to measure in turns with this one.
        enki: Measure stock Enki, too.
        rounds: Of each row; 25 beside others and 7 alone if left out.
        only: Part of the names of the rows that are wanted.
    """
    found = contenders(beside, enki)
    for robots, walls in ((1, 0), (10, 0), (100, 20)):
        check_digests(found, robots, walls)
    wanted = [row for row in rows() if only in row.name]
    let_all_measure(found, wanted, rounds or (25 if len(found) > 1 else 7))
    yield "best of its rounds", table(found, wanted)


if __name__ == "__main__":
    run(__doc__, measure)
