"""Gymnasium environments: they pass Gymnasium's checks, and single and vector environments play the same episodes."""

from __future__ import annotations

import subprocess
import sys
import warnings
from dataclasses import replace
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from elib.base.errors import ArgumentError
from elib.learn import all_tasks
from elib.learn.envs import TaskEnv, TaskVectorEnv
from elib.learn.sensors import channels_of
from elib.simulator.physics import Defect, Energy, EpuckModel, Pose, Randomisation, Scene, SensorView, Task, Zone
from elib.simulator.physics.records import SENSORS
from shared import PATIENCE, needs_page

GOAL = 0.3  # m from the left edge.


def progress(world, i) -> float:
    return float(world.robots[i].x - world.robots[i].before_x)


def has_arrived(world) -> bool:
    return bool(world.robots[0].x > GOAL)


def make_task(**options: Any) -> Task:
    scenes = tuple(Scene(side, 0.4, step=1 / 40, model=EpuckModel(motor_noise=0.05)) for side in (0.4, 0.5))
    given = {"fitness": "sum", "solved": 0.01, "seconds": 0.6, "is_over": has_arrived, "sensors": ("proximity",)}
    return Task("reach", "Reach the right side.", scenes, progress, **(given | options))


REACH = make_task(sensors=("proximity", "rotation"), randomisation=Randomisation(motor_noise=(0.0, 0.1)))
PAIR = make_task(robots=2)


def single(task: Task = REACH, **options: Any) -> TaskEnv:
    return TaskEnv(task, engine="interpreted", **options)


def several(count: int, task: Task = REACH, **options: Any) -> TaskVectorEnv:
    return TaskVectorEnv(count, task, engine="interpreted", **options)


@pytest.fixture
def registered():
    """The name of an environment of a task of our own."""
    name = "elib-tests/Reach-v0"
    gymnasium.register(
        name,
        entry_point="elib.learn.envs:TaskEnv",
        vector_entry_point="elib.learn.envs:TaskVectorEnv",
        kwargs={"task": REACH, "engine": "interpreted"},
    )
    yield name
    del gymnasium.registry[name]


def played(env: TaskEnv, seed: int | None, actions: np.ndarray) -> list[Any]:
    """Return everything that an environment says in an episode."""
    said: list[Any] = [env.reset(seed=seed)]
    for action in actions:
        said.append(env.step(action))
        if said[-1][2] or said[-1][3]:
            break
    return said


def some_actions(count: int, width: int = 2, seed: int = 5) -> np.ndarray:
    draw = np.random.default_rng(seed)
    return draw.uniform(-0.02, 0.1, (count, width)).astype(np.float32)


# -- Gymnasium's own checks --


@needs_page
def test_the_environment_passes_the_checks_of_gymnasium_in_all_render_modes(registered, monkeypatch) -> None:
    monkeypatch.setenv("ELIB_BROWSER", "no")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(registered).unwrapped)


def test_make_vec_takes_the_native_vector_environment(registered) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make_vec(registered, num_envs=3)
    assert isinstance(env, TaskVectorEnv)
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert env.observation_space.shape == (3, 9)
    assert env.action_space.shape == (3, 2)
    observations, _ = env.reset(seed=1)
    assert env.observation_space.contains(observations)


def test_the_wrappers_of_gymnasium_count_the_return_of_every_world() -> None:
    env = gymnasium.wrappers.vector.RecordEpisodeStatistics(several(2, make_task(is_over=None)))
    env.reset(seed=1)
    total = 0.0
    for action in some_actions(6, 4).reshape(6, 2, 2):
        _, rewards, _, ended, infos = env.step(action)
        total += rewards[0]
    assert ended.all()
    assert infos["episode"]["r"][0] == pytest.approx(total)
    assert infos["fitness"][0] == pytest.approx(total)


# -- names and ranges --


def test_every_sensor_has_a_name_a_unit_and_a_range_for_each_of_its_numbers() -> None:
    for sensor in SENSORS:
        value = getattr(SensorView(), sensor)
        channels = channels_of(sensor)
        assert len(channels) == (len(value) if isinstance(value, list) else 1)
        assert len({channel.name for channel in channels}) == len(channels)
        for channel in channels:
            assert channel.name.startswith(sensor)
            assert channel.unit
            assert channel.low < channel.high


