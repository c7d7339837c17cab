"""Line following: where the line is, how to stay on it and how to look for it."""

from __future__ import annotations

import math

import pytest

from elib.base.errors import Unsupported
from elib.behaviours import find, play
from elib.behaviours.line_following import (
    LEARNING,
    LEGS,
    SWEEP,
    bare_floor,
    follow,
    leg_direction,
    offset,
    sweep,
)
from elib.link.protocol.values import Ground

PAPER, LINE = 810, 150


def ground(*dark: str) -> Ground:
    """Return what the sensors read with the line under some of them."""
    return Ground(counts=tuple(LINE if name in dark else PAPER for name in ("left", "centre", "right")))


@pytest.mark.parametrize(
    ("dark", "expected"),
    [
        (("centre",), 0.0),
        (("left",), 1.0),
        (("right",), -1.0),
        (("left", "centre"), 0.5),
        (("centre", "right"), -0.5),
        (("left", "centre", "right"), 0.0),
    ],
)
def test_the_line_is_where_the_dark_sensors_are(dark: tuple[str, ...], expected: float) -> None:
    assert offset(ground(*dark), PAPER) == pytest.approx(expected)


def test_without_a_dark_sensor_there_is_no_line_and_noise_is_not_taken_for_one() -> None:
    assert offset(ground(), PAPER) is None
    assert offset(Ground(counts=(PAPER - 240, PAPER + 240, PAPER)), PAPER) is None


def test_cliff_sensors_take_no_part() -> None:
    assert offset(Ground(counts=(PAPER, PAPER, PAPER, LINE, LINE)), PAPER) is None


def test_the_bare_floor_is_learnt_from_what_is_not_the_line() -> None:
    assert bare_floor(ground("centre"), 0.0) == PAPER
    assert bare_floor(ground("left", "centre", "right"), PAPER) == PAPER
    darker = Ground(counts=(700, LINE, 700))
    assert bare_floor(darker, 800.0) == pytest.approx(800 - LEARNING * 100)


def test_it_turns_to_the_side_where_the_line_is_and_the_more_the_further() -> None:
    straight, half, far = (follow(line, cruise=0.5) for line in (0.0, 0.5, 1.0))
    assert straight == (0.5, 0.5)
    assert 0 < half.right - half.left < far.right - far.left
    assert sum(straight) > sum(half) > sum(far)
    assert follow(-1.0) == (far.right, far.left)


def test_a_lost_line_is_looked_for_on_its_side_then_on_the_other_then_all_round() -> None:
    leg, heading, turned = 0, 0.0, [0.0]
    while leg < len(LEGS):
        heading += 0.05 * leg_direction(leg)
        leg = sweep(heading, leg)
        turned.append(heading)
    assert max(turned[: turned.index(min(turned))]) == pytest.approx(SWEEP, abs=0.05)
    assert min(turned) == pytest.approx(-SWEEP, abs=0.05)
    assert max(turned) - min(turned) == pytest.approx(math.tau, abs=0.1)


@pytest.mark.parametrize("url", ["sim://line?firmware=btcom-1.1.3", "sim://square"])
def test_a_robot_without_ground_sensors_is_told_so(url: str) -> None:
    joint = "&" if "?" in url else "?"
    with pytest.raises(Exception, match="the robot does not have them") as caught:
        play(find("line-following"), f"{url}{joint}speed=max", seconds=5)
    assert "sim://line" in str(caught.value) or isinstance(caught.value.__cause__, Unsupported)
