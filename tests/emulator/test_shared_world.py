"""``sim://...?robot=N``: several connections of one event loop into one world."""

import asyncio
import gc
import math
import weakref
from pathlib import Path

import pytest
from fault_rig import CUT, ask, open_url, opened, until_lost

import elib
from elib.base.errors import ArgumentError, LinkBusy, LinkNotFound, SimulationError
from elib.link.transport import robots_of
from elib.link.transport.lease import lease
from elib.simulator.emulator.sim_transport import SimTransport
from elib.simulator.emulator.simulation import RECONNECT_TIMEOUT, Simulation, running
from elib.testing import simulated
from shared import inside, now, with_fault

URL = "sim://square?speed=max&robots=3"

FACE_TO_FACE = """
[arena]
size = [1.0, 1.0]

[[robot]]
position = [0.4, 0.5]
heading = 0

[[robot]]
position = [0.5, 0.5]
heading = 180
firmware = "epuck2"
"""
"""Two robots with 26 mm between them."""


@pytest.fixture
def pair(tmp_path: Path) -> str:
    """URL of a world of two robots that look at each other."""
    path = tmp_path / "pair.toml"
    path.write_text(FACE_TO_FACE)
    return f"sim://{path}?speed=max&quality=ideal"


def shared() -> list[Simulation]:
    """Return the worlds of the running event loop that several connections share."""
    return [simulation for simulation in running() if simulation.is_shared]


def numbered(url: str, *numbers: int) -> list[str]:
    return [f"{url}&robot={number}" for number in numbers]


@simulated
async def test_robots_opened_by_their_number_share_a_world_and_a_url_without_one_has_its_own() -> None:
    robots = [await open_url(url) for url in (*numbered(URL, 1, 3), URL)]
    assert robots[0].simulation is robots[1].simulation is not robots[2].simulation
    assert [robot.robot.index for robot in robots] == [0, 2, 0]
    assert robots[0].simulation.count == 3
    for robot in robots:
        await robot.close()
    assert not shared()


@simulated
async def test_the_order_of_keys_and_the_speed_do_not_make_another_world() -> None:
    first = await open_url("sim://square?robots=2&speed=max&robot=1")
    second = await open_url("sim://square?robot=2&robots=2")
    assert first.simulation is second.simulation
    await first.close()
    await second.close()


@simulated
async def test_another_seed_or_another_number_of_robots_is_another_world() -> None:
    urls = ["sim://square?robots=2&robot=1", "sim://square?robots=3&robot=1", "sim://square?robots=2&seed=5&robot=1"]
    robots = [await open_url(url) for url in urls]
    assert len({robot.simulation for robot in robots}) == 3
    for robot in robots:
        await robot.close()


@simulated
async def test_robots_of_one_world_see_and_push_each_other(pair: str) -> None:
    first, second = [await open_url(url) for url in numbered(pair, 1, 2)]
    assert [robot.robot.firmware for robot in (first, second)] == ["asercom-1.2.2", "epuck2"]
    near = [int(text) for text in (await ask(first, b"N\r"))[2:].split(b",")]
    assert min(near[0], near[7]) > 50 > max(near[2:6]), "the other stands 26 mm in front"
    world = first.simulation.world
    assert world is not None
    before = world.poses[1].x
    assert await ask(first, b"D,800,800\r") == b"d\r\n"
    await asyncio.sleep(2)
    second.simulation.catch_up()
    assert world.poses[1].x > before + 0.05, "pushed along"
    await first.close()
    await second.close()


@simulated
async def test_a_robot_that_is_open_is_not_opened_again_but_after_it_was_closed() -> None:
    first, second = [await open_url(url) for url in numbered(URL, 1, 2)]
    with pytest.raises(LinkBusy, match="robot=2 is open already"):
        await open_url(f"{URL}&robot=2")
    await ask(second, b"D,11,12\r")
    await second.close()
    await second.close()
    again = await open_url(f"{URL}&robot=2")
    assert again.simulation is first.simulation
    assert await ask(again, b"E\r") == b"e,11,12\r\n", "the robot was left as it is"
    await again.close()
    await first.close()


@simulated
async def test_the_last_to_leave_ends_the_world_in_whatever_order_they_leave() -> None:
    for order in ((0, 1, 2), (2, 0, 1), (1, 2, 0)):
        robots = [await open_url(url) for url in numbered(URL, 1, 2, 3)]
        simulation = robots[0].simulation
        for index in order:
            assert simulation in shared()
            assert await ask(robots[index], b"Q\r") == b"q,0,0\r\n", "a new world each time"
            await ask(robots[index], b"D,9,9\r")
            await robots[index].close()
        assert simulation not in shared()
    loop = asyncio.get_running_loop()
    assert all(timer.cancelled() for timer in loop._scheduled)  # type: ignore[attr-defined]


@simulated
async def test_each_robot_of_a_world_may_have_a_link_and_a_fault_script_of_its_own(tmp_path: Path) -> None:
    faulty = with_fault(tmp_path, CUT, "sim://square?robots=2&robot=2")
    calm = await open_url("sim://square?robots=2&robot=1&latency=0.05")
    stricken = await open_url(faulty)
    assert stricken.simulation is calm.simulation
    began = now()
    assert await ask(calm, b"E\r") == b"e,0,0\r\n"
    assert now() - began > 0.1
    began = now()
    assert await ask(stricken, b"E\r") == b"e,0,0\r\n"
    assert now() - began < 0.01
    error = await until_lost(stricken)
    assert "robot=2" in error.message
    assert await ask(calm, b"E\r") == b"e,0,0\r\n", "the other's link is as it was"
    with pytest.raises(LinkNotFound, match="for another"):
        await open_url(faulty)
    await asyncio.sleep(10)
    back = await open_url(faulty)
    assert back.simulation is calm.simulation
    assert back.robot is stricken.robot
    await back.close()
    await calm.close()


