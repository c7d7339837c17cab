"""Episodes of a task: many worlds in one compiled call, each with rewards, an end, and conditions that are drawn.

All worlds lie in one memory (:class:`Packed`), so that one call runs them all and no Python runs for each of them. A
world begins again by copying its scene as it was laid out, whichever of the task's scenes its episode draws.
"""

from __future__ import annotations

import concurrent.futures
import copy
import math
import os
import traceback
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from functools import cached_property, partial
from pathlib import Path
from types import FunctionType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from elib.base.errors import ArgumentError
from elib.base.rules import Whole, nearest
from elib.simulator.physics.controller import Controller
from elib.simulator.physics.course import Course, Judge, Kept, begin_worlds, play_episodes, step_worlds
from elib.simulator.physics.engine import INTERPRETED, EngineName, explained
from elib.simulator.physics.geometry import unit
from elib.simulator.physics.judging import (
    Judgement,
    judge_of,
    observed_count,
    observer_of,
    shape_of,
    start_of,
    takes_memory,
)
from elib.simulator.physics.noise import seed_key
from elib.simulator.physics.packing import laid_out, room_for, world_at
from elib.simulator.physics.placement import places
from elib.simulator.physics.records import SENSORS, Episode, Records, SensorView
from elib.simulator.physics.scene import Scene, check_seed
from elib.simulator.physics.sensors import chosen
from elib.simulator.physics.simulation import law_of
from elib.simulator.physics.task import Task
from elib.simulator.physics.usage import constants_of, fields_read
from elib.simulator.physics.world import World

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

STARTS = 64
"""Sets of places where the robots of a scene may start, if the scene does not name them."""

DRAWN: Final = (
    "motor_noise",
    "sensor_noise",
    "wheel_spread",
    "axle_spread",
    "gain_spread",
    "offset_spread",
    "ambient",
    "spread",
)
"""What an episode draws for the setting of its world, in the order of its ranges; the latency is the last one."""

COUNTED = ("walls", "discs", "things", "lamps", "tones", "zones")
"""Records of which scenes may have different numbers, and which a reward may read by their place."""

REMEMBERED: Final = 'Task(memory={"visited": [0.0] * 100}, robot_memory={"energy": 1.0}), reward(world, i, memory)'
"""How a task says what its functions remember, for hints."""

SMALL = 2_000
"""Robot-ticks of a call below which threads cost more than they save."""


class Scores(NamedTuple):
    """What came of episodes.

    Attributes:
        fitness: The fitness of each individual with each seed, (individuals, seeds).
        steps: Steps of the left and the right motor at the end, mean over the robots, (individuals, seeds, 2).
    """

    fitness: NDArray[np.float64]
    steps: NDArray[np.float64]


