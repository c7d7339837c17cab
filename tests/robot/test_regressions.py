"""Defects that were found once, each as the sentence that it broke."""

import asyncio
import threading
from collections.abc import Awaitable, Callable

import numpy as np
import pytest

import elib
from elib.base.errors import ArgumentError, LinkClosed, LinkLost, ReplyTimeout
from elib.link.session import Wrote
from elib.simulator.emulator.firmware.base import Firmware
from elib.testing import emulator_of, link_of, simulated, simulation_of
from shared import PATIENCE, inside

BTCOM, EPUCK2 = "sim://square?speed=max&firmware=btcom-2.0", "sim://square?speed=max&firmware=epuck2"


def firmware_of(robot: elib.Epuck | elib.BlockingEpuck) -> Firmware:
    return emulator_of(robot).firmware


def wheels(firmware: Firmware) -> list[float]:
    return [motor.speed for motor in firmware.motors]


@simulated
async def test_the_last_stop_is_the_last_thing_the_robot_hears_although_another_task_drives() -> None:
    wrote: list[bytes] = []
    async with elib.open(BTCOM) as robot:
        firmware = firmware_of(robot)
        robot.trace(lambda time, event: wrote.append(event.data) if isinstance(event, Wrote) else None)

        async def drive() -> None:
            while True:
                await robot.set_speed(0.3, -0.3)

        driver = asyncio.ensure_future(drive())
        await asyncio.sleep(0.1)
    with pytest.raises(LinkClosed):
        await driver
    assert wrote[-1] == b"S\r"
    assert wheels(firmware) == [0, 0]


@inside(elib.open, EPUCK2)
async def test_obstacle_avoidance_does_not_start_a_robot_that_was_stopped(robot: elib.Epuck) -> None:
    await robot.set_speed(0.5, 0.5)
    await robot.stop()
    await robot.set_obstacle_avoidance(True)
    before = await robot.encoders()
    await robot.sleep(2.0)
    after = await robot.encoders()
    # It still turns away from what it thinks it sees, some steps; it does not drive.
    assert max(abs(new - old) for new, old in zip(after, before, strict=True)) < 100


@pytest.mark.parametrize("stop", [lambda robot: robot.stop(), lambda robot: robot.set_speed(0, 0)], ids=["stop", "0"])
@inside(elib.open, EPUCK2)
async def test_obstacle_avoidance_does_not_start_a_robot_whose_answer_to_the_stop_was_lost(
    robot: elib.Epuck, stop: Callable[[elib.Epuck], Awaitable[object]]
) -> None:
    await robot.set_speed(0.3, 0.3)
    link_of(robot).lose_next_reply()
    with pytest.raises(ReplyTimeout):
        await stop(robot.within(0.2))
    await robot.set_obstacle_avoidance(False)
    assert wheels(firmware_of(robot)) == [0, 0]


@inside(elib.open, EPUCK2)
async def test_obstacle_avoidance_does_not_start_a_robot_that_a_text_command_has_stopped(robot: elib.Epuck) -> None:
    await robot.set_speed(0.3, 0.3)
    await robot.text("S")
    await robot.set_obstacle_avoidance(False)
    assert wheels(firmware_of(robot)) == [0, 0]


@inside(elib.open, EPUCK2)
async def test_stop_stops_an_epuck2_that_avoids_obstacles_by_itself(robot: elib.Epuck) -> None:
    await robot.set_obstacle_avoidance(True)
    await robot.set_speed(0.5, 0.5)
    await robot.sleep(0.5)
    await robot.stop()
    before = await robot.encoders()
    await robot.sleep(2.0)
    assert await robot.encoders() == before


@simulated
async def test_leaving_stops_an_epuck2_that_avoids_obstacles_by_itself() -> None:
    async with elib.open(EPUCK2) as robot:
        firmware = firmware_of(robot)
        await robot.set_obstacle_avoidance(True)
        await robot.set_speed(0.5, 0.5)
        await robot.sleep(0.5)
    await asyncio.sleep(0.2)
    assert wheels(firmware) == [0, 0]


