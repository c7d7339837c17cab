"""A study: the folder of one evolution, from which it goes on after any interruption, and what it evaluates."""

from __future__ import annotations

import hashlib
import json
import math
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from elib.base.errors import ArgumentError, ElibError
from elib.base.files import read_file, write_file
from elib.base.rules import Number, Text, Whole, check
from elib.learn.catalogue import find_task
from elib.learn.journal import differences_of, open_folder, read_lines, versions
from elib.learn.networks import Law, Network, find_controller
from elib.learn.optimisers import Floats, Optimiser, optimiser
from elib.simulator.physics.engine import EngineName
from elib.simulator.physics.episodes import Episodes, Scores
from elib.simulator.physics.task import Task

SETTINGS, GENERATIONS, BEST = "study.toml", "generations.jsonl", "best.toml"
GENERATIONS_TABLE, INDIVIDUALS_TABLE, PLOT = "generations.parquet", "individuals.parquet", "fitness.svg"

MAX_SETTINGS = 100_000
"""Bytes of study.toml at most; it has some twenty lines."""

PACKAGES = ("numpy", "numba", "cmaes", "ribs")
"""Packages whose versions are noted: another one may draw other random numbers."""

NOT_COMPARED = "generations"
"""The one setting that may change: more of them go on from those that there are."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What decides the result of a study: with equal settings, every study gives the same result."""

    task: Annotated[str, Text(1000)]  # one that comes with elib, or FILE.py:TASK
    controller: Annotated[str, Text(1000)] = "recurrent"  # or feedforward, braitenberg, FILE.py:LAW
    hidden: Annotated[int, Whole(0, 100)] = 0  # neurons of a network
    algorithm: Annotated[str, Text()] = "cma"  # or ga, map-elites
    population: Annotated[int, Whole(2, 100_000)] = 50  # individuals of a generation
    generations: Annotated[int, Whole(1, 1_000_000)] = 100
    scenarios: Annotated[int, Whole(1, 10_000)] = 4  # episodes of an individual in a generation
    seconds: Annotated[float, Number(0, 1e6, "s")] = 0.0  # of an episode; 0 stands for what the task says
    seed: Annotated[int, Whole(0, 2**63 - 1)] = 1  # of everything random

    def __post_init__(self) -> None:
        check(self)

    @property
    def sources(self) -> dict[str, str]:
        """The files of the user that take part, and a digest of the content of each."""
        files = [name.rpartition(":")[0] for name in (self.task, self.controller)]
        return {
            file: hashlib.blake2b(read_file(file, "the file", largest=10**7), digest_size=16).hexdigest()
            for file in files
            if file.endswith(".py")
        }

    def evaluation(self, engine: EngineName = "compiled") -> Evaluation:
        """Return what gives individuals their fitness.

        Raises:
            ArgumentError: There is no such task or controller.
        """
        task = find_task(self.task)
        if self.seconds:
            task = replace(task, seconds=self.seconds)
        found = find_controller(self.controller, task.sensors, hidden=self.hidden, top_speed=task.top_speed)
        task = replace(task, sensors=found.sensors)  # A law may read others than the task names.
        return Evaluation(task, found, engine, key=json.dumps([asdict(self), self.sources]))

    def optimiser(self, size: int) -> Optimiser:
        """Return the optimiser at its beginning, for individuals of *size* parameters."""
        return optimiser(self.algorithm, size, self.population, self.seeds(0, 1)[0])

    def seeds(self, generation: int, count: int) -> list[int]:
        """Return seeds for a generation, counted from 1; no two generations have the same."""
        drawn = np.random.SeedSequence(self.seed, spawn_key=(generation,)).generate_state(count, np.uint64)
        return [int(each) >> 1 for each in drawn]  # Below 2**63: JSON and TOML readers have signed integers.


