"""Sweeps: one run for every combination of parameters, worlds, faults and seeds, measured, and kept in one table.

A behaviour runs through the whole chain, link and firmware included. A champion of an evolution runs in the physics
alone, where faults of the link do not exist.
"""

from __future__ import annotations

import contextlib
import io
import itertools
import json
import math
import random
import statistics
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import numpy as np

from elib.base.errors import ArgumentError, ElibError
from elib.base.files import parse_json, read_file, write_file
from elib.base.rules import Number, Whole, nearest, number_from
from elib.behaviours import Behaviour, BehaviourStyle, RunContext, find, play
from elib.learn.catalogue import run_file
from elib.learn.champion import Champion, load_champion
from elib.learn.executor import Executor
from elib.learn.journal import differences_of, open_folder, versions
from elib.learn.study import Evaluation, check_fitness, evaluate
from elib.link.session.statistics import merged
from elib.link.transport import Url, parse_url
from elib.records.et.formats import write_table
from elib.records.et.table import Header, Table
from elib.robot.aio import Epuck, on_open
from elib.simulator.emulator import faultscript
from elib.simulator.emulator.settings import DEFAULT_WORLD, settings_of
from elib.simulator.physics.scene import Scene
from elib.simulator.physics.task import Randomisation
from elib.studies.drive import RobotReport

SETTINGS, RUNS, TABLE, PLOT = "sweep.json", "runs.jsonl", "runs.parquet", "sweep.svg"
CHAMPION = ".toml"
"""What the name of a champion's file ends in."""
NO_FAULT = "none"
SECONDS = 30.0
"""s of robot time for a run of a behaviour, unless another time is given: many behaviours never end by themselves."""
MAX_RUNS = 1_000_000
MAX_PROGRAM = 1_000_000
"""Bytes of a program at most: each job carries it to its worker."""
CELL = 0.1
"""m. Edge of the squares in which the visited area is counted: somewhat more than a robot."""

Value = float | str
Row = dict[str, Any]

DRIVE = {
    "path": "length of the path, m",
    "distance": "distance from the start, m",
    "mean_speed": "mean speed, m/s",
    "contact_time": "time in contact, s",
    "contacts": "contacts",
    "area": "visited area, m²",
    "end_x": "x at the end, m",
    "end_y": "y at the end, m",
    "end_heading": "heading at the end, rad",
    "duration": "duration, s",
    "requests": "requests",
    "timeouts": "requests without an answer",
}
"""What is measured of a behaviour, in the true world. Of a swarm: the mean over its robots; the end is the first's."""
EPISODE = {
    "fitness": "fitness",
    "solved": "part of the episodes that were solved",
    "left_steps": "steps of the left motor",
    "right_steps": "steps of the right motor",
}
"""What is measured of a champion."""


@dataclass(frozen=True, slots=True)
class Range:
    """So many numbers between two bounds."""

    low: float
    high: float
    count: int


@dataclass(frozen=True, slots=True)
class Run:
    """One run of a sweep."""

    number: int  # from 0
    parameters: tuple[tuple[str, Value], ...]  # name and value of each that is varied
    world: str  # its name or file; empty for that of the target
    fault: str  # a fault script, settings of the link such as loss=0.1, or none
    seed: int  # of the world and of the behaviour

    @property
    def url(self) -> str:
        """The URL of its robot."""
        given = parse_url(f"sim://{self.world}")
        extra = [] if self.fault == NO_FAULT else [self.fault if "=" in self.fault else f"fault={self.fault}"]
        keys = dict(pair.partition("=")[::2] for pair in "&".join(extra).split("&") if pair)
        keys = {**given.keys, **keys, "speed": "max", "seed": str(self.seed)}
        return str(parse_url(str(Url("sim", given.target, tuple(keys.items())))))


