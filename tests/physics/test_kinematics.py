"""The drive against closed forms."""

import math

import pytest
from world_rig import heading_length

from elib.base.errors import ArgumentError
from elib.simulator.physics import EpuckModel, Pose, Scene, World
from elib.simulator.physics.body import AXLE, WHEEL_DIAMETER
from elib.simulator.physics.motion import MAX_TRAVEL

METRES_PER_STEP = math.pi * WHEEL_DIAMETER / 1000


def room(*, heading=0.0, step=1 / 64, size=4.0, model=None, seed=0):
    starts = (Pose(size / 2, size / 2, heading),)
    return World(Scene(size, size, starts=starts, step=step, seed=seed, model=model or EpuckModel(quality="ideal")))


@pytest.mark.parametrize("heading", [0.0, 0.3, math.pi / 2, -2.5, math.pi])
def test_equal_wheels_drive_straight(heading):
    world = room(heading=heading)
    world.set_wheel_speeds(0, 0.1, 0.1)
    world.run(640)
    pose = world.poses[0]
    assert pose.x == pytest.approx(2 + math.cos(heading), abs=1e-12)
    assert pose.y == pytest.approx(2 + math.sin(heading), abs=1e-12)
    assert abs(math.remainder(pose.heading - heading, math.tau)) < 1e-12


@pytest.mark.parametrize("step", [1 / 64, 1 / 100, 0.1])
@pytest.mark.parametrize(("left", "right"), [(0.06, 0.10), (-0.1, 0.1)], ids=["ahead", "on the spot"])
def test_unequal_wheels_drive_the_exact_circle_at_any_step(step, left, right):
    radius = AXLE / 2 * (left + right) / (right - left)
    world = room(step=step)
    world.set_wheel_speeds(0, left, right)
    for _ in range(400):
        world.step()
        angle = (right - left) / AXLE * world.time
        pose = world.pose(0)
        assert math.remainder(pose.heading - angle, math.tau) == pytest.approx(0, abs=1e-9)
        assert pose.x == pytest.approx(2 + radius * math.sin(angle), abs=1e-9)
        assert pose.y == pytest.approx(2 + radius - radius * math.cos(angle), abs=1e-9)


def test_the_heading_stays_a_unit_vector_over_hours():
    world = room()
    world.set_wheel_speeds(0, -0.1, 0.12)
    world.run(100_000)
    assert heading_length(world) == pytest.approx(1, abs=1e-15)


def test_backwards_retraces_the_way():
    world = room(heading=0.7)
    world.set_wheel_speeds(0, 0.05, 0.11)
    world.run(200)
    world.set_wheel_speeds(0, -0.05, -0.11)
    world.run(200)
    pose = world.pose(0)
    assert (pose.x, pose.y, pose.heading) == pytest.approx((2, 2, 0.7), abs=1e-11)


def test_a_change_within_a_tick_loses_nothing():
    world = room()
    world.set_wheel_speeds(0, 0.1, 0.1, at=0.0)
    world.set_wheel_speeds(0, 0.0, 0.0, at=0.5 + 1 / 200)
    world.run_to(1.0)
    assert world.pose(0).x == pytest.approx(2 + 0.1 * (0.5 + 1 / 200), abs=1e-12)


def test_a_drive_in_the_past_acts_now_and_time_never_goes_back():
    world = room()
    world.run_to(1.0)
    world.set_wheel_speeds(0, 0.064, 0.064, at=0.2)
    assert world.tick == 64
    world.run_to(0.5)
    assert world.tick == 64
    world.run_to(2.0)
    assert world.pose(0).x == pytest.approx(2.064, abs=1e-12)


@pytest.mark.parametrize("speed", [1.3, -1.3, math.nan, math.inf])
def test_a_wheel_that_would_roll_through_walls_is_refused_and_the_old_speed_stays(speed):
    world = room()
    world.set_wheel_speeds(0, 0.1, 0.1)
    with pytest.raises(ArgumentError, match=str(MAX_TRAVEL * 64)):
        world.set_wheel_speeds(0, 0.0, speed)
    world.run(64)
    assert world.pose(0).x == pytest.approx(2.1)


@pytest.mark.parametrize("time", [math.inf, math.nan])
def test_running_without_an_end_is_refused(time):
    with pytest.raises(ArgumentError, match="finite"):
        room().run_to(time)


def test_motor_noise_scatters_the_way_and_keeps_its_mean():
    ends = []
    for seed in range(60):
        world = room(seed=seed, model=EpuckModel(motor_noise=0.05, quality="ideal"))
        world.set_wheel_speeds(0, 0.1, 0.1)
        world.run(64)
        ends.append(world.pose(0).x - 2)
    mean = sum(ends) / len(ends)
    deviation = math.sqrt(sum((end - mean) ** 2 for end in ends) / len(ends))
    # 64 independent ticks of two wheels of 0.1/64 m each, of which the centre moves by half the sum.
    expected = 0.05 * 0.1 / 64 * math.sqrt(64 / 2)
    assert mean == pytest.approx(0.1, abs=4 * expected / math.sqrt(60))
    assert 0.7 * expected < deviation < 1.3 * expected


def test_spread_makes_each_robot_its_own_and_the_same_one_again():
    model = EpuckModel(wheel_spread=0.005, axle_spread=0.005, quality="ideal")

    def end(seed):
        world = room(seed=seed, model=model)
        world.set_wheel_speeds(0, 0.1, 0.1)
        world.run(640)
        return world.pose(0)

    assert end(1) == end(1)
    assert end(1) != end(2)
    assert abs(end(1).heading) > 1e-4
