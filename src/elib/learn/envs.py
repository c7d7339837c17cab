"""Gymnasium environments of tasks with one robot: one world at a time, or thousands that take a step in one call.

Tasks with several robots are environments of PettingZoo: :mod:`elib.learn.swarm_envs`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elib.base.errors import ArgumentError, Unsupported
from elib.base.extras import install
from elib.learn.catalogue import find_task
from elib.learn.liveview import LiveView, picture
from elib.learn.sensors import channels_of
from elib.simulator.physics import Episodes, Task
from elib.simulator.physics.engine import EngineName
from elib.simulator.physics.observing import Channel

try:
    import gymnasium
    from gymnasium.spaces import Box
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ImportError:
    raise Unsupported("environments need Gymnasium, which is not installed", hint=install("learn")) from None

Floats32 = NDArray[np.float32]

HUMAN, RGB_ARRAY = "human", "rgb_array"


def require_shape(actions: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return actions as an array."""
    try:
        given = np.asarray(actions, dtype=np.float64)
    except (TypeError, ValueError):
        raise ArgumentError(f"the action is {actions!r}; it must be numbers of the shape {shape}, m/s") from None
    if given.shape != shape:
        raise ArgumentError(
            f"the action has the shape {given.shape}; it must have the shape {shape}",
            hint="give the speeds of the left and the right wheel, m/s",
        )
    if not math.isfinite(np.add.reduce(given, axis=None)) and not np.isfinite(given).all():
        raise ArgumentError(
            "the action has a speed that is not a finite number",
            hint="look at what chooses the actions: it may diverge",
        )
    return given


