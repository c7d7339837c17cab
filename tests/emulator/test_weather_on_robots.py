"""What fault scripts do to a whole virtual robot: battery, restart, and links that can be opened again."""

import asyncio
import gc
import math
import weakref
from itertools import pairwise
from pathlib import Path

import pytest

import elib
from elib.emulator import lost
from elib.emulator.lost import AFTERLIFE
from elib.emulator.sim import SimTransport, Simulation
from elib.emulator.weather import EMPTY, WEAK
from elib.testing.simulated import simulated
from elib.testing.weather import faults_of, weather
from elib.transport import open_transport
from elib.transport.keeping import keep
from elib.transport.simulation import SimulationSettings

CUT = '[[fault]]\nkind = "cut"\nfrom = 5\nevery = 100\nfor = 10\n'


def now() -> float:
    return asyncio.get_running_loop().time()


@pytest.fixture
def stormy(tmp_path: Path) -> str:
    """URL of a robot whose link is cut from 5 s to 15 s, and every 100 s again."""
    return storm(tmp_path, CUT)


def storm(folder: Path, text: str, url: str = "sim://square?speed=max") -> str:
    path = folder / "storm.toml"
    path.write_text(f'description = "a storm"\n{text}')
    return weather(path, url)


async def open_sim(url: str) -> SimTransport:
    transport = await open_transport(url)
    assert isinstance(transport, SimTransport)
    return transport


async def ask(transport: SimTransport, line: bytes) -> bytes:
    await transport.write(line)
    answer = b""
    async with asyncio.timeout(10):
        while not answer.endswith(b"\n"):
            answer += await transport.read()
    return answer


async def until_lost(transport: SimTransport) -> elib.LinkLost:
    with pytest.raises(elib.LinkLost) as caught:
        while True:
            await transport.read()
    return caught.value


# -- the link is cut and comes back ------------------------------------------------------------------------------------


def test_after_a_cut_the_same_url_leads_to_the_same_robot_and_world(stormy: str) -> None:
    @simulated
    async def story() -> None:
        first = await open_sim(stormy)
        world = first.simulation.world
        assert world is not None
        assert await ask(first, b"D,100,100\r") == b"d\r\n"
        error = await until_lost(first)
        assert now() == 5.0
        assert "the link was cut at 5 s, as the fault script says" in error.message
        await first.close()
        await asyncio.sleep(10)
        second = await open_sim(stormy)
        assert second.simulation is first.simulation
        assert await ask(second, b"E\r") == b"e,100,100\r\n"
        assert world.time == pytest.approx(15.0, abs=0.1), "it drove on meanwhile"
        await second.close()

    story()


def test_while_a_cut_lasts_nothing_is_found_and_the_error_says_how_long(stormy: str) -> None:
    @simulated
    async def story() -> None:
        first = await open_sim(stormy)
        await ask(first, b"E\r")
        await until_lost(first)
        for attempt in range(20):
            assert now() == 5 + attempt / 2
            with pytest.raises(elib.LinkNotFound, match=f"for another {10 - attempt / 2:g} s"):
                await open_sim(stormy)
            await asyncio.sleep(0.5)
        second = await open_sim(stormy)
        assert second.simulation is first.simulation
        await first.close()  # late, and without harm to the second
        assert await ask(second, b"E\r") == b"e,0,0\r\n"
        await second.close()

    story()


def test_a_link_that_is_cut_again_and_again_can_be_opened_again_and_again(stormy: str) -> None:
    @simulated
    async def story() -> None:
        found = set()
        for gap in range(5):
            robot = await open_sim(stormy)
            found.add(robot.simulation)
            assert await ask(robot, b"Q\r") == b"q,0,0\r\n"
            await until_lost(robot)
            assert now() == pytest.approx(5 + 100 * gap)
            await robot.close()
            await asyncio.sleep(11)
        assert len(found) == 1
        (simulation,) = found
        assert simulation.weather[0].counts.cuts == 5

    story()


@simulated
async def test_a_cut_ordered_by_a_test_leaves_the_robot_to_be_found_too() -> None:
    first = await open_sim("sim://?speed=max")
    await ask(first, b"D,7,8\r")
    first.simulation.links[0].cut()
    await until_lost(first)
    await first.close()
    second = await open_sim("sim://?speed=max")
    assert await ask(second, b"E\r") == b"e,7,8\r\n"
    await second.close()
    third = await open_sim("sim://?speed=max")
    assert await ask(third, b"E\r") == b"e,0,0\r\n", "the second was closed, not cut"
    await third.close()


@simulated
async def test_a_second_opening_while_the_first_lives_is_a_world_of_its_own() -> None:
    first, second = await open_sim("sim://?speed=max"), await open_sim("sim://?speed=max")
    assert first.simulation is not second.simulation
    await first.close()
    await second.close()


