"""Going to the light: what the robot does with eight readings, below a lamp and in a shadow."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest
from readings import DARK, NAMES, lamp_at

from elib.behaviours import RunContext, RunResult, find, play
from elib.behaviours.go_to_light import FAINT, brightness, is_blocked, seek
from elib.link.protocol.values import AmbientLight, Proximity, Wheels
from elib.robot.aio import Epuck
from elib.simulator.physics.world import World
from elib.testing.inside import transport_of


def light(**brighter: int) -> AmbientLight:
    """Return a reading of a dark room in which it is brighter at these sensors, counts."""
    return AmbientLight(*(DARK - brighter.get(name, 0) for name in NAMES))


def turning(wheels: Wheels | None) -> float:
    """Return how much faster the right wheel turns: positive is to the left."""
    assert wheels is not None
    return wheels.right - wheels.left


def test_brightness_is_counted_from_the_darkest_sensor() -> None:
    assert brightness(light(front_left=500, rear_left=20)) == [0, 0, 0, 0, 20, 0, 0, 500]


@pytest.mark.parametrize("level", [0, 1000, DARK])
def test_even_light_turns_it_to_neither_side(level: int) -> None:
    # In 2011 it drew to the left, whatever its level.
    assert seek(AmbientLight(*[level] * 8)) is None


def test_noise_is_not_taken_for_light() -> None:
    assert seek(light(left=FAINT - 1, rear_right=20)) is None


def test_light_straight_ahead_is_driven_to_straight() -> None:
    assert seek(light(front_left=900, front_right=900), cruise=0.3) == Wheels(0.3, 0.3)


# The four decisions of 2011: light behind on either side, and ahead on either side.
@pytest.mark.parametrize(
    ("sensors", "wheels"),
    [
        (("rear_left", "left"), Wheels(0.0, 0.3)),
        (("rear_right", "right"), Wheels(0.3, 0.0)),
        (("left", "diagonal_left"), Wheels(0.0, 0.3)),
        (("right", "diagonal_right"), Wheels(0.3, 0.0)),
    ],
)
def test_light_from_one_side_turns_the_robot_about_the_wheel_of_that_side(
    sensors: tuple[str, ...], wheels: Wheels
) -> None:
    assert seek(light(**dict.fromkeys(sensors, 800)), cruise=0.3) == wheels


def test_the_further_aside_the_light_the_more_the_robot_bends() -> None:
    bends = [turning(seek(lamp_at(direction), cruise=1.0)) for direction in (-30, -20, -10, 0, 10, 20, 30)]
    assert all(a < b for a, b in pairwise(bends))
    assert bends[3] == pytest.approx(0, abs=0.05)


def test_how_far_the_light_is_changes_the_bend_little() -> None:
    near, far = (turning(seek(lamp_at(15, distance))) for distance in (0.3, 0.8))
    assert near == pytest.approx(far, rel=0.3)


def test_from_any_side_the_robot_turns_the_shorter_way_round() -> None:
    for direction in range(-170, 171, 20):
        assert math.copysign(1, turning(seek(lamp_at(direction)))) == math.copysign(1, direction), direction


def test_no_wheel_is_faster_than_the_cruise_or_turns_backwards() -> None:
    for direction in range(-180, 180, 15):
        wheels = seek(lamp_at(direction), cruise=0.7)
        assert wheels is not None
        assert all(0 <= wheel <= 0.7 for wheel in wheels)


@pytest.mark.parametrize(
    ("sensor", "count", "blocks"),
    [("front_left", 600, True), ("diagonal_right", 1000, True), ("left", 3000, False), ("rear_right", 3000, False)],
)
def test_what_is_in_front_blocks_and_what_is_beside_does_not(sensor: str, count: int, blocks: bool) -> None:
    assert is_blocked(Proximity(*(count if name == sensor else 0 for name in NAMES))) == blocks


ROOM = """
about = "A lamp, and a pillar that throws a shadow."
[arena]
size = [1.5, 1.5]
[[robot]]
position = [{x}, 0.75]
heading = {heading}
"""
LAMP = """
[[light]]
position = [0.75, 0.75]
height = {height}
intensity = {intensity}
"""
PILLAR = """
[[cylinder]]
position = [0.50, 0.75]
radius = 0.05
height = 0.3
"""


def seek_in(folder: Path, room: str, seconds: float) -> tuple[RunResult, float]:
    """Return how going to the light went in that room, and how far from its middle it ended, m."""
    path = folder / "room.toml"
    path.write_text(room)
    worlds: list[World] = []

    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        transport = transport_of(robots[0])
        assert transport.simulation.world is not None
        worlds.append(transport.simulation.world)

    outcome = play(find("go-to-light"), f"sim://{path}?speed=max&latency=0.02", seconds=seconds, watch=watch)
    place = worlds[0].pose(0)
    return outcome, math.hypot(place.x - 0.75, place.y - 0.75)


@pytest.mark.parametrize(("height", "intensity"), [(0.04, 0.5), (0.06, 6.0), (0.2, 2.0)])
def test_it_ends_beneath_low_and_high_dim_and_bright_lamps(tmp_path: Path, height: float, intensity: float) -> None:
    room = ROOM.format(x=0.3, heading=70) + LAMP.format(height=height, intensity=intensity)
    outcome, distance = seek_in(tmp_path, room, 40)
    states = [name for _, name in outcome.states]  # noise may make it seek a second time
    assert (states[0], *states[-3:]) == ("seeking", "passing", "arriving", "arrived")
    assert outcome.reason == "done"
    assert outcome.messages == ("the light is overhead",)
    assert distance < 0.02


def test_a_time_that_ends_on_the_way_back_ends_it_there(tmp_path: Path) -> None:
    room = ROOM.format(x=0.3, heading=70) + LAMP.format(height=0.12, intensity=2.0)
    whole, _ = seek_in(tmp_path, room, 40)
    outcome, _ = seek_in(tmp_path, room, whole.duration - 0.5)
    assert outcome.states == whole.states[:-2]
    assert outcome.reason == "time"
    assert outcome.duration < whole.duration


def test_begun_beneath_the_lamp_it_comes_back_to_it(tmp_path: Path) -> None:
    room = ROOM.format(x=0.75, heading=70) + LAMP.format(height=0.12, intensity=2.0)
    outcome, distance = seek_in(tmp_path, room, 40)
    states = [name for _, name in outcome.states]
    assert states == ["seeking", "wandering", "seeking", "passing", "arriving", "arrived"]
    assert distance < 0.02


def test_a_shadow_is_not_taken_for_the_place_beneath_the_lamp(tmp_path: Path) -> None:
    room = ROOM.format(x=0.2, heading=0) + LAMP.format(height=0.12, intensity=2.0) + PILLAR
    outcome, distance = seek_in(tmp_path, room, 90)
    assert "avoiding" in [name for _, name in outcome.states]
    assert outcome.states[-1][1] == "arrived"
    assert distance < 0.02


def test_in_the_dark_it_wanders_and_never_arrives(tmp_path: Path) -> None:
    outcome, _ = seek_in(tmp_path, ROOM.format(x=0.3, heading=70), 20)
    assert {name for _, name in outcome.states} <= {"seeking", "wandering", "avoiding"}
    assert outcome.reason == "time"
