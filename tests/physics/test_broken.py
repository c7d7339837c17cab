"""Broken parts of robots in the physics: one law for all, on both engines, and nothing for robots that are whole."""

import random
from dataclasses import replace

import numpy as np
import pytest
from world_rig import ENGINES

from elib.base.body import FASTEST_2
from elib.base.errors import ArgumentError
from elib.simulator.physics import Defect, Episodes, EpuckModel, Pose, Randomisation, Scene, Task, World
from elib.simulator.physics.defects import FACTORS, PARTS, SENSORS
from elib.simulator.physics.motion import MAX_TRAVEL
from elib.simulator.physics.records import SENSORS as VIEWED
from elib.simulator.physics.scene import MAX_STEP

READ = {"accelerometer": "acceleration", "gyroscope": "rotation"}
"""Sensors that a world calls otherwise than a robot."""
ROOM = Scene(1.0, 1.0, starts=(Pose(0.3, 0.3), Pose(0.6, 0.6, 1.0), Pose(0.75, 0.3, 2.0)), model=EpuckModel())


def driven(engine="interpreted", *given, ticks=20):
    """Return a world of three robots that have driven, of which the second one has the given defects."""
    world = World(ROOM, seed=4, engine=engine)
    world.set_defects(1, given)
    for robot in range(3):
        world.set_step_rates(robot, 400, 300)
    world.run(ticks)
    return world


def readings(world):
    return {sensor: world.readings(sensor).reshape(3, -1) for sensor in VIEWED}


def drawn(draw):
    """Return some defects of any parts."""
    found = []
    for _ in range(draw.randrange(1, 8)):
        of = draw.choice(list(PARTS))
        numbers = tuple(draw.sample(range(len(PARTS[of])), draw.randrange(len(PARTS[of]))))
        if of in ("wheel", "clock"):
            found.append(Defect(of, numbers, factor=draw.uniform(0.3, 1.0)))
        elif draw.random() < 0.3:
            found.append(Defect(of, numbers, stuck=draw.uniform(0, 300), noise=draw.uniform(0, 30)))
        else:
            more = draw.uniform(0, 2), draw.uniform(-50, 50), draw.choice((0.0, 20.0))
            found.append(Defect(of, numbers, *more))
    return found


def test_all_that_can_break_has_places_of_its_own_and_every_sensor_of_a_world_is_among_it():
    assert [place for part in PARTS.values() for place in part] == list(range(39))
    assert {READ.get(sensor, sensor) for sensor in SENSORS} == {*VIEWED, "magnetometer"}


@pytest.mark.parametrize("sensor", [sensor for sensor in SENSORS if sensor != "magnetometer"])
def test_a_broken_sensor_of_one_robot_changes_its_readings_and_nothing_else(sensor):
    name, number = READ.get(sensor, sensor), 2 if sensor == "gyroscope" else 0
    whole, seen = readings(driven()), readings(driven("interpreted", Defect(sensor, (number,), stuck=0.75)))
    expected = 1 if name in ("proximity", "ambient_light", "ground", "microphones") else 0.75
    assert seen[name][1, 0] == expected != whole[name][1, 0]
    seen[name][1, 0] = whole[name][1, 0]
    assert all((seen[each] == whole[each]).all() for each in VIEWED)


def test_readings_stay_in_their_range_whatever_is_added():
    for shift in (-1e5, 1e5):
        seen = readings(driven("interpreted", *(Defect(sensor, shift=shift) for sensor in SENSORS)))
        high = shift > 0
        assert set(seen["proximity"][1]) == set(seen["ambient_light"][1]) == {4095 * high}
        assert set(seen["ground"][1]) == {1000 * high}
        assert seen["distance"][1] == 2.0 * high


def test_noise_has_the_deviation_that_was_asked_for_and_mending_ends_it():
    world = driven("interpreted", Defect("ambient_light", (3,), factor=0.5, noise=40.0))
    seen = []
    for _ in range(1500):
        world.step()
        seen.append(world.ambient_light(1)[3])
    assert np.std(seen) == pytest.approx(40.0, rel=0.1)
    assert np.mean(seen) == pytest.approx(0.5 * world.ambient_light(1)[2], rel=0.05)
    world.set_defects(1, ())
    assert world.ambient_light(1)[3] == pytest.approx(world.ambient_light(1)[2], rel=0.05)


