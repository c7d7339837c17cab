"""Episodes of a task: the same to the last bit on both engines, and the same as a world that runs by itself."""

import math
import pickle
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from world_rig import IDEAL, everything, task

from elib import ArgumentError, Controller, Scene, World
from elib.base.body import METRES_PER_STEP, step_rate
from elib.simulator.physics import Box, Cylinder, Episodes, EpuckModel, Light, Pose, Randomisation
from elib.simulator.physics.course import START
from elib.simulator.physics.noise import bits, seed_key
from elib.simulator.physics.observing import goal
from elib.simulator.physics.placement import places
from lanes import few_and_many

BARE = Scene(0.8, 0.6, step=1 / 40, model=IDEAL)
FULL = Scene(
    1.0,
    0.9,
    boxes=(Box(0.3, 0.3, 0.06, 0.05, is_pushable=True, mass=0.03), Box(0.7, 0.6, 0.1, 0.2)),
    cylinders=(Cylinder(0.6, 0.2, 0.03, is_pushable=True, mass=0.02),),
    lights=(Light(0.5, 0.5, 0.1, 1.0),),
    step=1 / 40,
    model=EpuckModel(motor_noise=0.02, gain_spread=0.05, quality="ideal"),
)
SEEDS = [8_127_421_013_306_842_519, 3, (1 << 64) - 2]


def clock(world, i):
    """Earn 1 a tick."""
    return 1.0


def far_to_the_right(world):
    return world.robots[0].x > 0.5


def seek(robot, parameters, memory):
    memory[0] = 0.5 * memory[0] + parameters[0] * (robot.proximity[0] - robot.proximity[7])
    robot.left = parameters[1] - memory[0]
    robot.right = parameters[1] + memory[0]


DRAWN = Randomisation(
    motor_noise=(0.0, 0.1), sensor_noise=(0.5, 2.0), ambient=(3000.0, 4000.0), gain_spread=(0.0, 0.1), latency=(0, 0.1)
)


def stepped(about, engine, *, count, seeds, steps, threads=None):
    """Return all that can be seen of some steered episodes."""
    seen = []
    episodes = Episodes(about, count, engine=engine, threads=threads)
    draw = np.random.default_rng(5)
    for seed in seeds:
        episodes.reset(seed)
        for _ in range(steps):
            seen.append(episodes.step(draw.uniform(-0.1, 0.1, (count, about.robots, 2))).tolist())
            seen += [episodes.readings(sensor).tolist() for sensor in about.sensors]
        seen.append([everything(episodes.world(k)) for k in range(count)])
        seen += [episodes.ticks.tolist(), episodes.is_over.tolist()]
    return seen


def played(about, engine, *, threads=None):
    """Return all that can be seen of episodes that a population of controllers plays."""
    population = np.random.default_rng(6).uniform(0, 600, (5, 2))
    controller = Controller(seek, [0.0, 0.0], memory=1)
    scores = Episodes(about, 4, engine=engine, threads=threads).play(controller, population, SEEDS)
    return [scores.fitness.tolist(), scores.steps.tolist()]


@pytest.mark.usefixtures("compiled_episodes")
def test_both_engines_and_any_number_of_threads_step_the_same_episodes_to_the_last_bit(monkeypatch):
    monkeypatch.setattr("elib.simulator.physics.episodes.SMALL", 0)
    about = task(FULL, BARE, robots=3, randomisation=DRAWN, seconds=0.5)
    told = stepped(about, "interpreted", count=4, seeds=SEEDS, steps=7)
    for threads in (1, 3):
        assert told == stepped(about, "compiled", count=4, seeds=SEEDS, steps=7, threads=threads)


@pytest.mark.long
def test_both_engines_and_any_number_of_threads_play_the_same_episodes_to_the_last_bit(monkeypatch):
    monkeypatch.setattr("elib.simulator.physics.episodes.SMALL", 0)
    about = task(FULL, BARE, robots=3, randomisation=DRAWN, sensors=("proximity", "ambient_light"))
    told = stepped(about, "interpreted", count=4, seeds=SEEDS, steps=24), played(about, "interpreted")
    for threads in (1, 3):
        assert told[0] == stepped(about, "compiled", count=4, seeds=SEEDS, steps=24, threads=threads)
        assert told[1] == played(about, "compiled", threads=threads)