@dataclass(frozen=True, slots=True)
class Sweep:
    """What is to be run."""

    target: str  # name of a behaviour, FILE.py or FILE.py:NAME with one of yours, or best.toml
    grid: tuple[tuple[str, tuple[Value, ...]], ...] = ()  # every combination of these values is run
    samples: tuple[tuple[str, Range], ...] = ()  # random values of these are drawn, all together
    worlds: tuple[str, ...] = ("",)  # as in Run
    faults: tuple[str, ...] = (NO_FAULT,)  # as in Run
    seeds: int = 1  # every combination is run with the seeds 1 to this
    seconds: float | None = None  # of robot time for a run; None stands for 30, or for what a champion's task says
    # The text of the target's file, if it is one: another text is another sweep, and workers on other computers do not
    # have the program.
    source: str | None = None

    @property
    def varied(self) -> tuple[str, ...]:
        """The names of the parameters."""
        return tuple(name for name, _ in (*self.grid, *self.samples))

    @property
    def metrics(self) -> Mapping[str, str]:
        """What is measured: names of columns, and what they are."""
        return EPISODE if self.target.endswith(CHAMPION) else DRIVE

    def runs(self) -> list[Run]:
        """Return all runs, in the order of the table."""
        corners = itertools.product(*(values for _, values in self.grid))
        every = itertools.product(corners, self._drawn(), self.worlds, self.faults, range(1, self.seeds + 1))
        return [
            Run(k, tuple(zip(self.varied, (*corner, *point), strict=True)), world, fault, seed)
            for k, (corner, point, world, fault, seed) in enumerate(every)
        ]

    def check(self) -> list[Run]:
        """Return all runs, after everything that can be checked before the first one was."""
        Whole(1).require(self.seeds, "seeds")
        names = self.varied
        for name in names:
            if names.count(name) > 1:
                raise ArgumentError(f"the parameter {name!r} is given twice", hint="once, with all its values")
            if name in {**self.metrics, "run": "", "world": "", "fault": "", "seed": "", "ended": "", "error": ""}:
                raise ArgumentError(f"the parameter {name!r} has the name of a column of the table")
        counts = {values.count for _, values in self.samples}
        if len(counts) > 1:
            raise ArgumentError(
                f"the samples have different numbers: {', '.join(map(str, sorted(counts)))}",
                hint="they are drawn together, so all need the same number",
            )
        total = math.prod([*(len(values) for _, values in self.grid), len(self.worlds), len(self.faults), self.seeds])
        total *= next(iter(counts), 1)
        if total > MAX_RUNS:
            raise ArgumentError(f"this would be {total} runs; the limit is {MAX_RUNS}", hint="take fewer values")
        runs = self.runs()
        _target(self).check(runs)
        return runs

    def _drawn(self) -> list[tuple[float, ...]]:
        """Return the points of the samples, a Latin hypercube: each of equal parts of a range has one of its values."""
        columns = []
        for name, values in self.samples:
            generator = random.Random(f"{name} {values}")
            parts = list(range(values.count))
            generator.shuffle(parts)
            width = (values.high - values.low) / values.count
            columns.append([values.low + width * (part + generator.random()) for part in parts])
        return list(zip(*columns, strict=True)) if columns else [()]


def parse_grid(text: str) -> tuple[str, tuple[Value, ...]]:
    """Return name and values of ``cruise=0.2,0.4``, or of ``cruise=0.2..0.6:5``: five values at equal distances."""
    name, _, rest = text.partition("=")
    name = name.strip().replace("-", "_")
    if ".." in rest:
        name, values = parse_sample(text)
        step = (values.high - values.low) / max(1, values.count - 1)
        # As decimals: 0.1 + 2 * 0.1 is 0.30000000000000004, and the last one may be beyond the end.
        return name, tuple(min(float(f"{values.low + k * step:.12g}"), values.high) for k in range(values.count))
    found = [number_from(each.strip()) for each in rest.split(",")]
    if not name or "" in found:
        raise ArgumentError(f"{text!r} is not a parameter with its values", hint="such as cruise=0.2,0.4,0.6")
    return name, tuple(each if isinstance(each, float | int) else str(each) for each in found)


def parse_sample(text: str) -> tuple[str, Range]:
    """Return name and range of ``base=0.1..0.5:20``: twenty random numbers."""
    name, _, rest = text.partition("=")
    low, _, rest = rest.partition("..")
    high, _, count = rest.partition(":")
    with contextlib.suppress(ValueError):
        found = Range(float(low), float(high), int(count))
        if name.strip() and math.isfinite(found.low) and found.low < found.high < math.inf and found.count > 0:
            return name.strip().replace("-", "_"), found
    raise ArgumentError(f"{text!r} is not a parameter with a range and a number", hint="such as base=0.1..0.5:20")


class _Drive:
    """A behaviour as the target of a sweep."""

    def __init__(self, behaviour: Behaviour) -> None:
        self._behaviour = behaviour
        if behaviour.style is BehaviourStyle.BYTES:
            raise ArgumentError(f"{behaviour.name} writes bytes to the line itself: no robot can be measured")

    def check(self, runs: Sequence[Run]) -> None:
        for run in runs:
            self._behaviour.check(dict(run.parameters))
        for url in {replace(run, number=0, seed=1, parameters=()).url for run in runs}:
            settings = settings_of(parse_url(self._behaviour.resolve_url(url)))
            Scene.load(settings.world, robots=settings.robots)
            if settings.fault is not None:
                faultscript.load(settings.fault)

    def world_of(self, run: Run) -> str:
        return parse_url(self._behaviour.resolve_url(run.url)).target or DEFAULT_WORLD

    def measure(self, run: Run, seconds: float | None) -> Row:
        robots: list[RobotReport] = []

        def watch(context: RunContext, opened: tuple[Epuck, ...]) -> None:
            robots.extend(RobotReport(robot, context.began) for robot in opened)

        how: Any = {"seconds": seconds or SECONDS, "options": dict(run.parameters), "seed": run.seed}
        error = None
        try:
            with contextlib.redirect_stdout(io.StringIO()):  # a thousand runs would print a thousand times
                ended = play(self._behaviour, run.url, watch=watch, **how).reason
        except Exception as problem:  # that a run failed is a result of it
            ended, error = "error", f"{type(problem).__name__}: {problem}"
        for robot in robots:
            robot.close()
        return {**_drive_row(robots), "ended": ended, "error": error}


