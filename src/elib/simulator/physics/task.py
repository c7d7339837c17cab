"""Tasks: what robots are to learn, in which worlds, and what they earn for it."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, Literal, TypeAlias

from elib.base.body import FASTEST_2, METRES_PER_STEP, step_rate
from elib.base.errors import ArgumentError
from elib.base.rules import Number, Probability, Text, Whole, check, fields_of, nearest, shown
from elib.simulator.physics.body import QUALITIES, EpuckModel
from elib.simulator.physics.defects import Defect
from elib.simulator.physics.observing import Observation
from elib.simulator.physics.records import SENSORS
from elib.simulator.physics.scene import Scene

Reward: TypeAlias = Callable[..., float]
"""What robot *i* earned in the last tick, from ``(world, i)``, or ``(world, i, memory)``."""

Ending: TypeAlias = Callable[..., bool]
"""Whether an episode is over before its time, from ``(world,)``, or ``(world, memory)``."""

Range: TypeAlias = tuple[float, float]
"""The lowest and the highest value of a number that is drawn evenly between them."""

FASTEST = step_rate(FASTEST_2, 1) * METRES_PER_STEP
"""m/s. How fast the wheels of an e-puck1 turn at most: 0.129 m/s."""


@dataclass(frozen=True, slots=True)
class Randomisation:
    """What is drawn again for each episode, evenly between a lowest and a highest value.

    What is None stays as the world's robots have it. The units are those of
    :class:`~elib.simulator.physics.body.EpuckModel`.

    Attributes:
        spread: Range of the factor on all that tells real robots from ideal ones, 0..2: 0 for ideal robots, 1 for
            typical ones.
        motor_noise: Range of the noise of each wheel's travel, 0..0.3.
        sensor_noise: Range of the factor on the noise of every sensor, 0..10.
        wheel_spread: Range of the spread of wheel radii, 0..0.1.
        axle_spread: Range of the spread of axles, 0..0.1.
        gain_spread: Range of the spread of the infrared sensors' gains, 0..0.5.
        offset_spread: Range of the spread of what the infrared sensors read in the open, counts, 0..300. It is 0 unless
            given: robots of a task are calibrated, as a real one is before it drives, so a controller sees only what is
            near.
        ambient: Range of what the infrared sensors read in the room's light, counts, 0..4095.
        latency: Range of the time from a decision until the wheels follow it, s, from 0 to the period of the task.
        defects: What may be broken in a robot.
        broken: How probable it is for each robot that one of the defects is drawn for it, 0..1. It then has that one
            for the whole episode, and nothing but its readings shows it.
    """

    spread: Range | None = None
    motor_noise: Range | None = None
    sensor_noise: Range | None = None
    wheel_spread: Range | None = None
    axle_spread: Range | None = None
    gain_spread: Range | None = None
    offset_spread: Range | None = (0.0, 0.0)
    ambient: Range | None = None
    latency: Range = (0.0, 0.0)
    defects: tuple[Defect, ...] = ()
    broken: Probability = 0.0

    def __post_init__(self) -> None:
        check(self)
        if self.broken and not self.defects:
            raise ArgumentError(
                f"robots are broken with probability {self.broken:g}, but no defect is named",
                hint='name some: defects=(Defect("proximity", (0,), stuck=300.0),)',
            )
        if self.defects and not self.broken:
            raise ArgumentError("defects are named, but no robot has one", hint="say how probable one is: broken=0.2")
        limits = {each.name: each.rule for each in fields_of(EpuckModel)}
        limits["spread"] = Number(0, max(QUALITIES.values()))
        for entry in fields(self):
            given = getattr(self, entry.name)
            if given is None or entry.name in ("defects", "broken"):
                continue
            low, high = given
            most = getattr(limits.get(entry.name), "high", math.inf)
            if not 0.0 <= low <= high <= most:
                raise ArgumentError(
                    f"the range of {entry.name} is {given}; it must be (low, high) with 0 <= low <= high <= {most}"
                )


@dataclass(frozen=True, slots=True)
class Task:
    """What robots are to learn: worlds, sensors, a reward for every tick, and how long an episode lasts.

    The reward function is called as ``reward(world, i)`` after every tick, for each robot. It reads the records of the
    world (``Records``): ``world.robots[i].x``, ``.before_x`` (one tick ago), ``.heading_x``,
    ``.left_speed`` (m/s), ``world.views[i].proximity``; and of the scene ``world.things[0].x`` (what can be pushed),
    ``world.lamps[0].x`` (lights), ``world.tones[0].x`` (sounds), and ``setting``, ``walls`` and ``discs``. It is plain
    Python that Numba compiles, like the function of a :class:`~elib.simulator.physics.controller.Controller`.

    It changes nothing but the task's memory, if there is one, which it then takes as a third argument:
    ``reward(world, i, memory)``. Each number has a name and its value at the beginning of every episode, or an array of
    such values. Those of the world are ``memory.name``, those of each robot ``memory.name[i]``. The functions
    ``is_over(world, memory)`` and those of observations may take it too. Within a tick the rewards of the robots are
    asked for in their order, and then whether the episode is over.

    Attributes:
        name: A short name, such as ``avoid``.
        summary: One sentence that says what the robots have to do.
        scenes: The worlds. Each episode draws one of them, and one of 64 sets of starts where the scene names none.
        reward: What robot i earned in the last tick.
        sensors: What a controller sees: names of fields of :class:`~elib.simulator.physics.records.SensorView`.
        reward_sensors: What the reward and the end read of the robots' views; these are sensed in every tick.
        is_over: Whether the episode ends now, before its time; None if only time ends it.
        memory: Numbers that the functions remember of the world, such as ``{"visited": [0.0] * 100}``.
        robot_memory: Numbers that they remember of each robot, such as ``{"energy": 1.0}``.
        observe: What environments show beside the sensors (:class:`~elib.simulator.physics.observing.Observation`).
        robots: How many share a world.
        fitness: What an episode's fitness is: with ``"mean"`` the sum of the rewards over the ticks of a full episode,
            with ``"sum"`` the sum of the rewards. In both, the mean over the robots.
        solved: An episode with this fitness, or more, counts as a success.
        seconds: How long an episode lasts at most, s.
        period: Time between two decisions of a controller, s: a whole number of ticks. The speeds hold in between.
        top_speed: The fastest a controller can let a wheel turn, m/s.
        randomisation: What each episode draws.
        on_board: The reward needs nothing but readings and wheel speeds, so that it can be measured on a real robot.
        source: Where the fitness comes from.
    """

    name: Annotated[str, Text()]
    summary: Annotated[str, Text()]
    scenes: tuple[Scene, ...]
    reward: Reward
    sensors: tuple[str, ...] = ("proximity",)
    reward_sensors: tuple[str, ...] = ()
    is_over: Ending | None = None
    memory: Mapping[str, Any] = field(default_factory=dict)
    robot_memory: Mapping[str, Any] = field(default_factory=dict)
    observe: tuple[Observation, ...] = ()
    robots: Annotated[int, Whole(1)] = 1
    fitness: Literal["mean", "sum"] = "mean"
    solved: float = math.inf
    seconds: Annotated[float, Number(0.001, 1e6, "s")] = 60.0
    period: Annotated[float, Number(0.0001, 10, "s")] = 0.1
    top_speed: Annotated[float, Number(0.001, FASTEST, "m/s")] = 0.1
    randomisation: Randomisation = field(default_factory=Randomisation)
    on_board: bool = False
    source: str = ""

    def __post_init__(self) -> None:
        check(self, "the task's ")
        if not self.scenes or not all(isinstance(scene, Scene) for scene in self.scenes):
            raise ArgumentError(f"task {self.name!r} has no scenes", hint="give a tuple of elib.Scene")
        for sensor in (*self.sensors, *self.reward_sensors):
            if sensor not in SENSORS:
                raise ArgumentError(
                    f"task {self.name!r}: there is no sensor {sensor!r}", hint=nearest(str(sensor), SENSORS)
                )
        if isinstance(self.observe, Observation) or not all(isinstance(each, Observation) for each in self.observe):
            raise ArgumentError(
                f"task {self.name!r}: observe is {shown(self.observe)}; it must be a tuple of observations",
                hint="such as observe=(goal(0.5, 0.5),)",
            )
        self._check_memory()
        for scene in self.scenes:
            ticks = self.period / scene.step
            if abs(ticks - round(ticks)) > 1e-6 or round(ticks) < 1:
                raise ArgumentError(
                    f"task {self.name!r}: a period of {self.period} s is not a whole number of ticks of {scene.step} s",
                    hint="choose the scene's step so that it divides the period",
                )
            if scene.step != self.scenes[0].step:
                raise ArgumentError(f"task {self.name!r}: its scenes have different steps", hint="give all the same")
        if self.decisions < 1:
            raise ArgumentError(
                f"task {self.name!r}: an episode of {self.seconds:g} s is shorter than a period, {self.period:g} s",
                hint="make the episodes longer: at least one decision is made in each",
            )
        if self.randomisation.latency[1] > self.period:
            raise ArgumentError(
                f"task {self.name!r}: a latency of {self.randomisation.latency[1]} s is longer than its period",
                hint=f"at most {self.period} s",
            )

    def _check_memory(self) -> None:
        """Check names and starts of what is remembered; arrays become lists."""
        names = [*self.memory, *self.robot_memory]
        for name in names:
            if not name.isidentifier() or name.startswith("_") or names.count(name) > 1:
                raise ArgumentError(
                    f"task {self.name!r} remembers {name!r}, which cannot be the name of a number, or is taken",
                    hint="give each number a name of its own, of letters, digits and underscores",
                )
        for option in ("memory", "robot_memory"):
            given = getattr(self, option)
            starts = {name: _start(start, f"{option}[{name!r}] of task {self.name!r}") for name, start in given.items()}
            object.__setattr__(self, option, starts)

    @property
    def step(self) -> float:
        """Length of a tick, s."""
        return self.scenes[0].step

    @property
    def ticks_a_period(self) -> int:
        """Ticks between two decisions."""
        return round(self.period / self.step)

    @property
    def decisions(self) -> int:
        """Decisions of a controller in a full episode."""
        return int(self.seconds / self.period + 1e-9)

    @property
    def ticks(self) -> int:
        """Ticks of a full episode."""
        return self.decisions * self.ticks_a_period

    @property
    def top_steps(self) -> float:
        """The fastest a controller can let a wheel turn, steps/s: the unit of control functions."""
        return self.top_speed / METRES_PER_STEP

    def __repr__(self) -> str:
        return f"<Task {self.name}: {self.summary}>"


def _start(given: Any, what: str) -> Any:
    """Return the start of what is remembered: a number, or a list, perhaps of lists."""
    import numpy as np

    with contextlib.suppress(TypeError, ValueError):  # no numbers, or rows of different lengths
        start = np.asarray(given, np.float64)
        if start.size and np.isfinite(start).all():
            return start.tolist()
    raise ArgumentError(
        f"{what} is {shown(given)}; it must be a finite number, or an array of such numbers",
        hint='such as memory={"visited": [[0.0] * 10] * 10}, robot_memory={"energy": 1.0}',
    )