@simulated
async def test_another_url_does_not_lead_to_a_lost_robot() -> None:
    first = await open_sim("sim://?speed=max&seed=1")
    first.simulation.links[0].cut()
    second = await open_sim("sim://?speed=max&seed=2")
    assert second.simulation is not first.simulation
    third = await open_sim("sim://?speed=max&seed=1")
    assert third.simulation is first.simulation
    await second.close()
    await third.close()


@simulated
async def test_of_two_lost_robots_the_one_lost_first_is_found_first() -> None:
    robots = [await open_sim("sim://?speed=max") for _ in range(3)]
    for index in (1, 0, 2):
        robots[index].simulation.links[0].cut()
    found = [await open_sim("sim://?speed=max") for _ in range(3)]
    assert [robot.simulation for robot in found] == [robots[index].simulation for index in (1, 0, 2)]
    for robot in found:
        await robot.close()


@simulated
async def test_a_lost_robot_nobody_looks_for_is_gone_after_a_while() -> None:
    first = await open_sim("sim://?speed=max")
    first.simulation.links[0].cut()
    await asyncio.sleep(AFTERLIFE - 1)
    second = await open_sim("sim://?speed=max")
    assert second.simulation is first.simulation
    second.simulation.links[0].cut()
    await asyncio.sleep(AFTERLIFE + 1)
    third = await open_sim("sim://?speed=max")
    assert third.simulation is not first.simulation
    await third.close()
    assert not lost._LOST


def test_a_robot_cut_off_for_good_is_never_replaced_while_somebody_looks_for_it(tmp_path: Path) -> None:
    @simulated
    async def story(url: str) -> None:
        first = await open_sim(url)
        await ask(first, b"E\r")
        await until_lost(first)
        for _ in range(10):
            await asyncio.sleep(AFTERLIFE / 2)
            with pytest.raises(elib.LinkNotFound, match="for good"):
                await open_sim(url)

    story(storm(tmp_path, '[[fault]]\nkind = "cut"\nat = 1'))


def test_a_lost_robot_goes_with_its_event_loop() -> None:
    simulations = []

    @simulated
    async def story() -> None:
        transport = await open_sim("sim://?speed=max")
        transport.simulation.links[0].cut()
        simulations.append(weakref.ref(transport.simulation))

    story()
    gc.collect()
    assert simulations[0]() is None


@simulated
async def test_a_robot_is_kept_for_whoever_means_to_come_back_however_the_last_connection_ended() -> None:
    url = "sim://square?speed=max"
    with keep(url):
        first = await open_sim(url)
        await ask(first, b"D,1,2\r")
        await first.close()
        await asyncio.sleep(10 * AFTERLIFE)
        second = await open_sim(url)
        assert await ask(second, b"E\r") == b"e,1,2\r\n"
        with keep("sim://square?speed=max"):
            await second.close()
    fresh = await open_sim(url)
    assert await ask(fresh, b"E\r") == b"e,0,0\r\n", "nobody meant to come back any more"
    assert fresh.simulation is not first.simulation
    await fresh.close()
    assert not lost._LOST


@simulated
async def test_what_was_kept_and_is_connected_at_the_end_goes_on() -> None:
    url = "sim://?speed=max"
    with keep(url):
        robot = await open_sim(url)
        robot.simulation.links[0].cut()
        robot = await open_sim(url)
    assert await ask(robot, b"E\r") == b"e,0,0\r\n"
    await robot.close()


# -- silence, battery, restart -----------------------------------------------------------------------------------------


def test_who_gives_up_a_silent_robot_meets_it_again(tmp_path: Path) -> None:
    @simulated
    async def story(url: str) -> None:
        async with elib.open(url) as robot:
            await robot.set_encoders(11, 12)
            with pytest.raises(elib.LinkLost):
                while True:
                    try:
                        await robot.encoders()
                    except elib.ReplyTimeout:
                        continue
        with pytest.raises(elib.RobotSilent):
            async with elib.open(url):
                pass
        await asyncio.sleep(20)
        async with elib.open(url) as robot:
            assert await robot.encoders() == (11, 12)

    story(storm(tmp_path, '[[fault]]\nkind = "silence"\nfrom = 2\nuntil = 20'))


