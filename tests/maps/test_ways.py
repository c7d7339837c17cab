"""Ways on a map: they keep off what is on it, and errors say why there is none."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

import elib
from elib.base.body import RADIUS
from elib.base.errors import NoWay
from elib.maps.ways import MARGIN, way
from elib.simulator.physics import Box, Scene


def closest(grid: elib.Grid, places: list[tuple[float, float]]) -> float:
    """Return how near the lines between places come to something, m."""
    room = grid.clearance(0.1)
    nearest = math.inf
    for (x, y), (to_x, to_y) in pairwise(places):
        for k in range(101):
            nearest = min(nearest, float(room[grid.square(x + k / 100 * (to_x - x), y + k / 100 * (to_y - y))]))
    return nearest


def test_where_nothing_is_in_the_way_it_is_a_straight_line() -> None:
    assert way(elib.Grid.of_world("square"), (0.2, 0.2), (0.8, 0.6)) == [(0.8, 0.6)]


def test_through_the_maze_it_keeps_to_the_middle() -> None:
    grid = elib.Grid.of_world("maze")
    places = [(0.1, 0.1), *way(grid, (0.1, 0.1), (1.3, 1.3))]
    assert places[-1] == (1.3, 1.3)
    assert closest(grid, places) > RADIUS + 0.02
    assert len(places) < 40


def test_it_leads_round_a_box_and_through_no_gap_that_is_too_narrow() -> None:
    gap = 2 * (RADIUS + MARGIN) - 0.02
    grid = elib.Grid.of_world(
        Scene(1.0, 1.0, boxes=(Box(0.5, (0.8 - gap) / 2, 0.1, 0.8 - gap), Box(0.5, 0.9, 0.1, 0.2)))
    )
    with pytest.raises(NoWay, match="no way leads to"):
        way(grid, (0.2, 0.5), (0.8, 0.5))
    free = elib.Grid.of_world(Scene(1.0, 1.0, boxes=(Box(0.5, 0.4, 0.1, 0.8),)))
    places = [(0.2, 0.5), *way(free, (0.2, 0.5), (0.8, 0.5))]
    assert closest(free, places) >= RADIUS + MARGIN - free.cell


def test_errors_say_what_is_wrong_with_start_or_goal() -> None:
    grid = elib.Grid.of_world("square")
    with pytest.raises(NoWay, match=r"the goal \(3.00, 0.50\) m is not on the map"):
        way(grid, (0.5, 0.5), (3.0, 0.5))
    with pytest.raises(NoWay, match="set_pose"):
        way(grid, (-1.0, 0.5), (0.5, 0.5))
    with pytest.raises(NoWay, match="no room at the goal"):
        way(grid, (0.5, 0.5), (0.5, 0.02))
    drawn = elib.Grid()
    drawn.add(elib.Pose(0, 0), [math.inf] * 8)
    with pytest.raises(NoWay, match="not known what is there"):
        way(drawn, (0, 0), (0.2, 0.2))
    assert way(drawn, (0, 0), (0.2, 0.2), through_unknown=True)


def test_a_robot_that_touches_something_may_drive_away_from_it() -> None:
    grid = elib.Grid.of_world("square")
    assert way(grid, (0.038, 0.5), (0.5, 0.5))
