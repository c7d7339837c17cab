"""Accelerometer and gyroscope: gravity, centripetal force, starts and bumps."""

import math
import statistics

import pytest
from world_rig import Room

from elib.simulator.physics import EpuckModel, Pose, Scene
from elib.simulator.physics.body import GRAVITY
from elib.simulator.physics.sensors.acceleration import RANGE

STEP = 1 / 64
QUIET = EpuckModel(sensor_noise=0)
TURNS = [-4.86, -1.0, -1e-6, 0.0, 1e-6, 0.3, 4.86, 40.0]


def at_rest(model=QUIET, engine="interpreted"):
    return Room(Scene(4, 4, starts=(Pose(1, 1, 0.5),), model=model, step=STEP), engine=engine)


def driven(*poses, model=QUIET, engine="interpreted"):
    """A robot that was at these three poses, the last one now."""
    room = at_rest(model, engine)
    first, before, now = poses
    here = room.robots[0]
    here.x, here.y, here.heading_x, here.heading_y = now.x, now.y, math.cos(now.heading), math.sin(now.heading)
    here.before_x, here.before_y = before.x, before.y
    here.before_heading_x, here.before_heading_y = math.cos(before.heading), math.sin(before.heading)
    here.last_step_x, here.last_step_y = before.x - first.x, before.y - first.y
    return room


def acceleration(room):
    return room.read("acceleration")


def rate(room):
    return room.read("rotation")[0]


def line(*distances, heading=0.5):
    return [Pose(1 + d * math.cos(heading), 1 + d * math.sin(heading), heading) for d in distances]


def circle(speed, radius, start=0.3):
    """On a circle, to the left for a positive radius."""
    turn = speed * STEP / radius
    angles = [start + k * turn for k in range(3)]
    return [Pose(2 + radius * math.sin(a), 2 - radius * math.cos(a), a) for a in angles]


def test_at_rest_it_reads_gravity_upwards():
    assert acceleration(at_rest()) == [0.0, 0.0, GRAVITY]
    assert rate(at_rest()) == 0.0


def test_steady_motion_is_felt_no_more_than_rest():
    assert acceleration(driven(*line(0, 0.002, 0.004))) == pytest.approx([0, 0, GRAVITY], abs=1e-9)


def test_speeding_up_and_slowing_down_are_felt_ahead_and_behind():
    change = 1.0 * STEP * STEP
    faster = acceleration(driven(*line(0, 0.001, 0.002 + change)))
    slower = acceleration(driven(*line(0, 0.001, 0.002 - change)))
    assert faster == pytest.approx([1, 0, GRAVITY], abs=1e-9)
    assert slower == pytest.approx([-1, 0, GRAVITY], abs=1e-9)


def test_a_start_at_full_speed_lasts_one_tick():
    speed = 0.1288
    start = acceleration(driven(*line(0, 0, speed * STEP)))
    assert start == pytest.approx([speed / STEP, 0, GRAVITY])
    assert 0.8 < start[0] / GRAVITY < 0.9


@pytest.mark.parametrize(("speed", "radius"), [(0.1288, 0.1), (0.1, 0.05), (0.1, -0.05), (-0.1, 0.08)])
def test_a_curve_is_felt_towards_its_centre_and_nowhere_else(speed, radius):
    ahead, leftward, up = acceleration(driven(*circle(speed, radius)))
    assert leftward == pytest.approx(speed**2 / radius, rel=2e-3)
    assert ahead == pytest.approx(0, abs=1e-9)
    assert up == GRAVITY


def test_a_wall_is_felt_from_behind_as_far_as_the_chip_reaches():
    stopped = acceleration(driven(*line(0, 0.002, 0.002)))
    assert stopped == pytest.approx([-0.002 / STEP**2, 0, GRAVITY])
    thrown = acceleration(driven(*line(0, 0.02, -0.02)))
    assert thrown == [-RANGE, pytest.approx(0, abs=1e-9), GRAVITY]
    assert pytest.approx(2) == RANGE / GRAVITY


@pytest.mark.parametrize("turn", TURNS)
def test_the_gyroscope_reads_the_turn_of_the_last_tick(turn):
    here = Pose(1, 1, 3.0)
    after = Pose(1, 1, math.remainder(3.0 + turn * STEP, math.tau))
    assert rate(driven(here, here, after)) == pytest.approx(turn, abs=1e-12, rel=1e-12)


def test_the_noise_is_webots_three_per_mille():
    def values(sensor, room, count=400):
        return [sensor(room.at_tick(tick)) for tick in range(count)]

    noisy = values(acceleration, at_rest(EpuckModel()))
    for k, mean in enumerate((0, 0, GRAVITY)):
        axis = [value[k] for value in noisy]
        assert statistics.fmean(axis) == pytest.approx(mean, abs=0.005)
        assert statistics.stdev(axis) == pytest.approx(0.003 * GRAVITY, rel=0.1)
    assert statistics.stdev(values(rate, at_rest(EpuckModel()))) == pytest.approx(math.radians(0.1), rel=0.1)
    turning = driven(Pose(1, 1), Pose(1, 1), Pose(1, 1, 4.0 * STEP), model=EpuckModel())
    assert statistics.stdev(values(rate, turning)) == pytest.approx(0.0017 + 0.003 * 4, rel=0.1)


@pytest.mark.usefixtures("compiled_worlds")
def test_compiled_the_readings_are_the_same():
    for k in range(30):
        poses = [Pose(1 + 0.001 * k * j, 1 - 0.0007 * j * j, 0.2 * k + 0.01 * j * k) for j in range(3)]
        plain = driven(*poses, model=EpuckModel()).at_tick(k)
        fast = driven(*poses, model=EpuckModel(), engine="compiled").at_tick(k)
        assert acceleration(fast) == acceleration(plain)
        assert rate(fast) == rate(plain)
