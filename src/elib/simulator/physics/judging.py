"""What a task earns, ends, remembers and observes: the functions that episodes call, each with the task's memory."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from elib.simulator.physics.course import Judge
from elib.simulator.physics.engine import Engine, opened
from elib.simulator.physics.observing import SENSED, numbers_of
from elib.simulator.physics.packing import world_at
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def shape_of(task: Task) -> np.dtype[Any]:
    """Return the type of a task's memory: a record of all its numbers, one for each robot where they are its own."""
    import numpy as np

    shapes = {name: np.shape(start) for name, start in task.memory.items()}
    shapes |= {name: (task.robots, *np.shape(start)) for name, start in task.robot_memory.items()}
    return np.dtype((np.record, [(name, "f8", shape) for name, shape in shapes.items()]))


def start_of(task: Task) -> NDArray[np.float64]:
    """Return what a task remembers at the beginning of each episode; a number of no use if that is nothing."""
    import numpy as np

    parts = [np.ravel(start) for start in task.memory.values()]
    parts += [np.tile(np.ravel(start), task.robots) for start in task.robot_memory.values()]
    return np.concatenate([*parts, np.zeros(int(not parts))]).astype(np.float64)


def _named(task: Task) -> Callable[[Any], Any]:
    """Return a function that gives the numbers of a memory their names."""
    if not task.memory and not task.robot_memory:
        return lambda numbers: numbers
    kind = shape_of(task)
    return lambda numbers: numbers.view(kind)[0]


def takes_memory(function: Callable[..., Any], count: int) -> bool:
    """Return whether a function that gets so many arguments takes the memory as a further one."""
    try:
        return len(inspect.signature(function).parameters) > count
    except (TypeError, ValueError):  # a function of C, which does not say it
        return False


def _with_memory(given: Callable[..., Any], count: int) -> Callable[..., Any]:
    """Return a function that takes the memory after *count* arguments, whether or not the given one does."""
    function = getattr(given, "py_func", given)
    if takes_memory(function, count):
        return function
    forms: dict[int, Callable[..., Any]] = {
        1: lambda world, memory: function(world),
        2: lambda world, i, memory: function(world, i),
        3: lambda world, i, k, memory: function(world, i, k),
    }
    return forms[count]


def goes_on(world: Records) -> bool:
    """Return False: only time ends an episode."""
    return False


class Judgement:
    """The functions of a task with the memory of one episode, for worlds that no kernel of episodes runs."""

    def __init__(self, task: Task) -> None:
        self._memory = _named(task)(start_of(task))
        self._reward, self._is_over = _with_memory(task.reward, 2), _with_memory(task.is_over or goes_on, 1)
        self._observe = [_with_memory(each.function, 3) for each in task.observe]

    def reward(self, world: Records, i: int) -> float:
        """Return what robot *i* earned in the last tick."""
        return float(self._reward(world, i, self._memory))

    def is_over(self, world: Records) -> bool:
        """Return whether the episode is over."""
        return bool(self._is_over(world, self._memory))

    def observe(self, world: Records, number: int, i: int, k: int) -> float:
        """Return number *k* that robot *i* observes by the observation of this number."""
        return float(self._observe[number](world, i, k, self._memory))


def judge_of(engine: Engine, task: Task, kept: Any) -> Judge:
    """Return what a task judges a tick by, as kernels of *engine* call it for a course such as this one."""
    reward, is_over = _with_memory(task.reward, 2), _with_memory(task.is_over or goes_on, 1)
    scale = 1 / task.ticks if task.fitness == "mean" else 1.0
    named = _named(task)

    def judge(kept: Any, w: int) -> None:
        course = opened(kept)
        world, memory, earned = world_at(course.worlds, w), named(course.remembered[w]), course.earned[w]
        for i in range(len(world.robots)):
            earned[i] += reward(world, i, memory) * scale
        if is_over(world, memory):
            course.episodes[w].is_over = 1

    # What is written beside a memory would be written to that of another world.
    return engine.argument(judge, lambda: (kept, 0), checks_indices=bool(task.memory or task.robot_memory))


def observer_of(engine: Engine, task: Task, kept: Any) -> Judge:
    """Return what writes all that the robots of a world observe into the course, as kernels of *engine* call it."""
    parts = [(_reading(SENSED[sensor]), numbers_of(sensor)) for sensor in task.sensors]
    parts += [(_with_memory(each.function, 3), len(each.channels)) for each in task.observe]
    write = _writer(parts)
    named = _named(task)

    def observe(kept: Any, w: int) -> None:
        course = opened(kept)
        world, memory = world_at(course.worlds, w), named(course.remembered[w])
        for i in range(len(world.robots)):
            write(world, i, memory, course.observed[w][i])

    return engine.argument(observe, lambda: (kept, 0))


Writer: TypeAlias = Callable[[Records, int, Any, Any], None]


def observed_count(task: Task) -> int:
    """Return how many numbers a robot observes."""
    return sum(map(numbers_of, task.sensors)) + sum(len(each.channels) for each in task.observe)


def _reading(take: Callable[[Any, int], float]) -> Callable[..., float]:
    return lambda world, i, k, memory: take(world.views[i], k)


def _writer(parts: Sequence[tuple[Callable[..., float], int]], at: int = 0) -> Writer:
    """Return what writes the numbers of several functions, each with its count, into a row from the place *at* on."""
    if not parts:
        return lambda world, i, memory, row: None
    function, count = parts[0]
    write_others = _writer(parts[1:], at + count)

    def write(world: Records, i: int, memory: Any, row: Any) -> None:
        for k in range(count):
            row[at + k] = function(world, i, k, memory)
        write_others(world, i, memory, row)

    return write
