"""Billiard: where the cushion is, and how a ball leaves it."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from readings import degrees, ideal, near

from elib.base.body import SENSOR_DIRECTIONS
from elib.base.pose import Pose
from elib.behaviours import RunContext, find, play
from elib.behaviours.billiard import (
    NEAR,
    NOISE,
    circular_mean,
    cushion,
    is_stuck,
    rebound,
)
from elib.link.protocol.values import Proximity
from elib.robot.aio import Epuck
from elib.testing import with_faults
from elib.testing.inside import transport_of

RIM = 0.037
"""m from the robot's middle to what it touches."""


def at_a_cushion(direction: float, gap: float) -> Proximity:
    """Return what a robot reads whose cushion lies in that direction, degrees to the left, this far from its rim, m."""
    world = ideal("billiard", seed=1)
    world.move_robot(0, Pose(0.9, 0.9 - RIM - gap, math.radians(90 - direction)))
    world.step()
    return Proximity(*world.proximity(0))


def test_angles_on_both_sides_of_the_front_have_their_mean_in_front() -> None:
    assert circular_mean([math.radians(350), math.radians(10)], [1, 1]) == pytest.approx(0, abs=1e-9)


def test_angles_on_both_sides_of_the_back_have_their_mean_behind() -> None:
    assert abs(circular_mean([math.radians(170), math.radians(190)], [1, 1])) == pytest.approx(math.pi)


def test_a_mean_leans_to_the_greater_weight() -> None:
    assert 45 < degrees(circular_mean([0, math.pi / 2], [1, 3])) < 90


@pytest.mark.parametrize(
    ("sensor", "turn"),
    [("front_right", 146), ("front_left", -146), ("diagonal_left", -88), ("diagonal_right", 88)],
)
def test_one_sensor_at_the_cushion_turns_the_robot_as_in_2011(sensor: str, turn: float) -> None:
    # 2011: 180 degrees less twice the sensor's angle, away from its side.
    direction = cushion(near(**{sensor: 2 * NEAR}))
    assert direction is not None
    assert degrees(rebound(direction)) == pytest.approx(turn, abs=0.5)


def test_a_cushion_straight_ahead_sends_the_robot_back() -> None:
    direction = cushion(near(front_left=NEAR, front_right=NEAR))
    assert direction is not None
    assert abs(degrees(rebound(direction))) == pytest.approx(180)


@pytest.mark.parametrize("direction", [-80, -45, -10, 10, 45, 80])
def test_the_way_out_makes_the_same_angle_with_the_cushion_as_the_way_in(direction: float) -> None:
    heading = degrees(rebound(math.radians(direction)))
    along, into = math.cos(math.radians(direction)), math.sin(math.radians(direction))
    # The part along the normal is reversed, the part along the cushion kept.
    assert math.cos(math.radians(heading - direction)) == pytest.approx(-along)
    assert math.sin(math.radians(heading - direction)) == pytest.approx(-into)


@pytest.mark.parametrize("gap", [0.012, 0.016])
@pytest.mark.parametrize("direction", [-70, -50, -30, -10, 0, 20, 40, 60, 80])
def test_the_cushion_is_found_to_nine_degrees_at_any_angle(direction: float, gap: float) -> None:
    assert degrees(cushion(at_a_cushion(direction, gap))) == pytest.approx(direction, abs=9)


@pytest.mark.parametrize("direction", [-180, -150, -120, 110, 130, 160])
def test_a_cushion_behind_the_robot_is_ignored(direction: float) -> None:
    assert cushion(at_a_cushion(direction, 0.012)) is None


def test_a_cushion_far_away_is_ignored() -> None:
    assert cushion(near(front_left=NEAR - 1, front_right=NEAR - 1)) is None


def test_noise_does_not_move_the_cushion() -> None:
    assert cushion(near(front_left=NEAR, right=NOISE, rear_right=NOISE - 10)) == pytest.approx(SENSOR_DIRECTIONS[7])


@pytest.mark.parametrize("behind", ["rear_left", "rear_right"])
def test_something_before_and_behind_holds_it(behind: str) -> None:
    assert is_stuck(near(front_left=NEAR, **{behind: NEAR}))
    assert not is_stuck(near(front_left=NEAR, **{behind: NEAR - 1}))
    assert not is_stuck(near(front_left=NEAR - 1, **{behind: NEAR}))


@pytest.mark.parametrize("beside", ["right", "left"])
def test_something_beside_does_not_hold_it_as_it_did_in_2011(beside: str) -> None:
    assert not is_stuck(near(front_left=900, **{beside: 900}))


VICE = """
about = "A centimetre before the robot, and one behind."
[arena]
size = [1.0, 1.0]
[[wall]]
from = [0.449, 0.45]
to = [0.449, 0.55]
[[wall]]
from = [0.541, 0.45]
to = [0.541, 0.55]
[[robot]]
position = [0.495, 0.5]
"""


def test_held_before_and_behind_it_turns_by_chance_until_it_rolls_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("elib.behaviours.billiard.OpenAir", lambda: lambda near: near)  # as if it had been elsewhere
    path = tmp_path / "vice.toml"
    path.write_text(VICE)
    places: list[Pose] = []

    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        transport = transport_of(robots[0])
        world = transport.simulation.world
        assert world is not None
        robots[0].trace(lambda _, __: places.append(world.pose(0)))

    outcome = play(find("billiard"), f"sim://{path}?speed=max&latency=0.02&quality=ideal", seconds=60, watch=watch)
    assert outcome.states[1][1] == "stuck"
    assert outcome.states[-1][1] != "stuck"
    assert max(abs(place.y - 0.5) for place in places) > 0.2
    assert outcome.reason == "time"
    assert outcome.duration < 62


def test_halved_and_garbled_answers_count_as_lost_and_do_not_end_it() -> None:
    outcome = play(find("billiard"), with_faults("half-answers", "sim://billiard?speed=max&latency=0.03"), seconds=60)
    assert outcome.reason == "time"
    assert outcome.statistics is not None
    assert outcome.statistics.lost > 5
    assert [name for _, name in outcome.states].count("rebounding") >= 1
