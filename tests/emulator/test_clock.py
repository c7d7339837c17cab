"""The clock of a virtual world: stopped, stepped and changed in speed, and what that means for robots and programs."""

# clock: all that waits here waits on a loop whose time jumps, except where until() says what it waits for

from __future__ import annotations

import asyncio

import pytest
from clock_rig import jumping
from served_rig import Seen

import elib
from elib.base.errors import ArgumentError, LinkClosed, LinkNotFound, ReplyTimeout, SimulationError
from elib.link.transport import open_transport, parse_url
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.emulator.sim_transport import open_sim
from elib.testing import simulation_of
from shared import now, until


@jumping
async def test_while_paused_nothing_moves_and_calls_wait_instead_of_failing() -> None:
    async with elib.open("sim://square") as robot:
        control = Control(simulation_of(robot))
        await robot.set_speed(0.5, 0.5)
        await asyncio.sleep(0.2)
        control.pause()
        before, time = control.world.pose(0), control.world.time
        calls = [asyncio.create_task(robot.within(0.3).proximity()) for _ in range(3)]
        await asyncio.sleep(0.8)
        assert not any(call.done() for call in calls)
        assert (control.snapshot().robots[0].pose, control.world.time) == (before, time)
        control.resume()
        assert all(len(reading) == 8 for reading in await asyncio.gather(*calls))
        await asyncio.sleep(0.2)
        assert control.snapshot().robots[0].pose.x > before.x


@jumping
async def test_a_stop_during_a_pause_is_the_first_thing_that_happens_after_it() -> None:
    async with elib.open("sim://square") as robot:
        control = Control(simulation_of(robot))
        await robot.set_speed(0.5, 0.5)
        control.pause()
        waiting = asyncio.create_task(robot.within(0.3).proximity())
        stop = asyncio.create_task(robot.stop())
        await asyncio.sleep(1.5)
        before = control.world.pose(0)
        control.resume()
        await asyncio.gather(waiting, stop, return_exceptions=True)
        assert stop.exception() is None
        assert control.snapshot().robots[0].pose.x - before.x < 0.005


@jumping
async def test_a_robot_of_a_paused_world_is_closed_within_a_bound() -> None:
    async with elib.open("sim://square") as robot:
        control = Control(simulation_of(robot))
        await robot.set_speed(0.5, 0.5)
        control.pause()
        waiting = asyncio.create_task(robot.within(0.3).proximity())
        await asyncio.sleep(0.8)
        began = now()
        assert await robot.stop_and_close() is not None
        assert now() - began < 3
        assert isinstance((await asyncio.gather(waiting, return_exceptions=True))[0], ReplyTimeout | LinkClosed)


@jumping
async def test_a_step_lets_the_world_go_on_by_so_much() -> None:
    async with elib.open("sim://square") as robot:
        control = Control(simulation_of(robot))
        with pytest.raises(ArgumentError, match="only a paused world"):
            control.step()
        await robot.set_speed(0.5, 0.5)
        control.pause()
        time, before = control.snapshot().time, control.world.pose(0)
        control.step()
        assert control.snapshot().time == time + control.world.scene.step
        control.step(0.5)
        assert control.snapshot().time == pytest.approx(time + 0.5, abs=0.04)
        assert control.world.pose(0).x - before.x == pytest.approx(0.5 * 0.0644, abs=0.004)  # half a turn a second
        control.resume()


@jumping
async def test_at_another_speed_world_and_firmware_run_faster_than_the_program() -> None:
    async with elib.open("sim://square") as robot:
        control = Control(simulation_of(robot))
        for speed in (4, 0.5):
            control.set_speed(speed)
            time = control.snapshot().time
            await asyncio.sleep(0.4)
            assert control.snapshot().time - time == pytest.approx(speed * 0.4, abs=0.04)
        durations = []
        for speed in (1, 0.1):
            control.set_speed(speed)
            began = now()
            await robot.proximity()
            durations.append(now() - began)
        assert durations[1] > 8 * durations[0], "the line is slower, too"
        for speed in (0, 0.05, 11):
            with pytest.raises(ArgumentError, match="speed is"):
                control.set_speed(speed)


async def test_programs_outside_get_no_answer_while_paused_and_the_late_one_after_it(seen: Seen) -> None:
    controls: list[Control] = []
    order: list[str] = []
    traffic = lambda name, time, way, data: order.append(way)  # noqa: E731
    async with serve(SimulationSettings(baud=0), tcp="0", control=controls.append, traffic=traffic) as robots:
        robot = await open_transport(robots[0].url)
        controls[0].pause()
        await robot.write(b"E\r")
        await until(lambda: seen.data == b"E\r")
        order.append("resumed")
        controls[0].resume()
        assert (await robot.read()).startswith(b"e,")
        assert order == ["resumed", "to robot", "to host"]
        await robot.close()


@jumping
async def test_no_robot_of_a_paused_world_is_opened() -> None:
    first = await open_sim(parse_url("sim://square?robots=2&robot=1"))
    control = Control(first.simulation)
    control.pause()
    with pytest.raises(LinkNotFound, match="its world is paused"):
        await open_sim(parse_url("sim://square?robots=2&robot=2"))
    control.resume()
    second = await open_sim(parse_url("sim://square?robots=2&robot=2"))
    await second.close()
    await first.close()


@jumping
async def test_a_fault_script_waits_with_the_world(tmp_path) -> None:
    script = tmp_path / "script.toml"
    script.write_text('description = "Cut."\n[[fault]]\nkind = "cut"\nfrom = 0.3\nuntil = 30.0\n')
    robot = await open_sim(parse_url(f"sim://square?fault={script}&baud=0"))
    control = Control(robot.simulation)
    await robot.write(b"E\r")
    control.pause()
    await asyncio.sleep(0.5)
    assert not control.is_cut(0)
    control.resume()
    await until(lambda: control.link(0).script == ("cut",))
    assert control.is_cut(0)
    await robot.close()
    control.simulation.close()


def test_time_that_is_computed_cannot_be_paused_and_a_speed_from_the_url_stays() -> None:
    async def computed(robot: elib.Epuck) -> None:
        control = Control(simulation_of(robot))
        with pytest.raises(SimulationError, match="cannot be paused: this simulation computes its own time"):
            control.pause()
        with pytest.raises(SimulationError, match="the speed cannot be changed"):
            control.set_speed(2)

    async def scaled(robot: elib.Epuck) -> None:
        control = Control(simulation_of(robot))
        with pytest.raises(SimulationError, match="the speed was set to 2 when the simulation was started"):
            control.set_speed(3)
        control.pause()
        time, began = control.snapshot().time, now()
        await until(lambda: now() > began + 0.02)
        assert control.snapshot().time == time
        control.resume()
        with pytest.raises(ReplyTimeout):
            control.set_faults(0, loss=1)
            await robot.within(0.2).proximity()
        control.set_faults(0, loss=0)

    elib.run(computed, robot="sim://square?speed=max")
    elib.run(scaled, robot="sim://square?speed=2")
