"""Finding out where the robot is on a map."""

from __future__ import annotations

import math
import random
from pathlib import Path

import pytest

import elib
from elib.base.errors import ArgumentError, NoWay
from elib.behaviours.find_place import find_place
from elib.link.protocol.profiles import PROFILES
from elib.simulator.worlds.files import parse_file
from elib.testing import simulated, simulation_of, world_of
from lanes import short

ROOM = """
[arena]
size = [1.4, 1.2]

[[wall]]
from = [0.45, 0.0]
to = [0.45, 0.3]

[[box]]
position = [0.08, 0.52]
size = [0.16, 0.16]

[[robot]]
position = [0.15, 0.15]
"""
MAZE = elib.Grid.of_world("maze")


def put_anywhere(robot: elib.Epuck, chance: random.Random) -> None:
    """Put the robot at a place of the maze that has room for it."""
    free = [(row, column) for row, column in zip(*(MAZE.clearance(0.06) > 0.055).nonzero(), strict=True)]
    x, y = MAZE.place(*chance.choice(free))
    world_of(robot).move_robot(0, elib.Pose(x, y, chance.uniform(-math.pi, math.pi)))


def truth(robot: elib.Epuck) -> elib.Pose:
    """Return where the robot is."""
    simulation_of(robot).catch_up()
    return world_of(robot).pose(0)


def still(robot: elib.Epuck) -> bool:
    """Return whether the wheels stand."""
    return world_of(robot).wheel_speeds(0) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("link", "seed"),
    short(
        [*((f"firmware={each}", 7) for each in PROFILES), *(("fault=flaky-bluetooth", seed) for seed in (8, 9))],
        ("firmware=asercom-1.2.2", 7),
    ),
)
@simulated
async def test_it_finds_the_robot_wherever_it_was_put_and_then_it_stands(link: str, seed: int) -> None:
    chance = random.Random(f"{link} {seed}")
    async with elib.open(f"sim://maze?quality=typical&seed={seed}&{link}") as robot:
        for _ in range(2):  # the second time it knows what its sensors read in the open
            put_anywhere(robot, chance)
            pose = await find_place(robot, MAZE)
            real = truth(robot)
            assert still(robot)
            assert math.dist((pose.x, pose.y), (real.x, real.y)) < 0.04
            assert abs(math.remainder(pose.heading - real.heading, math.tau)) < 0.2
            assert await robot.pose() == pose, "odometry counts from there"


@pytest.mark.long
@simulated
async def test_it_goes_round_a_box_that_is_not_on_the_map_once_and_leaves_it(tmp_path: Path) -> None:
    box = "[[box]]\nposition = [0.8, 0.7]\nsize = [0.1, 0.1]\npushable = false\n"
    (tmp_path / "room.toml").write_text(ROOM + box)
    async with elib.open(f"sim://{tmp_path}/room.toml?quality=typical&seed=4") as robot:
        world_of(robot).move_robot(0, elib.Pose(0.8, 0.81, 0.0))
        pose = await find_place(robot, elib.Grid.of_world(parse_file(ROOM.encode(), "room.toml").scene))
        real = truth(robot)
        assert math.dist((pose.x, pose.y), (real.x, real.y)) < 0.04


@simulated
async def test_a_place_that_is_not_found_in_time_is_an_error_and_odometry_stays() -> None:
    async with elib.open("sim://square?quality=typical&seed=3") as robot:
        before = truth(robot)
        with pytest.raises(NoWay, match="not found in 5 s") as error:
            await find_place(robot, elib.Grid.of_world("square"), limit=5)
        assert "more time" in error.value.hint
        assert still(robot)
        pose, real = await robot.pose(), truth(robot)
        driven = math.dist((real.x, real.y), (before.x, before.y))
        assert math.hypot(pose.x, pose.y) == pytest.approx(driven, abs=0.02)


@simulated
async def test_what_is_no_map_and_no_time_is_refused_before_a_wheel_turns() -> None:
    async with elib.open("sim://maze") as robot:
        with pytest.raises(ArgumentError, match="limit"):
            await find_place(robot, MAZE, limit=0)
        with pytest.raises(ArgumentError, match="Grid"):
            await find_place(robot, "maze.png")  # type: ignore[arg-type]
        assert still(robot)
