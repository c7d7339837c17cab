"""Episodes of a task through firmware and link: with virtual robots, whose world is measured, and on a robot."""

from __future__ import annotations

import asyncio
import math
import tempfile
from collections.abc import Coroutine, Iterator, Mapping, Sequence
from contextlib import AsyncExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from elib.base.body import METRES_PER_STEP, step_rate
from elib.base.errors import ArgumentError, ElibError, Unsupported
from elib.base.files import write_file
from elib.behaviours import Behaviour, RunContext
from elib.learn.champion import Champion
from elib.link.transport.url import Url
from elib.robot.aio import Epuck
from elib.robot.link import Link, LinkSettings
from elib.robot.runner import run_on
from elib.robot.running import run_coroutine
from elib.robot.swarms.swarm import Swarm
from elib.robot.watchdog import is_supported
from elib.simulator.emulator.sim_transport import SimTransport, robots_of
from elib.simulator.physics import Records, SensorView, Task, World
from elib.simulator.physics.judging import Judgement
from elib.simulator.physics.records import Robot, Setting
from elib.simulator.worlds.writer import written_scene
from elib.testing import world_of

GRACE = 10.0
"""s that a robot whose answers are lost may take longer to begin an episode, or to end it."""


def play_on_wire(champion: Champion, world: str, keys: Mapping[str, object]) -> tuple[float, bool]:
    """Play an episode with virtual robots that are driven through their firmwares and links.

    The world is the text of a world file, and the keys are those of a ``sim://`` URL.

    Returns:
        The fitness, by the task's own reward in the virtual world; and whether a link failed for good. Its robot then
        kept its speeds, and the others went on.
    """
    with tempfile.TemporaryDirectory(prefix="elib-") as folder:
        path = Path(folder, "world.toml")
        write_file(path, world.encode())
        url = Url("sim", str(path), (("speed", "max"), *((key, str(value)) for key, value in keys.items())))
        return run_coroutine(lambda: _episode(champion, url), "max")


async def _episode(champion: Champion, url: Url) -> tuple[float, bool]:
    task = champion.find_task()
    async with AsyncExitStack() as stack:
        robots = []
        for own in robots_of(url):
            # A virtual robot ends with its world: a stop that the link loses would be reported for nothing.
            link = Link(str(own), settings=LinkSettings(keep_moving=True))
            try:
                robots.append(await stack.enter_async_context(Epuck(link)))
            except ElibError as error:
                if is_of_link(error):  # A link may be so poor that it cannot even be opened.
                    return 0.0, True
                raise
        transport = robots[0].session.transport
        assert isinstance(transport, SimTransport)
        simulation = transport.simulation
        assert simulation.world is not None
        simulation.catch_up()
        counter = RewardCounter(task, simulation.world)
        stack.callback(simulation.world.follow(counter.add))
        drives = [
            asyncio.ensure_future(champion.drive(robot, counter.begin, number=i)) for i, robot in enumerate(robots)
        ]
        latest = simulation.time + GRACE
        try:
            while not counter.is_over and all(map(is_of_link, ended(drives))):
                if simulation.time > latest or len(ended(drives)) == len(drives):
                    counter.begin()  # If no robot can decide anything, the episode passes without them.
                await asyncio.sleep(task.period)
                simulation.catch_up()
        finally:
            errors = ended(drives)
            for drive in drives:
                drive.cancel()
            await asyncio.gather(*drives, return_exceptions=True)
        for each in errors:
            if not is_of_link(each):
                raise each
        return counter.fitness, bool(errors)


def ended(drives: Sequence[asyncio.Future[None]]) -> list[BaseException]:
    """Return the errors of those that ended."""
    return [error for drive in drives if drive.done() and (error := drive.exception()) is not None]


def is_of_link(error: BaseException) -> bool:
    """Return whether the link failed, and not the program, or what it asked for."""
    return isinstance(error, ElibError) and not isinstance(error, ArgumentError | Unsupported)


@contextmanager
def one_episode(champion: Champion, scene: int = 1, seed: int | None = None) -> Iterator[Behaviour]:
    """Yield a champion as a behaviour whose virtual robots live in a world of its task, for one episode.

    The run ends with the episode, and says its fitness. Robots that are somewhere else are driven without an end.

    Args:
        champion: The controller.
        scene: Which world of the task, from 1.
        seed: The seed of starts, robots and noise; None for that of the world.

    Raises:
        ArgumentError: There is no such task or world, or its file is not there.
    """
    task = champion.find_task()
    if not 1 <= scene <= len(task.scenes):
        names = ", ".join(each.name for each in task.scenes)
        there = f"{task.name} has the worlds 1 to {len(task.scenes)}: {names}"
        raise ArgumentError(f"there is no world {scene}", hint=there)
    with tempfile.TemporaryDirectory(prefix="elib-") as folder:
        path = Path(folder, "world.toml")
        path.write_text(written_scene(task.scenes[scene - 1], task.summary), "utf-8")
        begun = asyncio.Event()
        keys = f"robots={task.robots}" + ("" if seed is None else f"&seed={seed}")
        inner = champion.behaviour(f"{path.as_posix()}?{keys}", lambda view: begun.set())

        async def drive(robots: Swarm, run: RunContext) -> None:
            driven = cast("Coroutine[Any, Any, None]", inner.function(robots, run))
            if path.as_posix() not in robots[0].url:
                await driven
                return
            counter, over = RewardCounter(task, world_of(robots[0])), asyncio.Event()

            def add() -> None:
                counter.is_begun = begun.is_set()
                counter.add()
                if counter.is_over:
                    over.set()

            undo = world_of(robots[0]).follow(add)
            both = [asyncio.ensure_future(driven), asyncio.ensure_future(over.wait())]
            try:
                done, _ = await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
            finally:
                undo()
                for each in both:
                    each.cancel()
                await asyncio.gather(*both, return_exceptions=True)
            for each in done:
                each.result()  # the error that ended the drive
            run.say(counter.told())

        yield replace(inner, function=drive)


