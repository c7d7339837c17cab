"""Colours, poses and the exact unit vector."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elib.base.errors import ArgumentError
from elib.simulator.physics import Box, Colour, Cylinder, Pose, Wall
from elib.simulator.physics.geometry import unit


@given(st.floats(-50, 50))
def test_the_unit_vector_agrees_with_the_library_to_rounding(angle):
    cosine, sine = unit(angle)
    assert cosine == pytest.approx(math.cos(angle), abs=1e-14)
    assert sine == pytest.approx(math.sin(angle), abs=1e-14)


def test_quarter_turns_are_exact():
    assert [unit(k * math.pi / 2) for k in range(4)] == [(1, 0), (0, 1), (-1, 0), (0, -1)]


def test_a_colour_survives_being_written_down():
    assert Colour.parse(str(Colour(208, 64, 48))) == Colour(208, 64, 48)


@pytest.mark.parametrize("text", ["red", "#12345", "#1234567", "#12345g", "123456", "", "#+1 2 3"])
def test_text_that_is_not_a_colour_is_refused_with_a_pattern_to_follow(text):
    with pytest.raises(ArgumentError, match="not a colour") as caught:
        Colour.parse(text)
    assert "#rrggbb" in caught.value.hint


@pytest.mark.parametrize(
    "build",
    [
        lambda: Pose(math.nan, 0),
        lambda: Pose(0, 0, math.inf),
        lambda: Wall(1, 1, 1, 1),
        lambda: Wall(0, 0, 1, 1, height=0),
        lambda: Box(0, 0, 0.1, -0.1),
        lambda: Cylinder(0, 0, 0),
        lambda: Cylinder(0, math.nan, 0.1),
    ],
)
def test_a_thing_that_cannot_exist_is_refused(build):
    with pytest.raises(ArgumentError):
        build()


def test_a_turned_box_keeps_its_size_and_goes_round_to_the_left():
    corners = Box(1.0, 2.0, 0.4, 0.2, angle=math.pi / 2).corners
    expected = [(1.1, 1.8), (1.1, 2.2), (0.9, 2.2), (0.9, 1.8)]
    assert [pytest.approx(corner) for corner in expected] == list(corners)
