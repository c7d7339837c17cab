"""Room on the floor: things that touch, cross, lie within each other, or leave the arena."""

import math

import pytest

from elib.emulator.clearance import SLACK, blocker
from elib.physics import Box, Cylinder, Wall
from elib.physics.geometry import gap


def disc(x, y, radius=0.037):
    return Cylinder(x, y, radius)


@pytest.mark.parametrize(
    ("one", "other", "apart"),
    [
        (disc(0, 0, 0.1), disc(0.5, 0, 0.2), 0.2),
        (disc(0, 0, 0.1), disc(0.25, 0, 0.2), -0.05),
        (disc(0.5, 0.3, 0.1), Wall(0, 0, 1, 0), 0.2),
        (disc(1.3, 0.4, 0.1), Wall(0, 0, 1, 0), 0.4),
        (disc(0.5, 0.5, 0.1), Box(0.5, 0, 0.4, 0.4), 0.2),
        (Box(0, 0, 0.2, 0.2), Box(0.5, 0, 0.2, 0.2), 0.3),
        (Box(0, 0, 0.2, 0.2), Box(0, 0.5, 0.2, 0.2, math.pi / 4), 0.4 - math.sqrt(0.02)),
    ],
)
def test_the_gap_is_the_distance_between_the_rims_both_ways(one, other, apart):
    assert gap(one, other) == pytest.approx(apart)
    assert gap(other, one) == pytest.approx(apart)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (disc(0, 0, 0.01), Box(0, 0, 1, 1)),
        (Wall(-1, 0, 1, 0), Box(0, 0, 0.2, 0.2)),
        (Wall(-0.05, 0, 0.05, 0), Box(0, 0, 0.2, 0.2)),
        (Wall(0, 0, 1, 1), Wall(0, 1, 1, 0)),
        (Box(0, 0, 1, 0.1), Box(0, 0, 0.1, 1)),
        (Box(0, 0, 1, 1), Box(0.01, 0.01, 0.1, 0.1, 0.5)),
        (Box(0, 0, 2, 1), Box(1, 0, 2, 1)),
        (Box(0, 0, 1, 1), Box(0, 0, 1, 1)),
    ],
)
def test_what_crosses_or_lies_within_overlaps_however_thin_it_is(one, other):
    assert gap(one, other) < -SLACK
    assert gap(other, one) < -SLACK


def test_an_overlap_is_as_deep_as_one_has_to_move_to_be_clear():
    assert gap(Box(0, 0, 2, 1), Box(1.8, 0, 2, 1)) == pytest.approx(-0.2)
    assert gap(disc(0, 0.9, 0.1), Box(0, 0, 2, 2)) == pytest.approx(-0.2)
    assert gap(Wall(0, -1, 0, 0.01), Box(0, 1, 2, 2)) == pytest.approx(-0.01)


def test_a_thing_has_room_up_to_the_edge_and_up_to_its_neighbours_and_not_beyond():
    others = [("epuck-2", disc(0.5, 0.5)), ("wall", Wall(0.2, 0.2, 0.2, 0.6))]
    assert blocker(disc(0.037, 0.963), others, 1, 1) is None
    assert blocker(disc(0.036, 0.5), others, 1, 1) == "the edge of the arena"
    assert blocker(disc(0.5 + 0.074, 0.5), others, 1, 1) is None
    assert blocker(disc(0.5 + 0.073, 0.5), others, 1, 1) == "epuck-2"
    assert blocker(disc(0.22, 0.3), others, 1, 1) == "wall"
    assert blocker(Box(0.1, 0.4, 0.3, 0.02), others, 1, 1) == "the edge of the arena"
    assert blocker(Box(0.2, 0.4, 0.3, 0.02), others, 1, 1) == "wall"
