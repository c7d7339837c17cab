"""Wall following: distances from counts, and the turns that keep one."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from readings import NAMES, NOTHING, ideal

from elib.base.body import AXLE, RADIUS
from elib.base.errors import ArgumentError
from elib.base.infrared import LIGHT
from elib.base.pose import Pose
from elib.behaviours import find
from elib.behaviours.wall_following import (
    AHEAD,
    CLEAR,
    SIGHT,
    SPIN,
    UNIT,
    follow,
    mirrored,
    sees_wall,
    wall_distance,
)
from elib.link.protocol.values import Proximity, Wheels


def near(**metres: float) -> Proximity:
    """Return a reading with walls at these distances, m; the other sensors see none."""
    return Proximity(*(round((UNIT / metres[name]) ** 2) if name in metres else 0 for name in NAMES))


def along(clearance: float, slant: float = 0.0) -> Proximity:
    """Return what a robot reads with a wall on its right, m away, when it heads off the wall by *slant* degrees."""
    world = ideal("square", seed=2)
    world.move_robot(0, Pose(0.5, RADIUS + clearance, math.radians(slant)))
    world.step()
    return Proximity(*world.proximity(0))


def turn(wheels: Wheels) -> float:
    """Return the share by which it bends, positive to the right."""
    return (wheels.left - wheels.right) / (wheels.left + wheels.right)


def test_a_count_tells_how_far_a_white_wall_is() -> None:
    counts = [round(LIGHT / distance**2) for distance in (0.01, 0.02, 0.05)]
    assert [wall_distance(count) for count in (*counts, 1, 0)] == pytest.approx([0.01, 0.02, 0.05, SIGHT, SIGHT])


@pytest.mark.parametrize("clearance", [0.02, 0.03, 0.04])
def test_the_law_of_the_sensor_holds_in_the_simulated_room(clearance: float) -> None:
    assert wall_distance(along(clearance).right) == pytest.approx(clearance, abs=0.004)


def test_mirroring_exchanges_left_and_right_and_mirroring_twice_changes_nothing() -> None:
    reading = Proximity(1, 2, 3, 4, 5, 6, 7, 8)
    assert mirrored(reading).front_left == reading.front_right
    assert mirrored(reading).rear_right == reading.rear_left
    assert mirrored(mirrored(reading)) == reading


def test_a_wall_on_the_right_is_seen_and_one_on_the_left_is_ignored() -> None:
    assert sees_wall(near(right=0.05))
    assert sees_wall(near(diagonal_right=0.06))
    assert not sees_wall(near(left=0.02, front_left=0.05))
    assert not sees_wall(NOTHING)


@pytest.mark.parametrize("distance", [0.02, 0.03, 0.035])
def test_parallel_at_the_set_distance_it_goes_nearly_straight(distance: float) -> None:
    assert abs(turn(follow(along(distance), distance=distance))) < 0.15


def test_too_near_it_turns_off_and_too_far_towards_the_wall() -> None:
    turns = [turn(follow(along(clearance))) for clearance in (0.015, 0.025, 0.04)]
    assert turns[0] < -0.3
    assert turns[2] > 0.15
    assert all(nearer < further for nearer, further in pairwise(turns))


def test_heading_for_the_wall_it_turns_off_before_it_is_too_near() -> None:
    assert turn(follow(along(0.035, slant=-20))) < -0.1
    assert turn(follow(along(0.035, slant=10))) > 0.05


def test_something_in_front_is_turned_from_on_the_spot_until_the_way_is_free() -> None:
    assert follow(near(front_left=AHEAD - 0.005)) == (-SPIN, SPIN)
    begun = Wheels(-SPIN, SPIN)
    between = near(front_right=(AHEAD + CLEAR) / 2)
    assert follow(between, begun) == begun
    assert follow(between).left > 0
    assert follow(near(front_right=CLEAR + 0.01), begun).left > 0


def test_what_comes_near_on_the_other_side_is_turned_from_too() -> None:
    assert follow(near(diagonal_left=0.02, right=0.03)) == (-SPIN, SPIN)


def test_beside_the_end_of_a_wall_it_goes_straight_on_and_then_round_it() -> None:
    assert turn(follow(near(right=0.03))) == pytest.approx(0, abs=0.02)
    assert turn(follow(near(right=0.05))) > 0.2
    radius = AXLE / 2 / turn(follow(NOTHING, distance=0.03))
    assert radius == pytest.approx(RADIUS + 0.03)
    assert turn(follow(near(right=0.07))) == pytest.approx(turn(follow(NOTHING))), "however far the narrow end seems"


def test_beside_something_round_of_which_the_diagonal_sensor_sees_little_the_side_sensor_keeps_it_off() -> None:
    far, close = (turn(follow(near(diagonal_right=0.06, right=beside))) for beside in (0.035, 0.02))
    assert far > 0
    assert close < far - 0.2


def test_where_there_was_no_wall_it_drives_straight_on() -> None:
    assert follow(NOTHING, cruise=0.3, is_lost=True) == (0.3, 0.3)


def test_no_reading_asks_for_more_than_the_wheels_can_do() -> None:
    for distance in (0.02, 0.035):
        for count in (0, 45, 200, 4095):
            for names in (("diagonal_right",), ("right",), ("right", "front_left")):
                reading = Proximity(*(count if name in names else 0 for name in NAMES))
                assert all(-1 <= wheel <= 1 for wheel in follow(reading, distance=distance, cruise=0.5))


def test_a_distance_beyond_the_range_of_the_sensors_is_refused() -> None:
    with pytest.raises(ArgumentError, match=r"distance is 0\.1 m"):
        find("wall-following").check({"distance": 0.1})
