"""Accelerometer and gyroscope: gravity, centripetal force, starts and bumps."""

import math
import statistics

import pytest
from world_rig import Room

from elib.base.body import METRES_PER_STEP
from elib.simulator.physics import EpuckModel, Pose, Scene
from elib.simulator.physics.body import GRAVITY
from elib.simulator.physics.sensors.acceleration import RANGE
from elib.simulator.physics.sensors.rotation import rocking

STEP = 1 / 64
QUIET = EpuckModel(sensor_noise=0, quality="ideal")
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


def values(sensor, room, count=400):
    return [sensor(room.at_tick(tick)) for tick in range(count)]


def test_a_robot_that_stands_has_the_noise_that_was_measured():
    noisy = values(acceleration, at_rest(EpuckModel(quality="ideal")))
    for k, (mean, counts) in enumerate(((0, 2.0), (0, 1.8), (GRAVITY, 2.5))):  # of 768
        axis = [value[k] for value in noisy]
        assert statistics.fmean(axis) == pytest.approx(mean, abs=0.005)
        assert statistics.stdev(axis) == pytest.approx(counts / 768 * GRAVITY, rel=0.1)
    assert statistics.stdev(values(rate, at_rest(EpuckModel(quality="ideal")))) == pytest.approx(
        math.radians(0.11), rel=0.1
    )
    turning = driven(Pose(1, 1), Pose(1, 1), Pose(1, 1, 4.0 * STEP), model=EpuckModel(quality="ideal"))
    assert statistics.stdev(values(rate, turning)) == pytest.approx(math.radians(0.11) + 0.003 * 4, rel=0.1)


def rolling(steps, quality="typical"):
    """A robot whose motors turn at so many steps/s, but that does not move: it feels what shakes it alone."""
    room = at_rest(EpuckModel(sensor_noise=0, quality=quality))
    room.robots[0].left_speed = steps * METRES_PER_STEP
    return room


@pytest.mark.parametrize(("steps", "factor"), [(0, 0), (10, 1), (212, 1), (340, 1), (680, 2), (800, 2)])
def test_the_motors_shake_a_typical_robot_as_measured_and_an_ideal_one_not(steps, factor):
    for k, share in enumerate((0.045, 0.022, 0.043)):
        axis = [value[k] for value in values(acceleration, rolling(steps))]
        assert statistics.stdev(axis) == pytest.approx(factor * share * GRAVITY, rel=0.1, abs=1e-9)
    room = rolling(steps)
    rates = [*zip(*values(lambda room: rocking(room.state.world, 0), room), strict=True), values(rate, room)]
    for axis, degrees in zip(rates, (1.1, 2.3, 4.9), strict=True):
        assert statistics.stdev(axis) == pytest.approx(factor * math.radians(degrees), rel=0.1, abs=1e-9)
    assert acceleration(rolling(steps, "ideal")) == [0.0, 0.0, GRAVITY]
    assert rate(rolling(steps, "ideal")) == 0.0


def test_typical_robots_differ_in_tilt_and_offset_as_measured_and_bad_ones_twice_as_much():
    def spread(quality):
        starts = tuple(Pose(1 + 0.1 * (k % 20), 1 + 0.1 * (k // 20)) for k in range(400))
        room = Room(Scene(4, 4, starts=starts, model=EpuckModel(sensor_noise=0, quality=quality)))
        tilts = [room.read("acceleration", i) for i in range(400)]
        rates = [(*rocking(room.state.world, i), room.read("rotation", i)[0]) for i in range(400)]
        assert all(math.hypot(*tilt) == pytest.approx(GRAVITY) for tilt in tilts)
        leaning = [math.asin(tilt[0] / GRAVITY) for tilt in tilts]
        return [math.degrees(statistics.stdev(axis)) for axis in (leaning, *zip(*rates, strict=True))]

    assert spread("typical") == pytest.approx([3, 2, 5, 1], rel=0.1)
    assert spread("bad") == pytest.approx([6, 4, 10, 2], rel=0.1)
    assert spread("ideal") == [0, 0, 0, 0]


@pytest.mark.usefixtures("compiled_worlds")
@pytest.mark.parametrize("quality", ["ideal", "bad"])
def test_compiled_the_readings_are_the_same(quality):
    model = EpuckModel(quality=quality)
    for k in range(30):
        poses = [Pose(1 + 0.001 * k * j, 1 - 0.0007 * j * j, 0.2 * k + 0.01 * j * k) for j in range(3)]
        plain = driven(*poses, model=model).at_tick(k)
        fast = driven(*poses, model=model, engine="compiled").at_tick(k)
        for room in (plain, fast):
            room.robots[0].right_speed = 0.01 * k
        assert acceleration(fast) == acceleration(plain)
        assert rate(fast) == rate(plain)
        assert rocking(fast.state.world, 0) == rocking(plain.state.world, 0)
