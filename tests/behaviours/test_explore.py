"""Exploring: a map of an arena that the robot does not know."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from played import played

import elib
from elib.base.pose import Pose
from elib.behaviours.explore import NEAR, STRETCH, Straight
from elib.simulator.physics import World
from elib.testing import simulation_of

WORLD = """
[arena]
size = [0.6, 0.4]

[[wall]]
from = [0.3, 0.0]
to = [0.3, 0.2]

[[robot]]
position = [0.15, 0.15]
"""


def explored(folder: Path, monkeypatch: pytest.MonkeyPatch, world: str, seconds: float) -> tuple[elib.Grid, Pose, str]:
    """Let a drawn robot explore a world, and return its map, where it started, and why it ended."""
    monkeypatch.chdir(folder)
    run = played("explore", f"sim://{world}?speed=max&quality=typical&seed=1", seconds=seconds)
    assert "explored.png" in run.outcome.messages[-1]
    assert not any("not to be relied on" in each for each in run.outcome.messages)
    return elib.Grid.open("explored.png"), run.before, run.outcome.reason


def right(grid: elib.Grid, start: Pose, world: str) -> float:
    """Return the share of a world's squares that a map has right, which began where the robot did."""
    real = elib.Grid.of_world(world)
    is_wall, is_free = real.clearance(0.04) < 0.025, real.clearance(0.04) > 0.005
    count = 0
    for row in range(real.odds.shape[0]):
        for column in range(real.odds.shape[1]):
            x, y = real.place(row, column)
            cosine, sine = math.cos(start.heading), math.sin(start.heading)
            there = (x - start.x) * cosine + (y - start.y) * sine, (y - start.y) * cosine - (x - start.x) * sine
            count += (grid.is_occupied(*there) and is_wall[row, column]) or (
                grid.is_free(*there) and is_free[row, column]
            )
    return count / real.odds.size


def test_it_draws_a_small_arena_and_ends_when_nothing_is_left_to_see(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "small.toml").write_text(WORLD)
    grid, start, reason = explored(tmp_path, monkeypatch, "small.toml", 150)
    assert reason == "done"
    assert right(grid, start, "small.toml") > 0.9


@pytest.mark.parametrize(
    ("moved_at", "seconds", "told"),
    [(20, 65, "not to be relied on"), pytest.param(40, 100, "draws the map again", marks=pytest.mark.long)],
)
def test_a_map_that_contradicts_itself_is_not_left_without_a_word(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moved_at: float, seconds: float, told: str
) -> None:
    monkeypatch.chdir(tmp_path)

    def watch(run: elib.behaviours.RunContext, robots: tuple[elib.Epuck, ...]) -> None:
        world = simulation_of(robots[0]).world
        assert world is not None
        world.follow(lambda: put(world))

    def put(world: World) -> None:
        if world.time > moved_at and not moved:
            moved.append(world.time)
            world.move_robot(0, Pose(0.9, 0.7, 1.0))

    moved: list[float] = []
    url = "sim://maze?speed=max&quality=typical&seed=2"
    options = {"number": 7}
    said = elib.play(elib.behaviours.find("explore"), url, seconds=seconds, options=options, watch=watch).messages
    assert "m² known" in said[0]
    assert any(told in each for each in said), said
    assert elib.Grid.open("explored7.png").occupied.any()


@pytest.mark.long
def test_it_draws_the_maze_in_five_minutes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grid, start, _ = explored(tmp_path, monkeypatch, "maze", 300)
    assert right(grid, start, "maze") > 0.9


def along(heading: float, steps: int, *, bend: float = 0.0, beside: float = 0.03) -> list[tuple[Pose, float]]:
    """Return poses of odometry on a straight way beside a wall, and the wall's distance."""
    way = 0.01
    return [
        (Pose(k * way * math.cos(heading), k * way * math.sin(heading), heading + bend * k * way), beside)
        for k in range(steps)
    ]


def test_the_heading_beside_a_wall_is_at_a_right_angle_to_that_beside_the_first_one() -> None:
    straight = Straight()
    told = [straight(*each) for each in along(0.1, 12)]
    assert told[0] is None
    assert told[-1] == pytest.approx(0.1)
    for pose, beside in along(0.1 + math.pi / 2 + 0.15, 12):
        heading = straight(pose, beside)
    assert heading == pytest.approx(0.1 + math.pi / 2)


def test_without_a_straight_wall_beside_it_the_heading_is_not_told() -> None:
    straight = Straight()
    [straight(*each) for each in along(0.0, 12)]
    assert straight(*along(0.6, 12)[-1]) is None, "this wall is slanted"
    for others in (along(0.0, 12, bend=4.0), along(0.0, 12, beside=NEAR + 0.01), along(0.0, int(50 * STRETCH))):
        straight = Straight()
        assert [straight(*each) for each in others][-1] is None


def test_most_walls_tell_what_stands_at_right_angles_not_the_first_one() -> None:
    straight = Straight()
    for each in along(0.6, 20):  # a box in the room
        straight(*each)
    assert straight.direction == pytest.approx(0.6)
    for each in along(0.0, 40, bend=0.05):
        heading = straight(*each)
    assert straight.direction == pytest.approx(0.0, abs=0.01)
    assert heading == pytest.approx(0.0, abs=0.01)
    assert [straight(*each) for each in along(0.6, 12)][-1] is None, "now the box is what is slanted"


@pytest.mark.long
def test_it_goes_from_what_stands_in_a_room_to_the_walls_and_draws_them_straight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    grid, _, _ = explored(tmp_path, monkeypatch, "arena", 120)
    rows, columns = grid.occupied.nonzero()
    axes = ((math.cos(turn), math.sin(turn)) for turn in np.radians(range(90)))
    turned = [max(np.ptp(columns * x - rows * y), np.ptp(columns * y + rows * x)) for x, y in axes]
    assert 0.95 < min(turned) * grid.cell < 1.1, "a room of 1 m"
