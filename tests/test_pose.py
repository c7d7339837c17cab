"""Poses: where whole steps bring a robot on its nominal wheels."""

from __future__ import annotations

import math

import pytest

from elib.base.body import AXLE, METRES_PER_STEP
from elib.base.pose import Pose, advanced


def test_a_step_is_an_eighth_of_a_millimetre() -> None:
    assert pytest.approx(0.1288e-3, rel=1e-3) == METRES_PER_STEP


def test_equal_steps_go_straight_on() -> None:
    pose = advanced(Pose(0.1, 0.2, math.pi / 2), 1000, 1000)
    assert (pose.x, pose.y, pose.heading) == pytest.approx((0.1, 0.2 + 0.1288, math.pi / 2), abs=1e-4)


def test_opposite_steps_turn_on_the_spot() -> None:
    quarter = round(math.pi / 2 * AXLE / 2 / METRES_PER_STEP)
    pose = advanced(Pose(0.5, 0.5, 0.0), -quarter, quarter)
    assert (pose.x, pose.y) == pytest.approx((0.5, 0.5))
    assert pose.heading == pytest.approx(math.pi / 2, abs=0.003)


def test_an_arc_ends_where_the_circle_says_in_one_step_or_in_many() -> None:
    one = advanced(Pose(0, 0, 0), 500, 1000)
    many = Pose(0, 0, 0)
    for _ in range(100):
        many = advanced(many, 5, 10)
    assert (one.x, one.y, one.heading) == pytest.approx((many.x, many.y, many.heading))