def test_an_episode_is_what_a_world_with_its_seed_does_by_itself():
    seed = SEEDS[0]
    starts = places(FULL, 2, bits(seed_key(seed), START) % 64)
    world = World(replace(FULL, starts=starts), seed=seed)
    episodes = Episodes(task(FULL, robots=2), engine="interpreted")
    episodes.reset(seed)
    speeds = ((0.05, 0.08), (-0.04, 0.1))
    for robot, (left, right) in enumerate(speeds):
        world.set_step_rates(robot, int(left / METRES_PER_STEP), int(right / METRES_PER_STEP))
    for _ in range(15):
        episodes.step([speeds])
        world.run(4)
        assert episodes.world(0).hash() == world.hash()
        assert episodes.readings("proximity")[0].tolist() == world.readings("proximity").tolist()


@pytest.mark.usefixtures("compiled_episodes")
def test_an_episode_begins_as_it_did_whatever_was_pushed_before(engine):
    about = task(FULL, seconds=60.0, sensors=("proximity", "ambient_light"))
    episodes = Episodes(about, engine=engine)
    episodes.reset(SEEDS[1])
    fresh = episodes.world(0).hash()
    for _ in range(100):
        episodes.step([[[0.1, 0.09]]])
    assert episodes.world(0).hash() != fresh
    episodes.reset(SEEDS[1])
    assert episodes.world(0).hash() == fresh


def test_world_k_of_many_has_the_episode_of_a_single_world_with_its_seed():
    many, one = Episodes(task(FULL, BARE), 3, engine="interpreted"), Episodes(task(FULL, BARE), engine="interpreted")
    many.reset(SEEDS[2])
    for k in range(3):
        one.reset((SEEDS[2] + k) % (1 << 64))
        assert one.world(0).hash() == many.world(k).hash()


def test_an_episode_ends_with_its_time_and_the_next_call_begins_another_one():
    episodes = Episodes(task(BARE, reward=clock, seconds=0.5), 2, engine="interpreted")
    first = episodes.world(0).hash()
    for _ in range(5):
        assert episodes.step(np.zeros((2, 1, 2))).tolist() == [[4], [4]]
    assert episodes.ticks.tolist() == [20, 20] == [episodes.task.ticks] * 2
    assert not episodes.is_over.any()
    assert episodes.step(np.zeros((2, 1, 2)), begin_again=False).tolist() == [[0], [0]]
    assert episodes.ticks.tolist() == [20, 20]
    assert episodes.step(np.zeros((2, 1, 2))).tolist() == [[0], [0]]
    assert episodes.ticks.tolist() == [0, 0]
    assert episodes.world(0).hash() != first
    assert episodes.step(np.zeros((2, 1, 2))).tolist() == [[4], [4]]


def test_a_task_ends_an_episode_in_the_tick_in_which_it_says_so():
    right = replace(BARE, starts=(Pose(0.4935, 0.3, 0.0),))
    episodes = Episodes(task(right, reward=clock, is_over=far_to_the_right, top_speed=0.12), engine="interpreted")
    speed = step_rate(776, 1) * METRES_PER_STEP
    ticks = math.ceil((0.5 - 0.4935) / (speed / 40))
    assert 0 < ticks < 4  # within a period
    earned = []
    while not episodes.is_over[0]:
        earned.append(episodes.step([[[0.1, 0.1]]])[0, 0])
    assert sum(earned) == episodes.ticks[0] == ticks
    assert episodes.step([[[0.1, 0.1]]])[0, 0] == episodes.ticks[0] == 0
    scores = episodes.play(Controller(seek, [0.0, 0.0], memory=1), [[0.0, 776.4], [0.0, 0.0]], [1])
    assert scores.fitness.ravel().tolist() == [ticks, 80]