class Episodes:
    """Worlds in which episodes of a task run: steered from outside, :meth:`step`, or by controllers, :meth:`play`.

    The same seed gives the same episode to the last bit, on either engine and with any number of threads.

    Attributes:
        task: The task.
        count: How many worlds there are for :meth:`step`.
        threads: How many run at once.
    """

    def __init__(
        self,
        task: Task,
        count: int = 1,
        *,
        seed: int = 0,
        engine: EngineName = "compiled",
        threads: int | None = None,
    ) -> None:
        """Set up the worlds, each at the beginning of an episode.

        Args:
            task: The task.
            count: How many worlds, 1 or more.
            seed: World k begins with the seed *seed* + k.
            engine: ``"compiled"``, which needs the extra ``compiled``, or ``"interpreted"``, in which a reward function
                can be debugged.
            threads: How many worlds run at once, 1 or more; None means one a core.

        Raises:
            ArgumentError: A number is out of its range, or a function of the task fails.
            SimulationError: There is no room for the robots, or Numba is not installed.
        """
        self.task = task
        self.count = Whole(1).require(count, "the number of worlds")
        self.threads = (os.cpu_count() or 1) if threads is None else Whole(1).require(threads, "threads")
        if engine == "interpreted":
            self.threads = 1
        self._models = [World(scene, robots=task.robots, engine=engine) for scene in task.scenes]
        self._engine = self._models[0]._state.engine  # noqa: SLF001  # of one package
        self._check_functions()
        self._scenes = self._lay_out_scenes()
        self._seed = check_seed(seed)
        self._pool: tuple[int, concurrent.futures.ThreadPoolExecutor] | None = None

    @cached_property
    def _steered(self) -> Course:
        """The worlds for :meth:`step`: laid out when they are first asked for, because :meth:`play` needs none."""
        course = self._course(self.count, 0)
        self._begin(course, self._engine.kept(course), self._seed, range(self.count))
        return course

    @cached_property
    def _kept(self) -> Kept:
        """The same in the short form for kernels."""
        return self._engine.kept(self._steered)

    def reset(self, seed: int | None = 0, which: Sequence[int] | None = None) -> None:
        """Begin the first episodes of other seeds, or the next episodes.

        Args:
            seed: World k gets the seed *seed* + k, modulo 2**64. None begins the episode that :meth:`step` would begin
                next, also where one has not ended.
            which: Numbers of the worlds that begin again; None means all.

        Raises:
            ArgumentError: *seed* is out of its range, or there is no such world.
        """
        worlds = range(self.count)
        # Compiled code does not check an index.
        chosen = (
            worlds if which is None else [Whole(0, self.count - 1).require(w, "the number of a world") for w in which]
        )
        self._begin(self._steered, self._kept, seed, chosen)

    def _begin(self, course: Course, kept: Kept, seed: int | None, which: Sequence[int]) -> None:
        if seed is not None:
            first = check_seed(seed)
            for w in which:
                course.episodes[w].key = _episode_key(first + w)
        self._engine.ready(begin_worlds)(self._observer, kept, self._engine.ints(which), int(seed is None))

    def step(self, actions: ArrayLike, *, begin_again: bool = True) -> NDArray[np.float64]:
        """Let one period pass in every world.

        A world whose episode had ended before this call begins the next one instead, and its robots earn 0.

        Args:
            actions: Speeds of the left and the right wheel of each robot, m/s, of shape (worlds, robots, 2). They are
                limited to the task's top speed; what is not a number stands for 0.
            begin_again: Whether worlds whose episodes have ended begin again; otherwise they stand still.

        Returns:
            What each robot earned, (worlds, robots).
        """
        import numpy as np

        given = np.asarray(actions, dtype=np.float64).reshape(self.count, self.task.robots, 2)
        kernel, how, cuts = self._stepping
        table, begins = self._engine.table(given), int(begin_again)
        try:
            if len(cuts) == 1:
                kernel(*how, 0, self.count, table, begins)
            else:
                self._all([partial(kernel, *how, *cut, table, begins) for cut in cuts])
        except IndexError as error:
            raise self._out_of_range() from error
        return self._steered.earned.copy()

    @cached_property
    def _stepping(self) -> tuple[Callable[..., None], tuple[Any, ...], list[tuple[int, int]]]:
        """The kernel of :meth:`step`, its first arguments, and the worlds of each thread."""
        cuts = self._cuts(self.count, self.count * self.task.robots * self.task.ticks_a_period)
        return self._engine.ready(step_worlds), (self._judge, self._observer, self._kept), cuts

    @property
    def is_over(self) -> NDArray[np.bool_]:
        """Whether the episode of each world was ended by the task, (worlds,)."""
        return self.progress[:, 0] > 0.0

    @property
    def ticks(self) -> NDArray[np.int64]:
        """Ticks of each world since its episode began, (worlds,)."""
        return self.progress[:, 1].astype(int)

    @property
    def progress(self) -> NDArray[np.float64]:
        """Of each world 1 if the task has ended its episode, and the ticks since that began, (worlds, 2)."""
        return self._steered.progress.copy()

    @property
    def observed(self) -> NDArray[np.float64]:
        """What each robot observes now, (worlds, robots, n): readings of the task's sensors, then its observations."""
        return self._steered.observed.copy()

    @property
    def places(self) -> NDArray[np.float64]:
        """What is true of each robot, (worlds, robots, 8).

        These are x and y, m; heading, rad; 1 if it touches something; energy, 0..1; points; the zones in which it is, a
        bit for each; and which of the task's defects it has, from 0, or -1 for none.
        """
        return self._steered.places.copy()

    @property
    def memory(self) -> NDArray[Any]:
        """What the task remembers, a record for each world: ``memory["energy"]`` holds a number of all of them."""
        named: NDArray[Any] = self._steered.remembered.copy().view(self._shape)[:, 0]
        return named

    @cached_property
    def _shape(self) -> np.dtype[Any]:
        return shape_of(self.task)  # To make it takes twice as long as the step of one world.

    def readings(self, sensor: str) -> NDArray[Any]:
        """Return what a sensor of the task reads now, (worlds, robots, n): n is 1 for a sensor of one number. A copy.

        Raises:
            ArgumentError: The task does not name this sensor.
        """
        if sensor not in self.task.sensors:
            raise ArgumentError(f"task {self.task.name!r} does not sense {sensor!r}", hint="name it in its sensors")
        column = self._engine.column(SensorView, self._steered.worlds.views, sensor)
        return column.reshape(self.count, self.task.robots, -1).copy()

    def world(self, index: int) -> World:
        """Return one of the worlds as it is now: a copy, to look at and to draw."""
        scene = int(self._steered.episodes[index].scene)
        shown = copy.deepcopy(self._models[scene])
        shown._state.world = copy.deepcopy(world_at(self._steered.worlds, index))  # noqa: SLF001  # of one package
        return shown

    def play(self, controller: Controller, population: ArrayLike, seeds: Sequence[int]) -> Scores:
        """Let every individual of a population play an episode for each seed.

        Args:
            controller: Its control function, and how much that remembers; the sensors are those of the task, and its
                own parameters are not used.
            population: Parameters of the control function, (individuals, n); the robots of a world share them.
            seeds: The seeds of the episodes, 0 <= seed < 2**64. With the same seed all individuals have the same
                conditions.

        Raises:
            ArgumentError: A number is out of its range, or the control function fails.
            SimulationError: The control function cannot be compiled.
        """
        import numpy as np

        rows = Controller(controller.function, population, sensors=self.task.sensors, memory=controller.memory)
        if rows.parameters.ndim != 2:
            raise ArgumentError(f"the population has the shape {rows.parameters.shape}", hint="give (individuals, n)")
        rows.try_out()
        with self._compiling():
            law = law_of(self._engine, rows.function)
        games = self._engine.records(Episode, [Episode(key=_episode_key(check_seed(seed))) for seed in seeds])
        count = len(rows.parameters)
        ticks = self.task.ticks * self.task.robots * count * len(seeds)
        cuts = self._cuts(count, ticks)
        course = self._course(len(cuts), rows.memory)
        kept = self._engine.kept(course)
        table = self._engine.table(rows.parameters)
        jobs, results = [], []
        for w, (first, end) in enumerate(cuts):
            fitness, steps = np.zeros((end - first, len(seeds))), np.zeros((end - first, len(seeds), 2))
            results.append((fitness, steps))
            arguments = (law, self._judge, kept, w, table[first:end], games, fitness, steps)
            jobs.append(partial(self._engine.ready(play_episodes), *arguments))
        try:
            self._all(jobs)
        except IndexError as error:
            raise self._out_of_range() from error
        return Scores(*(np.concatenate([part[k] for part in results]) for k in (0, 1)))

    def _check_functions(self) -> None:
        """Call the functions of the task once, interpreted: compiled code does not check an index.

        Scenes that have as many things, lamps and so on as an earlier one are left out.

        Raises:
            ArgumentError: One of them fails or reads what is not sensed, or the reward is not a finite number.
        """
        self._check_declared()
        kinds = {
            tuple(len(getattr(model.records, name)) for name in COUNTED): scene
            for model, scene in zip(reversed(self._models), reversed(self.task.scenes), strict=True)
        }
        for scene in kinds.values():
            self._check_in(scene)

    def _check_declared(self) -> None:
        task = self.task
        if not task.memory and not task.robot_memory:
            for role, function, count in self._functions():
                if takes_memory(function, count):
                    raise ArgumentError(
                        f"the {role} of task {task.name!r} takes a memory, and the task declares none",
                        hint=f"name what it remembers, and how that begins: {REMEMBERED}",
                    )
        for role, function, _ in self._functions():
            read = fields_read(function, set()) & frozenset(SENSORS)
            missing = tuple(sorted(read.difference(task.sensors, task.reward_sensors)))
            if missing:
                raise ArgumentError(
                    f"the {role} of task {task.name!r} reads {', '.join(missing)}, "
                    "which the task does not declare: it would be 0",
                    hint=f"declare it in the task: reward_sensors={(*task.reward_sensors, *missing)!r}",
                )

    def _check_in(self, scene: Scene) -> None:
        task = self.task
        world = World(scene, robots=task.robots)
        world.step()
        for sensor in (*task.sensors, *task.reward_sensors):
            world.readings(sensor)
        records: Any = world.records
        judgement, before = Judgement(task), self._untouched(records)
        try:
            earned = [judgement.reward(records, i) for i in range(task.robots)]
            judgement.is_over(records)
            for number, own in enumerate(task.observe):
                for i in range(task.robots):
                    earned += [judgement.observe(records, number, i, k) for k in range(len(own.channels))]
        except Exception as error:
            frames, here = traceback.extract_tb(error.__traceback__), Path(__file__).parent
            at = next((each for each in frames if Path(each.filename).parent != here), frames[-1])  # the user's
            where = f"in {Path(at.filename).name}, line {at.lineno}: {at.line}"
            raise ArgumentError(
                f"a function of task {task.name!r} fails in the first tick: {error!r}, {where}",
                hint=_cure(error, scene, records),
            ) from error
        if self._untouched(records) != before:
            raise ArgumentError(
                f"a function of task {task.name!r} changes the world, or a variable of its module, in the first tick",
                hint="these functions only read; what they remember is declared, and cleared by every reset:"
                f" {REMEMBERED}",
            )
        if not all(map(math.isfinite, earned)):
            raise ArgumentError(f"the reward of task {task.name!r} is {earned} in the first tick, not a finite number")

    def _functions(self) -> list[tuple[str, Callable[..., object], int]]:
        """Return the functions of the task, each with a word for it, and how many arguments it has without a memory."""
        task = self.task
        found: list[tuple[str, Callable[..., object], int]] = [("reward", task.reward, 2)]
        found += [("end", task.is_over, 1)] if task.is_over is not None else []
        return found + [("observation", each.function, 3) for each in task.observe]

    def _untouched(self, records: Records) -> str:
        """Return in words all that the functions of the task must not change."""
        used = [
            list(constants_of(each, set(), set())) for _, each, _ in self._functions() if isinstance(each, FunctionType)
        ]
        return repr((records.robots, records.views, records.things, used))  # unlike ==, it takes NaN for NaN

    def _out_of_range(self) -> ArgumentError:
        return ArgumentError(
            f"a function of task {self.task.name!r} uses an index that is out of its range",
            hint=f"bound it, as by min and max; to see where, use {INTERPRETED}",
        )

    @cached_property
    def _judge(self) -> Judge:
        """What the kernels call after each tick."""
        with self._compiling():
            return judge_of(self._engine, self.task, self._like)

    @cached_property
    def _observer(self) -> Judge:
        """What the kernels call for what the robots observe."""
        with self._compiling():
            return observer_of(self._engine, self.task, self._like)

    @cached_property
    def _like(self) -> Kept:
        """Something like what those get."""
        return self._engine.kept(self._course(1, 0))

    def _compiling(self) -> AbstractContextManager[None]:
        return explained(f"task {self.task.name!r}", f"; what lasts is declared: {REMEMBERED}")

    def _all(self, jobs: Sequence[Callable[[], None]]) -> None:
        """Run the first job here, and the others in threads."""
        first, *others = jobs
        if others and (self._pool is None or self._pool[0] != os.getpid()):  # A forked process has no threads.
            self._pool = os.getpid(), concurrent.futures.ThreadPoolExecutor(self.threads - 1)
        running = [self._pool[1].submit(job) for job in others] if self._pool else []
        try:
            first()
        finally:
            concurrent.futures.wait(running)
        for done in running:
            done.result()

    def _cuts(self, count: int, ticks: int) -> list[tuple[int, int]]:
        """Return the parts of so many things that take so many ticks: only one if threads cost more than they save."""
        return self._parts(count) if ticks >= SMALL else [(0, count)]

    def _parts(self, count: int) -> list[tuple[int, int]]:
        """Return the first and the last + 1 of each thread's part of so many things."""
        parts = min(self.threads, count)
        return [(k * count // parts, (k + 1) * count // parts) for k in range(parts)]

    def _lay_out_scenes(self) -> dict[str, Any]:
        """Return the parts of a course that are those of the scenes."""
        import numpy as np

        task = self.task
        # Starts that the scenes name are the same in each set.
        sets = 1 if all(len(scene.starts) >= task.robots for scene in task.scenes) else STARTS
        return {
            "originals": laid_out(self._engine, [model.records for model in self._models]),
            "starts": self._engine.table(np.array([_starts(scene, task.robots, sets) for scene in task.scenes])),
            "ranges": self._engine.table(np.array([_ranges(task, scene) for scene in task.scenes])),
        }

    def _course(self, count: int, memory: int) -> Course:
        """Lay out so many worlds, whose controllers remember so many numbers."""
        import numpy as np

        task, robots = self.task, self.task.robots
        return Course(
            worlds=room_for(self._scenes["originals"], self._parts(count)),
            **self._scenes,
            episodes=self._engine.records(Episode, [Episode() for _ in range(count)]),
            memory=self._engine.table(np.zeros((count, robots, memory))),
            remembered=np.tile(start_of(task), (count, 1)),
            fresh=start_of(task),
            earned=np.zeros((count, robots)),
            observed=np.zeros((count, robots, observed_count(task))),
            places=np.zeros((count, robots, 8)),
            progress=np.zeros((count, 2)),
            period=task.ticks_a_period,
            ticks=task.ticks,
            top_speed=task.top_speed,
            sensors=chosen(task.sensors),
            reward_sensors=chosen(task.reward_sensors),
        )

    def __getstate__(self) -> dict[str, Any]:
        made = ("_judge", "_observer", "_like", "_kept", "_stepping")  # of this process
        return {key: value for key, value in vars(self).items() if key not in made} | {"_pool": None}


def _cure(error: Exception, scene: Scene, records: Records) -> str:
    """Return what to write instead of what has failed in a function of a task."""
    if isinstance(error, AttributeError):
        kind = error.obj
        there = getattr(kind, "__dataclass_fields__", None) or getattr(kind, "_fields", ())
        there = there or getattr(getattr(kind, "dtype", None), "names", None) or ()
        meant = nearest(error.name or "", there) + " " if there else ""
        if there:
            return f"{meant if meant.startswith('did') else ''}it has {', '.join(there)}"
    if isinstance(error, IndexError):
        counts = ", ".join(f"{len(getattr(records, name))} {name}" for name in ("robots", *COUNTED[2:]))
        return f"the first has the number 0; the world {scene.name!r} has {counts}"
    return "a reward takes (world, i) and returns a number, an end takes (world) and returns True or False"


def _episode_key(seed: int) -> int:
    """Return the key of the first episode of a seed, which need not be below 2**64."""
    return seed_key(seed & ((1 << 64) - 1))


def _starts(scene: Scene, robots: int, sets: int) -> list[list[list[float]]]:
    """Return so many sets of starts of a scene, each (robots, 4)."""
    found = []
    for seed in range(sets):
        poses = places(scene, robots, seed)
        found.append([[pose.x, pose.y, *unit(pose.heading)] for pose in poses])
    return found


def _ranges(task: Task, scene: Scene) -> list[tuple[float, ...]]:
    """Return the ranges of what an episode in a scene draws, and what may be broken in its robots."""
    wanted = task.randomisation
    own = ((scene.model.given(name),) * 2 for name in DRAWN)
    drawn = [*(getattr(wanted, name) or each for name, each in zip(DRAWN, own, strict=True)), wanted.latency]
    rows = [*((low, high, 0.0, 0.0) for low, high in drawn), (wanted.broken, 0.0, 0.0, 0.0)]
    return [*rows, *(defect.row for defect in wanted.defects)]