@dataclass(frozen=True)
class Evaluation:
    """How individuals get their fitness. It can be pickled, so that other processes evaluate too."""

    task: Task
    controller: Network | Law  # whose parameters are the individuals
    engine: EngineName = "compiled"  # or interpreted, to examine a reward function
    key: str = ""  # equal keys stand for equal evaluations, also after pickling; empty if that is not known

    def is_same(self, other: Evaluation) -> bool:
        """Whether *other* gives every individual the same fitness."""
        return self is other or (self.key == other.key != "" and self.engine == other.engine)


_latest: tuple[Evaluation, int | None, Episodes] | None = None
"""The worlds of the last evaluation of this process: to lay them out and to compile takes longer than an episode."""


def evaluate(evaluation: Evaluation, population: Floats, seeds: Sequence[int], threads: int | None = None) -> Scores:
    """Return what individuals, rows of a population, earn in an episode for each seed.

    So many threads run at once; None means one a core. The result does not depend on it.
    """
    global _latest
    latest = _latest  # Read once: a Dask worker with several threads evaluates several things at a time.
    if latest is None or latest[1] != threads or not latest[0].is_same(evaluation):
        latest = _latest = evaluation, threads, Episodes(evaluation.task, engine=evaluation.engine, threads=threads)
    known, _, episodes = latest
    return episodes.play(known.controller.controller(population), population, seeds)


def check_fitness(fitness: float, whose: str, evaluation: Evaluation) -> None:
    """Check that a fitness is a finite number."""
    if not math.isfinite(fitness):
        raise ArgumentError(
            f"the fitness {whose} is {fitness}",
            hint=f"the reward of the task {evaluation.task.name} must be a finite number in every tick",
        )


class Generation(NamedTuple):
    """One generation as it is recorded: one line of generations.jsonl. Lists have a value for each individual."""

    generation: int  # from 1
    population: str  # a digest of all parameters: they are not recorded, the optimiser finds them again
    seeds: list[int]  # of the episodes
    fitness: list[float]  # the mean over its episodes
    left: list[float]  # mean speed of the left wheel, as a part of the top speed
    right: list[float]

    @property
    def best(self) -> int:
        """Index of the best individual."""
        return max(range(len(self.fitness)), key=self.fitness.__getitem__)


def digest_of(population: Floats) -> str:
    """Return a digest of the parameters of a population, to the last bit."""
    return hashlib.blake2b(population.astype("<f8").tobytes(), digest_size=8).hexdigest()


class Study(AbstractContextManager["Study"]):
    """The folder of a study, open for writing; another program cannot open it meanwhile.

    Args:
        folder: The folder. It is made if it does not exist; if it holds a study, that one goes on.
        settings: What the study begins with, or began with.

    Attributes:
        generations: What is recorded.

    Raises:
        ArgumentError: The folder holds something else, or a study with other settings; nothing is changed then.
        ElibError: The folder cannot be written, or another program writes into it.
    """

    def __init__(self, folder: Path, settings: Settings) -> None:
        self.folder = folder
        self.settings = settings
        self._journal = open_folder(folder, "a study", SETTINGS, GENERATIONS)
        try:
            self._resume()
        except BaseException:
            self._journal.close()
            raise

    def _resume(self) -> None:
        settings, lines = self.settings, self._journal.lines
        now = {"settings": asdict(settings), "sources": settings.sources, "versions": versions(*PACKAGES)}
        is_new = not lines and not (self.folder / BEST).exists()  # Nothing is lost if a mended task begins again.
        if not is_new and (self.folder / SETTINGS).exists():
            _compare(self.folder, _read(self.folder), now)
        self.generations = [_generation(line, k, self.folder, settings) for k, line in enumerate(lines, start=1)]
        if len(lines) > settings.generations:
            raise ArgumentError(
                f"{self.folder} already has {len(lines)} generations, more than {settings.generations}",
                hint="ask for more with --generations, or choose another folder with --out",
            )
        if is_new or not (self.folder / SETTINGS).exists() or _read(self.folder)["settings"] != asdict(settings):
            write_file(self.folder / SETTINGS, _toml(now).encode())
        for name in (SETTINGS, BEST, GENERATIONS_TABLE, INDIVIDUALS_TABLE, PLOT):
            for left in self.folder.glob(f".{name}.*"):  # what a killed program had begun to write
                left.unlink(missing_ok=True)

    def append(self, generation: Generation) -> None:
        """Record a generation; it is on the disk when this returns."""
        self._journal.append(generation._asdict())
        self.generations.append(generation)

    def note(self, result: Mapping[str, object]) -> None:
        """Write the result of the study into study.toml."""
        write_file(self.folder / SETTINGS, _toml({**_read(self.folder), "result": result}).encode())

    def close(self) -> None:
        """Let other programs open the folder."""
        self._journal.close()

    def __exit__(self, *_: object) -> None:
        self.close()


