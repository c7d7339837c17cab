"""Flocking: the three rules, and a flock that drives the same way without touching."""

from __future__ import annotations

import asyncio
import cmath
import math
import statistics

import pytest

from elib.behaviours import RunContext, find, play
from elib.behaviours.flocking import BYTE, flock, north_of, packed
from elib.link.protocol.values import MagneticField, Neighbour
from elib.robot.aio import Epuck
from elib.testing.inside import world_of

NOTHING = (0,) * 8


def course(neighbours: list[Neighbour], *, north: float = 0.0, near: tuple[int, ...] = NOTHING) -> float:
    """Return where a robot goes, degrees, positive to the left."""
    ahead, leftward = flock(north, neighbours, near, spacing=0.2)
    return math.degrees(math.atan2(leftward, ahead))


def test_alone_it_drives_straight_on() -> None:
    assert flock(1.0, [], NOTHING) == (1.0, 0.0)


@pytest.mark.parametrize("side", [1, -1])
def test_it_goes_towards_the_far_and_away_from_the_near(side: int) -> None:
    assert side * course([Neighbour(0.5, side * math.pi / 2)]) > 20
    assert side * course([Neighbour(0.1, side * math.pi / 2)]) < -10
    assert course([Neighbour(0.2, side * math.pi / 2)]) == 0


@pytest.mark.parametrize("turned", [-150, -90, -20, 20, 90, 150])
def test_it_turns_towards_the_direction_of_its_neighbour(turned: float) -> None:
    # The robot looks north; its neighbour looks so many degrees to the left of that, and sees north to its right.
    other = Neighbour(0.2, 0.0, packed(-math.radians(turned)))
    assert course([other]) == pytest.approx(turned / 2, abs=1)


def test_only_the_difference_of_the_directions_counts() -> None:
    for own in (0.0, 1.0, -2.0):
        other = Neighbour(0.2, 0.0, packed(own - 0.8))
        assert course([other], north=own) == pytest.approx(math.degrees(0.4), abs=1)


def test_a_message_without_a_direction_leaves_only_the_distance() -> None:
    assert course([Neighbour(0.5, 1.0, b"")]) == course([Neighbour(0.5, 1.0, b"ab")])


def test_what_the_infrared_sensors_see_is_avoided() -> None:
    assert course([], near=(400, 400, 0, 0, 0, 0, 100, 50)) > 60
    assert course([], near=(20,) * 8) == 0


@pytest.mark.parametrize("angle", [0.0, 0.01, 1.0, 3.1, -3.1, -0.01])
def test_a_direction_fits_into_a_byte(angle: float) -> None:
    assert math.remainder(packed(angle)[0] * BYTE - angle, math.tau) == pytest.approx(0, abs=BYTE / 2)
    field = MagneticField(20e-6 * math.cos(angle), 20e-6 * math.sin(angle), -44e-6)
    assert north_of(field) == pytest.approx(angle)


def aligned(url: str, seconds: float) -> list[float]:
    """Run the behaviour and return how equal the headings are, 0 to 1, each second; no robot may touch anything."""
    seen = []

    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        loop, world = asyncio.get_running_loop(), world_of(robots[0])

        def look() -> None:
            seen.append(abs(sum(cmath.exp(1j * pose.heading) for pose in world.poses)) / world.robots)
            assert not any(world.touching(robot) for robot in range(world.robots))
            loop.call_later(1, look)

        look()

    play(find("flocking"), url, seconds=seconds, watch=watch)
    return seen


@pytest.mark.long
def test_eight_robots_drive_the_same_way_after_a_while_and_touch_nothing() -> None:
    seen = aligned("sim://crowd?robots=8&firmware=epuck2&speed=max&seed=1", 40)
    assert len(seen) >= 40
    assert seen[0] < 0.2
    assert statistics.fmean(seen[20:]) > 0.8


def test_robots_without_a_compass_only_keep_their_distance() -> None:
    assert len(aligned("sim://crowd?robots=4&speed=max&seed=1", 10)) >= 10
