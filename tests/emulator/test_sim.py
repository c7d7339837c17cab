import asyncio
import json
import math
from pathlib import Path

import pytest
from clock_rig import jumping
from fault_rig import ask, open_url, opened

from elib.base.errors import ArgumentError, ElibError, LinkClosed, LinkNotFound, SimulationError
from elib.base.timebase import ScaledLoop, new_loop
from elib.link.protocol.profiles import PROFILES
from elib.link.transport import open_transport, parse_url, speed_of
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.emulator.sim_transport import SimTransport, open_sim
from elib.simulator.emulator.simulation import HEARTBEAT, Simulation
from elib.testing import simulated
from shared import inside, now


@inside(opened, "sim://?speed=max")
async def test_a_virtual_robot_is_booted_and_answers_at_the_pace_of_the_line(robot: SimTransport) -> None:
    assert (robot.origin, robot.url) == ("simulator", "sim://?speed=max")
    assert await ask(robot, b"E\r") == b"e,0,0\r\n"
    assert now() == pytest.approx((2 + 7) * 10 / 115200, rel=0.2)


@inside(opened, "sim://?speed=max&latency=0.01&baud=9600")
async def test_latency_and_baud_of_the_url_reach_the_link(robot: SimTransport) -> None:
    await ask(robot, b"E\r")
    assert now() == pytest.approx(0.02 + (2 + 7) * 10 / 9600, rel=0.05)


@inside(opened, "sim://square?speed=max&quality=typical&seed=3")
async def test_the_quality_of_the_url_draws_the_faults_of_the_robot(robot: SimTransport) -> None:
    world = robot.simulation.world
    assert world is not None
    assert world.scene.model.quality == "typical"
    assert min(world.proximity(0)) > 20  # in the open


def test_an_unknown_quality_names_the_known_ones() -> None:
    with pytest.raises(ArgumentError, match='"ideal" or "good" or "typical" or "bad"'):
        SimulationSettings(quality="perfect")


@inside(opened, "sim://?speed=max&loss=1")
async def test_loss_of_the_url_reaches_the_link(robot: SimTransport) -> None:
    await robot.write(b"E\r")
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(60):
            await robot.read()


@inside(opened, "sim://square?speed=max")
async def test_the_robot_drives_as_far_as_it_was_told(robot: SimTransport) -> None:
    world = robot.simulation.world
    assert world is not None
    start = world.poses[0]
    await ask(robot, b"D,500,500\r")
    await asyncio.sleep(2)
    await ask(robot, b"D,0,0\r")
    robot.simulation.catch_up()
    end = world.poses[0]
    assert math.hypot(end.x - start.x, end.y - start.y) == pytest.approx(2 * 500 * 0.1288e-3, rel=0.01)


@inside(opened, "sim://square?speed=max")
async def test_catching_up_moves_a_robot_nobody_talks_to(robot: SimTransport) -> None:
    world = robot.simulation.world
    assert world is not None
    await ask(robot, b"D,200,200\r")
    await asyncio.sleep(1)
    robot.simulation.catch_up()
    assert world.time == pytest.approx(now(), abs=world.scene.step)
    assert robot.simulation.time == now()


def test_the_same_seed_gives_the_same_run_and_another_seed_another() -> None:
    @simulated
    async def run(url: str) -> bytes:
        robot = await open_url(url)
        readings = b"".join([await ask(robot, b"N\r") for _ in range(20)])
        await robot.close()
        return readings

    first = run("sim://?speed=max&seed=1")
    assert run("sim://?speed=max&seed=1") == first
    assert run("sim://?speed=max&seed=2") != first


@pytest.mark.parametrize("firmware", PROFILES)
@simulated
async def test_every_firmware_can_be_chosen(firmware: str) -> None:
    robot = await open_url(f"sim://?speed=max&firmware={firmware}")
    assert (await ask(robot, b"V\r")).startswith(b"v,")
    await robot.close()


@inside(opened, "sim://square?speed=max&robots=3")
async def test_the_first_of_several_robots_is_driven_and_the_others_stand_still(robot: SimTransport) -> None:
    world = robot.simulation.world
    assert world is not None
    before = world.poses
    await ask(robot, b"D,300,300\r")
    await asyncio.sleep(0.5)
    robot.simulation.catch_up()
    assert world.poses[1:] == before[1:]
    assert world.poses[0] != before[0]
    assert len(robot.simulation.robots) == 1


@simulated
async def test_a_file_of_constants_can_replace_the_world(tmp_path: Path) -> None:
    file = tmp_path / "robot.json"
    file.write_text(json.dumps({"selector": 11}))
    robot = await open_url(f"sim://?speed=max&hardware={file}")
    assert await ask(robot, b"C\r") == b"c,11\r\n"
    assert robot.simulation.world is None
    await robot.close()


