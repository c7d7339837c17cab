"""``robot.distances()``: metres from the infrared sensors, without what they read in the open."""

from __future__ import annotations

import math

import pytest

import elib
from elib.link.protocol.profiles import PROFILES


@pytest.mark.parametrize("firmware", list(PROFILES))
def test_a_wall_comes_nearer_by_what_the_robot_drives(firmware: str) -> None:
    with elib.connect(f"sim://square?speed=max&firmware={firmware}&quality=typical") as robot:
        assert robot.distances().nearest == math.inf
        robot.set_speed(0.3, 0.3)
        while robot.distances().ahead >= 0.04:
            assert robot.time < 60, "it has not come to a wall"
        robot.set_speed(0, 0)
        robot.sleep(0.5)
        before = min(robot.distances().ahead for _ in range(5))
        robot.drive(-0.01)
        after = min(robot.distances().ahead for _ in range(5))
        assert after - before == pytest.approx(0.01, abs=0.005)


def test_what_the_sensors_read_in_the_open_is_learned_again_after_a_restart() -> None:
    with elib.connect("sim://square?speed=max&quality=typical") as robot:
        robot.calibrate_proximity()
        assert robot.distances().nearest == math.inf
        robot.reset()  # the calibration is lost: the counts in the open are high again
        assert robot.distances().nearest == math.inf
        assert max(robot.proximity()) > 60


def test_distances_are_numbers_clockwise_from_the_front_right() -> None:
    found = elib.Distances(0.01, 0.02, 0.03, 0.04, 0.05, 0.06, math.inf, 0.02)
    assert (found.ahead, found.nearest, found[2], found.rear_left) == (0.01, 0.01, 0.03, 0.05)
    assert repr(found).startswith("Distances(front_right=0.01")