class Environment:
    """What all environments have.

    Attributes:
        task: The task.
        observation_names: The names of the numbers of an observation, in order.
        observation_units: The units of these numbers.
        action_names: The names of the numbers of an action, in order.
        action_units: The units of these numbers.
        render_mode: The render mode, as given.
    """

    metadata: dict[str, Any]

    def _set_up(
        self,
        task: Task | str,
        engine: EngineName,
        render_mode: str | None,
        *,
        count: int = 1,
        threads: int | None = 1,
        **metadata: object,
    ) -> tuple[gymnasium.Space[Floats32], gymnasium.Space[Floats32]]:
        """Set up the worlds, and return what one robot observes, and what steers it."""
        modes = self.metadata["render_modes"]
        if render_mode is not None and render_mode not in modes:
            hint = f"choose from {', '.join(modes)}, or leave it out"
            raise ArgumentError(f"render_mode is {render_mode!r}", hint=hint)
        self.task = task = find_task(task) if isinstance(task, str) else task
        self._episodes = Episodes(task, count, engine=engine, threads=threads)
        self._fitness = np.zeros(count)  # of each world's episode so far
        self._has_begun = False
        self._ticks, self._remembers = task.ticks, bool(task.memory or task.robot_memory)
        self._states = _states(task)
        # A mean fitness is a share of the whole episode, and too small a number for a single decision.
        self._scale = float(task.decisions) if task.fitness == "mean" else 1.0
        self.metadata = {**self.metadata, "render_fps": round(1 / task.period), **metadata}
        observed = [channel for sensor in task.sensors for channel in channels_of(sensor)]
        observed += [channel for each in task.observe for channel in each.channels]
        acted = tuple(Channel(f"{side}_wheel", "m/s", -task.top_speed, task.top_speed) for side in ("left", "right"))
        self.observation_names, self.observation_units = _named(observed)
        self.action_names, self.action_units = _named(acted)
        self.render_mode = render_mode
        self._view = LiveView(task.period) if render_mode == HUMAN else None
        space = _box(observed)
        self._low, self._high = space.low, space.high
        return cast("gymnasium.Space[Floats32]", space), cast("gymnasium.Space[Floats32]", _box(acted))

    def _begin(self, seed: int | Sequence[int | None] | None, which: Sequence[int] | None = None) -> None:
        """Begin episodes in the worlds of these numbers, or in all.

        World k begins with the seed *seed* + k, or with number k of several seeds. None means the episode after the
        present one, in a sequence that the world's last seed decides.
        """
        chosen = list(range(len(self._fitness))) if which is None else list(which)
        if seed is None or isinstance(seed, int | np.integer):
            self._episodes.reset(None if seed is None else int(seed), chosen)
        else:
            for world, own in zip(chosen, seed, strict=True):
                self._episodes.reset(None if own is None else (int(own) - world) % (1 << 64), [world])
        self._fitness[chosen] = 0.0
        self._has_begun = True

    def _check_begun(self) -> None:
        if not self._has_begun:
            raise ArgumentError("step() was called before reset()", hint="call reset() first: it begins an episode")

    def _decide(self, actions: ArrayLike) -> tuple[list[float], bool, bool]:
        """Let one decision pass in the only world; return each robot's reward, and whether task or time ended it."""
        self._check_begun()
        earned = self._episodes.step(actions, begin_again=False)[0].tolist()
        self._fitness[0] += sum(earned) / len(earned)
        is_over, ticks = self._episodes.progress[0].tolist()
        return [each * self._scale for each in earned], is_over > 0.0, ticks >= self._ticks and is_over == 0.0

    def _observe(self) -> Floats32:
        """Return what all robots observe, in the units and the ranges of its space, (worlds, robots, n): a copy."""
        found = self._episodes.observed.astype(np.float32)
        return np.minimum(np.maximum(found, self._low, out=found), self._high, out=found)

    def _info(self, robot: int = 0, *, has_ended: bool = False) -> dict[str, Any]:
        """Return what is true of a robot of the first world, whatever it observes."""
        place = self._episodes.places[0, robot]
        info: dict[str, Any] = {"pose": place[:3], "is_touching": bool(place[3])}
        for name, column, kind in self._states:
            info[name] = kind(place[column])
        if self._remembers:
            memory = self._episodes.memory[0]
            info["memory"] = {name: memory[name] for name in self.task.memory}
            info["memory"] |= {name: memory[name][robot] for name in self.task.robot_memory}
        if has_ended:
            fitness = float(self._fitness[0])
            info |= {"fitness": fitness, "is_success": fitness >= self.task.solved}
        return info

    def _show(self, *, is_new: bool = False) -> None:
        """Show the first world on the page, if there is one."""
        if self._view is not None:
            self._view.show(self._episodes.world(0), is_new=is_new)

    def _require_one_robot(self) -> None:
        if self.task.robots > 1:
            raise ArgumentError(
                f"task {self.task.name!r} has {self.task.robots} robots, and an environment of Gymnasium has one",
                hint="use elib.learn.swarm_envs.SwarmEnv, or for many worlds at once elib.learn.Episodes",
            )

    def render(self) -> Any:
        """Return a picture of the world as an array (rows, columns, 3) if the render mode is ``"rgb_array"``."""
        return picture(self._episodes.world(0)) if self.render_mode == RGB_ARRAY else None

    def close(self) -> None:
        """Close the page in the browser. Safe to repeat."""
        if self._view is not None:
            self._view.close()


def _states(task: Task) -> list[tuple[str, int, type]]:
    """Return what infos hold of a task's worlds beside the pose: name, column of the places, and type."""
    has_zones = any(scene.zones for scene in task.scenes)
    has_pucks = any(each.collect for scene in task.scenes for each in scene.cylinders)
    there = {
        ("energy", 4, float): any(scene.energy is not None for scene in task.scenes),
        ("score", 5, float): has_zones or has_pucks,
        ("zones", 6, int): has_zones,
        ("defect", 7, int): bool(task.randomisation.defects),
    }
    return [each for each, is_there in there.items() if is_there]