def _drive_row(robots: Sequence[RobotReport]) -> Row:
    """Return what robots did; their columns are empty if none was opened."""
    if not robots:
        return dict.fromkeys(DRIVE)

    first = robots[0].path[-1]
    links = merged([each.robot.statistics for each in robots])
    duration = max(each.time for each in robots)
    path = statistics.fmean(each.distance for each in robots)
    lines = [[(each.x, each.y) for each in robot.path] for robot in robots]
    areas = [round(CELL * CELL * len({(int(x // CELL), int(y // CELL)) for x, y in line}), 4) for line in lines]
    values = (
        path,
        statistics.fmean(math.dist(line[0], line[-1]) for line in lines),
        path / duration if duration else 0.0,
        statistics.fmean(each.contact_time for each in robots),
        sum(each.contacts for each in robots),
        statistics.fmean(areas),
        *(first.x, first.y, first.heading),
        *(duration, links.count, links.lost),
    )
    return dict(zip(DRIVE, values, strict=True))


class _Episode:
    """A champion as the target of a sweep: its parameters are what episodes of its task draw."""

    def __init__(self, champion: Champion) -> None:
        self._champion = champion

    def check(self, runs: Sequence[Run]) -> None:
        for run in runs:
            if run.fault != NO_FAULT:
                raise ArgumentError(
                    f"fault {run.fault!r} is one of the link, and a champion is run in the physics, without a link",
                    hint="elib transfer runs it over a link; here, vary latency and noise",
                )
        for run in {replace(each, number=0, seed=1) for each in runs}:
            self._evaluation(run, None)

    def world_of(self, run: Run) -> str:
        return run.world or f"task {self._champion.task}"

    def _evaluation(self, run: Run, seconds: float | None) -> Evaluation:
        champion, task = self._champion, self._champion.find_task()
        known = [each.name for each in fields(Randomisation)]
        for name, value in run.parameters:
            if name not in known:
                raise ArgumentError(f"a task has no parameter {name!r}", hint=nearest(name, known))
            Number().require(value, name)
        drawn: dict[str, Any] = {name: (value, value) for name, value in run.parameters}
        task = replace(
            task,
            randomisation=replace(task.randomisation, **drawn),
            sensors=champion.network.sensors,
            period=champion.period,
            seconds=seconds or task.seconds,
            scenes=(replace(Scene.load(run.world), step=task.step),) if run.world else task.scenes,
        )
        key = json.dumps([asdict(champion), run.parameters, run.world, seconds])
        return Evaluation(task, champion.network, key=key)

    def measure(self, run: Run, seconds: float | None) -> Row:
        evaluation = self._evaluation(run, seconds)
        scores = evaluate(evaluation, np.array([self._champion.parameters]), [run.seed], threads=1)
        fitness = float(scores.fitness[0][0])
        check_fitness(fitness, f"of run {run.number}", evaluation)
        left, right = map(float, scores.steps[0][0])
        return {
            "fitness": fitness,
            "solved": float(fitness >= evaluation.task.solved),
            "left_steps": left,
            "right_steps": right,
        }


@lru_cache(maxsize=4)
def _target(sweep: Sweep) -> _Drive | _Episode:
    """Return what is run."""
    name, _, variable = sweep.target.partition(".py:")
    if sweep.target.endswith(CHAMPION):
        if sweep.source not in (None, read_program(sweep.target)):  # perhaps on one of several computers only
            raise ArgumentError(f"{sweep.target} is not what it was when the sweep began", hint="put that one back")
        return _Episode(load_champion(sweep.target))
    if variable or name.endswith(".py"):
        return _Drive(_behaviour_of(Path(name if not variable else f"{name}.py"), sweep.source or "", variable))
    return _Drive(find(name))


def read_program(target: str) -> str | None:
    """Return the text of the file that *target* names, a program or a champion; None if it names something else."""
    file = target.partition(".py:")[0] + ".py" if ".py:" in target else target
    if not file.endswith((".py", CHAMPION)):
        return None
    content = read_file(file, "the file", largest=MAX_PROGRAM)
    if len(content) > MAX_PROGRAM:
        raise ArgumentError(f"{file} is larger than {MAX_PROGRAM} bytes")
    try:
        return content.decode()
    except UnicodeDecodeError:
        raise ArgumentError(f"{file} is not text in UTF-8") from None


def _behaviour_of(file: Path, source: str, name: str) -> Behaviour:
    """Return a behaviour of a program, which is imported; the file itself need not be there."""
    module = sys.modules[f"elib.swept.{file.stem}"] = ModuleType(f"elib.swept.{file.stem}")

    def refuse(robot: Epuck) -> None:
        raise ArgumentError(
            f"{file} drives a robot as soon as it is imported",
            hint='put what does that below: if __name__ == "__main__":',
        )

    with on_open(refuse):
        run_file(module, file, source)
    behaviours = {key: each for key, each in vars(module).items() if isinstance(each, Behaviour)}
    own = {key: each for key, each in behaviours.items() if each.function.__module__ == module.__name__}
    if name and name not in own:
        raise ArgumentError(f"{file} has no behaviour {name!r}", hint=nearest(name, own))
    if not name and len(own) != 1:
        raise ArgumentError(
            f"{file} has {len(own)} behaviours{': ' if own else ''}{', '.join(own)}",
            hint="name one: FILE.py:NAME" if own else "decorate a function with @elib.behaviour",
        )
    return own[name or next(iter(own))]


def measure(sweep: Sweep, run: Run) -> Row:
    """Do one run, and return its row of the table."""
    target = _target(sweep)
    where = {"world": target.world_of(run), "fault": run.fault, "seed": run.seed}
    return {"run": run.number, **dict(run.parameters), **where, **target.measure(run, sweep.seconds)}


def run_sweep(sweep: Sweep, folder: Path, executor: Executor) -> Iterator[Row]:
    """Do the runs that are not in the folder yet, and write table and plot at the end.

    Yields:
        The rows in the order in which they come: first those that are there already.
    """
    runs = sweep.check()
    with open_folder(folder, "a sweep", SETTINGS, RUNS) as journal:
        _check_settings(sweep, folder, is_new=not journal.lines)
        rows = {int(row["run"]): row for row in journal.lines}
        if not rows.keys() <= set(range(len(runs))):
            raise ElibError(f"{folder / RUNS} has runs that do not belong to this sweep", hint="choose a new folder")
        yield from list(rows.values())
        left = [run for run in runs if run.number not in rows]
        for _, row in executor.run(measure, [(sweep, run) for run in left]):
            journal.append(row)
            rows[row["run"]] = row
            yield row
        write_table(folder / TABLE, table_of([rows[k] for k in range(len(runs))]))


def _check_settings(sweep: Sweep, folder: Path, *, is_new: bool) -> None:
    """Write the settings of a new sweep, or compare them with those of one that was interrupted."""
    settings = json.loads(json.dumps({"sweep": asdict(sweep), "versions": versions("numpy", "numba")}))
    path = folder / SETTINGS
    if is_new:
        write_file(path, json.dumps(settings, indent=1).encode())
        return
    content = read_file(path, "the sweep", largest=2 * MAX_PROGRAM)
    try:
        before = parse_json(content)
    except ValueError as error:
        raise ArgumentError(f"{path} is damaged: {error}", hint="choose a new folder") from None
    there: dict[str, Any] = before if isinstance(before, dict) else {}
    began, asked = ({**each.get("sweep", {})} for each in (there, settings))
    changed = [f"the program {asked['target']} was changed"] * (began.pop("source", None) != asked.pop("source"))
    differences = changed + differences_of(began, asked, elib=there.get("versions", {}).get("elib"))
    if differences:
        raise ArgumentError(
            f"{folder} holds another sweep: {'; '.join(differences)}", hint="choose a new folder with --out"
        )


def table_of(rows: Sequence[Row]) -> Table:
    """Return rows as a table: its columns are those of the first row."""
    headers = [Header(name, kind_of([row.get(name) for row in rows])) for name in rows[0]]
    return Table(headers, ([row.get(header.name) for header in headers] for row in rows))


def kind_of(values: Sequence[object]) -> Literal["whole", "number", "text"]:
    """Return what the cells of a column are."""
    there = [value for value in values if value is not None]
    if there and all(isinstance(value, int) for value in there):
        return "whole"
    return "number" if there and all(isinstance(value, int | float) for value in there) else "text"


def check_metric(sweep: Sweep, metric: str) -> str:
    """Return the name of the column that is drawn."""
    name = (metric or next(iter(sweep.metrics))).replace("-", "_")
    if name not in sweep.metrics:
        raise ArgumentError(f"{metric!r} is not measured", hint=f"choose from {', '.join(sweep.metrics)}")
    return name
