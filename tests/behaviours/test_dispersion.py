"""Dispersion: which way leads away, and how it is driven."""

from __future__ import annotations

import math

import pytest
from readings import degrees, near

from elib.base.body import SENSOR_DIRECTIONS
from elib.behaviours.dispersion import NOISE, STRAIGHT, disperse, escape


def test_where_nothing_is_near_there_is_nothing_to_leave() -> None:
    assert escape(near()) is None
    assert escape([NOISE] * 8) is None


@pytest.mark.parametrize("sensor", range(8))
def test_a_neighbour_is_left_in_the_opposite_direction(sensor: int) -> None:
    counts = [0.0] * 8
    counts[sensor] = 200.0
    assert math.cos(degrees(escape(counts)) * math.pi / 180 - SENSOR_DIRECTIONS[sensor]) == pytest.approx(-1)


def test_between_two_neighbours_it_leaves_sideways_and_the_nearer_one_counts_more() -> None:
    assert degrees(escape(near(front_left=100, front_right=100, rear_left=100, rear_right=100, left=100))) < -80
    away = degrees(escape(near(left=400, right=100)))
    assert away == pytest.approx(-90)


def test_ahead_it_bends_and_aside_or_behind_it_turns_on_the_spot() -> None:
    assert disperse(0.0, pace=0.3) == (0.3, 0.3)
    bent = disperse(STRAIGHT / 2, pace=0.3)
    assert bent.right == 0.3 > bent.left > 0
    for direction in (STRAIGHT + 0.1, math.pi):
        assert disperse(direction, pace=0.3) == (-0.3, 0.3)
        assert disperse(-direction, pace=0.3) == (0.3, -0.3)


def test_no_direction_asks_for_more_than_the_pace() -> None:
    for tenths in range(-31, 32):
        assert all(abs(wheel) <= 0.3 for wheel in disperse(tenths / 10, pace=0.3))
