"""The time-of-flight sensor: a cone of rays, weighted by their light, and the errors that were measured."""

import math
import statistics
from dataclasses import replace
from itertools import pairwise

import pytest
from world_rig import room_of

from elib.base.timeofflight import CALIBRATION, OFFSET, PLACE, biased
from elib.simulator.physics import Box, Cylinder, EpuckModel, Pose, Scene, Wall
from elib.simulator.physics.sensors.distance import CONE, UNSURE

QUIET = EpuckModel(sensor_noise=0, quality="ideal")


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


def test_what_fills_a_part_of_the_cone_counts_by_the_light_that_it_sends_back():
    def seen(**things):
        return measured(walls=(wall_at(1.0),), **things)

    # A fifth of the cone ends at the post, at 0.45 m along the axis, and four fifths at the wall.
    depth = 0.5 - PLACE[0] - 0.02 * math.cos(0.11)
    mixed = (1 / depth + 4) / (1 / depth**2 + 4)
    post = Cylinder(3.5, 3 + PLACE[1] + 0.05, 0.02)
    assert seen(cylinders=(post,)) == pytest.approx(mixed, abs=0.005)
    assert seen(cylinders=(replace(post, is_pushable=True),)) == seen(cylinders=(post,))
    assert measured(cylinders=(post,)) == pytest.approx(depth, abs=0.005)


@pytest.mark.parametrize(
    ("size", "pairs"),
    [
        (0.03, ((57.9, 50), (97.5, 100), (121.6, 150), (137.7, 200))),
        (0.05, ((66.1, 50), (108.3, 100), (141.9, 150), (170.9, 200))),
    ],
)
def test_tubes_before_a_wall_are_read_too_far_as_real_robots_read_them(size, pairs):
    # measured-robots: time_of_flight.narrow_objects. Their robot read 27 mm less than the one of the table.
    for true, read in pairs:
        tube = Cylinder(3 + PLACE[0] + true / 1000 + size / 2, 3 + PLACE[1], size / 2)
        found = 1000 * biased(measured(cylinders=(tube,), walls=(wall_at(0.8),))) - 27
        assert found == pytest.approx(read, abs=18)


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


def test_a_slanted_wall_is_measured_a_little_nearer_than_on_the_axis():
    x = 3 + PLACE[0]
    slanted = Wall(x + 0.4, 3 + PLACE[1] - 0.5, x + 0.6, 3 + PLACE[1] + 0.5)
    depths = [0.5 / (1 + 0.2 * math.tan(angle)) for angle in (-0.22, -0.11, 0, 0.11, 0.22)]
    mean = sum(1 / depth for depth in depths) / sum(1 / depth**2 for depth in depths)
    assert measured(walls=(slanted,)) == pytest.approx(mean, rel=1e-9)
    assert 0.495 < mean < 0.5


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


@pytest.mark.parametrize(("low", "high"), list(pairwise(CALIBRATION))[1:-1])
def test_between_two_rows_of_the_table_a_reading_and_its_noise_lie_on_straight_lines(low, high):
    true, reads, deviation = ((one + other) / 2 for one, other in zip(low, high, strict=True))
    values = [
        biased(measured(walls=(wall_at(true),), model=EpuckModel(quality="ideal"), tick=tick)) for tick in range(300)
    ]
    assert statistics.fmean(values) == pytest.approx(reads, abs=4 * deviation / math.sqrt(300))
    assert statistics.stdev(values) == pytest.approx(deviation, rel=0.15)


def test_nothing_has_no_noise():
    assert {measured(model=EpuckModel(quality="ideal"), tick=tick) for tick in range(20)} == {2.0}


def test_typical_robots_read_too_much_or_too_little_each_in_its_own_way():
    starts = tuple(Pose(3, 1 + 0.1 * k) for k in range(100))
    model = EpuckModel(sensor_noise=0, quality="typical")
    room = room_of(Scene(12, 12, starts=starts, walls=(Wall(3.334, 0.5, 3.334, 11.5),), model=model))
    read = [biased(room.read("distance", i)[0]) for i in range(100)]
    assert statistics.stdev(read) == pytest.approx(OFFSET, rel=0.2)
    assert statistics.fmean(read) == pytest.approx(biased(0.3), abs=0.005)


@pytest.mark.parametrize(("quality", "share"), [("ideal", 0), ("typical", 0.05), ("bad", 0.1)])
def test_beyond_0_9_metres_a_real_robot_sees_nothing_now_and_then(quality, share):
    model = EpuckModel(quality=quality)
    far = [measured(walls=(wall_at(UNSURE + 0.01),), model=model, tick=tick) for tick in range(2000)]
    near = [measured(walls=(wall_at(UNSURE - 0.01),), model=model, tick=tick) for tick in range(300)]
    assert far.count(2.0) / 2000 == pytest.approx(share, abs=0.02)
    assert near.count(2.0) == 0


@pytest.mark.usefixtures("compiled_worlds")
def test_compiled_the_measurements_are_the_same():
    things = {
        "walls": (wall_at(1.2), Wall(2.2, 2.1, 2.6, 2.9)),
        "boxes": (Box(3.3, 3.4, 0.1, 0.2, 0.3), Box(2.7, 3.2, 0.1, 0.1, 0.3)),
        "cylinders": (Cylinder(3.2, 2.8, 0.04), Cylinder(3.0, 2.6, 0.04)),
        "others": (Pose(3.1, 3.1), Pose(2.6, 3.3)),
        "model": EpuckModel(quality="typical"),
    }
    for k in range(0, 40, 13):
        slow = measured(heading=0.16 * k, tick=k, **things)
        assert measured(heading=0.16 * k, tick=k, engine="compiled", **things) == slow