def test_a_mean_fitness_is_a_share_of_the_ticks_of_a_full_episode():
    episodes = Episodes(task(BARE, reward=clock, fitness="mean", robots=2), engine="interpreted")
    scores = episodes.play(Controller(seek, [0.0, 0.0], memory=1), [[0.0, 100.0]], [1, 2])
    assert scores.fitness.ravel().tolist() == pytest.approx([1, 1])


def test_wheels_follow_a_decision_after_the_latency_that_was_drawn():
    late = replace(BARE, starts=(Pose(0.2, 0.3, 0.0),))
    at = [
        Episodes(task(late, randomisation=Randomisation(latency=(delay, delay))), engine="interpreted")
        for delay in (0.0, 0.05, 0.1)
    ]
    for each in at:
        each.step([[[0.1, 0.1]]])
    moved = [each.world(0).poses[0].x - 0.2 for each in at]
    period = step_rate(776, 1) * METRES_PER_STEP * 0.1
    assert moved == pytest.approx([period, period / 2, 0.0])
    at[2].step([[[0.0, 0.0]]])
    assert at[2].world(0).poses[0].x - 0.2 == pytest.approx(period)  # a whole period late


@few_and_many(10, 25)
def test_what_is_drawn_lies_within_its_range_and_differs_from_episode_to_episode(examples):
    episodes = Episodes(task(BARE, FULL, randomisation=DRAWN), examples, engine="interpreted")
    drawn = [episodes.world(k) for k in range(examples)]
    ambient = [world.ambient for world in drawn]
    assert all(3000 <= each <= 4000 for each in ambient)
    assert len(set(ambient)) == examples
    assert {world.scene for world in drawn} == {BARE, FULL}
    assert all(0 <= world.records.setting[0].motor_noise <= 0.1 for world in drawn)


def test_actions_are_limited_to_the_top_speed_and_what_is_no_number_stands():
    middle = replace(BARE, starts=(Pose(0.4, 0.3, 0.0),))
    moved = []
    for action in (0.05, 9.0, math.nan, math.inf):
        episodes = Episodes(task(middle, top_speed=0.05), engine="interpreted")
        episodes.step([[[action, action]]])
        moved.append(episodes.world(0).poses[0].x)
    assert moved[0] == moved[1] == moved[3] > moved[2] == 0.4


@pytest.mark.usefixtures("compiled_episodes", "compiled_worlds")
def test_a_pickled_copy_goes_on_with_the_same_episode():
    episodes = Episodes(task(FULL), 2)
    episodes.step(np.full((2, 1, 2), 0.05))
    twin = pickle.loads(pickle.dumps(episodes))
    actions = np.full((2, 1, 2), 0.08)
    assert twin.step(actions).tolist() == episodes.step(actions).tolist()
    assert twin.world(1).hash() == episodes.world(1).hash()


def fails(world, i):
    return world.robots[i + 1].x


def not_a_number(world, i):
    return math.inf


def dark(world, i):
    return brightness(world.views[i]) if world.robots[i].x > 5.0 else 0.0


def brightness(view):
    return view.ambient_light[0] / 4095


CONSTANTS = SimpleNamespace(distance=0.3)


def no_reading(world, i):
    return CONSTANTS.distance


def stands(world):
    return view_of(world).distance < 0.3


def view_of(world):
    return world.views[0]


def flies(world, i):
    return world.robots[i].vx


def grows(world, i):
    return world.robot[i].x


def pushes(world, i):
    world.robots[i].x = 0.5
    return 1.0