@pytest.mark.parametrize("firmware", ["btcom-1.1.3", "btcom-2.0", "asercom-1.2.2", "epuck2"])
def test_a_robot_that_restarts_greets_and_has_forgotten_everything(firmware: str, tmp_path: Path) -> None:
    @simulated
    async def story(url: str) -> None:
        async with elib.open(url) as robot:
            await robot.set_speed(0.2, 0.2)
            await robot.set_encoders(1000, 1000)
            usual = await robot.camera()
            await robot.set_camera(20, 10, 8, "grey")
            await asyncio.sleep(18)
            assert await robot.encoders() == (0, 0)
            assert await robot.speed() == (0, 0)
            assert await robot.camera() == usual
            assert robot.statistics.resets == 1
            assert faults_of(robot).counts.resets == 1
            transport = robot.session.transport
            assert isinstance(transport, SimTransport)
            simulation = transport.simulation
            simulation.catch_up()
            assert simulation.world is not None
            pose = simulation.world.poses[0]
            await asyncio.sleep(3)
            simulation.catch_up()
            assert simulation.world.poses[0] == pose

    story(storm(tmp_path, '[[fault]]\nkind = "reset"\nat = 5', f"sim://square?speed=max&firmware={firmware}"))


@pytest.mark.parametrize("firmware", ["asercom-1.2.2", "epuck2"])
def test_a_battery_runs_down_slows_the_robot_and_lets_it_die_standing_still(firmware: str, tmp_path: Path) -> None:
    @simulated
    async def story(url: str) -> None:
        async with elib.open(url) as robot:
            transport = robot.session.transport
            assert isinstance(transport, SimTransport)
            simulation, volts, trips = transport.simulation, [], []
            await robot.set_speed(0.05, 0.05)
            await asyncio.sleep(2)
            with pytest.raises(elib.LinkLost):
                while True:
                    start = now()
                    try:
                        volts.append((await robot.battery()).volts)
                        trips.append(now() - start)
                    except elib.ReplyTimeout:
                        simulation.catch_up()
                        assert simulation.world is not None
                        died = simulation.world.poses[0]
                    await asyncio.sleep(0.5)
            assert volts[0] == pytest.approx(4.0, abs=0.05)
            assert volts[-1] == pytest.approx(3.3, abs=0.05)
            assert all(later <= earlier for earlier, later in pairwise(volts))
            slower = 0.05 * (WEAK - volts[-1]) / (WEAK - EMPTY)
            assert trips[-1] - trips[0] == pytest.approx(slower, abs=0.002)
            assert faults_of(robot).is_dead
        await asyncio.sleep(5)
        simulation.catch_up()
        assert simulation.world.poses[0] == died
        with pytest.raises(elib.RobotSilent):
            async with elib.open(url):
                pass

    text = '[[fault]]\nkind = "battery"\nfrom = 2\nuntil = 12\nvolts = [4.0, 3.2]\nslows = 0.05'
    story(storm(tmp_path, text, f"sim://square?speed=max&firmware={firmware}"))


def test_a_battery_stays_where_the_script_left_it_and_is_as_ever_before_it(tmp_path: Path) -> None:
    @simulated
    async def story(url: str) -> None:
        async with elib.open(url) as robot:
            usual = (await robot.battery()).raw
            await asyncio.sleep(30)
            assert (await robot.battery()).volts == pytest.approx(3.6, abs=0.01)
        async with elib.open("sim://?speed=max") as robot:
            assert (await robot.battery()).raw == usual

    story(storm(tmp_path, '[[fault]]\nkind = "battery"\nfrom = 5\nuntil = 10\nvolts = [4.0, 3.6]'))


# -- many robots, seeds, and the end -----------------------------------------------------------------------------------


@simulated
async def test_each_robot_of_a_simulation_has_weather_of_its_own_and_the_urls_seed_goes_first() -> None:
    first = Simulation(SimulationSettings(robots=3, fault="flaky-bluetooth"))
    again = Simulation(SimulationSettings(robots=3, fault="flaky-bluetooth", seed=1))
    other = Simulation(SimulationSettings(robots=3, fault="flaky-bluetooth", seed=5))

    def fates(simulation: Simulation, robot: int) -> list[object]:
        player = simulation.weather[robot]
        player.begin()
        return [player.fate(2 + index / 100) for index in range(500)]

    assert fates(first, 0) == fates(again, 0)
    assert fates(first, 0) != fates(first, 1)
    assert fates(again, 1) != fates(other, 1)
    for simulation in (first, again, other):
        simulation.close()


def test_a_closed_simulation_leaves_no_timer_of_its_weather(stormy: str) -> None:
    @simulated
    async def story() -> None:
        robot = await open_sim(stormy)
        await ask(robot, b"E\r")
        assert math.isfinite(robot.simulation.weather[0].script.faults[0].when.next_change(now()))
        await robot.close()
        assert all(timer.cancelled() for timer in asyncio.get_running_loop()._scheduled)  # type: ignore[attr-defined]

    story()
