"""The process that stops the robots of a program that died or froze, and what it leaves alone."""

import asyncio
import contextlib
import os
import socket
import subprocess
import sys
import textwrap
from collections.abc import AsyncIterator

import pytest

import elib
from elib.emulator.server import serve
from elib.emulator.settings import SimulationSettings
from elib.errors import Unsupported
from elib.protocol.profiles import PROFILES
from elib.robot.emergency import OPEN_STOPS
from elib.robot.signals import SIGNALS
from elib.robot.watchdog import WATCHDOG, is_supported
from elib.robot.watchdog_process import write_now

if not is_supported():
    pytest.skip("no watchdog on this system", allow_module_level=True)

PATIENCE = 20.0
FD_SETSIZE = 1024


@contextlib.asynccontextmanager
async def robot_on(way: str, **keys: str) -> AsyncIterator[tuple[str, list[object]]]:
    """Serve a robot on *way*; yield its URL and its motors."""
    motors: list[object] = []
    settings = SimulationSettings.from_text("arena", keys)
    meet = lambda control: motors.extend(control.simulation.robots[0].emulator.firmware.motors)  # noqa: E731
    tcp = "0" if way == "tcp" else None
    async with serve(settings, pty=way == "pty", tcp=tcp, control=meet) as served:
        yield served[0].url, motors


def are_turning(motors: list[object]) -> bool:
    """Return whether a wheel turns."""
    return any(motor.speed for motor in motors)  # type: ignore[attr-defined]


async def until_standing(motors: list[object]) -> None:
    """Wait until no wheel turns."""
    async with asyncio.timeout(PATIENCE):
        while are_turning(motors):  # noqa: ASYNC110  # wheels tell nobody
            await asyncio.sleep(0.01)


async def start_and_end(way: str, firmware: str, end: str) -> None:
    async with robot_on(way, firmware=firmware) as (url, motors):
        program = f"""
            import os, elib
            robot = elib.connect({url!r}, watchdog=True)
            robot.set_speed(0.4, 0.4)
            print("driving", flush=True)
            {end}
            """
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-c", textwrap.dedent(program), stdout=subprocess.PIPE
        )
        assert process.stdout is not None
        assert await process.stdout.readline() == b"driving\n"
        await until_standing(motors)
        await process.wait()
        # The port is free again in a moment.
        async with asyncio.timeout(PATIENCE):
            while True:
                with contextlib.suppress(elib.LinkError):
                    async with elib.open(url) as robot:
                        await robot.proximity()
                        return


@pytest.mark.long
@pytest.mark.parametrize("way", ["tcp", "pty"])
@pytest.mark.parametrize("firmware", PROFILES)
def test_a_program_that_just_dies_leaves_a_robot_that_stands_and_a_port_that_is_free(way: str, firmware: str) -> None:
    asyncio.run(start_and_end(way, firmware, "os._exit(3)"))


@pytest.mark.parametrize("way", ["tcp", "pty"])
def test_a_blocked_event_loop_stops_the_robot_and_the_program_goes_on(way: str) -> None:
    async def main() -> None:
        async with robot_on(way) as (url, motors):
            blocked = asyncio.Event()
            outside = asyncio.get_running_loop()

            async def drive(robot: elib.Epuck) -> elib.Wheels:
                await robot.set_speed(0.4, 0.4)
                asyncio.run_coroutine_threadsafe(until_standing(motors), outside).result(PATIENCE)  # blocks this loop
                outside.call_soon_threadsafe(blocked.set)
                await robot.set_speed(0.3, 0.3)
                return await robot.speed()

            found = await asyncio.to_thread(elib.run, drive, robot=url, watchdog=True)
            assert found == pytest.approx((0.3, 0.3), abs=0.001)
            assert blocked.is_set()
            assert not are_turning(motors)

    asyncio.run(main())


@pytest.mark.parametrize("way", ["tcp", "pty"])
def test_a_closed_robot_leaves_no_watchdog_and_a_port_that_is_free_at_once(way: str) -> None:
    async def main() -> None:
        async with robot_on(way) as (url, _):
            for _ in range(10):
                async with elib.open(url, watchdog=True) as robot:
                    await robot.set_speed(0.4, 0.4)
                    assert WATCHDOG._watched
                assert not WATCHDOG._watched
                assert WATCHDOG._line is None
                assert not OPEN_STOPS

    asyncio.run(main())