def light(world, i):
    return world.lamps[0].x


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"reward": dark},
            "the reward of task 'test' reads ambient_light, which the task does not declare: it would be 0\n"
            r".*reward_sensors=\('proximity', 'ambient_light'\)",
        ),
        (
            {"is_over": stands, "reward_sensors": ("proximity",)},
            "the end of task 'test' reads distance, .*\n"
            r".*reward_sensors=\('proximity', 'distance'\)",
        ),
        (
            {"reward": flies},
            "'Robot' object has no attribute 'vx'.*\nhint: did you mean x. it has x, y, heading_x, h",
        ),
        (
            {"reward": grows},
            "'Records' object has no attribute 'robot'.*\nhint: did you mean robots. it has set",
        ),
        ({"reward": fails}, "a function of task 'test' fails in the first tick: IndexError"),
        ({"reward": light}, r"IndexError.*, in test_episodes.py, line \d+: return .*\nhint: the first .* 0 lamps, "),
        ({"observe": (goal(lamp=3),)}, r"IndexError.*lamps\[lamp\].*\nhint: the first has the number 0; .* 0 lamps, "),
        ({"observe": goal(1.0, 1.0)}, r"observe is .*; it must be a tuple of observations\nhint: such as observe=\(g"),
        ({"reward": not_a_number}, r"the reward of task 'test' is \[inf\] in the first tick"),
        ({"is_over": fails}, "the end of task 'test' takes a memory, and the task declares none"),
        ({"reward": pushes}, "a function of task 'test' changes the world, or a variable"),
        ({"sensors": ("sonar",)}, "there is no sensor 'sonar'\nhint: choose one of proximity, "),
        ({"sensors": ("proximit",)}, "there is no sensor 'proximit'\nhint: did you mean proximity?"),
        ({"period": 0.03}, "a period of 0.03 s is not a whole number of ticks of 0.025 s"),
        ({"seconds": 0.05}, r"an episode of 0.05 s is shorter than a period, 0.1 s"),
        ({"robots": 0}, "the task's robots"),
        ({"top_speed": 0.2}, "the task's top_speed"),
        ({"randomisation": Randomisation(latency=(0, 0.2))}, "a latency of 0.2 s is longer than its period"),
    ],
)
def test_a_task_with_a_mistake_says_which(change, message):
    with pytest.raises(ArgumentError, match=message):
        Episodes(task(BARE, **change), engine="interpreted")


def test_a_reward_that_reads_what_one_of_the_scenes_does_not_have_is_refused():
    with pytest.raises(ArgumentError, match="a function of task 'test' fails in the first tick: IndexError"):
        Episodes(task(FULL, BARE, reward=light), engine="interpreted")
    Episodes(task(FULL, replace(FULL, boxes=()), reward=light), engine="interpreted")


def test_a_reward_may_read_what_the_controller_or_the_reward_senses_also_in_a_branch_not_yet_taken():
    for declared in ({"sensors": ("ambient_light",)}, {"reward_sensors": ("ambient_light",)}):
        Episodes(task(BARE, reward=dark, **declared), engine="interpreted")
    Episodes(task(BARE, reward=no_reading), engine="interpreted")


@pytest.mark.parametrize("seed", [None, 1])
@pytest.mark.parametrize("which", [[2], [-1], [0.5]])
def test_a_world_that_does_not_exist_cannot_begin_again(seed, which):
    with pytest.raises(ArgumentError, match=r"the number of a world is .* from 0 to 1"):
        Episodes(task(BARE), 2, engine="interpreted").reset(seed, which)


def test_ranges_with_mistakes_and_tasks_without_scenes_are_refused():
    with pytest.raises(ArgumentError, match=r"the range of motor_noise is \(0.2, 0.1\)"):
        Randomisation(motor_noise=(0.2, 0.1))
    with pytest.raises(ArgumentError, match=r"0 <= low <= high <= 0\.3"):
        Randomisation(motor_noise=(0.0, 0.4))
    with pytest.raises(ArgumentError, match=r"0 <= low <= high <= 4095"):
        Randomisation(ambient=(0.0, 4096.0))
    with pytest.raises(ArgumentError, match="has no scenes"):
        task()
    with pytest.raises(ArgumentError, match="its scenes have different steps"):
        task(BARE, replace(BARE, step=1 / 80))


def test_a_population_of_the_wrong_shape_and_a_sensor_that_is_not_sensed_are_refused():
    episodes = Episodes(task(BARE), engine="interpreted")
    with pytest.raises(ArgumentError, match="the population has the shape"):
        episodes.play(Controller(seek, [0.0, 0.0], memory=1), [1.0, 2.0], [1])
    with pytest.raises(ArgumentError, match="does not sense 'ground'"):
        episodes.readings("ground")
    with pytest.raises(ArgumentError, match="fails on readings of 0"):
        episodes.play(Controller(seek, [0.0, 0.0], memory=0), [[1.0, 2.0]], [1])
