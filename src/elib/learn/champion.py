"""Champions: the best controllers of studies, as files ``best.toml``, and how they drive robots over a link.

::

    task = "avoid"
    controller = "recurrent"
    hidden = 0
    sensors = ["proximity"]
    period = 0.1        # s between two decisions
    top_speed = 0.1     # m/s of a wheel
    seed = 1
    generation = 62
    fitness = 0.71
    version = "0.1.0"
    parameters = [
      0.31415926535897931, -2.5,
    ]
"""

from __future__ import annotations

import contextlib
import json
import math
import os
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Final

from elib import __version__
from elib.base.body import STEPS_PER_REVOLUTION
from elib.base.errors import Unsupported
from elib.base.files import read_file, write_file
from elib.base.rules import Mistake, Number, Rule, Several, Text, Whole, check
from elib.base.tables import MAX_FILE, Table, keys_of, read_toml
from elib.base.timeofflight import unbiased
from elib.behaviours import Behaviour, BehaviourStyle, OpenAir, RunContext, react
from elib.learn.catalogue import find_task
from elib.learn.networks import Law, Network, find_controller
from elib.robot.aio import Epuck
from elib.robot.polling import polls
from elib.robot.swarms.fanout import in_parallel, raise_first
from elib.robot.swarms.swarm import Swarm
from elib.simulator.physics.body import GRAVITY
from elib.simulator.physics.controller import MAX_MEMORY
from elib.simulator.physics.records import SENSORS, SensorView
from elib.simulator.physics.task import FASTEST, Task

COMMANDS: Final = {sensor: sensor for sensor in SENSORS} | {"acceleration": "accelerometer", "rotation": "gyroscope"}
"""The command that reads each sensor."""

CHECKING: Final = 3.0
"""s for a reading before the robot moves; it is asked for again if an answer is lost."""

LATE: Final = 1.25
"""Part of the controller's period from which its decisions come too late: in that time an e-puck at 0.1 m/s drives 3 mm
farther than the controller expects."""

COUNTED: Final = 20
"""Decisions over which their time is measured."""


@dataclass(frozen=True, slots=True)
class _Names(Rule):
    def __str__(self) -> str:
        return f"a list of sensors, each one of {', '.join(SENSORS)}"

    def accept(self, value: object) -> tuple[str, ...]:
        if isinstance(value, list | tuple) and value and all(each in SENSORS for each in value):
            return tuple(value)
        raise self.refuse(value)


