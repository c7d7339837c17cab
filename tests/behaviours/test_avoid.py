"""Obstacle avoidance: the controller alone, then the loop in simulated worlds."""

from __future__ import annotations

import asyncio
from itertools import pairwise

import pytest
from readings import near

from elib.behaviours import find, run_behaviour
from elib.behaviours.avoid import BLOCKED, FREE, NOISE, SPIN, avoid
from elib.link.protocol.values import Wheels
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.testing.inside import transport_of
from lanes import short

MAX_TOUCH = 1.0
"""s that the robot may lean on something before it counts as stuck."""
SAMPLE = 1 / 64


def test_free_ground_is_crossed_straight_at_cruising_speed() -> None:
    assert avoid(near(), cruise=0.7) == Wheels(0.7, 0.7)


def test_noise_alone_does_not_bend_the_way() -> None:
    assert avoid(near(front_left=20, diagonal_left=15, left=NOISE)) == Wheels(0.6, 0.6)


@pytest.mark.parametrize("sensor", ["diagonal_left", "left", "front_left"])
def test_something_on_the_left_turns_the_robot_right(sensor: str) -> None:
    wheels = avoid(near(**{sensor: 300}))
    assert wheels.left > wheels.right >= 0


@pytest.mark.parametrize("sensor", ["diagonal_right", "right", "front_right"])
def test_something_on_the_right_turns_the_robot_left(sensor: str) -> None:
    wheels = avoid(near(**{sensor: 300}))
    assert wheels.right > wheels.left >= 0


def test_the_nearer_it_is_the_more_the_robot_bends() -> None:
    bends = [(w := avoid(near(diagonal_left=count))).left - w.right for count in (60, 150, 300, 450)]
    assert all(a < b for a, b in pairwise(bends))


def test_what_is_behind_changes_nothing() -> None:
    assert avoid(near(rear_left=3000, rear_right=3000)) == avoid(near())


@pytest.mark.parametrize(("left", "right", "turn"), [(900, 500, 1), (500, 900, -1), (900, 900, 1)])
def test_with_something_right_in_front_it_turns_on_the_spot_away_from_the_nearer_side(
    left: int, right: int, turn: int
) -> None:
    assert avoid(near(front_left=left, front_right=right)) == Wheels(turn * SPIN, -turn * SPIN)


def test_a_turn_once_begun_keeps_its_direction_though_the_nearer_side_changes() -> None:
    begun = avoid(near(front_left=BLOCKED + 500, front_right=BLOCKED))
    assert avoid(near(front_right=BLOCKED + 500), begun) == begun
    assert avoid(near(front_right=FREE + 1), begun) == begun


def test_a_turn_ends_when_the_way_is_free() -> None:
    begun = avoid(near(front_left=BLOCKED + 500))
    assert avoid(near(front_left=FREE - 1, diagonal_left=FREE), begun).right > 0


def test_no_reading_at_all_asks_for_more_than_the_wheels_can_do() -> None:
    for count in (0, 100, 1000, 4095):
        for sensors in (("front_left",), ("front_left", "front_right"), ("diagonal_right", "right")):
            assert all(-1 <= wheel <= 1 for wheel in avoid(near(**dict.fromkeys(sensors, count)), cruise=1.0))


async def _wander(robot: Epuck, seconds: float, **options: object) -> tuple[float, float, int]:
    """Return the longest touch, s, the path's length, m, and how many squares of 10 cm it crossed."""
    transport = transport_of(robot)
    world = transport.simulation.world
    assert world is not None
    touch = longest = path = 0.0
    squares: set[tuple[int, int]] = set()

    async def observe() -> None:
        nonlocal touch, longest, path
        before = world.pose(0)
        while True:
            await asyncio.sleep(SAMPLE)  # clock: simulated
            transport.simulation.catch_up()
            now = world.pose(0)
            touch = touch + SAMPLE if world.touching(0) else 0.0
            longest = max(longest, touch)
            path += ((now.x - before.x) ** 2 + (now.y - before.y) ** 2) ** 0.5
            squares.add((int(now.x * 10), int(now.y * 10)))
            before = now

    observer = asyncio.create_task(observe())
    await run_behaviour(find("avoid"), robot, seconds=seconds, options=options)
    observer.cancel()
    return longest, path, len(squares)


@pytest.mark.parametrize("seed", short(range(4), 0))
def test_in_the_arena_it_keeps_moving_and_never_leans_on_a_wall(seed: int) -> None:
    longest, path, squares = run_on(f"sim://?speed=max&seed={seed}", lambda robot: _wander(robot, 30))
    assert longest < MAX_TOUCH
    assert path > 30 * 0.05  # at 0.6 rev/s it makes 7.7 cm/s where nothing is near
    assert squares >= 12


@pytest.mark.parametrize("cruise", short([0.2, 1.0], 1.0))
def test_other_cruising_speeds_are_safe_too(cruise: float) -> None:
    longest, path, _ = run_on("sim://?speed=max&seed=3", lambda robot: _wander(robot, 30, cruise=cruise))
    assert longest < MAX_TOUCH
    assert path > 30 * 0.1288 * cruise * 0.5


def test_it_finds_its_way_over_a_link_that_is_slow_and_loses_answers() -> None:
    async def main(robot: Epuck) -> tuple[tuple[float, float, int], int]:
        return await _wander(robot, 60), robot.statistics.lost

    (longest, path, _), lost = run_on("sim://?speed=max&seed=2&latency=0.03&jitter=0.01&loss=0.03", main)
    assert lost > 5
    assert longest < MAX_TOUCH
    assert path > 1.0
