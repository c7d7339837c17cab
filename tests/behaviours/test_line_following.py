"""Line following: where the line is, how to stay on it and how to look for it."""

from __future__ import annotations

import math

import pytest

from elib.base.errors import Unsupported
from elib.behaviours import find, play
from elib.behaviours.line_following import CONTRAST, LEARNING, LEGS, SWEEP, Levels, follow, leg_direction, sweep
from elib.link.protocol.values import Ground

NAMES = "left", "centre", "right"
PAPER = 960
LINES = (325, 325, 325), (79, 300, 750), (585, 179, 294)
"""What the sensors of an ideal robot read over black, and those of two robots that differ as real ones do, counts."""


def ground(line: tuple[int, ...], *dark: str) -> Ground:
    """Return what sensors that read *line* over black read with the line under some of them."""
    return Ground(counts=tuple(black if name in dark else PAPER for name, black in zip(NAMES, line, strict=True)))


def learnt(line: tuple[int, ...]) -> Levels:
    """Return the levels that such sensors learn when the line passes under each of them."""
    levels = Levels()
    for name in NAMES:
        levels.learn(ground(line, name))
    levels.learn(ground(line))
    return levels


@pytest.mark.parametrize("line", LINES)
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
def test_the_line_is_where_the_dark_sensors_are(line: tuple[int, ...], dark: tuple[str, ...], expected: float) -> None:
    assert learnt(line).offset(ground(line, *dark)) == pytest.approx(expected)


@pytest.mark.parametrize("line", LINES)
def test_without_a_dark_sensor_there_is_no_line_and_a_shadow_is_not_taken_for_one(line: tuple[int, ...]) -> None:
    levels = learnt(line)
    assert levels.offset(ground(line)) is None
    shadow = [PAPER - (PAPER - black) // 3 for black in line]
    assert levels.offset(Ground(counts=tuple(shadow))) is None


def test_a_sensor_that_has_not_seen_a_line_yet_sees_none() -> None:
    levels = Levels()
    for count in (PAPER, PAPER - CONTRAST + 1, PAPER):
        levels.learn(Ground(counts=(count, count, count)))
    assert levels.offset(Ground(counts=(PAPER - CONTRAST + 1,) * 3)) is None


def test_cliff_sensors_take_no_part() -> None:
    for line in LINES:
        assert learnt(line).offset(Ground(counts=(PAPER, PAPER, PAPER, 325, 325))) is None


def test_what_line_and_floor_give_is_learnt_on_the_way_and_each_sensor_by_itself() -> None:
    levels = learnt(LINES[1])
    levels.learn(Ground(counts=(179, 860, 860)))
    assert levels.line == pytest.approx([79 + LEARNING * 100, 300, 750])
    assert levels.floor == pytest.approx([PAPER, PAPER - LEARNING * 100, PAPER - LEARNING * 100])


@pytest.mark.parametrize("count", [-1, 0, 5, 4095])
def test_a_hole_and_an_impossible_count_are_not_learnt(count: int) -> None:
    levels = learnt(LINES[0])
    levels.learn(Ground(counts=(count,) * 3))
    assert (levels.line, levels.floor) == ([325.0] * 3, [960.0] * 3)


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