@pytest.mark.parametrize(
    ("url", "error", "message"),
    [
        ("sim://arenna", LinkNotFound, "arena"),
        ("sim://?firmware=btcom", ArgumentError, "btcom-1.1.3"),
        ("sim://?fault=script.toml", ArgumentError, "cannot be read"),
        ("sim://?hardware=/nowhere.json", ElibError, "/nowhere.json"),
    ],
)
async def test_what_does_not_exist_is_named_with_what_does(url: str, error: type[ElibError], message: str) -> None:
    with pytest.raises(error) as caught:
        await open_sim(parse_url(url))
    assert message in str(caught.value)


async def test_a_speed_that_the_running_loop_does_not_have_is_refused_with_a_hint() -> None:
    for speed in ("max", "4"):
        with pytest.raises(SimulationError, match="this one runs in real time") as caught:
            await open_sim(parse_url(f"sim://?speed={speed}"))
        assert "elib.connect(), elib.run()" in caught.value.hint


@pytest.mark.parametrize("url", ["sim://", "sim://?speed=max", "sim://?speed=20"])
def test_a_loop_made_for_the_url_runs_it(url: str) -> None:
    async def main() -> bytes:
        robot = await open_url(url)
        answer = await ask(robot, b"E\r")
        await robot.close()
        return answer

    with asyncio.Runner(loop_factory=lambda: new_loop(speed_of(url))) as runner:
        assert runner.run(main()) == b"e,0,0\r\n"


def test_a_loop_of_another_factor_is_refused() -> None:
    with (
        asyncio.Runner(loop_factory=lambda: ScaledLoop(2)) as runner,
        pytest.raises(SimulationError, match="runs in 2 times real time"),
    ):
        runner.run(open_sim(parse_url("sim://?speed=3")))


@inside(opened, "sim://?speed=max&baud=0")
async def test_an_unpaced_robot_still_lets_simulated_time_pass(robot: SimTransport) -> None:
    asked = 0
    while now() < 0.001:
        await ask(robot, b"E\r")
        asked += 1
    assert 10 < asked < 1000


@jumping
async def test_in_real_time_the_world_goes_on_while_nobody_talks() -> None:
    transport = await open_url("sim://square")
    heartbeat = transport.simulation._heartbeat
    assert heartbeat is not None
    assert heartbeat.when() == pytest.approx(now() + HEARTBEAT, abs=HEARTBEAT)
    await transport.close()
    assert heartbeat.cancelled(), "a closed simulation has no timers"


@simulated
async def test_in_simulated_time_an_idle_simulation_sets_no_timer() -> None:
    simulation = Simulation(SimulationSettings(robots=2))
    assert len(simulation.robots) == 2
    assert simulation._heartbeat is None
    assert not asyncio.get_running_loop()._scheduled
    simulation.close()


@simulated
async def test_a_closed_robot_stays_closed_and_leaves_nothing_behind() -> None:
    robot = await open_url("sim://?speed=max")
    await robot.write(b"H\r")
    await robot.close()
    await robot.close()
    with pytest.raises(LinkClosed):
        await robot.read()
    assert all(timer.cancelled() for timer in asyncio.get_running_loop()._scheduled)
    assert asyncio.all_tasks() == {asyncio.current_task()}


@inside(opened, "sim://?speed=max")
async def test_a_picture_comes_whole_and_in_its_time(robot: SimTransport) -> None:
    await ask(robot, b"J,1,40,40,8\r")
    start = now()
    await robot.write(bytes([256 - ord("I"), 0]))
    picture = b""
    async with asyncio.timeout(10):
        while len(picture) < 3203:
            picture += await robot.read()
    assert len(picture) == 3203
    assert now() - start == pytest.approx(0.30, abs=0.02), "measured on the robot (wire-protocol.md, 5.13)"


@pytest.mark.parametrize(("pause", "stops"), [(0.0, True), (0.032, False)])
def test_a_client_that_reads_less_than_it_asks_for_runs_ahead_until_the_ring_overflows(
    pause: float, stops: bool
) -> None:
    # Webots' remote control takes six bytes of the ten that asercom's ground sensors are: what is left of one step it
    # takes for the next one's answer, so that it asks again before the robot has answered.
    step = b"\xbc\x64\x00\x64\x00" + b"\x9f\xb3\xb2\xb1\xaf\x00"
    wanted = 6 + 6 + 16 + 16 + 4

    @simulated
    async def steps() -> int:
        transport = await open_transport("sim://square?speed=max&firmware=asercom-1.2.2")
        heard = b""
        for number in range(200):
            await transport.write(step)
            try:
                async with asyncio.timeout(1):
                    while len(heard) < wanted:
                        heard += await transport.read()
            except TimeoutError:
                return number
            heard = heard[wanted:]
            await asyncio.sleep(pause)
        return 200

    done = steps()
    assert 60 < done < 100 if stops else done == 200