@simulated
async def test_a_link_that_its_script_cuts_is_not_opened_even_if_nobody_had_lost_it(tmp_path: Path) -> None:
    faulty = with_fault(tmp_path, CUT, "sim://square?robots=2&robot=2")
    other = await open_url("sim://square?robots=2&robot=1")
    robot = await open_url(faulty)
    await ask(robot, b"E\r")
    await robot.close()
    await asyncio.sleep(6)
    with pytest.raises(LinkNotFound, match="has cut the link for another"):
        await open_url(faulty)
    await asyncio.sleep(10)
    await (await open_url(faulty)).close()
    await other.close()


@inside(opened, f"{URL}&robot=1")
async def test_a_robot_of_a_running_world_is_not_rebuilt_with_another_link(first: SimTransport) -> None:
    second = await open_url(f"{URL}&robot=2&latency=0.01")
    await second.close()
    with pytest.raises(ArgumentError, match="was opened with another firmware or link before"):
        await open_url(f"{URL}&robot=2")


@simulated
async def test_a_world_whose_robots_are_all_lost_waits_for_each_of_them_and_then_ends() -> None:
    robots = [await open_url(url) for url in numbered(URL, 1, 2)]
    simulation = robots[0].simulation
    await ask(robots[1], b"D,3,4\r")
    for each in simulation.robots.values():
        each.link.cut()
    for robot in robots:
        await until_lost(robot)
        await robot.close()
    await asyncio.sleep(RECONNECT_TIMEOUT - 1)
    back = await open_url(f"{URL}&robot=2")
    assert back.simulation is simulation
    assert await ask(back, b"E\r") == b"e,3,4\r\n"
    await asyncio.sleep(2)  # nobody came for robot 1
    await back.close()
    assert not shared()


@simulated
async def test_a_lease_of_one_robot_keeps_the_world_of_all() -> None:
    first, second = numbered(URL, 1, 2)
    with lease(second):
        robots = [await open_url(first), await open_url(second)]
        simulation = robots[0].simulation
        for robot in robots:
            await robot.close()
        await asyncio.sleep(10 * RECONNECT_TIMEOUT)
        back = await open_url(second)
        assert back.simulation is simulation
        await back.close()
        assert simulation in shared()
    assert not shared()


@simulated
async def test_the_robots_that_nobody_opened_stand_still_and_one_opened_late_is_as_if_just_switched_on() -> None:
    first = await open_url(f"{URL}&robot=1")
    world = first.simulation.world
    assert world is not None
    before = world.poses
    await ask(first, b"D,100,100\r")
    await asyncio.sleep(2)
    late = await open_url(f"{URL}&robot=3")
    assert len(first.simulation.robots) == 2
    assert await ask(late, b"D,200,200\r") == b"d\r\n"
    await asyncio.sleep(1)
    first.simulation.catch_up()
    assert world.time == pytest.approx(now(), abs=world.scene.step)
    assert world.poses[1] == before[1]
    moved = [math.dist((old.x, old.y), (new.x, new.y)) for old, new in zip(before, world.poses, strict=True)]
    assert moved[0] == pytest.approx(3 * 100 * 0.1288e-3, rel=0.05)
    assert moved[2] == pytest.approx(1 * 200 * 0.1288e-3, rel=0.05)
    await first.close()
    await late.close()


@pytest.mark.parametrize(
    ("url", "error", "message"),
    [
        ("sim://square?robots=3&robot=4", ArgumentError, "robot is 4, but there are robots=3"),
        ("sim://square?robot=0", ArgumentError, "robot is 0; it must be a whole number from 1"),
        ("sim://square?robot=2", ArgumentError, "the world has 1 robots, counted from 1"),
        ("sim://nowhere?robot=1", LinkNotFound, "there is no world 'nowhere'"),
        ("sim://square?robot=1&fault=no.toml", ArgumentError, "no.toml"),
    ],
)
@simulated
async def test_an_impossible_robot_is_refused_and_leaves_no_world_behind(
    url: str, error: type[elib.ElibError], message: str
) -> None:
    with pytest.raises(error, match=message):
        await open_url(url)
    assert not shared()
    assert not asyncio.get_running_loop()._scheduled  # type: ignore[attr-defined]


def test_two_event_loops_have_a_world_each_and_an_abandoned_one_goes_with_its_loop() -> None:
    worlds = []

    @simulated
    async def story() -> None:
        robot = await open_url(f"{URL}&robot=1")
        assert shared() == [robot.simulation]
        worlds.append(weakref.ref(robot.simulation))

    story()
    story()
    gc.collect()
    assert [world() for world in worlds] == [None, None]


def test_a_url_is_expanded_to_one_for_each_robot_of_its_world(pair: str) -> None:
    assert [str(url) for url in robots_of("sim://crowd?robots=2&seed=7")] == [
        "sim://crowd?robots=2&seed=7&robot=1",
        "sim://crowd?robots=2&seed=7&robot=2",
    ]
    assert [str(url) for url in robots_of(pair)] == numbered(pair, 1, 2), "as many as the world names"
    for single in ("sim://square", "sim://square?robots=5&robot=4", "tcp://127.0.0.1:4000", "replay://run.log"):
        assert [str(url) for url in robots_of(single)] == [single]


def test_a_world_without_robots_cannot_be_expanded(tmp_path: Path) -> None:
    path = tmp_path / "empty.toml"
    path.write_text("[arena]\nsize = [1, 1]\n")
    with pytest.raises(SimulationError, match="has no robot"):
        robots_of(f"sim://{path}")
