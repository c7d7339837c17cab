"""PettingZoo environments of the tasks: each robot of a world is an agent."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np

from elib.base.errors import ArgumentError, Unsupported
from elib.base.extras import install
from elib.learn.envs import HUMAN, RGB_ARRAY, Environment, Floats32, require_shape
from elib.simulator.physics import Task
from elib.simulator.physics.engine import EngineName

try:
    from gymnasium import Space
    from pettingzoo import ParallelEnv
except ImportError:
    raise Unsupported(
        "the environments of swarms need PettingZoo, which is not installed", hint=install("learn")
    ) from None


class SwarmEnv(Environment, ParallelEnv):  # type: ignore[misc]  # PettingZoo has no types
    """A task as a PettingZoo parallel environment: the agents ``robot_0`` and so on decide at the same time.

    Every agent observes what its own sensors read, and steers its own wheels. Its info is that of a
    :class:`elib.learn.envs.TaskEnv`. All episodes end together, with the same fitness.

    Attributes:
        possible_agents: The names of all robots.
        agents: The names of all robots during an episode; empty after it.
    """

    metadata: dict[str, Any] = {"render_modes": [HUMAN, RGB_ARRAY], "is_parallelizable": True}

    def __init__(
        self, task: Task | str = "aggregation", *, engine: EngineName = "compiled", render_mode: str | None = None
    ) -> None:
        """Set up the world, as :class:`elib.learn.envs.TaskEnv` does, of a task with any number of robots."""
        observed, acted = self._set_up(task, engine, render_mode)
        self.metadata |= {"name": f"{self.task.name.replace('-', '_')}_v0"}
        self.possible_agents = [f"robot_{k}" for k in range(self.task.robots)]
        self.agents: list[str] = []
        self.observation_spaces = {agent: deepcopy(observed) for agent in self.possible_agents}
        self.action_spaces = {agent: deepcopy(acted) for agent in self.possible_agents}

    def observation_space(self, agent: str) -> Space[Floats32]:
        """Return what an agent can observe."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Space[Floats32]:
        """Return what an agent can do."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Floats32], dict[str, dict[str, Any]]]:
        """Begin an episode, as :meth:`elib.learn.envs.TaskEnv.reset` does."""
        if seed is None and not self._has_begun:
            seed = int(np.random.default_rng().integers(1 << 63))
        self._begin(seed)
        self.agents = list(self.possible_agents)
        self._show(is_new=True)
        return self._observations(), {agent: self._info(i) for i, agent in enumerate(self.agents)}

    def step(
        self, actions: dict[str, Floats32]
    ) -> tuple[dict[str, Floats32], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Let all robots drive until their next decision.

        Args:
            actions: For each agent the speeds of its left and right wheel, m/s.

        Raises:
            ArgumentError: There is not an action of two numbers for every agent, or :meth:`reset` was not called yet.
        """
        self._check_begun()
        if not self.agents:
            return {}, {}, {}, {}, {}
        if actions.keys() != set(self.agents):
            raise ArgumentError(f"there are actions for {sorted(actions)}", hint=f"give one for each of {self.agents}")
        given = [require_shape(actions[agent], (2,)) for agent in self.agents]
        rewards, is_over, is_late = self._decide(np.stack(given))
        self._show()
        agents, has_ended = self.agents, is_over or is_late
        if has_ended:
            self.agents = []
        return (
            self._observations(),
            dict(zip(agents, rewards, strict=True)),
            dict.fromkeys(agents, is_over),
            dict.fromkeys(agents, is_late),
            {agent: self._info(i, has_ended=has_ended) for i, agent in enumerate(agents)},
        )

    def _observations(self) -> dict[str, Floats32]:
        return dict(zip(self.possible_agents, self._observe()[0], strict=True))
