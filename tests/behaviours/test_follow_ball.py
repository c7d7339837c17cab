"""Following a ball: finding it in a picture, and the speeds that keep it at a distance."""

from __future__ import annotations

import colorsys
import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from elib.behaviours import RunContext, find, play
from elib.behaviours.follow_ball import (
    COLUMNS,
    FEWEST,
    FOCAL,
    MAX_CORRECTION,
    PERIOD,
    ROWS,
    Ball,
    Hue,
    approach,
    coloured,
    find_ball,
)
from elib.robot.aio import Epuck
from elib.testing.inside import transport_of

DIAMETER = 0.065
GREY = (176, 172, 164)
ORANGE = (240, 120, 24)


def picture(*spans: tuple[int, int], colour: tuple[int, int, int] = ORANGE) -> NDArray[np.uint8]:
    """Return a picture of a grey room in which these columns, from and up to, have another colour."""
    pixels = np.full((ROWS, COLUMNS, 3), GREY, np.uint8)
    for first, last in spans:
        pixels[3:9, first:last] = colour
    return pixels


def columns_of(ball: Ball) -> tuple[int, int]:
    """Return which columns a ball takes."""
    half = math.asin(DIAMETER / 2 / ball.distance)
    left, right = (COLUMNS / 2 - FOCAL * math.tan(ball.bearing + side * half) for side in (1, -1))
    return round(left), round(right)


def test_the_colour_of_each_hue_is_its_own_and_no_others() -> None:
    for hue in Hue:
        red, green, blue = (round(255 * part) for part in colorsys.hsv_to_rgb(hue / 360, 0.9, 0.8))
        pixels = picture((0, COLUMNS), colour=(red, green, blue))
        assert {other for other in Hue if coloured(pixels, other).any()} == {hue}


def test_red_is_found_on_both_sides_of_its_hue_and_grey_black_and_white_have_no_hue() -> None:
    for colour in ((208, 32, 32), (208, 32, 50), (208, 50, 32)):
        assert coloured(picture((5, 9), colour=colour), Hue.RED).sum() == 24
    for colour in (GREY, (0, 0, 0), (30, 4, 4), (255, 255, 255), (200, 150, 150)):
        assert not coloured(picture((5, 9), colour=colour), Hue.RED).any()


@pytest.mark.parametrize(
    ("bearing", "distance"), [(0.0, 0.12), (0.05, 0.12), (-0.2, 0.2), (0.15, 0.2), (-0.28, 0.5), (0.25, 0.5)]
)
def test_a_ball_is_found_where_it_is_and_as_far_as_its_width_says(bearing: float, distance: float) -> None:
    there = Ball(bearing, distance)
    found = find_ball(picture(columns_of(there)), diameter=DIAMETER)
    assert found is not None
    assert found.bearing == pytest.approx(bearing, abs=0.01)
    assert found.distance == pytest.approx(distance, rel=0.12)


def test_of_two_balls_the_one_that_shows_more_counts_and_specks_are_ignored() -> None:
    found = find_ball(picture((5, 8), (40, 50)))
    assert found is not None
    assert found.bearing < 0
    assert find_ball(picture()) is None
    speck = picture()
    speck[4, 10 : 10 + FEWEST] = ORANGE
    assert find_ball(speck) is None


def test_it_turns_to_the_side_of_the_ball_and_keeps_the_distance() -> None:
    left, right = approach(Ball(0.3, 0.4))
    assert left < right
    assert approach(Ball(-0.3, 0.4)) == pytest.approx((right, left))
    ahead = [sum(approach(Ball(0.0, distance), distance=0.2)) for distance in (0.1, 0.15, 0.2, 0.25, 0.3)]
    assert ahead[2] == 0
    assert all(near < far for near, far in pairwise(ahead))


def test_a_ball_far_aside_is_turned_to_before_the_robot_drives() -> None:
    left, right = approach(Ball(0.8, 0.6))
    assert left == pytest.approx(-right)


@pytest.mark.parametrize("columns", [(0, 20), (40, COLUMNS)])
def test_a_ball_that_reaches_beyond_the_picture_is_turned_to_and_not_driven_at(columns: tuple[int, int]) -> None:
    ball = find_ball(picture(columns))
    assert ball is not None
    assert ball.is_cut
    left, right = approach(ball, distance=0.1)
    assert left == pytest.approx(-right)
    near = find_ball(picture((0, COLUMNS)))
    assert near is not None
    assert max(approach(near)) < 0  # it fills the picture


def test_no_wheel_exceeds_the_cruise_and_a_slow_link_makes_a_slow_robot() -> None:
    for bearing in (-1.0, -0.2, 0.0, 0.4):
        for distance in (0.05, 0.15, 2.0):
            for gap in (PERIOD, 1.0):
                wheels = approach(Ball(bearing, distance), cruise=0.4, gap=gap)
                assert all(abs(wheel) <= 0.4 + 1e-9 for wheel in wheels)
    left, right = approach(Ball(0.3, 0.15), gap=1.0)
    assert (right - left) * 0.1288 / 0.053 == pytest.approx(MAX_CORRECTION * 0.3, rel=0.01)


def test_where_there_is_no_ball_it_looks_round_says_so_and_searches_elsewhere() -> None:
    paths = []

    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        transport = transport_of(robots[0])
        paths.append(transport.simulation)

    outcome = play(find("follow-ball"), "sim://square?speed=max", seconds=25, options={"colour": "blue"}, watch=watch)
    assert [name for _, name in outcome.states][:3] == ["looking-round", "searching", "looking-round"]
    assert outcome.messages[0] == "nothing blue in sight"
    assert paths[0].world is not None
    assert math.dist((0.5, 0.5), (paths[0].world.pose(0).x, paths[0].world.pose(0).y)) > 0.05