def test_observations_and_actions_have_names_units_and_bounds() -> None:
    env = single()
    assert env.observation_names[:2] == ("proximity_front_right", "proximity_diagonal_right")
    assert env.observation_names[-1] == "rotation"
    assert env.observation_units == ("counts",) * 8 + ("rad/s",)
    assert env.observation_space == gymnasium.spaces.Box(
        np.array([0] * 8 + [-5], np.float32), np.array([4095] * 8 + [5], np.float32), dtype=np.float32
    )
    assert env.action_names == ("left_wheel", "right_wheel")
    assert env.action_units == ("m/s", "m/s")
    assert env.action_space == gymnasium.spaces.Box(-0.1, 0.1, (2,), np.float32)


# -- seeds --


def test_the_same_seed_gives_the_same_episodes_and_another_seed_others() -> None:
    actions = some_actions(20)
    first, second, other = (
        [played(env, seed, actions), played(env, None, actions)]
        for env, seed in ((single(), 3), (single(), 3), (single(), 4))
    )
    assert data_equivalence(first, second, exact=True)
    assert not data_equivalence(first, other)
    assert not data_equivalence(first[0], first[1])


def test_without_a_seed_every_environment_begins_elsewhere() -> None:
    assert (single().reset()[0] != single().reset()[0]).any()
    assert (several(1).reset()[0] != several(1).reset()[0]).any()


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_worlds_in_one_call_say_what_single_environments_in_a_loop_say(mode: AutoresetMode) -> None:
    loop = SyncVectorEnv([single] * 4, autoreset_mode=mode)
    native = several(4, autoreset_mode=mode)
    assert data_equivalence(loop.reset(seed=11), native.reset(seed=11), exact=True)
    endings = set()
    for actions in some_actions(30, 8).reshape(30, 4, -1):
        expected, got = loop.step(actions), native.step(actions)
        assert data_equivalence(expected, got, exact=True)
        endings |= {"terminated"} if got[2].any() else set()
        endings |= {"truncated"} if got[3].any() else set()
    assert endings == {"terminated", "truncated"}


def test_each_world_can_have_a_seed_of_its_own() -> None:
    env = several(3)
    observations, _ = env.reset(seed=[8, 3, (1 << 64) - 1])
    for observation, seed in zip(observations, (8, 3, (1 << 64) - 1), strict=True):
        assert (observation == single().reset(seed=seed)[0]).all()


# -- rewards, and the end of an episode --


def test_a_mean_fitness_is_the_mean_of_the_rewards_of_the_decisions() -> None:
    env = single(make_task(fitness="mean", is_over=None))
    rewards = [step[1] for step in played(env, 1, some_actions(20))[1:]]
    *_, info = env.step(np.zeros(2, np.float32))
    assert len(rewards) == 6
    assert info["fitness"] == pytest.approx(np.mean(rewards))


def test_the_end_says_its_fitness_and_whether_that_is_a_success() -> None:
    forward = np.full((20, 2), 0.1, np.float32)
    for seed in range(6):
        *before, last = played(single(), seed, forward)
        assert all(info.keys() == {"pose", "is_touching"} for *_, info in before)
        assert last[4]["is_success"] is (last[4]["fitness"] >= 0.01)
        assert last[4]["fitness"] == pytest.approx(sum(step[1] for step in [*before[1:], last]))


def test_the_info_holds_what_a_world_with_a_state_knows_of_the_robot() -> None:
    zones = (Zone("far", 0.4, 0.1, radius=0.05), Zone("here", 0.1, 0.3, radius=0.05, score=2.0))
    scene = Scene(0.5, 0.4, step=1 / 40, zones=zones, energy=Energy(0.4), starts=(Pose(0.1, 0.3),))
    defects = (Defect("proximity", stuck=70.0), Defect("wheel", (0,), factor=0.5))
    task = make_task(is_over=None, randomisation=Randomisation(defects=defects, broken=0.6))
    task = replace(task, scenes=(scene,))
    worlds, found = several(12, task), []
    worlds.reset(seed=1)
    *_, infos = worlds.step(np.zeros((12, 2), np.float32))
    for k in range(12):
        *_, (seen, _, _, _, info) = played(single(task), 1 + k, np.zeros((1, 2), np.float32))
        assert (info["energy"], info["score"], info["zones"]) == (pytest.approx(0.96), 2.0, 0b10)
        assert (seen == 70.0).all() == (info["defect"] == 0)
        assert all(infos[name][k] == info[name] for name in ("energy", "score", "zones", "defect"))
        found.append(info["defect"])
    assert set(found) == {-1, 0, 1}