class RewardCounter:
    """Adds up what the robots of a world earn for a task, tick by tick, up to the end of the episode.

    Ticks count from the first decision of a robot on, as in physics.
    """

    def __init__(self, task: Task, world: World) -> None:
        self.is_begun = self.is_over = False
        self._task = task
        self._world = world
        self._judgement = Judgement(task)
        self._ticks = 0
        self._earned = 0.0

    def begin(self, _: object = None) -> None:
        """Begin to count, unless it has begun."""
        self.is_begun = True

    def add(self) -> None:
        """Add what the robots earned in the last tick."""
        if self.is_over or not self.is_begun:
            return
        task, world = self._task, self._world
        for sensor in task.reward_sensors:
            world.readings(sensor)
        with _calibrated(world.records):
            for i in range(task.robots):
                self._earned += self._judgement.reward(world.records, i)
        self._ticks += 1
        self.is_over = self._ticks == task.ticks or self._judgement.is_over(world.records)

    def told(self) -> str:
        """Return the fitness of the episode in words, and whether that is enough."""
        goal = self._task.solved
        judged = f", {'solved' if self.fitness >= goal else 'not solved'} (from {goal:g} on)" if goal < math.inf else ""
        return f"fitness {self.fitness:.4g}{judged}"

    @property
    def fitness(self) -> float:
        """The fitness of the episode so far, as :meth:`~elib.simulator.physics.Episodes.play` counts it."""
        scale = 1 / self._task.ticks if self._task.fitness == "mean" else 1.0
        return self._earned * scale / self._task.robots


@contextmanager
def _calibrated(world: Records) -> Iterator[None]:
    """Let a world's infrared sensors have read what they do in physics, where the robots of a task are calibrated."""
    read = [list(view.proximity) for view in world.views]
    for robot, view in zip(world.robots, world.views, strict=True):
        for s, offset in enumerate(robot.offset):
            view.proximity[s] = max(view.proximity[s] - round(offset), 0)
    yield
    for raw, view in zip(read, world.views, strict=True):
        for s, counts in enumerate(raw):
            view.proximity[s] = counts


def can_be_measured(champion: Champion) -> bool:
    """Return whether the readings that the controller sees, and its speeds, are enough for the task's reward."""
    task = champion.find_task()
    return task.on_board and set(task.reward_sensors) <= set(champion.network.sensors)


def play_on_robot(champion: Champion, url: str) -> float:
    """Drive a robot for an episode; it is stopped at the end, whatever happens.

    The reward of a tick is that of the last readings and of the speeds that led to them. It counts for the time between
    two decisions, which on a slow link is longer than the period of the task.

    Returns:
        The fitness; nan if it cannot be measured.

    Raises:
        ElibError: The robot could not be reached, was lost, or does not have a sensor of the controller.
    """
    task = champion.find_task()
    here, view = Robot(), SensorView()
    parts = {"setting": [Setting(step=task.step)], "robots": [here], "views": [view]}
    records = Records(**dict.fromkeys(Records._fields, ()) | parts)  # type: ignore[arg-type]
    generation = task.scenes[0].model.generation
    is_measured, judgement, earned = can_be_measured(champion), Judgement(task), 0.0

    async def main(robot: Epuck) -> None:
        began = before = math.nan

        def watch(seen: SensorView) -> None:
            nonlocal began, before, earned
            now = robot.time
            if math.isnan(began):
                began = now
            elif is_measured:
                for sensor in champion.network.sensors:
                    setattr(view, sensor, getattr(seen, sensor))
                earned += judgement.reward(records, 0) * (min(now, began + task.seconds) - before) / task.step
                if judgement.is_over(records):
                    drive.cancel()
            if now >= began + task.seconds:
                drive.cancel()
            before = now
            here.left_speed = step_rate(seen.left, generation) * METRES_PER_STEP
            here.right_speed = step_rate(seen.right, generation) * METRES_PER_STEP

        drive = asyncio.ensure_future(champion.drive(robot, watch))
        try:
            await asyncio.wait([drive], timeout=task.seconds + GRACE)
        finally:
            drive.cancel()
            with suppress(asyncio.CancelledError):
                await drive

    run_on(url, main, watchdog=is_supported())
    if not is_measured:
        return math.nan
    return earned / task.ticks if task.fitness == "mean" else earned