def _named(channels: Sequence[Channel]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names and the units of numbers."""
    return tuple(channel.name for channel in channels), tuple(channel.unit for channel in channels)


def _box(channels: Sequence[Channel]) -> Box:
    """Return the space of arrays that hold these numbers."""
    low, high = (np.array([channel[k] for channel in channels], np.float32) for k in (2, 3))
    return Box(low, high, dtype=np.float32)


class TaskEnv(Environment, gymnasium.Env[Floats32, Floats32]):
    """A task with one robot as a Gymnasium environment.

    The info holds what is true, whatever the robot observes: its ``pose`` (x and y, m; heading, rad) and
    ``is_touching``. Of a world with such things it also holds the robot's ``energy``, 0..1, its ``score`` in points,
    the ``zones`` in which it is, a bit for each in the order of the scene, and its ``defect``: the number of that in
    the task's randomisation, from 0, or -1 for none. A task with a memory adds the numbers of that as ``memory``. Where
    the episode ends, the info also holds its ``fitness``, as ``elib evolve`` computes it, and ``is_success``.
    """

    metadata: dict[str, Any] = {"render_modes": [HUMAN, RGB_ARRAY], "render_fps": 10}

    def __init__(
        self, task: Task | str = "avoid", *, engine: EngineName = "compiled", render_mode: str | None = None
    ) -> None:
        """Set up the world.

        Args:
            task: A task, or the name of one.
            engine: ``"compiled"``, or ``"interpreted"``, which needs no compiling at first. Both give the same
                episodes.
            render_mode: ``"rgb_array"``: :meth:`render` returns a picture. ``"human"``: a page in the browser shows
                the world, and every step takes as long as in reality.

        Raises:
            ArgumentError: There is no such task or render mode, or the task has several robots.
            SimulationError: Numba is not installed.
            Unsupported: The packages of the page are not installed.
        """
        self.observation_space, self.action_space = self._set_up(task, engine, render_mode)
        self._require_one_robot()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats32, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: The seed of the episode, which decides its scene, its start, its noise and what is drawn for it; the
                seeds of the episodes after it follow from it. None means the next episode.
            options: Not used.
        """
        super().reset(seed=seed)
        if seed is None and not self._has_begun:
            seed = int(self.np_random.integers(1 << 63))
        self._begin(seed)
        self._show(is_new=True)
        return self._observe().reshape(-1), self._info()

    def step(self, action: Floats32) -> tuple[Floats32, float, bool, bool, dict[str, Any]]:
        """Let the robot drive until its next decision.

        Args:
            action: Speeds of the left and the right wheel, m/s.

        Raises:
            ArgumentError: The action has another shape, or :meth:`reset` was not called yet.
        """
        (reward,), is_over, is_late = self._decide(require_shape(action, (2,)))
        self._show()
        return self._observe().reshape(-1), reward, is_over, is_late, self._info(has_ended=is_over or is_late)


class TaskVectorEnv(VectorEnv[Floats32, Floats32, NDArray[Any]], Environment):
    """A task with one robot as a Gymnasium vector environment: all worlds take a step in one compiled call.

    World k plays the same episodes as a :class:`TaskEnv` with the same seed, and the infos are those of all of them.
    """

    metadata: dict[str, Any] = {"render_modes": [RGB_ARRAY], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        task: Task | str = "avoid",
        *,
        engine: EngineName = "compiled",
        threads: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
    ) -> None:
        """Set up the worlds.

        Args:
            num_envs: How many, 1 or more.
            task: A task, or the name of one.
            engine: ``"compiled"``, or ``"interpreted"``, which is far slower.
            threads: How many worlds run at once; None means one a core. The result does not depend on it.
            autoreset_mode: ``"NextStep"``: in the step after its end a world begins its next episode, whatever the
                action, and earns 0. ``"SameStep"``: it begins in the step of its end; the infos hold the last
                observation as ``final_obs`` and the infos of the end as ``final_info``.
            render_mode: ``"rgb_array"``: :meth:`render` returns a picture of every world.

        Raises:
            ArgumentError: There is no such task or mode, a number is out of its range, or the task has several robots.
            SimulationError: Numba is not installed.
        """
        modes = {mode.value: mode for mode in (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP)}
        mode = modes.get(getattr(autoreset_mode, "value", autoreset_mode))
        if mode is None:
            raise ArgumentError(
                f"autoreset_mode is {autoreset_mode!r}, but the worlds begin again by themselves",
                hint=f"choose from {', '.join(modes)}",
            )
        self._mode = mode
        self.single_observation_space, self.single_action_space = self._set_up(
            task, engine, render_mode, count=num_envs, threads=threads, autoreset_mode=mode
        )
        self._require_one_robot()
        self.num_envs = num_envs
        self._all = np.ones(num_envs, dtype=np.bool_)
        self._ended = ~self._all
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats32, dict[str, Any]]:
        """Begin an episode in every world.

        World k begins with the seed *seed* + k, or with number k of several seeds; None means the next episode.
        """
        if isinstance(seed, Sequence):
            if len(seed) != self.num_envs:
                raise ArgumentError(f"there are {len(seed)} seeds for {self.num_envs} worlds", hint="give one for each")
        else:
            super().reset(seed=seed)
        if seed is None and not self._has_begun:
            seed = int(self.np_random.integers(1 << 63))
        self._begin(seed)
        return self._observations(), self._infos(self._all)

    def step(self, actions: Floats32) -> tuple[Floats32, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Let all robots drive until their next decision; actions are wheel speeds, m/s, (worlds, 2)."""
        given = require_shape(actions, (self.num_envs, 2))
        self._check_begun()
        is_same_step = self._mode is AutoresetMode.SAME_STEP
        if not is_same_step:
            self._fitness[self._ended] = 0.0
        rewards = self._episodes.step(given, begin_again=not is_same_step)[:, 0]
        self._fitness += rewards
        is_over, ticks = self._episodes.progress.T
        terminated = is_over > 0.0
        truncated = (ticks >= self._ticks) & ~terminated
        self._ended = ended = terminated | truncated
        observations, infos = self._observations(), self._infos(self._all)
        if ended.any():
            told = _told("fitness", np.where(ended, self._fitness, 0.0), ended)
            told |= _told("is_success", ended & (self._fitness >= self.task.solved), ended)
            if is_same_step:
                last = np.empty(self.num_envs, dtype=object)
                for world in np.flatnonzero(ended):
                    last[world] = observations[world]
                told |= self._infos(ended)
                self._begin(None, np.flatnonzero(ended).tolist())
                observations, infos = self._observations(), self._infos(self._all)
                infos |= _told("final_obs", last, ended) | _told("final_info", told, ended)
            else:
                infos |= told
        return observations, rewards * self._scale, terminated, truncated, infos

    def _infos(self, which: NDArray[np.bool_]) -> dict[str, Any]:
        """Return what is true of the robots of these worlds, whatever they observe."""
        places, told = self._episodes.places[:, 0], dict[str, Any]()
        places[~which] = 0.0
        infos = _told("pose", places[:, :3], which) | _told("is_touching", places[:, 3] > 0.0, which)
        for name, column, kind in self._states:
            infos |= _told(name, places[:, column].astype(kind), which)
        if self._remembers:
            memory = self._episodes.memory
            memory[~which] = 0.0
            for name in memory.dtype.names or ():
                told |= _told(name, memory[name][:, 0] if name in self.task.robot_memory else memory[name], which)
            infos |= _told("memory", told, which)
        return infos

    def _observations(self) -> Floats32:
        return self._observe().reshape(self.num_envs, -1)

    def render(self) -> tuple[Any, ...] | None:
        """Return a picture of each world, (rows, columns, 3), if the render mode is ``"rgb_array"``."""
        pictures = (picture(self._episodes.world(k)) for k in range(self.num_envs))
        return None if self.render_mode is None else tuple(pictures)


def _told(name: str, values: Any, which: NDArray[np.bool_]) -> dict[str, Any]:
    """Return an info of those worlds, as Gymnasium writes the infos of several worlds."""
    return {name: values, f"_{name}": which.copy()}