# -- mistakes --


def test_a_task_of_several_robots_is_refused_with_where_it_can_be_learned() -> None:
    for make in (single, partial(several, 2)):
        with pytest.raises(ArgumentError, match=r"task 'reach' has 2 robots, .*has one\nhint: use .*SwarmEnv"):
            make(PAIR)


def test_an_action_of_another_shape_is_refused_with_the_right_one() -> None:
    env = single()
    env.reset(seed=1)
    with pytest.raises(ArgumentError, match=r"the shape \(3,\); it must have the shape \(2,\)"):
        env.step(np.zeros(3, np.float32))
    with pytest.raises(ArgumentError, match="it must be numbers"):
        env.step("fast")  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match=r"it must have the shape \(2, 2\)"):
        several(2).step(np.zeros(2, np.float32))


def test_an_action_that_is_no_number_is_refused_before_it_counts_as_standing_still() -> None:
    env = single()
    env.reset(seed=1)
    with pytest.raises(ArgumentError, match="not a finite number"):
        env.step(np.array([np.nan, 0.1], np.float32))


def test_modes_that_do_not_exist_are_refused() -> None:
    with pytest.raises(ArgumentError, match="render_mode is 'ansi'"):
        single(render_mode="ansi")
    with pytest.raises(ArgumentError, match="render_mode is 'human'"):
        several(1, render_mode="human")
    for mode in ("Disabled", AutoresetMode.DISABLED, "next", None):
        with pytest.raises(ArgumentError, match="begin again by themselves\nhint: choose from NextStep, SameStep"):
            several(1, autoreset_mode=mode)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="the number of worlds is 0; it must be a whole number from 1 on"):
        several(0)
    with pytest.raises(ArgumentError, match="2 seeds for 3 worlds"):
        several(3).reset(seed=[1, 2])


def test_a_step_before_the_first_reset_is_refused() -> None:
    with pytest.raises(ArgumentError, match=r"step\(\) was called before reset\(\)\nhint: call reset\(\) first"):
        single().step(np.zeros(2, np.float32))
    with pytest.raises(ArgumentError, match=r"step\(\) was called before reset\(\)"):
        several(2).step(np.zeros((2, 2), np.float32))


# -- pictures --


def test_a_picture_shows_the_world_from_above() -> None:
    env = single(render_mode="rgb_array")
    env.reset(seed=1)
    before = env.render()
    assert before.dtype == np.uint8
    assert before.ndim == 3
    assert before.shape[2] == 3
    env.step(np.array([0.1, -0.1], np.float32))
    assert (env.render() != before).any()
    assert single().render() is None


def test_a_vector_environment_has_a_picture_of_every_world() -> None:
    env = several(2, render_mode="rgb_array")
    env.reset(seed=1)
    one = single(render_mode="rgb_array")
    one.reset(seed=2)
    pictures = env.render()
    assert pictures is not None
    assert (pictures[1] == one.render()).all()
    assert several(1).render() is None


# -- names of environments --


def names_of_environments() -> set[str]:
    return {name for name in gymnasium.registry if name.startswith("elib/")}


def test_every_task_of_one_robot_that_comes_with_elib_is_registered_and_no_other() -> None:
    alone = {name for name, task in all_tasks().items() if task.robots == 1}
    assert names_of_environments() == {f"elib/{name.title().replace('-', '')}-v0" for name in alone}
    assert {gymnasium.spec(name).kwargs["task"] for name in names_of_environments()} == alone


@pytest.mark.long
def test_every_registered_environment_can_be_made() -> None:
    for name in names_of_environments():
        gymnasium.make(name, engine="interpreted").close()


@pytest.mark.long
def test_make_imports_the_package_that_stands_before_the_name() -> None:
    code = "import gymnasium; print(gymnasium.make('elib.learn:elib/Avoid-v0', engine='interpreted').unwrapped.task)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=PATIENCE, check=True)
    assert done.stdout.startswith("<Task avoid")
