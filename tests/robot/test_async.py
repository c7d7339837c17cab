import asyncio

import pytest

import elib
from elib.base.errors import LinkClosed, ReplyTimeout, SimulationError, Unsupported
from elib.link.protocol.profiles import PROFILES
from elib.link.session import Wrote
from elib.testing import EmulatedRobot, emulator_of, link_of, simulated
from shared import inside, run_python


def url(firmware: str = "btcom-2.0", **keys: object) -> str:
    return f"sim://square?speed=max&quality=ideal&firmware={firmware}" + "".join(
        f"&{key}={value}" for key, value in keys.items()
    )


@simulated
async def test_a_robot_can_be_awaited_and_closed_and_lives_once() -> None:
    robot = elib.open(url())
    with pytest.raises(LinkClosed, match="async with"):
        robot.selector()
    assert await robot is robot
    assert (await robot.selector()).position == 3
    await robot.close()
    await robot.close()
    with pytest.raises(LinkClosed):
        await robot.selector()
    with pytest.raises(LinkClosed, match="once"):
        async with robot:
            pass


@simulated
async def test_leaving_by_cancellation_stops_the_robot() -> None:
    moving = asyncio.Event()
    motors: list[object] = []

    async def drive() -> None:
        async with elib.open(url()) as robot:
            motors.extend(emulator_of(robot).firmware.motors)
            await robot.set_speed(0.5, 0.5)
            moving.set()
            await asyncio.sleep(60)

    task = asyncio.ensure_future(drive())
    await moving.wait()
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert [motor.speed for motor in motors] == [0, 0]  # type: ignore[attr-defined]


async def test_simulated_time_is_refused_in_a_real_loop() -> None:
    with pytest.raises(SimulationError, match="speed"):
        async with elib.open(url()):
            pass


# -- sensors and text --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("firmware", "writes"), [("btcom-1.1.3", 7), ("btcom-2.0", 1), ("asercom-1.2.2", 1), ("epuck2", 1)]
)
@simulated
async def test_all_sensors_cost_one_write_where_the_receive_ring_has_room_for_it(firmware: str, writes: int) -> None:
    async with elib.open(url(firmware)) as robot:
        wrote: list[bytes] = []
        robot.trace(lambda time, event: wrote.append(event.data) if isinstance(event, Wrote) else None)
        sensors = await robot.sensors()
        assert len(wrote) == writes
        assert all(len(data) <= PROFILES[firmware].receive_ring or firmware == "btcom-1.1.3" for data in wrote)
        absent = PROFILES[firmware].absent
        for name in type(sensors).__dataclass_fields__:
            if name not in ("time", "origin"):
                assert (getattr(sensors, name) is None) == (name in absent), name
        assert sensors.time == robot.time
        assert sensors.origin == "simulator"


@inside(elib.open, url("epuck2"))
async def test_a_virtual_epuck2_measures_the_magnetic_field_from_the_start(robot: elib.Epuck) -> None:
    before = await robot.magnetometer()
    assert any(before)
    await robot.start_magnetometer()
    assert tuple(await robot.magnetometer()) == tuple(before)


@simulated
async def test_a_virtual_btcom_says_0_before_the_first_speed() -> None:
    for firmware in ("btcom-1.1.3", "btcom-2.0"):
        async with elib.open(url(firmware)) as robot:
            assert tuple(await robot.speed()) == (0, 0)


@pytest.mark.parametrize("firmware", sorted(PROFILES))
@simulated
async def test_nothing_that_is_asked_overflows_the_receive_buffer_of_any_robot(firmware: str) -> None:
    async with elib.open(url(firmware)) as robot:
        for _ in range(30):
            await robot.within(0.2).sensors()
            await robot.within(0.2).attitude()
            await robot.within(0.2).set_led(8, elib.LedAction.TOGGLE)
        emulator = link_of(robot).robot
        assert not any(emulator.firmware.lights.ring)


@pytest.mark.parametrize("firmware", sorted(PROFILES))
@simulated
async def test_sensors_read_one_by_one_and_all_at_once_are_the_same(firmware: str) -> None:
    async with elib.open(f"sim://?speed=max&quality=ideal&firmware={firmware}") as robot:
        await robot.set_speed(0.1, -0.1)
        sensors = await robot.sensors()
        assert sensors.speed == await robot.speed()
        assert sensors.selector == await robot.selector()
        assert sensors.ir_receiver == await robot.ir_receiver()
        # Noisy sensors, read at two moments.
        assert list(sensors.accelerometer) == pytest.approx(list(await robot.accelerometer()), abs=20)
        assert list(sensors.microphones) == pytest.approx(list(await robot.microphones()), abs=12)
        assert sensors.encoders is not None