@inside(elib.open, BTCOM)
async def test_a_robot_that_falls_silent_but_still_hears_is_told_to_stop(robot: elib.Epuck) -> None:
    simulation = simulation_of(robot)
    await robot.set_speed(0.5, 0.5)
    simulation.robots[0].link.silence()
    with pytest.raises(ReplyTimeout):
        await robot.within(0.1).selector()
    with pytest.raises(LinkLost):
        await robot.within(30).selector()
    await asyncio.sleep(0.1)
    assert wheels(simulation.robots[0].emulator.firmware) == [0, 0]


@simulated
async def test_a_second_cancellation_while_leaving_frees_the_port_and_says_stop() -> None:
    moving = asyncio.Event()
    seen: list[object] = []

    async def drive() -> None:
        async with elib.open(BTCOM) as robot:
            seen.extend((robot.session.transport, simulation_of(robot)))
            await robot.set_speed(0.5, 0.5)
            seen[1].robots[0].link.stall()  # type: ignore[attr-defined]
            moving.set()
            await asyncio.sleep(60)

    task = asyncio.ensure_future(drive())
    await moving.wait()
    task.cancel()
    await asyncio.sleep(0.05)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert not seen[0].is_open  # type: ignore[attr-defined]


def test_leaving_a_silent_robot_takes_less_than_half_a_second() -> None:
    robot = elib.connect(BTCOM)
    link_of(robot).silence()
    began = robot.time
    robot.close()
    assert robot._portal.loop.time() - began < 0.5


def test_one_question_from_a_second_thread_does_not_stop_the_first_ones_time() -> None:
    with elib.connect(BTCOM) as robot:
        asked, may_end = threading.Event(), threading.Event()

        def ask() -> None:
            robot.selector()
            asked.set()
            may_end.wait(PATIENCE)  # alive, and not waiting for the robot

        thread = threading.Thread(target=ask)
        thread.start()
        assert asked.wait(PATIENCE)
        for _ in range(200):
            robot.sleep(1.0)
        assert thread.is_alive()
        may_end.set()
        thread.join()


@inside(elib.open, BTCOM)
async def test_a_thousand_replaced_speeds_are_one_command_and_all_end(robot: elib.Epuck) -> None:
    calls = [asyncio.ensure_future(robot.within(5).set_speed(0.1, step / 2000)) for step in range(1500)]
    assert await asyncio.gather(*calls) == [None] * 1500
    assert wheels(firmware_of(robot)) == [100, 750]


@inside(elib.open, "sim://?speed=max&firmware=btcom-1.1.3")
async def test_all_sensors_of_the_oldest_firmware_are_calibrated_like_the_single_reading(robot: elib.Epuck) -> None:
    await robot.calibrate_proximity()
    sensors = await robot.sensors()
    assert sensors.proximity is not None
    assert max(sensors.proximity) < 200


@inside(elib.open, EPUCK2)
async def test_two_colours_set_at_once_both_stay(robot: elib.Epuck) -> None:
    await asyncio.gather(robot.set_rgb_led(1, 1, 0, 0), robot.set_rgb_led(3, 0, 1, 0))
    assert firmware_of(robot).lights.rgb[:6] == [100, 0, 0, 0, 100, 0]


@inside(elib.open, EPUCK2)
async def test_a_lamp_switched_beside_the_obstacle_avoidance_stays_on(robot: elib.Epuck) -> None:
    await asyncio.gather(robot.set_body_led(1), robot.set_speed(0.2, 0.2), robot.set_obstacle_avoidance(True))
    assert firmware_of(robot).lights.body == 1
    assert await robot.speed() == (0.2, 0.2)


