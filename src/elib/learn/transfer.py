"""The transfer report: what a controller that learned in the simulator is worth where more of the robot is real.

The same controller runs in stages, each of which is one step nearer to a robot: physics alone, physics in which each
run draws how its robots differ, the whole chain with emulated firmware and link, robots with other sensors or wheels,
and a robot. Then one trouble after the other grows until the controller no longer does its task.

All virtual stages play the same episodes, with the same scenes, starts and seeds. So two stages do not differ by the
luck of their starts.
"""

from __future__ import annotations

import contextlib
import importlib.util
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elib.base.body import WHEEL_SPREAD
from elib.base.errors import ArgumentError, ElibError, Unsupported
from elib.base.rules import SEED, Delay, Probability, Whole, check
from elib.learn.champion import Champion
from elib.learn.executor import Executor, open_executor
from elib.learn.linked import can_be_measured, play_on_robot, play_on_wire
from elib.simulator.emulator.faultscript import load as load_script
from elib.simulator.emulator.firmware import FIRMWARES, WIFI_FIRMWARES
from elib.simulator.emulator.robotprofile import load_profile
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.physics import Episodes, EpuckModel, Randomisation, Task
from elib.simulator.physics.noise import spread_between
from elib.simulator.physics.profiles import PROFILES
from elib.simulator.worlds.writer import written_scene

BROKEN = 0.8
"""A trouble breaks a controller where its mean fitness falls below this part of that in physics."""
RESAMPLES = 10_000
"""Samples of the bootstrap. The ends of an interval then differ by about 1 % of its width from seed to seed."""
CONFIDENCE = 0.95
FIRST = SimulationSettings().firmware
ALL_FIRMWARES = (FIRST, *(name for name in (*FIRMWARES, *WIFI_FIRMWARES) if name != FIRST))
"""Every firmware, that of ``sim://`` first: links, profiles and troubles are tried on the first with the sensors."""
USUAL_DRAWS = Randomisation(
    spread=(0.5, 2.0), sensor_noise=(0.5, 2.0), motor_noise=(0.0, 0.06), offset_spread=(0.0, 20.0)
)
"""What each run of the stage *randomised* draws if the task names nothing: up to about twice what is usual."""


class Trouble(NamedTuple):
    """Something of which a robot has more than the simulator, and how much of it is tried."""

    name: str
    unit: str
    where: Literal["physics", "wire"]
    key: str  # the field of EpuckModel, or the key of sim://, that sets it
    usual: float  # how much of it a real robot has
    values: tuple[float, ...]  # what is tried, rising, up to the highest value that makes sense


# What is usual: the noise that the response profile states; the standard deviation of Enki's factor of 0.95 to 1.05 in
# each step; the wheels of typical robots; the thesis' Bluetooth link (wire-protocol.md, 5.13); the fault script
# flaky-bluetooth.
TROUBLES = (
    Trouble("sensor noise", "times", "physics", "sensor_noise", 1.0, (1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0)),
    Trouble("motor noise", "of the travel", "physics", "motor_noise", 0.03, (0.03, 0.06, 0.1, 0.15, 0.2, 0.3)),
    Trouble("wheel spread", "of the radius", "physics", "wheel_spread", WHEEL_SPREAD, (0.01, 0.02, 0.04, 0.07, 0.1)),
    Trouble("latency", "s each way", "wire", "latency", 0.01, (0.01, 0.03, 0.06, 0.12, 0.25, 0.5)),
    Trouble("loss", "of the answers", "wire", "loss", 0.02, (0.02, 0.05, 0.1, 0.2, 0.4)),
)