def read_study(folder: Path) -> tuple[Settings, list[Generation]]:
    """Return the settings and the generations of a study, which may still be running.

    Example::

        settings, generations = read_study(Path("avoid-study"))
        print(settings.task, [max(each.fitness) for each in generations])

    Raises:
        ArgumentError: There is no study in the folder.
        ElibError: A file of it is damaged.
    """
    settings = settings_of(folder)
    lines, _ = read_lines(folder / GENERATIONS)
    return settings, [_generation(line, k, folder, settings) for k, line in enumerate(lines, start=1)]


def settings_of(folder: Path) -> Settings:
    """Return the settings of the study in a folder.

    Raises:
        ArgumentError: There is no study, or its settings are damaged.
    """
    if not (folder / SETTINGS).is_file():
        raise ArgumentError(f"there is no study in {folder}", hint=f"a study has a file {SETTINGS}")
    known = {each.name for each in fields(Settings)}
    given: dict[str, Any] = {name: value for name, value in _read(folder)["settings"].items() if name in known}
    if "task" not in given:
        raise ArgumentError(f"{folder / SETTINGS} names no task", hint="put back a copy of the file")
    return Settings(**given)


def _read(folder: Path) -> dict[str, dict[str, Any]]:
    path = folder / SETTINGS
    content = read_file(path, "the study", largest=MAX_SETTINGS)
    try:
        document = tomllib.loads(content.decode())
        if not isinstance(document.get("settings"), dict):
            raise ValueError("it has no table [settings]")
    except ValueError as error:
        raise ArgumentError(f"{path} is damaged: {error}", hint="put back a copy of the file") from None
    return document


def _toml(document: Mapping[str, Mapping[str, object]]) -> str:
    parts = ["# A study of elib evolve: everything that decides its result. The same command goes on with it."]
    for name, table in document.items():
        if table:
            lines = [f"{key if key.isidentifier() else _value(key)} = {_value(value)}" for key, value in table.items()]
            parts.append("\n".join([f"[{name}]", *lines]))
    return "\n\n".join(parts) + "\n"


def _value(value: object) -> str:
    """Return a text or a number: what JSON writes of it is TOML too, unless it escapes the letters."""
    return json.dumps(value, ensure_ascii=False)


def _compare(folder: Path, there: Mapping[str, Mapping[str, Any]], now: Mapping[str, Mapping[str, Any]]) -> None:
    """Check that a study may go on."""
    settings = {**now["settings"], NOT_COMPARED: there["settings"].get(NOT_COMPARED)}
    before, after = there.get("sources", {}), now.get("sources", {})
    differences = differences_of(there["settings"], settings, elib=there.get("versions", {}).get("elib"))
    differences += [f"{file} was changed" for file in before if file in after and before[file] != after[file]]
    if differences:
        raise ArgumentError(
            f"{folder} holds a study that differs: {'; '.join(differences)}",
            hint="choose another folder with --out, or give what the study began with",
        )


def _generation(line: Mapping[str, Any], number: int, folder: Path, settings: Settings) -> Generation:
    count = settings.population
    try:
        found = Generation(**line)
        if found.generation == number and {len(found.fitness), len(found.left), len(found.right)} == {count}:
            return found
    except TypeError:  # other keys
        pass
    raise ElibError(
        f"{folder / GENERATIONS}:{number}: this is not generation {number} of {count} individuals",
        hint="put back a copy of the file, or delete this line and all below it: they will be done again",
    )
