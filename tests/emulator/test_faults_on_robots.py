"""What fault scripts do to a whole virtual robot: silence, battery, restart."""

import asyncio
import math
from itertools import pairwise
from pathlib import Path

import pytest
from fault_rig import CUT, ask, open_url

import elib
from elib.link.protocol.profiles import PROFILES
from elib.simulator.emulator.faultkinds import EMPTY, WEAK
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.emulator.simulation import Simulation
from elib.testing import faults_of, simulated
from elib.testing.inside import transport_of
from shared import now, with_fault


@simulated
async def test_a_program_that_gave_up_a_silent_robot_finds_it_again(tmp_path: Path) -> None:
    url = with_fault(tmp_path, 'kind = "silence"\nfrom = 2\nuntil = 20')
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


@pytest.mark.parametrize("firmware", PROFILES)
@simulated
async def test_a_robot_that_restarts_greets_and_has_forgotten_everything(firmware: str, tmp_path: Path) -> None:
    url = with_fault(tmp_path, 'kind = "reset"\nat = 5', f"sim://square?speed=max&firmware={firmware}")
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
        transport = transport_of(robot)
        simulation = transport.simulation
        simulation.catch_up()
        assert simulation.world is not None
        pose = simulation.world.poses[0]
        await asyncio.sleep(3)
        simulation.catch_up()
        assert simulation.world.poses[0] == pose


@pytest.mark.parametrize("firmware", ["asercom-1.2.2", "epuck2"])
def test_a_battery_runs_down_slows_the_robot_and_lets_it_die_standing_still(firmware: str, tmp_path: Path) -> None:
    @simulated
    async def story(url: str) -> None:
        async with elib.open(url) as robot:
            transport = transport_of(robot)
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

    text = 'kind = "battery"\nfrom = 2\nuntil = 12\nvolts = [4.0, 3.2]\nslows = 0.05'
    story(with_fault(tmp_path, text, f"sim://square?speed=max&firmware={firmware}"))


@simulated
async def test_a_robot_restarts_as_often_as_the_script_says(tmp_path: Path) -> None:
    url = with_fault(tmp_path, 'kind = "reset"\nfrom = 5\nuntil = 40\nevery = 10')
    async with elib.open(url) as robot:
        resets = []
        for _ in range(6):
            await asyncio.sleep(10)
            await robot.within(8).encoders()
            resets.append(faults_of(robot).counts.resets)
        assert resets == [1, 2, 3, 4, 4, 4]
        assert robot.statistics.resets == 4


@simulated
async def test_a_battery_that_is_empty_from_the_beginning_kills_at_once_and_not_before(tmp_path: Path) -> None:
    url = with_fault(tmp_path, 'kind = "battery"\nfrom = 5\nuntil = 6\nvolts = 3.0')
    robot = await open_url(url)
    await ask(robot, b"E\r")
    await asyncio.sleep(4.9)
    assert not robot.simulation.robots[0].player.is_dead
    await asyncio.sleep(0.2)
    assert robot.simulation.robots[0].player.is_dead
    await robot.close()


@simulated
async def test_a_battery_keeps_the_voltage_that_the_script_left_and_is_normal_before_it(tmp_path: Path) -> None:
    url = with_fault(tmp_path, 'kind = "battery"\nfrom = 5\nuntil = 10\nvolts = [4.0, 3.6]')
    async with elib.open(url) as robot:
        usual = (await robot.battery()).raw
        await asyncio.sleep(30)
        assert (await robot.battery()).volts == pytest.approx(3.6, abs=0.01)
    async with elib.open("sim://?speed=max") as robot:
        assert (await robot.battery()).raw == usual


@simulated
async def test_each_robot_of_a_simulation_has_faults_of_its_own_and_the_urls_seed_goes_first() -> None:
    first = Simulation(SimulationSettings(robots=3, fault="flaky-bluetooth"))
    again = Simulation(SimulationSettings(robots=3, fault="flaky-bluetooth", seed=1))
    other = Simulation(SimulationSettings(robots=3, fault="flaky-bluetooth", seed=5))

    def faults_of(simulation: Simulation, robot: int) -> list[object]:
        player = simulation.robots[robot].player
        player.begin()
        return [player.fault_at(2 + index / 100) for index in range(500)]

    assert faults_of(first, 0) == faults_of(again, 0)
    assert faults_of(first, 0) != faults_of(first, 1)
    assert faults_of(again, 1) != faults_of(other, 1)
    for simulation in (first, again, other):
        simulation.close()


@simulated
async def test_a_closed_simulation_leaves_no_timer_of_its_script(tmp_path: Path) -> None:
    url = with_fault(tmp_path, CUT)
    robot = await open_url(url)
    await ask(robot, b"E\r")
    assert math.isfinite(robot.simulation.robots[0].player.script.faults[0].when.next_change(now()))
    await robot.close()
    robot.simulation.close()  # a second time changes nothing
    assert all(timer.cancelled() for timer in asyncio.get_running_loop()._scheduled)  # type: ignore[attr-defined]
