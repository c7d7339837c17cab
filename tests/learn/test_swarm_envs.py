"""PettingZoo environments: they pass PettingZoo's checks, and play the episodes of their tasks."""

from __future__ import annotations

import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from pettingzoo.test import parallel_api_test, parallel_seed_test

from elib.base.errors import ArgumentError
from elib.learn.swarm_envs import SwarmEnv
from elib.simulator.physics import Episodes, Scene, Task


def near_the_other(world, i) -> float:
    here, there = world.robots[i], world.robots[1 - i]
    distance = abs(here.x - there.x) + abs(here.y - there.y)
    return float(1.0 / (1.0 + distance)) * (i + 1)


def has_met(world) -> bool:
    return bool(near_the_other(world, 0) > 0.92)


MEET = Task(
    "meet-up",
    "Meet.",
    (Scene(0.4, 0.3, step=1 / 40),),
    near_the_other,
    robots=2,
    seconds=0.8,
    solved=0.1,
    is_over=has_met,
)


def meeting(**options: Any) -> SwarmEnv:
    return SwarmEnv(MEET, engine="interpreted", **options)


def forward(env: SwarmEnv) -> dict[str, Any]:
    return {agent: np.full(2, 0.1, np.float32) for agent in env.agents}


def test_the_environment_passes_the_checks_of_pettingzoo() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(meeting(), num_cycles=50)
        parallel_seed_test(meeting, num_cycles=50)


def test_without_a_seed_every_environment_begins_elsewhere() -> None:
    first, second = (np.concatenate(list(meeting().reset()[0].values())) for _ in range(2))
    assert (first != second).any()


def test_agents_observe_and_steer_one_robot_each() -> None:
    env = meeting()
    assert env.possible_agents == ["robot_0", "robot_1"]
    assert env.metadata["name"] == "meet_up_v0"
    assert env.observation_names[0] == "proximity_front_right"
    assert env.action_names == ("left_wheel", "right_wheel")
    assert env.observation_units == ("counts",) * 8
    assert env.action_units == ("m/s", "m/s")
    for agent in env.possible_agents:
        assert env.observation_space(agent).shape == (8,)
        assert env.action_space(agent) == gymnasium.spaces.Box(-0.1, 0.1, (2,), np.float32)
    assert env.action_space("robot_0") is not env.action_space("robot_1")


def test_it_plays_the_episodes_of_the_task() -> None:
    swarm, episodes = meeting(), Episodes(MEET, engine="interpreted")
    draw = np.random.default_rng(1)
    for seed in (4, None, 5):
        observations, _ = swarm.reset(seed=seed)
        episodes.reset(seed)
        while swarm.agents:
            assert [*map(list, observations.values())] == episodes.readings("proximity")[0].tolist()
            action = draw.uniform(-0.1, 0.1, 4).astype(np.float32)
            observations, rewards, terminations, truncations, infos = swarm.step(
                {"robot_1": action[2:], "robot_0": action[:2]}
            )
            earned = episodes.step(action.reshape(1, 2, 2), begin_again=False)[0]
            assert list(rewards.values()) == (earned * MEET.decisions).tolist()
            is_over, is_late = bool(episodes.is_over[0]), bool(episodes.ticks[0] >= MEET.ticks)
            assert set(terminations.values()) == {is_over}
            assert set(truncations.values()) == {is_late and not is_over}
            for i, info in enumerate(infos.values()):
                pose = episodes.world(0).pose(i)
                assert info["pose"] == pytest.approx([pose.x, pose.y, pose.heading], abs=1e-12)
                assert ("fitness" in info) is (is_over or is_late)


def test_every_robot_earns_its_own_reward_and_the_end_tells_their_fitness() -> None:
    env = meeting()
    env.reset(seed=3)
    total = 0.0
    while env.agents:
        _, rewards, _, _, infos = env.step(forward(env))
        assert rewards["robot_1"] == pytest.approx(2 * rewards["robot_0"])
        total += rewards["robot_0"]
    assert infos["robot_0"]["fitness"] == pytest.approx(1.5 * total / MEET.decisions)
    assert env.step({}) == ({}, {}, {}, {}, {})


def test_actions_are_needed_for_every_agent_and_of_the_right_shape() -> None:
    env = meeting()
    with pytest.raises(ArgumentError, match=r"step\(\) was called before reset\(\)"):
        env.step({agent: np.zeros(2, np.float32) for agent in env.possible_agents})
    env.reset(seed=1)
    with pytest.raises(ArgumentError, match=r"there are actions for \['robot_1'\]"):
        env.step({"robot_1": np.zeros(2, np.float32)})
    with pytest.raises(ArgumentError, match=r"it must have the shape \(2,\)"):
        env.step({agent: np.zeros(3, np.float32) for agent in env.agents})
    with pytest.raises(ArgumentError, match="render_mode is 'ansi'"):
        meeting(render_mode="ansi")


def test_a_picture_shows_the_world_from_above() -> None:
    env = meeting(render_mode="rgb_array")
    env.reset(seed=1)
    assert env.render().shape[2] == 3
    assert meeting().render() is None
