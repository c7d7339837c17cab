"""The page of a study: the fitness of its generations, and the best controller so far driving in its world."""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import AsyncIterator, Iterator, Sequence
from dataclasses import replace

from elib.base.tasks import end_tasks
from elib.learn.linked import RewardCounter
from elib.learn.progress import Best, Progress
from elib.panel.panel import WORLD, Generation, Panel, StudyAbout, StudyState
from elib.panel.server.http import own_address, served
from elib.panel.server.inthread import in_thread
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.emulator.simulation import Simulation
from elib.simulator.physics.controller import Controller
from elib.simulator.physics.task import Task

LOOK = 0.1
"""s between two looks for a better controller, and for the end of the one that drives."""
MIN_SHOWN_TIME = 10.0
"""s that a controller drives, at least, before a better one takes its place: so one sees what it does."""
REST = 1.0
"""s that a robot stands still at the end, so that one sees where it came to."""


@contextlib.contextmanager
def study_page(progress: Progress, place: str = "") -> Iterator[str]:
    """Serve the page of a study until the block is left, and yield its URL.

    It runs in a thread of its own: the evolution never waits for it. The place is ``HOST:PORT`` or ``PORT`` on this
    computer; empty for the first free port, port 0 for any.
    """

    @contextlib.asynccontextmanager
    async def opened() -> AsyncIterator[str]:
        address = own_address(place)
        show = Show(progress)
        showing = asyncio.create_task(show.play())
        try:
            async with served(show.panel, address) as server:
                yield server.url
        finally:
            await end_tasks(showing)

    with in_thread(opened) as (url, _):
        yield url


class Show:
    """Lets the best controllers drive in the worlds of their task, one after the other, while a page is open.

    Attributes:
        panel: What the pages show.
    """

    def __init__(self, progress: Progress) -> None:
        self.panel = Panel(can=WORLD, study=self)
        self._is_watched = asyncio.Event()
        self.panel.on_visit, self.panel.on_empty = self._is_watched.set, self._leave
        self._progress = progress
        self._chosen: int | None = None
        self._is_asked = False
        self._shown: Best | None = None
        self._life: Life | None = None
        self._lives = 0

    def about(self) -> StudyAbout:
        """Return what does not change."""
        task, progress = self._progress.task, self._progress
        settings = {name: str(value) for name, value in progress.settings.items()}
        return StudyAbout(task.name, task.summary, progress.generations, task.seconds, settings)

    def generations(self, first: int) -> Sequence[Generation]:
        """Return the fitness of each generation from *first* on."""
        return self._progress.done[first:]

    def state(self) -> StudyState:
        """Return how far the study is."""
        progress = self._progress
        return StudyState(
            bests=[(best.generation, best.fitness) for best in progress.bests],
            left=progress.seconds_left,
            outcome=progress.outcome,
            chosen=self._chosen,
            shown=None if self._shown is None else self._shown.generation,
        )

    def choose(self, number: int | None) -> None:
        """Let one of the best controllers drive at once; None for the newest at any time."""
        self._chosen, self._is_asked = number, True

    async def play(self) -> None:
        """Let one controller after the other drive."""
        while True:
            await self._is_watched.wait()
            bests = self._progress.bests
            if bests:
                best = bests[-1 if self._chosen is None else min(self._chosen, len(bests) - 1)]
                if self._life is None or self._is_asked or self._life.is_over or self._is_old(self._life, best):
                    self._begin(best)
            await asyncio.sleep(LOOK)

    def _is_old(self, life: Life, best: Best) -> bool:
        """Return whether another controller is the best by now, and this one was seen long enough."""
        clock = life.simulation.clock
        return best is not self._shown and life.simulation.time > MIN_SHOWN_TIME and not clock.is_paused

    def _begin(self, best: Best) -> None:
        progress, old = self._progress, self._life
        life = Life(progress.task, progress.controller(best.parameters), self._lives)
        control = self.panel.worlds[""] = Control(life.simulation)
        if old is not None:
            control.set_speed(old.simulation.clock.rate)  # as a person has set it
            old.simulation.close()
        self._life, self._shown, self._is_asked = life, best, False
        self._lives += 1

    def _leave(self) -> None:
        """Compute nothing while no page is open: the evolution needs the processor."""
        self._is_watched.clear()
        if self._life is not None:
            self._life.simulation.close()
            self._life = None


class Life:
    """One controller drives in one world of its task, until its time is over, on the clock of the simulation.

    Its number chooses the world, and the seed of starts and noise.

    Attributes:
        simulation: The world, as pages show it.
    """

    def __init__(self, task: Task, controller: Controller, number: int) -> None:
        settings = SimulationSettings(robots=task.robots, seed=number)
        scene = task.scenes[number % len(task.scenes)]
        calibrated = replace(scene, model=replace(scene.model, offset_spread=0.0))  # as in the evolution
        self.simulation = Simulation(settings, is_connected=False, scene=calibrated)
        assert self.simulation.world is not None
        self._task, self._controller, self._world = task, controller, self.simulation.world
        self._parameters = tuple(controller.parameters.tolist())
        self._memory = [[0.0] * controller.memory for _ in range(task.robots)]
        self._counter = RewardCounter(task, self._world)
        self._counter.begin()
        self._ended = math.inf
        self._decide()
        self._world.follow(self._follow)

    @property
    def is_over(self) -> bool:
        """Whether its time is over, or the task ended it, and the robots have stood still for a moment."""
        return self._world.time > self._ended + REST

    def _follow(self) -> None:
        """Go on after a tick."""
        world = self._world
        if self._ended < math.inf:
            return
        self._counter.add()
        if self._counter.is_over:
            self._ended = world.time
            for robot in range(world.robots):
                world.set_wheel_speeds(robot, 0.0, 0.0)
        elif world.tick % self._task.ticks_a_period == 0:
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