def test_a_robot_that_comes_back_is_watched_on_its_new_link() -> None:
    async def main() -> None:
        async with robot_on("tcp") as (url, _), elib.reconnecting(url, first_delay=0.01, watchdog=True) as robot:
            before = set(WATCHDOG._watched)
            line = robot.session.transport.fileno()  # type: ignore[attr-defined]
            with socket.socket(fileno=os.dup(line)) as ours:
                ours.shutdown(socket.SHUT_RDWR)
            await robot.within(PATIENCE).proximity()
            assert len(WATCHDOG._watched) == 1
            assert WATCHDOG._watched != before

    asyncio.run(main())


def test_a_watchdog_that_cannot_be_started_leaves_nothing_open(monkeypatch: pytest.MonkeyPatch) -> None:
    async def main() -> None:
        async with robot_on("tcp") as (url, _):
            with monkeypatch.context() as broken:
                broken.setattr(sys, "executable", "/nowhere/python")
                with pytest.raises(Unsupported, match="the watchdog cannot be started"):
                    await elib.open(url, watchdog=True).__aenter__()
            assert WATCHDOG._line is None
            assert not OPEN_STOPS
            assert not SIGNALS._loops
            async with elib.open(url) as robot:
                await robot.proximity()

    asyncio.run(main())


def test_a_robot_whose_program_asked_for_no_watchdog_opens_where_none_can_be_started(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def main() -> None:
        async with robot_on("tcp") as (url, _):
            monkeypatch.setattr(sys, "executable", "/nowhere/python")

            def drive() -> None:
                with elib.connect(url) as robot:
                    robot.set_speed(0.2, 0.2)

            await asyncio.to_thread(drive)  # in this thread no signal ends the program in good order

    asyncio.run(main())


def test_a_program_without_files_has_no_watchdog(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("elib.robot.watchdog_process.__file__", "/nowhere/program.zip/watchdog_process.py")
    with pytest.raises(Unsupported, match="does not support the watchdog"):
        elib.open("sim://", watchdog=True)
    with pytest.raises(Unsupported, match="does not support the watchdog"):
        elib.swarm("sim://", watchdog=True)


def test_a_port_that_takes_no_more_bytes_does_not_make_the_watchdog_fail() -> None:
    fcntl = pytest.importorskip("fcntl")
    resource = pytest.importorskip("resource")
    most = resource.getrlimit(resource.RLIMIT_NOFILE)
    if most[0] <= FD_SETSIZE:
        pytest.skip("no descriptor of this process is that high")
    ours, its = socket.socketpair()
    with ours, its:
        ours.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while True:
                ours.send(bytes(65536))
        high = fcntl.fcntl(ours, fcntl.F_DUPFD, FD_SETSIZE)  # select() refuses it
        try:
            write_now(high, b"S\r")
        finally:
            os.close(high)


def test_a_robot_in_the_program_itself_needs_no_watchdog() -> None:
    with elib.connect("sim://?speed=max", watchdog=True):
        assert not WATCHDOG._watched


def test_an_awaited_robot_that_nobody_closed_is_stopped_with_its_event_loop() -> None:
    async def main() -> None:
        async with robot_on("tcp") as (url, motors):

            async def drive() -> None:
                robot = await elib.open(url)
                await robot.set_speed(0.4, 0.4)

            await asyncio.to_thread(asyncio.run, drive())
            await until_standing(motors)

    asyncio.run(main())


def test_a_robot_left_behind_in_a_loop_that_was_never_finished_is_stopped_at_exit() -> None:
    async def main() -> None:
        async with robot_on("tcp") as (url, motors):
            program = f"""
                import asyncio, elib
                async def drive():
                    global robot
                    robot = await elib.open({url!r})
                    await robot.set_speed(0.4, 0.4)
                loop = asyncio.new_event_loop()
                loop.run_until_complete(drive())
                """
            process = await asyncio.create_subprocess_exec(sys.executable, "-c", textwrap.dedent(program))
            assert await process.wait() == 0
            await until_standing(motors)

    asyncio.run(main())
