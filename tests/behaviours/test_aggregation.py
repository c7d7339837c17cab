"""Aggregation: the controller of two lines, and what counts as seeing another robot."""

from __future__ import annotations

import math

import pytest

from elib.base.body import AXLE
from elib.base.pose import Pose
from elib.behaviours.aggregation import COLUMNS, ROWS, aggregate, sees_another
from elib.robot.swarms.swarm import Swarm, swarm
from elib.testing import world_of


def test_when_it_sees_another_robot_it_turns_on_the_spot() -> None:
    assert aggregate(True, pace=0.5) == (0.5, -0.5)


def test_otherwise_it_drives_backwards_in_a_circle_of_fifteen_centimetres() -> None:
    left, right = aggregate(False, pace=0.5)
    assert max(left, right) < 0
    assert abs(AXLE / 2 * (left + right) / (left - right)) == pytest.approx(0.15, abs=0.002)


def test_both_turn_to_the_same_side() -> None:
    # Both turns are clockwise: the other robot comes into sight and leaves it at the same edge.
    for sees in (True, False):
        left, right = aggregate(sees)
        assert right - left < 0


@pytest.mark.parametrize("distance", [0.12, 0.2, 0.4, 0.8])
def test_a_robot_with_its_leds_on_is_seen_straight_ahead_and_not_aside(distance: float) -> None:
    async def main(robots: Swarm) -> list[bool]:
        world = world_of(robots[0])
        await robots[0].set_camera(COLUMNS, ROWS, 8)
        seen = []
        for aside in (0.0, math.radians(50)):
            world.move_robot(0, Pose(0.1, 0.1, 0.3))
            world.move_robot(1, Pose(0.1 + distance * math.cos(0.3), 0.1 + distance * math.sin(0.3), 1.0))
            world.move_robot(0, Pose(0.1, 0.1, 0.3 + aside))
            await robots[1].set_led(8, 1)
            picture = await robots[0].within(3).image()
            seen.append(sees_another(picture))
            await robots[1].set_led(8, 0)
            picture = await robots[0].within(3).image()
            seen.append(sees_another(picture))
        return seen

    assert swarm("sim://square?robots=2&speed=max").run(main) == [True, False, False, False]
