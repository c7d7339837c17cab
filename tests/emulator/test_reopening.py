"""A virtual robot whose link was cut or given up is found again under its URL."""

import asyncio
import gc
import weakref
from pathlib import Path

import pytest
from fault_rig import CUT, ask, open_url, until_lost

import elib
from elib.link.transport.lease import lease
from elib.simulator.emulator.simulation import RECONNECT_TIMEOUT, running
from elib.testing import simulated
from shared import now, with_fault


@pytest.fixture
def faulty(tmp_path: Path) -> str:
    """URL of a robot whose link is cut from 5 s to 15 s, and every 100 s again."""
    return with_fault(tmp_path, CUT)


@simulated
async def test_after_a_cut_the_same_url_leads_to_the_same_robot_and_world(faulty: str) -> None:
    first = await open_url(faulty)
    world = first.simulation.world
    assert world is not None
    assert await ask(first, b"D,100,100\r") == b"d\r\n"
    error = await until_lost(first)
    assert now() == 5.0
    assert "the link was cut at 5 s, as the fault script says" in error.message
    await first.close()
    await asyncio.sleep(10)
    second = await open_url(faulty)
    assert second.simulation is first.simulation
    assert await ask(second, b"E\r") == b"e,100,100\r\n"
    assert world.time == pytest.approx(15.0, abs=0.1), "it drove on meanwhile"
    await second.close()


@simulated
async def test_while_a_cut_lasts_nothing_is_found_and_the_error_says_how_long(faulty: str) -> None:
    first = await open_url(faulty)
    await ask(first, b"E\r")
    await until_lost(first)
    for attempt in range(20):
        assert now() == 5 + attempt / 2
        with pytest.raises(elib.LinkNotFound, match=f"for another {10 - attempt / 2:g} s"):
            await open_url(faulty)
        await asyncio.sleep(0.5)
    second = await open_url(faulty)
    assert second.simulation is first.simulation
    await first.close()  # late: it must not disturb the second
    assert await ask(second, b"E\r") == b"e,0,0\r\n"
    await second.close()


@simulated
async def test_a_link_that_is_cut_again_and_again_can_be_opened_again_and_again(faulty: str) -> None:
    found = set()
    for gap in range(5):
        robot = await open_url(faulty)
        found.add(robot.simulation)
        assert await ask(robot, b"Q\r") == b"q,0,0\r\n"
        await until_lost(robot)
        assert now() == pytest.approx(5 + 100 * gap)
        await robot.close()
        await asyncio.sleep(11)
    assert len(found) == 1
    (simulation,) = found
    assert simulation.robots[0].player.counts.cuts == 5


@simulated
async def test_a_cut_ordered_by_a_test_leaves_the_robot_to_be_found_too() -> None:
    first = await open_url("sim://?speed=max")
    await ask(first, b"D,7,8\r")
    first.simulation.robots[0].link.cut()
    await until_lost(first)
    await first.close()
    second = await open_url("sim://?speed=max")
    assert await ask(second, b"E\r") == b"e,7,8\r\n"
    await second.close()
    third = await open_url("sim://?speed=max")
    assert await ask(third, b"E\r") == b"e,0,0\r\n", "the second was closed, not cut"
    await third.close()


@simulated
async def test_a_second_opening_while_the_first_lives_is_a_world_of_its_own() -> None:
    first, second = await open_url("sim://?speed=max"), await open_url("sim://?speed=max")
    assert first.simulation is not second.simulation
    await first.close()
    await second.close()


@simulated
async def test_another_url_does_not_lead_to_a_lost_robot() -> None:
    first = await open_url("sim://?speed=max&seed=1")
    first.simulation.robots[0].link.cut()
    second = await open_url("sim://?speed=max&seed=2")
    assert second.simulation is not first.simulation
    third = await open_url("sim://?speed=max&seed=1")
    assert third.simulation is first.simulation
    await second.close()
    await third.close()


@simulated
async def test_of_two_lost_robots_the_one_lost_first_is_found_first() -> None:
    robots = [await open_url("sim://?speed=max") for _ in range(3)]
    for index in (1, 0, 2):
        robots[index].simulation.robots[0].link.cut()
    found = [await open_url("sim://?speed=max") for _ in range(3)]
    assert [robot.simulation for robot in found] == [robots[index].simulation for index in (1, 0, 2)]
    for robot in found:
        await robot.close()


@simulated
async def test_a_lost_robot_nobody_looks_for_is_gone_after_a_while() -> None:
    first = await open_url("sim://?speed=max")
    first.simulation.robots[0].link.cut()
    await asyncio.sleep(RECONNECT_TIMEOUT - 1)
    second = await open_url("sim://?speed=max")
    assert second.simulation is first.simulation
    second.simulation.robots[0].link.cut()
    await asyncio.sleep(RECONNECT_TIMEOUT + 1)
    third = await open_url("sim://?speed=max")
    assert third.simulation is not first.simulation
    await third.close()
    assert not any(each.waiting for each in running())


@simulated
async def test_a_robot_waits_out_a_cut_however_long(tmp_path: Path) -> None:
    url = with_fault(tmp_path, f'kind = "cut"\nat = 1\nfor = {10 * RECONNECT_TIMEOUT}')
    first = await open_url(url)
    await ask(first, b"E\r")
    await until_lost(first)
    await asyncio.sleep(10 * RECONNECT_TIMEOUT + 1)
    second = await open_url(url)
    assert second.simulation is first.simulation
    await second.close()


@simulated
async def test_a_robot_cut_off_for_good_is_never_replaced_while_somebody_looks_for_it(tmp_path: Path) -> None:
    url = with_fault(tmp_path, 'kind = "cut"\nat = 1')
    first = await open_url(url)
    await ask(first, b"E\r")
    await until_lost(first)
    for _ in range(10):
        await asyncio.sleep(RECONNECT_TIMEOUT / 2)
        with pytest.raises(elib.LinkNotFound, match="for good"):
            await open_url(url)


def test_a_lost_robot_goes_with_its_event_loop() -> None:
    simulations = []

    @simulated
    async def story() -> None:
        transport = await open_url("sim://?speed=max")
        transport.simulation.robots[0].link.cut()
        simulations.append(weakref.ref(transport.simulation))

    story()
    gc.collect()
    assert simulations[0]() is None


@simulated
async def test_a_robot_with_a_lease_is_kept_however_its_last_connection_ended() -> None:
    url = "sim://square?speed=max"
    with lease(url):
        first = await open_url(url)
        await ask(first, b"D,1,2\r")
        await first.close()
        await asyncio.sleep(10 * RECONNECT_TIMEOUT)
        second = await open_url(url)
        assert await ask(second, b"E\r") == b"e,1,2\r\n"
        with lease("sim://square?speed=max"):
            await second.close()
    fresh = await open_url(url)
    assert await ask(fresh, b"E\r") == b"e,0,0\r\n", "nobody has a lease any more"
    assert fresh.simulation is not first.simulation
    await fresh.close()
    assert not any(each.waiting for each in running())


@simulated
async def test_a_robot_that_is_connected_when_its_lease_ends_goes_on() -> None:
    url = "sim://?speed=max"
    with lease(url):
        robot = await open_url(url)
        robot.simulation.robots[0].link.cut()
        robot = await open_url(url)
    assert await ask(robot, b"E\r") == b"e,0,0\r\n"
    await robot.close()