def test_a_loose_wheel_rolls_nothing_and_its_steps_count_a_slow_clock_slows_both():
    whole, loose = driven(), driven("interpreted", Defect("wheel", (0,), factor=0.0))
    slow = driven("interpreted", Defect("clock", factor=0.5))
    assert loose.encoders(1) == whole.encoders(1)
    assert loose.poses[1].heading > whole.poses[1].heading + 0.2
    assert slow.encoders(1) == tuple(steps // 2 for steps in whole.encoders(1))
    assert loose.poses[0] == slow.poses[0] == whole.poses[0]


def test_a_camera_is_dark_or_noisy_in_each_pixel_of_its_own():
    def picture(*given):
        return driven("interpreted", *given).picture(1, [-100.0, 0.0, 100.0, 200.0], [50.0, 0.0, -50.0])

    whole, half = picture(), picture(Defect("camera", factor=0.5))
    assert (picture(Defect("camera", factor=0.0)) == 0).all()
    assert (abs(half - whole / 2) <= 0.5).all()
    noisy = picture(Defect("camera", noise=30.0)).astype(int) - whole
    assert len(np.unique(noisy)) > 10
    assert (noisy == picture(Defect("camera", noise=30.0)) - whole.astype(int)).all()


def test_a_new_run_has_whole_robots():
    world = driven("interpreted", Defect("proximity", stuck=9.0), Defect("wheel", factor=0.0))
    world.reset()
    for robot in range(3):
        world.set_step_rates(robot, 400, 300)
    world.run(20)
    assert world.hash() == driven().hash()


@pytest.mark.usefixtures("compiled_worlds")
def test_both_engines_give_the_same_bits_of_drawn_defects():
    draw = random.Random(1)
    for _ in range(8):
        given = drawn(draw)
        one, other = (driven(engine, *given, ticks=10) for engine in ENGINES)
        assert all((readings(one)[each] == readings(other)[each]).all() for each in VIEWED), given
        assert one.hash() == other.hash(), given


def forward(world, i):
    return world.robots[i].left_speed + world.views[i].proximity[0]


def of_task(broken, *given, robots=4):
    draws = Randomisation(defects=given, broken=broken)
    return Task(
        "t",
        "x",
        (ROOM,),
        forward,
        sensors=("proximity",),
        robots=robots,
        period=0.125,
        seconds=2.0,
        randomisation=draws,
    )


def stuck_robots(task, engine="interpreted"):
    episodes = Episodes(task, 30, engine=engine, threads=1)
    seen = []
    for _ in range(10):
        episodes.reset(None)
        earned = episodes.step(np.full((30, task.robots, 2), 0.05))
        seen.append((episodes.readings("proximity"), earned))
    return np.array([read for read, _ in seen]), np.array([earned for _, earned in seen])


@pytest.mark.parametrize("generation", [1, 2])
def test_a_clock_that_is_as_fast_as_can_be_turns_no_wheel_too_far_in_the_longest_step(generation):
    world = World(replace(ROOM, step=MAX_STEP, model=EpuckModel(generation=generation)))
    world.set_defects(0, [Defect("clock", factor=FACTORS["clock"][1])] * 2)
    world.set_step_rates(0, FASTEST_2, FASTEST_2)
    assert 0.8 * MAX_TRAVEL < world.wheel_speeds(0)[0] * MAX_STEP <= MAX_TRAVEL


def test_a_task_draws_a_broken_sensor_for_each_robot_with_the_probability_it_says():
    one_each = tuple(Defect("proximity", (s,), stuck=4000.0) for s in range(8))
    read, _ = stuck_robots(of_task(0.25, *one_each))
    stuck = read == 4000
    assert set(stuck.sum(axis=-1).ravel()) == {0, 1}
    assert stuck.any(axis=-1).mean() == pytest.approx(0.25, abs=0.04)
    assert (stuck.mean(axis=(0, 1, 2)) > 0.015).all(), "each of them is drawn"


@pytest.mark.usefixtures("compiled_episodes")
def test_both_engines_draw_the_same_broken_robots():
    task = of_task(0.5, Defect("proximity", (0,), factor=0.5, noise=20.0), Defect("clock", factor=0.5))
    for one, other in zip(*(stuck_robots(task, engine) for engine in ENGINES), strict=True):
        assert (one == other).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Defect("prox"), "of is 'prox'; it must be \"proximity\" or"),
        (lambda: Defect("ground", (5,), stuck=1.0), "numbers has 5; those of ground are 0 to 4"),
        (lambda: Defect("wheel", shift=1.0), "a wheel can only be slower or faster"),
        (lambda: Defect("wheel", factor=1.01), "the wheel's factor is 1.01; it must be a number from 0 to 1"),
        (lambda: Defect("clock", factor=9.0), "the clock's factor is 9"),
        (lambda: Randomisation(broken=0.5), "but no defect is named"),
        (lambda: Randomisation(defects=(Defect("camera", stuck=0.0),)), "no robot has one"),
        (lambda: Randomisation(defects=(Defect("camera", stuck=0.0),), broken=1.5), "broken is 1.5"),
    ],
)
def test_a_defect_that_cannot_be_is_refused(make, message):
    with pytest.raises(ArgumentError) as caught:
        make()
    assert message in caught.value.message