@inside(elib.open, BTCOM + "&latency=0.01")
async def test_text_commands_keep_the_rules_of_the_resync(robot: elib.Epuck) -> None:
    link = link_of(robot)
    link.lose_next_reply()
    with pytest.raises(ReplyTimeout):
        await robot.within(0.1).selector()
    assert (await robot.within(2).text("V")).startswith("v,")
    await robot.set_encoders(3, 3)
    link.delay_next_reply(1.5)
    with pytest.raises(ReplyTimeout):
        await robot.within(0.1).text("Q")
    await robot.within(9).set_encoders(4, 4)
    assert await robot.within(9).text("Q") == "q,4,4"


@inside(elib.open, "sim://?speed=max&firmware=btcom-1.1.3&latency=0.05")
async def test_a_bound_holds_for_all_requests_of_an_action_together(robot: elib.Epuck) -> None:
    began = robot.time
    with pytest.raises(ReplyTimeout):
        await robot.within(0.2).sensors()
    assert robot.time - began == pytest.approx(0.2)


@inside(elib.open, BTCOM)
async def test_slow_text_commands_wait_as_long_as_the_commands_they_are(robot: elib.Epuck) -> None:
    assert "finished" in await robot.text("K")
    assert "WELCOME" in await robot.text("R")


@inside(elib.open, BTCOM)
async def test_a_newer_speed_is_not_driven_before_an_older_stop_that_was_sent_as_text(robot: elib.Epuck) -> None:
    wrote: list[bytes] = []
    robot.trace(lambda time, event: wrote.append(event.data) if isinstance(event, Wrote) else None)
    await asyncio.gather(robot.selector(), robot.set_speed(0.1, 0.1), robot.text("S"), robot.set_speed(0.2, 0.2))
    assert wrote == [b"C\r", b"D,100,100\r", b"S\r", b"D,200,200\r"]


@inside(elib.open, EPUCK2)
async def test_the_arguments_of_actions_are_checked_too(robot: elib.Epuck) -> None:
    for switch, is_on in (("true", True), ("off", False)):
        await robot.set_obstacle_avoidance(switch)  # type: ignore[arg-type]
        assert robot.context.last_set.avoidance is is_on
    for wrong in ("maybe", 2, None):
        with pytest.raises(ArgumentError):
            await robot.set_obstacle_avoidance(wrong)  # type: ignore[arg-type]
    for endless in (float("inf"), float("nan"), -1, None, "1"):
        with pytest.raises(ArgumentError):
            await robot.sleep(endless)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError):
        robot.set_encoders(10**400, 0)
    with pytest.raises(ArgumentError):
        robot.within(10**400)
    await robot.set_body_led(np.True_)  # type: ignore[arg-type]
    assert firmware_of(robot).lights.body == 1


def test_a_call_that_fails_before_anything_is_sent_still_reaches_its_callback() -> None:
    with elib.connect(BTCOM) as robot:
        seen: list[object] = []
        robot.callback(None, lambda error, state: seen.append((type(error), state)), 7).text("")
        robot.sleep(0.1)
        assert seen == [(ArgumentError, 7)]


def test_a_blocking_call_from_within_the_loop_says_so_instead_of_waiting_for_ever() -> None:
    with elib.connect(BTCOM) as robot:
        errors: list[str] = []

        def hook(time: float, event: object) -> None:
            if not errors:
                errors.append("")
                try:
                    robot.selector()
                except RuntimeError as error:
                    errors[0] = str(error)

        robot.trace(hook)
        robot.selector()
        assert "robot.begin" in errors[0]


@pytest.mark.parametrize("count", [24, 40])
def test_more_callbacks_than_threads_may_all_call_the_robot(count: int) -> None:
    with elib.connect(BTCOM) as robot:
        seen: list[object] = []
        for _ in range(count):
            robot.callback(lambda value, state: seen.append(robot.within(30).selector())).selector()
        robot.sleep(5)
        assert len(seen) == count
