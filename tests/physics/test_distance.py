"""The time-of-flight sensor: a cone of rays, the nearest counts, and the spread of its published calibration."""

import math
import statistics

import pytest
from world_rig import room_of

from elib.simulator.physics import Box, Cylinder, EpuckModel, Pose, Scene, Wall
from elib.simulator.physics.sensors.distance import CONE, PLACE

QUIET = EpuckModel(sensor_noise=0)
# True m: read mm, relative standard deviation (e-puck.md, 10).
CALIBRATION = {0.05: (58.5, 0.032), 0.1: (111, 0.019), 0.2: (218.9, 0.009), 0.5: (531.9, 0.007), 1.0: (1052, 0.010)}


def measured(*, heading=0.0, model=QUIET, tick=0, engine="interpreted", size=6.0, **things):
    starts = (Pose(3, 3, heading), *things.pop("others", ()))
    room = room_of(Scene(size, size, starts=starts, model=model, **things), engine=engine)
    return room.at_tick(tick).read("distance")[0]


def wall_at(distance, half=0.5, height=0.1):
    x = 3 + PLACE[0] + distance
    return Wall(x, 3 - half, x, 3 + half, height=height)


@pytest.mark.parametrize("distance", [0.003, 0.05, 0.3, 1.0, 1.95])
def test_a_wall_straight_ahead_is_measured_truly(distance):
    assert measured(walls=(wall_at(distance),)) == pytest.approx(distance, rel=1e-12)


def test_distances_are_measured_up_to_two_metres():
    assert measured() == measured(walls=(wall_at(2.01),)) == 2.0


def test_the_nearest_thing_in_the_cone_counts():
    post = Cylinder(3.5, 3.05, 0.02)
    assert measured(walls=(wall_at(1.0),), cylinders=(post,)) < 0.5
    ball = Cylinder(3.5, 3.05, 0.02, is_pushable=True)
    assert measured(walls=(wall_at(1.0),), cylinders=(ball,)) < 0.5


@pytest.mark.parametrize("side", [1, -1])
def test_the_cone_is_as_wide_as_published(side):
    def seen(angle):
        x, y = 3 + PLACE[0] + 0.5 * math.cos(angle), 3 + PLACE[1] + 0.5 * math.sin(angle)
        return measured(cylinders=(Cylinder(x, y, 0.01),)) < 2.0

    assert seen(side * CONE / 2)
    assert seen(side * CONE / 4)
    assert not seen(side * (CONE / 2 + 0.025))
    assert pytest.approx(0.44) == CONE


def test_posts_are_seen_as_far_as_walls():
    assert measured(cylinders=(Cylinder(3 + PLACE[0] + 1.9, 3, 0.1),)) == pytest.approx(1.8, abs=1e-4)
    assert measured(others=(Pose(3 + PLACE[0] + 1.9, 3),)) == pytest.approx(1.9 - 0.037, abs=1e-4)
    assert measured(cylinders=(Cylinder(3 + PLACE[0] + 2.09, 3, 0.1),)) == pytest.approx(1.99, abs=1e-4)


def test_a_slanted_wall_is_met_by_the_outer_ray_first():
    x = 3 + PLACE[0]
    slanted = Wall(x + 0.4, 3 + PLACE[1] - 0.5, x + 0.6, 3 + PLACE[1] + 0.5)
    assert measured(walls=(slanted,)) == pytest.approx(0.5 / (math.cos(0.22) + 0.2 * math.sin(0.22)), rel=1e-9)


def test_what_is_lower_than_the_sensor_is_not_seen():
    assert measured(walls=(wall_at(0.5, height=0.032),)) == 2.0
    assert measured(walls=(wall_at(0.5, height=0.034),)) == pytest.approx(0.5)
    assert measured(cylinders=(Cylinder(3.5, 3, 0.03, height=0.03),)) == 2.0
    assert measured(boxes=(Box(3.5, 3, 0.1, 0.1, height=0.03),), walls=(wall_at(1.0),)) == pytest.approx(1.0)


def test_other_robots_are_seen_and_the_robot_itself_is_not():
    ahead, behind = Pose(3.5, 3), Pose(2.5, 3)
    assert measured(others=(ahead,)) == pytest.approx(0.5 - PLACE[0] - 0.037, abs=2e-4)
    assert measured(others=(behind,)) == 2.0
    assert measured(others=(behind,), heading=math.pi) == pytest.approx(0.5 - PLACE[0] - 0.037, abs=2e-4)


@pytest.mark.parametrize("distance", CALIBRATION)
def test_the_spread_is_that_of_the_published_calibration(distance):
    read, relative = CALIBRATION[distance]
    values = [measured(walls=(wall_at(distance),), model=EpuckModel(), tick=tick) for tick in range(300)]
    assert statistics.fmean(values) == pytest.approx(distance, abs=4 * relative * read / 1000 / math.sqrt(300))
    assert statistics.stdev(values) == pytest.approx(relative * read / 1000, rel=0.1)


def test_between_two_rows_the_spread_lies_between_theirs_and_at_the_end_there_is_none():
    values = [measured(walls=(wall_at(0.75),), model=EpuckModel(), tick=tick) for tick in range(300)]
    assert 0.0037 < statistics.stdev(values) < 0.0105
    assert all(0 <= value <= 2 for value in values)
    assert {measured(model=EpuckModel(), tick=tick) for tick in range(20)} == {2.0}


@pytest.mark.usefixtures("compiled_worlds")
def test_compiled_the_measurements_are_the_same():
    things = {
        "walls": (wall_at(1.2), Wall(2.2, 2.1, 2.6, 2.9)),
        "boxes": (Box(3.3, 3.4, 0.1, 0.2, 0.3), Box(2.7, 3.2, 0.1, 0.1, 0.3)),
        "cylinders": (Cylinder(3.2, 2.8, 0.04), Cylinder(3.0, 2.6, 0.04)),
        "others": (Pose(3.1, 3.1), Pose(2.6, 3.3)),
        "model": EpuckModel(),
    }
    for k in range(0, 40, 13):
        slow = measured(heading=0.16 * k, tick=k, **things)
        assert measured(heading=0.16 * k, tick=k, engine="compiled", **things) == slow