@inside(elib.open, url("asercom-1.2.2"))
async def test_any_text_command_gives_the_lines_of_its_answer(robot: elib.Epuck) -> None:
    assert await robot.text("D,100,-100") == "d"
    assert await robot.text("E\r") == "e,100,-100"
    assert (await robot.text("V")).splitlines()[1].startswith("HW version")
    assert (await robot.text("b")).startswith("b,")
    assert await robot.text("B,1") == "b"
    assert await robot.text("@") == "z,Command not found"
    assert len((await robot.text("H")).splitlines()) > 20
    assert await robot.text("Z") == "60: 0\n212: 0"


@pytest.mark.parametrize("firmware", PROFILES)
def test_a_help_text_that_is_longer_or_shorter_than_that_of_the_firmware_comes_whole(
    firmware: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = EmulatedRobot(firmware).send(b"H\r").decode()

    @simulated
    async def story(answer: str) -> None:
        async with elib.open(url(firmware)) as robot:
            monkeypatch.setitem(emulator_of(robot).firmware.TEXT, ord("H"), lambda self, line: answer.encode())
            assert (await robot.help_text()).split() == (await robot.text("H")).split() == answer.split()
            assert (await robot.selector()).position == 3
            assert robot.statistics.lost == robot.statistics.resyncs == 0

    for answer in (known, known + '"!"  more\r\nand a line without a letter\r\n', known[: known.index('"E"')]):
        story(answer)


@pytest.mark.parametrize("wrong", ["", " ", "\r", "D,1\rD,2", "D,\x00", "é", "D" * 4000, None, b"D", 7])
@inside(elib.open, url())
async def test_what_is_not_a_text_command_is_refused_before_it_is_sent(robot: elib.Epuck, wrong: object) -> None:
    with pytest.raises(elib.ArgumentError):
        await robot.text(wrong)  # type: ignore[arg-type]


@simulated
async def test_obstacle_avoidance_keeps_speeds_and_lamps() -> None:
    async with elib.open(url("epuck2")) as robot:
        firmware = emulator_of(robot).firmware
        await robot.set_body_led(1)
        await robot.set_rgb_led(3, 0.5, 0, 1)
        await robot.set_led(0, 1)
        await robot.set_speed(0.3, 0.2)
        await robot.set_obstacle_avoidance(True)
        assert await robot.speed() == (0.3, 0.2)
        lights = firmware.lights
        assert (lights.body, lights.ring[0], lights.rgb[3:6]) == (1, 1, [50, 0, 100])
        await robot.set_obstacle_avoidance(False)
    async with elib.open(url()) as robot:
        with pytest.raises(Unsupported):
            await robot.set_obstacle_avoidance(True)


# -- statistics --------------------------------------------------------------------------------------------------------


@inside(elib.open, url(latency=0.02))
async def test_statistics_tell_how_the_link_has_been(robot: elib.Epuck) -> None:
    link = link_of(robot)
    for _ in range(9):
        await robot.selector()
    link.lose_next_reply()
    with pytest.raises(ReplyTimeout):
        await robot.within(0.2).selector()
    await robot.selector()
    found = robot.statistics
    assert (found.count, found.lost, found.unsent, found.resyncs) == (10, 1, 0, 1)
    assert 0.04 < found.median < 0.05
    assert found.age == 0


@simulated
async def test_statistics_count_the_calls_that_wait_for_their_turn_and_for_their_answer() -> None:
    robot = elib.open(url(latency=0.02))
    assert (robot.statistics.waiting, robot.statistics.unanswered) == (0, 0)  # not open yet
    async with robot:
        calls = [asyncio.ensure_future(robot.selector()) for _ in range(3)]
        await asyncio.sleep(0.01)
        assert (robot.statistics.waiting, robot.statistics.unanswered) == (2, 3)
        await asyncio.gather(*calls)
        assert (robot.statistics.waiting, robot.statistics.unanswered) == (0, 0)


# -- run ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("sim", "name", "code"),
    [
        ("sim://square?baud=0", "SIGINT", 130),
        ("sim://square?speed=max", "SIGHUP", 129),
        ("sim://square?baud=0", "SIGTERM", 143),
    ],
)
def test_a_signal_stops_the_robot_of_an_async_program(sim: str, name: str, code: int) -> None:
    program = f"""
        import asyncio, os, signal, sys
        import elib
        from elib.testing import emulator_of

        async def main(robot):
            global motors
            await robot.set_speed(0.5, 0.5)
            motors = emulator_of(robot).firmware.motors
            os.kill(os.getpid(), signal.{name})
            while True:
                await asyncio.sleep(0.01)

        try:
            elib.run(main, argv=["--robot", {sim!r}])
        finally:
            print([motor.speed for motor in motors])
    """
    done = run_python(program)
    assert (done.returncode, done.stdout) == (code, "[0, 0]\n"), done.stderr
    assert "Traceback" not in done.stderr