@dataclass(frozen=True, slots=True)
class StageResult:
    """What came of the runs of one stage."""

    name: str  # such as "wire asercom-1.2.2"
    about: str  # what differs from the stage before, in a sentence
    runs: int  # how many runs there were
    seeds: tuple[int, ...] = ()  # the seed of each run; empty on a robot
    fitness: tuple[float, ...] = ()  # the fitness of each run; empty where it cannot be measured
    is_solved: tuple[bool, ...] = ()  # whether each run reached the fitness that the task counts as a success
    lost: int = 0  # how many runs ended because the link failed for good
    interval: tuple[float, float] = (math.nan, math.nan)  # 95 % confidence interval of the mean fitness, by bootstrap
    # mean fitness over that in physics; nan if there is none, or that in physics is not above 0
    ratio: float = math.nan
    # 95 % confidence interval of the ratio. Runs with the same seed are drawn together.
    ratio_interval: tuple[float, float] = (math.nan, math.nan)

    @property
    def mean(self) -> float:
        """Mean fitness of the runs; nan where it cannot be measured."""
        return math.fsum(self.fitness) / len(self.fitness) if self.fitness else math.nan

    @property
    def solved(self) -> int:
        """How many runs were a success."""
        return sum(self.is_solved)


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """How the fitness falls as one trouble grows."""

    trouble: Trouble
    values: tuple[float, ...]  # the value of each stage. The first one is what the worlds of the task have.
    stages: tuple[StageResult, ...]  # a stage for each value
    # where the mean fitness falls below 80 % of that in physics, interpolated between two values that were tried;
    # infinite if it never does, 0 if it is below already without the trouble
    limit: float

    @property
    def margin(self) -> float:
        """The limit, as so many times what a real robot has: the smaller, the more fragile is the controller."""
        return self.limit / self.trouble.usual

    @property
    def text(self) -> str:
        """What it says, as a sentence."""
        each, limit = self.trouble, self.limit
        if math.isinf(limit):
            return f"{each.name}: not broken by {self.values[-1]:g} {each.unit}, the most that was tried"
        if limit == 0.0:
            return f"{each.name}: below {100 * BROKEN:.0f} % of physics already without it"
        how = f"from {limit:.2g} {each.unit} on, {self.margin:.2g} x usual"
        return f"{each.name}: below {100 * BROKEN:.0f} % of physics {how}"


@dataclass(frozen=True, slots=True)
class TransferReport:
    """All stages of a transfer report, and what breaks the controller."""

    task: str
    seed: int
    stages: tuple[StageResult, ...]  # in the order in which they ran; physics is the first one
    sensitivities: tuple[Sensitivity, ...] = ()  # one for each trouble, the most fragile first
    left_out: tuple[str, ...] = ()  # stages that could not run, each with the reason


@dataclass(frozen=True, slots=True, kw_only=True)
class TransferPlan:
    """What a transfer report tries.

    Attributes:
        runs: Runs of each stage.
        seed: The seed that the seeds of all runs are made of.
        firmwares: The firmwares of the wire stages; those without the controller's sensors are left out.
        latency: Delay each way of the poor link, s.
        jitter: Standard deviation of that delay, s.
        loss: Probability that the poor link loses an answer.
        profiles: Other robots: names of response profiles, and files of robot profiles. None: all response profiles.
        faults: Fault scripts under which the whole chain is tried too, by name or file.
        sensitivity: Whether to look for what breaks the controller.
        robot: URL of a robot to run on, or None.
        robot_runs: Runs on the robot.
        engine: The engine of the physics; the result does not depend on it.

    Raises:
        ArgumentError: A number is out of its range, or there is no such profile.
    """

    runs: Annotated[int, Whole(1, 10_000)] = 20
    seed: Annotated[int, SEED] = 0
    firmwares: Sequence[str] = ALL_FIRMWARES
    latency: Delay = 0.05
    jitter: Delay = 0.01
    loss: Probability = 0.02
    profiles: Sequence[str] | None = None
    faults: Sequence[str] = ()
    sensitivity: bool = True
    robot: str | None = None
    robot_runs: Annotated[int, Whole(1, 1_000)] = 5
    engine: Literal["compiled", "interpreted"] | None = None

    def __post_init__(self) -> None:
        check(self)
        for name in self.profiles or ():
            if name not in PROFILES:
                if not name.endswith(".toml"):
                    hint = f"choose one of {', '.join(PROFILES)}, or a file that elib fit wrote, .toml"
                    raise ArgumentError(f"there is no robot profile {name!r}", hint=hint)
                load_profile(name)
        for name in self.faults:
            load_script(name)