@dataclass(frozen=True)
class Champion:
    """A controller with its parameters, and where it comes from.

    Attributes:
        task: Name of the task that it was made for, or ``FILE.py:NAME``.
        controller: ``recurrent``, ``feedforward``, ``braitenberg``, or ``FILE.py:NAME`` for a law of the user.
        sensors: The sensors that it sees.
        parameters: As many as the network or law has.
        hidden: Number of hidden neurons of a network.
        period: Time between two decisions, s.
        top_speed: The fastest that it turns a wheel, m/s.
        seed: Seed of its study.
        generation: The generation that it is from, counted from 1; 0 if no study made it.
        fitness: Its fitness in that study.
        version: Version of elib that wrote it.
    """

    task: Annotated[str, Text(1000, example='"avoid"')]
    controller: Annotated[str, Text(1000, example='"recurrent"')]
    sensors: Annotated[tuple[str, ...], _Names(example='["proximity"]')]
    parameters: Annotated[tuple[float, ...], Several(Number(), 1, MAX_MEMORY, example="[0.5, -0.25]")]
    hidden: Annotated[int, Whole(0, 100)] = 0
    period: Annotated[float, Number(0.0001, 10, "s")] = 0.1
    top_speed: Annotated[float, Number(0.001, FASTEST, "m/s")] = 0.1
    seed: Annotated[int, Whole(0, 2**63 - 1)] = 0
    generation: Annotated[int, Whole(0, 2**63 - 1)] = 0
    fitness: Annotated[float, Number()] = 0.0
    version: Annotated[str, Text()] = __version__

    def __post_init__(self) -> None:
        given: Any = self.parameters
        object.__setattr__(self, "parameters", tuple(given.tolist() if hasattr(given, "tolist") else given))
        check(self, "the champion's ")
        size = self.network.size
        if len(self.parameters) != size:
            raise Mistake(
                f"are {len(self.parameters)} numbers, but this controller has {size}",
                path=("parameters",),
                hint="compare controller, hidden and sensors with those of the study",
            )

    @cached_property
    def network(self) -> Network | Law:
        """The network or law."""
        return find_controller(self.controller, self.sensors, hidden=self.hidden, top_speed=self.top_speed)

    def find_task(self) -> Task:
        """Return the task that it was made for.

        Raises:
            ArgumentError: There is no such task, or its file is not there.
        """
        return find_task(self.task)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it into a file, from which :func:`load_champion` reads an equal one; an existing file is replaced.

        Files of the user, such as ``my_law.py:LAW``, are named relative to the folder of this file.

        Raises:
            ArgumentError: The file cannot be written there.
            ElibError: The disk is full.
        """
        folder = Path(path).resolve().parent
        lines = ["# A controller that elib found. Run it: elib run best.toml --robot URL"]
        for entry in fields(self):
            if entry.name != "parameters":
                value = getattr(self, entry.name)
                if entry.name in ("task", "controller"):
                    value = _relative(value, folder)
                lines.append(f"{entry.name} = {json.dumps(value, ensure_ascii=False)}")  # which is TOML, too
        lines += ["parameters = [", *(f"  {number!r}," for number in self.parameters), "]", ""]
        write_file(path, "\n".join(lines).encode())

    async def drive(
        self, robot: Epuck, watch: Callable[[SensorView], object] | None = None, *, number: int = 0
    ) -> None:
        """Drive an open robot until cancelled.

        Every period it reads the sensors that the controller sees, calls the very function that ran in the physics,
        and sets the speeds. After a lost answer the robot stands still before the next decision.

        Args:
            robot: The robot.
            watch: Called after each decision with what the robot saw, and the speeds that were set.
            number: Number of the robot among several, from 0, as the control function sees it.

        Raises:
            Unsupported: The robot does not have a sensor; it has not moved.
            LinkLost: The link was lost.
        """
        await self._check(robot)
        fastest = robot.context.profile.ranges.get("wheel_speed", (-1.0, 1.0))[1]
        function = self.network.function
        parameters, memory = list(self.parameters), [0.0] * self.network.memory
        view, open_air = SensorView(number=number), OpenAir()
        began = robot.time

        async def step(link: Epuck) -> None:
            for sensor, value in (await self._read(link, open_air)).items():
                setattr(view, sensor, value)
            view.time = robot.time - began
            view.left = view.right = 0.0
            function(view, parameters, memory)
            left, right = (_turns(speed, fastest) for speed in (view.left, view.right))
            await link.set_speed(left, right)
            if watch is not None:
                watch(view)

        await react(robot, step, period=self.period)

    async def _read(self, robot: Epuck, open_air: OpenAir) -> dict[str, Any]:
        """Return what the sensors read, as the physics gives it to a controller, in as few requests as possible.

        *open_air* takes off what infrared sensors read in the open: in physics the robots are calibrated.
        """
        found: dict[str, Any] = {}
        for poll in polls([COMMANDS[sensor] for sensor in self.network.sensors], robot.context):
            answer = await robot.execute(poll.request, poll.request.timeout)
            found |= poll.readings(answer)
        if "proximity" in found:
            found["proximity"] = open_air(found["proximity"])
        return {sensor: _seen(sensor, found[COMMANDS[sensor]]) for sensor in self.network.sensors}

    async def _check(self, robot: Epuck) -> None:
        """Check that the robot has all sensors, before it moves."""
        profile = robot.context.profile
        for sensor in self.network.sensors:
            reason = profile.absent.get(COMMANDS[sensor])
            if reason is not None:
                raise Unsupported(
                    f"the controller sees {sensor}, which {profile.name} does not have: {reason}",
                    hint="use a robot that has it, or learn the task without it",
                )
        found = await self._read(robot.within(CHECKING, tries=3), OpenAir())
        if max(found.get("ground", [1])) <= 0:  # Even a hole in the floor reads more.
            raise Unsupported(
                f"the controller sees ground, but all ground sensors of {robot.name} read 0",
                hint="is the ground module plugged in? A BTcom firmware must be built for it, too",
            )

    def behaviour(self, world: str = "", watch: Callable[[SensorView], object] | None = None) -> Behaviour:
        """Return it as a behaviour that drives one robot, or several at once, each with a memory of its own.

        Args:
            world: The world of virtual robots if their URL names none, such as ``maze`` or ``soccer?robots=4``.
            watch: Called after each decision of each robot, as by :meth:`drive`.
        """

        async def drive(robots: Swarm, run: RunContext) -> None:
            numbers = {robot.name: number for number, robot in enumerate(robots)}

            async def one(robot: Epuck) -> None:
                run.state("driving")
                times: list[float] = []

                def see(view: SensorView) -> None:
                    if len(times) <= COUNTED:
                        times.append(view.time)
                        needed = (view.time - times[0]) / COUNTED
                        if len(times) > COUNTED and needed > LATE * self.period:
                            run.say(
                                f"{robot.name}: the link is slow: a decision every {needed:.2f} s, but the controller"
                                f" learned with {self.period:g} s, so it may drive worse"
                            )
                    if watch is not None:
                        watch(view)

                await self.drive(robot, see, number=numbers[robot.name])

            results = await in_parallel(robots, one, fail_fast=True)
            errors = {name: error for name, error in results.items() if isinstance(error, Exception)}
            if errors and len(robots) == 1:
                raise errors[robots[0].name]
            if errors:
                raise_first(errors)

        kind = self.controller if isinstance(self.network, Law) else f"{self.controller} network"
        doc = f"Drive by a {kind} that was learned for the task {self.task}."
        return Behaviour(
            "champion", doc, drive, style=BehaviourStyle.SWARM, world=world, reconnects=True, takes_run=True
        )


def _seen(sensor: str, reading: Any) -> Any:
    """Return a reading as the physics gives it to a controller."""
    match sensor:
        case "ground" | "microphones":
            return list(reading.counts)
        case "distance":
            return unbiased(reading.metres)  # as the physics gives it to controllers
        case "acceleration":
            left, forward, up = reading.g  # As the robot's axes lie (e-puck.md, 6).
            return [GRAVITY * forward, GRAVITY * left, GRAVITY * up]
        case "rotation":
            return reading.rad_per_s[2]
        case _:
            return list(reading)


def _turns(speed: float, fastest: float) -> float:
    """Return a wheel's speed, steps/s, as the command takes it, rev/s. The physics also cuts the fraction off."""
    if math.isnan(speed):
        return 0.0
    most = fastest * STEPS_PER_REVOLUTION
    return int(min(max(speed, -most), most)) / STEPS_PER_REVOLUTION


