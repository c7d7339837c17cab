"""Following a ball: finding it in a picture, and the speeds that keep it at a distance."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from elib.base.body import FOCAL
from elib.behaviours import RunContext, find, play
from elib.behaviours.follow_ball import (
    COLUMNS,
    MAX_CORRECTION,
    PERIOD,
    ROWS,
    ZOOM,
    Ball,
    approach,
    find_ball,
)
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode
from elib.robot.aio import Epuck
from elib.testing.inside import transport_of

DIAMETER = 0.065
GREY, ORANGE = 22 << 11 | 43 << 5 | 20, 30 << 11 | 30 << 5 | 3
"""As the camera sends them: five bits of red, six of green, five of blue."""


def picture(*spans: tuple[int, int]) -> Image:
    """Return a picture of a grey room in which these columns, from and up to, are orange."""
    rows = []
    for row in range(ROWS):
        words = [GREY] * COLUMNS
        for first, last in spans if 3 <= row < 9 else ():
            words[first:last] = [ORANGE] * (last - first)
        rows += words
    return Image(CameraMode.COLOUR, COLUMNS, ROWS, np.array(rows, ">u2").tobytes())


def columns_of(ball: Ball) -> tuple[int, int]:
    """Return which columns a ball takes."""
    half = math.asin(DIAMETER / 2 / ball.distance)
    left, right = (COLUMNS / 2 - FOCAL / ZOOM * math.tan(ball.bearing + side * half) for side in (1, -1))
    return round(left), round(right)


@pytest.mark.parametrize(
    ("bearing", "distance"), [(0.0, 0.12), (0.05, 0.13), (-0.15, 0.2), (0.12, 0.2), (-0.22, 0.5), (0.2, 0.5)]
)
def test_a_ball_is_found_where_it_is_and_as_far_as_its_width_says(bearing: float, distance: float) -> None:
    there = Ball(bearing, distance)
    found = find_ball(picture(columns_of(there)), diameter=DIAMETER)
    assert found is not None
    assert found.bearing == pytest.approx(bearing, abs=0.01)
    assert found.distance == pytest.approx(distance, rel=0.12)


def test_of_two_balls_the_one_that_shows_more_counts() -> None:
    found = find_ball(picture((5, 8), (40, 50)))
    assert found is not None
    assert found.bearing < 0
    assert find_ball(picture()) is None


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
    assert left == pytest.approx(2 * approach(ball._replace(is_cut=False, distance=0.1), distance=0.1).left)
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


@pytest.mark.parametrize("firmware", ["asercom-1.2.2", "btcom-2.0", "btcom-1.1.3", "epuck2"])
def test_a_picture_comes_within_the_timeout_of_a_step(firmware: str) -> None:
    robot: list[Epuck] = []
    url = f"sim://soccer?robots=1&speed=max&latency=0.02&firmware={firmware}"
    play(find("follow-ball"), url, seconds=5, watch=lambda run, robots: robot.extend(robots))
    assert robot[0].statistics.count > 20
    assert robot[0].statistics.lost == 0
