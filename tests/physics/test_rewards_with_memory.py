"""What a task remembers and observes: named, cleared by every reset, and the same to the last bit on both engines."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from world_rig import IDEAL, task

from elib import ArgumentError, Controller, Scene, SimulationError
from elib.simulator.physics import Box, Cylinder, Episodes, EpuckModel, Light, Pose, Randomisation, Stripe
from elib.simulator.physics.observing import (
    Channel,
    Observation,
    camera_row,
    encoders,
    goal,
    ground_colours,
    neighbours,
)
from lanes import few_and_many

BARE = Scene(0.8, 0.6, step=1 / 40, model=IDEAL)
FULL = Scene(
    1.0,
    0.9,
    boxes=(Box(0.3, 0.3, 0.06, 0.05, is_pushable=True, mass=0.03), Box(0.7, 0.6, 0.1, 0.2)),
    cylinders=(Cylinder(0.6, 0.2, 0.03, is_pushable=True, mass=0.02),),
    lights=(Light(0.5, 0.5, 0.1, 1.0),),
    paint=(Stripe(((0.1, 0.1), (0.8, 0.7))),),
    step=1 / 40,
    model=EpuckModel(motor_noise=0.02),
)
CELLS = 6


def cell(at):
    return min(max(int(at * CELLS), 0), CELLS - 1)


def cover(world, i, memory):
    """Earn 1 for each new cell, less what the robot has used of its energy."""
    robot = world.robots[i]
    memory.energy[i] -= 0.003 * (robot.left_speed + robot.right_speed)
    memory.trail[i][1] = memory.trail[i][0]
    memory.trail[i][0] = robot.x
    row, column = cell(robot.y), cell(robot.x)
    if memory.visited[row][column] == 0.0:
        memory.visited[row][column] = 1.0
        memory.found += 1.0
        return 1.0
    return memory.energy[i] / 1000.0 + 0.001 * memory.trail[i][1]


def is_covered(world, memory):
    return memory.found >= 7.0


def left_to_find(world, i, k, memory):
    return CELLS * CELLS - memory.found if k == 0 else memory.energy[i]


LEFT = Observation([("to_find", "cells", 0.0, CELLS * CELLS), Channel("energy")], left_to_find)
SEEN = (goal(0.5, 0.5), goal(lamp=0), goal(thing=1), neighbours(2), encoders(), ground_colours(), camera_row(5), LEFT)


def covering(*scenes, **options):
    given = {
        "reward": cover,
        "is_over": is_covered,
        "memory": {"visited": np.zeros((CELLS, CELLS)), "found": 0.0},
        "robot_memory": {"energy": 1.0, "trail": [0.5, 0.25]},
        "randomisation": Randomisation(motor_noise=(0.0, 0.1), latency=(0, 0.1)),
        "fitness": "sum",
        "seconds": 1.0,
    }
    return task(*scenes or (FULL,), **(given | options))


def told(episodes, seed, decisions=12):
    """Return all that an episode says, driven by actions that its seed draws."""
    draw = np.random.default_rng(seed % (1 << 32))
    said = []
    episodes.reset(seed)
    for _ in range(decisions):
        said.append(episodes.observed.tolist())
        earned = episodes.step(draw.uniform(-0.02, 0.1, (episodes.count, episodes.task.robots, 2)), begin_again=False)
        said += [earned.tolist(), episodes.places.tolist(), episodes.memory.tolist(), episodes.progress.tolist()]
    return repr(said)


@pytest.mark.usefixtures("compiled_episodes")
@few_and_many(3, 30)
def test_both_engines_remember_and_observe_the_same_to_the_last_bit(examples):
    observe = SEEN if examples > 3 else (LEFT,)
    pairs = {}
    for robots in (1,) if examples == 3 else (1, 3):
        about = covering(FULL, robots=robots, observe=observe, sensors=("proximity", "ground"))
        pairs[robots] = [Episodes(about, engine=engine, threads=1) for engine in ("interpreted", "compiled")]

    @settings(max_examples=examples)
    @given(st.sampled_from(sorted(pairs)), st.integers(0, (1 << 64) - 1))
    def check(robots, seed):
        interpreted, compiled = pairs[robots]
        assert told(interpreted, seed) == told(compiled, seed)

    check()


@pytest.mark.usefixtures("compiled_episodes")
def test_nothing_is_remembered_from_another_episode(engine):
    about = covering(robots=2)
    seeds = [9, 4, 7, 9]
    episodes = Episodes(about, engine=engine, threads=1)
    assert [told(episodes, seed) for seed in seeds] == [
        told(Episodes(about, engine=engine, threads=1), seed) for seed in seeds
    ]


@pytest.mark.long
def test_a_thousand_episodes_in_any_order_and_number_of_threads_earn_what_each_earns_alone(monkeypatch):
    monkeypatch.setattr("elib.simulator.physics.episodes.SMALL", 0)
    about = covering(FULL, BARE, robots=2, seconds=0.5)
    law = Controller(lambda robot, parameters, memory: wander(robot, parameters, memory), [0.0, 0.0], memory=1)
    population = np.random.default_rng(3).uniform(0, 700, (2, 2))
    order = list(range(1000))
    random.Random(1).shuffle(order)
    for engine, count in (("compiled", 1000), ("interpreted", 40)):
        some = [seed for seed in order if seed < count]
        one, two = (Episodes(about, engine=engine, threads=threads) for threads in (1, 2))
        many = one.play(law, population, some).fitness
        alone = [one.play(law, population, [seed]).fitness[:, 0] for seed in sorted(some)]
        assert many.tolist() == two.play(law, population, some).fitness.tolist()
        assert many[:, np.argsort(some)].tolist() == np.array(alone).T.tolist()
    assert many.tolist() == Episodes(about, threads=2).play(law, population, some).fitness.tolist()


def wander(robot, parameters, memory):
    memory[0] += 1.0
    robot.left = parameters[0] + memory[0]
    robot.right = parameters[1]


def test_a_goal_ahead_has_the_bearing_0_and_one_to_the_left_a_quarter_turn():
    about = task(replace(BARE, starts=(Pose(0.4, 0.3, 0.5 * math.pi),)), observe=(goal(0.4, 0.5), goal(0.2, 0.3)))
    episodes = Episodes(about, engine="interpreted")
    assert episodes.observed[0, 0, 8:].tolist() == pytest.approx([0.2, 0.0, 0.2, math.pi / 2])


def test_neighbours_are_told_the_nearest_first_and_none_beyond_their_reach():
    starts = (Pose(0.1, 0.3), Pose(0.7, 0.3), Pose(0.1, 0.5))
    about = task(replace(BARE, starts=starts), robots=3, observe=(neighbours(2, reach=0.4),))
    seen = Episodes(about, engine="interpreted").observed[0, :, 8:]
    assert seen[0].tolist() == pytest.approx([0.2, math.pi / 2, 0.4, 0.0])
    assert seen[1].tolist() == [0.4, 0.0, 0.4, 0.0]


def test_a_row_of_the_camera_is_brighter_where_a_white_wall_stands_and_dark_where_nothing_is():
    scene = replace(BARE, starts=(Pose(0.4, 0.3, 0.0),), boxes=(Box(0.7, 0.3, 0.02, 0.6, height=0.01),))
    row = Episodes(task(scene, observe=(camera_row(8),)), engine="interpreted").observed[0, 0, 8:]
    assert (row > 0.0).all()
    assert row.tolist() == pytest.approx(row[::-1].tolist())


COUNTS = [0.0]


def counts_in_its_module(world, i):
    COUNTS[0] += 1.0
    return COUNTS[0]


def beyond(world, i, memory):
    memory.visited[int(world.setting[0].tick)][0] = 1.0
    return 0.0


def misspells(world, i, memory):
    return memory.energie[i]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"memory": {}, "robot_memory": {}}, r"takes a memory, and the task declares none\nhint: .*memory=\{"),
        (
            {"reward": counts_in_its_module},
            r"changes the world, or a variable of its module.*\nhint: .*robot_memory=\{",
        ),
        (
            {"reward": misspells},
            r"has no attribute .* in test_rewards_with_memory.py, .*\nhint: did you mean energy\? it has visited",
        ),
        ({"memory": {"visited": "none"}}, r"memory\['visited'\] of task 'test' is 'none'; it must be a finite number"),
        ({"robot_memory": {"found": 0.0}}, "remembers 'found', which cannot be the name of a number, or is taken"),
        ({"memory": {"1st": 0.0}}, "remembers '1st'"),
    ],
)
def test_a_memory_with_a_mistake_is_refused_with_what_to_write(change, message):
    with pytest.raises(ArgumentError, match=message):
        Episodes(covering(**change), engine="interpreted")


@pytest.mark.usefixtures("compiled_episodes")
def test_an_index_out_of_its_range_is_an_error_and_not_the_memory_of_another_world(engine):
    episodes = Episodes(covering(reward=beyond, is_over=None), 2, engine=engine, threads=1)
    with pytest.raises(ArgumentError, match="uses an index that is out of its range"):
        for _ in range(4):
            episodes.step(np.zeros((2, 1, 2)))


def test_an_observation_needs_channels():
    with pytest.raises(ArgumentError, match="an observation needs channels and a function"):
        Observation([], left_to_find)


@pytest.mark.usefixtures("compiled_episodes")
def test_what_cannot_be_compiled_says_how_to_remember():
    about = covering(reward=lambda world, i, memory: float(len({i: 1})))
    with pytest.raises(SimulationError, match="what lasts is declared: Task"):
        Episodes(about).step(np.zeros((1, 1, 2)))