def _relative(name: str, folder: Path) -> str:
    """Return ``FILE.py:NAME`` with the file as it is named from *folder*; other names as they are."""
    file, _, variable = name.rpartition(":")
    if not file.endswith(".py"):
        return name
    with contextlib.suppress(ValueError):  # Windows: on another drive.
        file = os.path.relpath(file, folder)
    return f"{Path(file).as_posix()}:{variable}"


def _absolute(name: str, folder: Path) -> str:
    """Return the opposite of :func:`_relative`."""
    file, _, variable = name.rpartition(":")
    return f"{os.path.normpath(folder / file)}:{variable}" if file.endswith(".py") else name


def load_champion(path: str | os.PathLike[str]) -> Champion:
    """Read a champion from its file.

    Raises:
        ArgumentError: The file cannot be read.
        SimulationError: The file breaks a rule; the message names the file, the line, the key and a cure.
    """
    name = os.fspath(path)
    folder = Path(name).resolve().parent

    def make(**values: Any) -> Champion:
        for key in ("task", "controller"):
            values[key] = _absolute(values[key], folder)
        return Champion(**values)

    hint = "check its path; elib evolve TASK writes one into its folder"
    source, document = read_toml(
        read_file(name, "the controller", largest=MAX_FILE, hint=hint), name, "a controller's file"
    )
    top = Table("", "A controller and its parameters.", make, keys_of(Champion), is_array=False)
    champion = source.read_all(document, top, ())[""][0]
    assert isinstance(champion, Champion)
    return champion
