"""``robot.go_to(x, y, map=grid)``: round what is on the map, and round what is not."""

from __future__ import annotations

import asyncio
import math
import threading
from pathlib import Path

import pytest

import elib
from elib.base.errors import NoWay
from elib.maps.ways import way
from elib.robot import ways
from elib.simulator.physics import World
from elib.testing import simulated, simulation_of

GOAL = 0.5, 0.3


def placed(robot: elib.BlockingEpuck) -> World:
    """Tell a robot where it is, and return its world."""
    world = simulation_of(robot).world
    assert world is not None
    pose = world.pose(0)
    robot.set_pose(pose.x, pose.y, pose.heading)
    return world


def off(world: World, x: float, y: float) -> float:
    """Return how far the robot is from a place, m."""
    pose = world.pose(0)
    return math.dist((pose.x, pose.y), (x, y))


def world_with(folder: Path, things: str) -> str:
    """Return a world of 60 cm x 60 cm with a wall that leaves two gaps, and other things."""
    file = folder / "room.toml"
    file.write_text(f"""
[arena]
size = [0.6, 0.6]

[[wall]]
from = [0.3, 0.15]
to = [0.3, 0.45]

[[robot]]
position = [0.15, 0.3]

{things}
""")
    return f"sim://{file}?speed=max&quality=typical&seed=3"


@pytest.mark.parametrize("firmware", ["asercom-1.2.2", "epuck2"])
def test_it_drives_through_the_maze_and_touches_nothing(firmware: str) -> None:
    with elib.connect(f"sim://maze?speed=max&quality=typical&firmware={firmware}&seed=5") as robot:
        world, touched = placed(robot), []
        world.follow(lambda: touched.append(world.touching(0)))
        pose = robot.go_to(0.5, 0.9, heading=0.0, map=elib.Grid.of_world("maze"))
        assert not any(touched)
        assert off(world, 0.5, 0.9) < 0.03
        assert (pose.x, pose.y) == pytest.approx((0.5, 0.9), abs=0.002)
        assert pose.heading == pytest.approx(0, abs=0.01)


def test_it_goes_round_a_box_that_is_not_on_the_map(tmp_path: Path) -> None:
    grid = elib.Grid.of_world(elib.Scene.load(world_with(tmp_path, "")[6:].partition("?")[0]))
    url = world_with(tmp_path, "[[box]]\nposition = [0.3, 0.5]\nsize = [0.05, 0.2]\n")
    with elib.connect(url.replace("seed=3", "seed=1")) as robot:  # its wheels differ by half a standard deviation
        world = placed(robot)
        for goal in (GOAL, (0.15, 0.4), GOAL):
            pose = robot.go_to(*goal, map=grid)
            assert off(world, *goal) < 0.03
            assert 0.02 < pose.uncertainty < 0.06, "in the open, it sees little"


def test_what_blocks_every_way_is_an_error_and_the_robot_stands(tmp_path: Path) -> None:
    grid = elib.Grid.of_world(elib.Scene.load(world_with(tmp_path, "")[6:].partition("?")[0]))
    boxes = "".join(f"[[box]]\nposition = [0.3, {y}]\nsize = [0.05, 0.2]\n\n" for y in (0.1, 0.5))
    with elib.connect(world_with(tmp_path, boxes)) as robot:
        world = placed(robot)
        with pytest.raises(NoWay, match="what is not on the map blocks the way"):
            robot.go_to(*GOAL, map=grid)
        robot.sleep(0.1)
        before = world.pose(0)
        robot.sleep(1)
        assert world.pose(0) == before
        assert before.x < 0.3
        assert off(world, robot.pose().x, robot.pose().y) < 0.03, "it still knows where it is"


def test_no_way_on_the_map_is_an_error_before_anything_moves() -> None:
    with elib.connect("sim://maze?speed=max") as robot:
        robot.distances()
        with pytest.raises(NoWay, match="is not on the map"):
            robot.go_to(3.0, 1.0, map=elib.Grid.of_world("maze"))
        assert robot.encoders() == (0, 0)


def test_a_robot_that_is_put_elsewhere_says_that_it_lost_its_way() -> None:
    with elib.connect("sim://maze?speed=max&quality=typical&seed=2") as robot:
        world = placed(robot)

        def put() -> None:
            if world.time > 15 and not moved:
                moved.append(world.time)
                world.move_robot(0, elib.Pose(0.9, 0.7, 2.0))

        moved: list[float] = []
        world.follow(put)
        with pytest.raises(NoWay, match=r"lost its way|Is the robot where"):
            robot.go_to(1.3, 1.3, map=elib.Grid.of_world("maze"))
        assert moved


@simulated
async def test_other_tasks_go_on_while_a_way_is_planned(monkeypatch: pytest.MonkeyPatch) -> None:
    loop, began, is_going_on = asyncio.get_running_loop(), asyncio.Event(), threading.Event()

    def plan(grid: elib.Grid, *where: tuple[float, float], through_unknown: bool) -> list[tuple[float, float]]:
        loop.call_soon_threadsafe(began.set)
        assert is_going_on.wait(20), "nothing else went on"
        return way(grid, *where, through_unknown=through_unknown)

    async def other() -> None:
        await began.wait()
        is_going_on.set()

    monkeypatch.setattr(ways, "way", plan)
    async with elib.open("sim://square?speed=max") as robot:
        await robot.set_pose(0.5, 0.5)
        await robot.distances()
        going = asyncio.create_task(other())
        pose = await robot.go_to(0.55, 0.5, map=elib.Grid.of_world("square"))
        await going
    assert pose.x == pytest.approx(0.55, abs=0.01)