def bootstrap(
    values: Sequence[float], reference: Sequence[float] | None = None, *, paired: bool = True, seed: int = 0
) -> tuple[float, float]:
    """Return the 95 % confidence interval of a mean, or of its ratio to that of *reference*: bootstrap percentiles.

    Runs are drawn together with their reference if both had the same seeds, *paired*. Both ends are nan for fewer than
    two runs, or where a mean to divide by is not above 0.
    """
    if len(values) < 2 or (reference is not None and len(reference) < 2):
        return math.nan, math.nan
    draws = np.random.default_rng(seed)
    chosen = draws.integers(0, len(values), (RESAMPLES, len(values)))
    means: NDArray[np.float64] = np.asarray(values, float)[chosen].mean(axis=1)
    if reference is not None:
        if not paired:
            chosen = draws.integers(0, len(reference), (RESAMPLES, len(reference)))
        below = np.asarray(reference, float)[chosen].mean(axis=1)
        if not (below > 0.0).all():
            return math.nan, math.nan
        means = means / below
    low, high = np.quantile(means, ((1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2))
    return float(low), float(high)


def transfer(
    champion: Champion,
    plan: TransferPlan | None = None,
    *,
    executor: Executor | None = None,
    progress: Callable[[str], object] = lambda text: None,
    ask: Callable[[str], object] | None = None,
) -> TransferReport:
    """Run a controller in stages from physics to a robot, and look for what breaks it.

    Args:
        champion: The controller and its task.
        plan: What to try.
        executor: What runs the episodes on the wire; this process unless given. The report does not depend on it.
        progress: Called with the name of each stage before it runs.
        ask: Called with a request to the person beside the robot before each run on it, and returns when that is done;
            None asks nothing.

    Raises:
        ArgumentError: The robot cannot run the task.
        ElibError: The robot could not be reached, or was lost.
    """
    plan = plan or TransferPlan()
    task = champion.find_task()
    if plan.robot is not None and task.robots > 1:
        raise ArgumentError(
            f"task {task.name!r} has {task.robots} robots; it cannot be measured on one",
            hint="leave --robot out",
        )
    with contextlib.nullcontext(executor) if executor is not None else open_executor() as runs:
        return _Transfer(champion, plan, runs, progress).report(ask)


class _Stage(NamedTuple):
    """A stage that runs in the simulator, with all seeds: in physics alone if it has a task, or else on the wire."""

    name: str
    about: str
    task: Task | None = None
    firmware: str = ""
    keys: Mapping[str, object] = {}


class _Transfer:
    """A sweep of one controller over stages: each is a task in physics, or keys of ``sim://`` on the wire."""

    def __init__(
        self, champion: Champion, plan: TransferPlan, executor: Executor, progress: Callable[[str], object]
    ) -> None:
        self.champion, self.plan, self.executor, self.progress = champion, plan, executor, progress
        self.learned = champion.find_task()
        alike = replace(self.learned, randomisation=Randomisation())
        self.task = changed(alike, partial(replace, quality="ideal"))
        self.engine = plan.engine or ("compiled" if importlib.util.find_spec("numba") else "interpreted")
        # Small enough to be read aloud and typed again, and far from the small seeds that people train with.
        draws = np.random.default_rng(plan.seed)
        self.seeds = tuple(int(seed) for seed in draws.choice(2**31, plan.runs, replace=False))
        self.worlds = list(self._worlds(alike))
        self.stages: list[StageResult] = []
        self.left_out: list[str] = []

    def report(self, ask: Callable[[str], object] | None) -> TransferReport:
        """Run all stages; first those on the robot, whose person then need not wait for the others."""
        plan = self.plan
        on_robot = [] if plan.robot is None else self._runs_on_robot(plan.robot, ask)
        for stage in self._physics():
            self._run(stage)
        about = "the whole chain with this firmware, typical robots, on a quiet link"
        working = [name for name in plan.firmwares if self._run(_Stage(f"wire {name}", about, firmware=name))]
        firmware = working[0] if working else ""
        for stage in self._others(firmware):
            self._run(stage)
        if plan.robot is not None and can_be_measured(self.champion):
            self.stages.append(self._stage("robot", plan.robot, on_robot, on_robot=True))
        elif plan.robot is not None:
            why = "the reward needs more than wheel speeds and what the controller sees: it is not measured"
            self.stages.append(StageResult("robot", f"{plan.robot}; {why}", len(on_robot)))
        found = self._sensitivities(firmware) if plan.sensitivity else []
        return TransferReport(self.task.name, plan.seed, tuple(self.stages), tuple(found), tuple(self.left_out))

    def _worlds(self, task: Task) -> Iterator[str]:
        """Yield the world of each seed's episode, with the robots at their starts, as the text of a world file."""
        episodes = Episodes(task, engine="interpreted")
        for seed in self.seeds:
            episodes.reset(seed)
            world = episodes.world(0)
            # What a world says of its robots' firmware would override what the stage says.
            yield written_scene(replace(world.scene, starts=tuple(world.poses), firmware=(), name=task.name))

    def _physics(self) -> Iterator[_Stage]:
        yield _Stage("physics", "physics alone; all robots are alike", self.task)
        learned = self.learned.randomisation
        draws, whose = (USUAL_DRAWS, "usual") if learned == Randomisation() else (learned, "the task's")
        about = f"physics; each run draws {whose} differences between robots"
        yield _Stage("randomised", about, replace(self.task, randomisation=draws))

    def _others(self, firmware: str) -> Iterator[_Stage]:
        """Yield a poor link, and other robots: response profiles in physics, files, which say more, on the wire."""
        plan = self.plan
        if firmware:
            poor = {"latency": plan.latency, "jitter": plan.jitter, "loss": plan.loss}
            about = f"{plan.latency * 1000:g} ms each way ± {plan.jitter * 1000:g} ms, {plan.loss:.1%} of answers lost"
            yield _Stage("poor link", f"{firmware}, {about}", firmware=firmware, keys=poor)
        own = {scene.model.profile for scene in self.task.scenes}
        for name in [name for name in PROFILES if own != {name}] if plan.profiles is None else plan.profiles:
            if name in PROFILES:
                task = changed(self.task, partial(replace, profile=name))
                yield _Stage(f"profile {name}", f"physics, infrared sensors: {PROFILES[name].source}", task)
            elif firmware:
                about = f"{firmware}, the robot of {name}"
                yield _Stage(f"profile {Path(name).stem}", about, firmware=firmware, keys={"profile": name})
        for name in plan.faults if firmware else ():
            about = f"{firmware}, under the fault script {name}"
            yield _Stage(f"fault {Path(name).stem}", about, firmware=firmware, keys={"fault": name})

    def _run(self, stage: _Stage) -> bool:
        """Run a stage of the report; return whether that is possible."""
        try:
            self.stages.append(self._result(stage))
        except Unsupported as error:
            cause = error.__cause__
            self.left_out.append(f"{stage.name}: {cause.message if isinstance(cause, ElibError) else error.message}")
            return False
        return True

    def _result(self, stage: _Stage) -> StageResult:
        """Run a stage; Unsupported if its firmware does not have the sensors of the controller."""
        self.progress(stage.name)
        champion = self.champion
        if stage.task is not None:
            controller = champion.network.controller(champion.parameters)
            scores = Episodes(stage.task, engine=self.engine).play(controller, [champion.parameters], self.seeds)
            return self._stage(stage.name, stage.about, scores.fitness[0].tolist())
        keys = {"robots": self.task.robots, "firmware": stage.firmware, **stage.keys}
        each = zip(self.seeds, self.worlds, strict=True)
        jobs = [(champion, world, {"seed": seed, **keys}) for seed, world in each]
        found = dict(self.executor.run(play_on_wire, jobs))
        fitness, is_lost = zip(*(found[k] for k in range(len(jobs))), strict=True)
        return replace(self._stage(stage.name, stage.about, fitness), lost=sum(is_lost))

    def _stage(self, name: str, about: str, fitness: Sequence[float], *, on_robot: bool = False) -> StageResult:
        """Return the stage that these runs make."""
        base = self.stages[0].fitness if self.stages else tuple(fitness)
        mean, below = math.fsum(fitness) / len(fitness), math.fsum(base) / len(base)
        seed = self.plan.seed
        return StageResult(
            name,
            about,
            len(fitness),
            () if on_robot else self.seeds,
            tuple(fitness),
            tuple(each >= self.task.solved for each in fitness),
            interval=bootstrap(fitness, seed=seed),
            ratio=mean / below if below > 0.0 else math.nan,
            ratio_interval=bootstrap(fitness, base, paired=not on_robot, seed=seed),
        )

    def _sensitivities(self, firmware: str) -> list[Sensitivity]:
        """Look for what breaks the controller; return the most fragile first."""
        if self.stages[0].mean <= 0.0:
            self.left_out.append("what breaks it: its mean fitness in physics is not above 0")
            return []
        found = [self._sensitivity(each, firmware) for each in TROUBLES if each.where == "physics" or firmware]
        return sorted(found, key=lambda each: (each.margin, each.stages[-1].mean))

    def _sensitivity(self, trouble: Trouble, firmware: str) -> Sensitivity:
        """Let one trouble grow until the controller is broken, or to the end of its range."""
        name, unit, where, key, _, tried = trouble
        physics = self.stages[0]
        if where == "physics":
            begin, first = min(_of(scene.model, key) for scene in self.task.scenes), physics
        else:
            begin, first = 0.0, next(stage for stage in self.stages if stage.name == f"wire {firmware}")
        values, stages, least = [begin], [first], BROKEN * physics.mean
        for value in tried:
            if value <= begin or stages[-1].mean < least:
                continue
            stage = _Stage(f"{name} {value:g}", f"{value:g} {unit}", firmware=firmware, keys={key: value})
            if where == "physics":
                task = changed(self.task, partial(_with_at_least, key=key, value=value))
                stage = stage._replace(task=task)
            values.append(value)
            stages.append(self._result(stage))
        limit = crossing(values, [stage.mean for stage in stages], least)
        return Sensitivity(trouble, tuple(values), tuple(stages), limit)

    def _runs_on_robot(self, url: str, ask: Callable[[str], object] | None) -> list[float]:
        """Return the fitness of each run on the robot, which stands still before, between and after them."""
        fitness = []
        count = self.plan.robot_runs
        for number in range(1, count + 1):
            self.progress(f"robot, run {number} of {count}")
            if ask is not None:
                ask(f"Run {number} of {count}: put the robot at a start.")
            fitness.append(play_on_robot(self.champion, url))
        return fitness


def changed(task: Task, change: Callable[[EpuckModel], EpuckModel]) -> Task:
    """Return a task whose robots are of another model."""
    return replace(task, scenes=tuple(replace(scene, model=change(scene.model)) for scene in task.scenes))


def _with_at_least(model: EpuckModel, key: str, value: float) -> EpuckModel:
    return replace(model, **{key: max(value, _of(model, key))})  # type: ignore[arg-type]


def _of(model: EpuckModel, key: str) -> float:
    """Return what robots have of a trouble: where the world does not say it, by their quality."""
    return spread_between(model.spread, model.given(key), WHEEL_SPREAD)


def crossing(values: Sequence[float], means: Sequence[float], least: float) -> float:
    """Return where the line through the points falls below *least*: 0 if it begins there, infinite if it never does."""
    if means[0] < least:
        return 0.0
    for (low, above), (high, below) in pairwise(zip(values, means, strict=True)):
        if below < least:
            return low + (high - low) * (above - least) / (above - below)
    return math.inf
