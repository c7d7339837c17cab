"""The page of a study: the fitness of its generations, and the best controller so far driving in its world."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import AsyncIterator, Iterator, Sequence
from concurrent.futures import Future
from functools import partial
from itertools import count
from typing import TYPE_CHECKING

from elib.emulator.control import Control
from elib.emulator.settings import SimulationSettings
from elib.emulator.simulation import Simulation
from elib.learn.progress import Best, Progress
from elib.physics.controller import Controller
from elib.web.panel import Panel
from elib.web.server import own_address, shown

if TYPE_CHECKING:
    from elib.learn.task import Task

LOOK = 0.1
"""s between two looks for a better controller, and for the end of the one that drives."""
LEAST = 10.0
"""s that a controller drives, at least, before a better one takes its place: otherwise nobody could see what it does."""
REST = 1.0
"""s that a robot stands still at the end, so that one sees where it came to."""
CLOSING_TIME = 5.0
"""s that the page may take to close."""


@contextlib.contextmanager
def study_page(progress: Progress, place: str = "") -> Iterator[str]:
    """Serve the page of a study until the block is left, in a thread of its own: the evolution never waits for it.

    Args:
        progress: What the evolution tells of itself.
        place: ``HOST:PORT`` or ``PORT`` on this computer; empty for the first free port, port 0 for any.

    Yields:
        The page's URL.

    Raises:
        ArgumentError: *place* is not an address, or other computers could reach it.
        LinkBusy: The port is taken, or all that were tried are.
        LinkDenied: This user may not use the port.
    """
    opened: Future[str] = Future()
    loop, stop = asyncio.new_event_loop(), asyncio.Event()

    async def serve() -> None:
        async with _served(progress, place) as url:
            opened.set_result(url)
            await stop.wait()

    def run() -> None:
        try:
            with asyncio.Runner(loop_factory=lambda: loop) as runner:
                runner.run(serve())
        except Exception as error:
            if opened.done():
                raise
            opened.set_exception(error)

    thread = threading.Thread(target=run, name="elib study page", daemon=True)
    thread.start()
    url = opened.result()
    try:
        yield url
    finally:
        with contextlib.suppress(RuntimeError):  # the page has failed, and its loop is closed
            loop.call_soon_threadsafe(stop.set)
        thread.join(CLOSING_TIME)


@contextlib.asynccontextmanager
async def _served(progress: Progress, place: str) -> AsyncIterator[str]:
    address = own_address(place)
    show = Show(progress)
    showing = asyncio.create_task(show.play())
    try:
        async with shown(show.panel, address) as url:
            yield url
    finally:
        showing.cancel()
        await asyncio.wait([showing])


class Show:
    """Lets the best controllers of a study drive in the worlds of its task, one after the other, while a page is open.

    Args:
        progress: What the evolution tells of itself.

    Attributes:
        panel: What the pages show.
    """

    def __init__(self, progress: Progress) -> None:
        self.panel = Panel(study=self)
        self._watched = asyncio.Event()
        self.panel.on_visit, self.panel.on_empty = self._watched.set, self._watched.clear
        self._progress = progress
        self._chosen: int | None = None
        self._shown: Best | None = None

    def about(self) -> dict[str, object]:
        """Return what does not change."""
        task, progress = self._progress.task, self._progress
        settings = {name: str(value) for name, value in progress.settings.items()}
        return {
            "task": task.name,
            "summary": task.summary,
            "count": progress.generations,
            "seconds": task.seconds,
            "settings": settings,
        }

    def generations(self, first: int) -> Sequence[Sequence[float]]:
        """Return the fitness of each generation from *first* on."""
        return self._progress.done[first:]

    def state(self) -> dict[str, object]:
        """Return how far the study is."""
        progress = self._progress
        return {
            "bests": [(best.generation, best.fitness) for best in progress.bests],
            "left": progress.seconds_left,
            "outcome": progress.outcome,
            "chosen": self._chosen,
            "shown": None if self._shown is None else self._shown.generation,
        }

    def choose(self, number: int | None) -> None:
        """Let one of the best controllers drive; None for the newest at any time."""
        self._chosen = number

    def _wanted(self) -> Best | None:
        bests = self._progress.bests
        return None if not bests else bests[-1 if self._chosen is None else min(self._chosen, len(bests) - 1)]

    async def play(self) -> None:
        """Let one controller after the other drive."""
        rate = 1.0
        for number in count():
            await self._watched.wait()
            while (best := self._wanted()) is None:
                await asyncio.sleep(LOOK)
            life = Life(self._progress.task, self._progress.controller(best.parameters), number)
            life.simulation.set_rate(rate)
            self.panel.control = Control(life.simulation)
            self._shown, chosen = best, self._chosen
            while not (life.is_over or chosen != self._chosen or self._is_old(life, best)):
                await asyncio.sleep(LOOK)
            if life.is_over:
                await asyncio.sleep(REST)
            life.simulation.close()
            rate = life.simulation.clock.rate

    def _is_old(self, life: Life, best: Best) -> bool:
        """Return whether the page is closed, or there is a better controller and this one was seen long enough."""
        simulation = life.simulation
        is_seen = simulation.time > LEAST and not simulation.clock.is_paused
        return not self._watched.is_set() or (is_seen and self._wanted() is not best)


class Life:
    """One controller drives in one world of its task, until its time is over; it runs on the clock of the simulation.

    Args:
        task: What was learned.
        controller: Drives all robots of the world.
        number: Which life it is: it chooses the world, and the seed of starts and noise.

    Attributes:
        simulation: The world, as pages show it.
        is_over: Whether the time is over, or the task is done.
    """

    def __init__(self, task: Task, controller: Controller, number: int) -> None:
        settings = SimulationSettings(robots=task.robots, seed=number)
        scene = task.scenes[number % len(task.scenes)]
        self.simulation = Simulation(settings, is_connected=False, scene=scene)
        assert self.simulation.world is not None
        self.is_over = False
        self._task, self._controller, self._world = task, controller, self.simulation.world
        self._memory = [[0.0] * controller.memory for _ in range(task.robots)]
        self._parameters = tuple(controller.parameters.tolist())
        self._ticks = max(1, round(task.period / scene.step))
        self._decide()
        self._world.follow(self._follow)

    def _follow(self) -> None:
        """Go on after a tick."""
        if self.is_over:
            return
        world, task = self._world, self._task
        self.is_over = world.tick * world.scene.step >= task.seconds
        if task.is_over is not None:
            for sensor in task.reward_sensors:
                world.readings(sensor)
            self.is_over = self.is_over or bool(task.is_over(world.records))
        if self.is_over:
            for robot in range(world.robots):
                world.set_wheel_speeds(robot, 0.0, 0.0)
        elif world.tick % self._ticks == 0:
            self._decide()

    def _decide(self) -> None:
        """Let the controller set the wheels of every robot."""
        world = self._world
        for sensor in self._controller.sensors:
            world.readings(sensor)
        for robot, memory in enumerate(self._memory):
            view = world.records.views[robot]
            view.time, view.left, view.right = world.time, 0.0, 0.0
            self._controller.function(view, self._parameters, memory)
            world.set_step_rates(robot, view.left, view.right)


__all__ = ["Life", "Show", "study_page"]
