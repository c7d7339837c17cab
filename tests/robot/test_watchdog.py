"""The process that stops the robots of a program that died or froze, and what it leaves alone."""

import asyncio
import contextlib
import os
import socket
import sys
import textwrap

import pytest
from served import served

import elib
from elib.base.errors import Unsupported
from elib.link.protocol.profiles import PROFILES
from elib.robot.emergency import OPEN_STOPS
from elib.robot.signals import SIGNALS
from elib.robot.watchdog import Watchdog, is_supported
from elib.robot.watchdog_process import write_now
from lanes import short
from shared import PATIENCE, until

if not is_supported():
    pytest.skip("no watchdog on this system", allow_module_level=True)

FD_SETSIZE = 1024


def watchdogs() -> list[Watchdog]:
    """Return the watchdogs of all open robots."""
    return [each.watchdog for each in OPEN_STOPS if each.watchdog is not None]


def runs(watchdog: Watchdog) -> bool:
    return watchdog._process.poll() is None


def ways_to_die() -> list[object]:
    """Return every firmware, and every line twice."""
    cases = list(zip(PROFILES, ("tcp", "pty", "pty", "tcp"), strict=True))
    return short(cases, cases[0])


@pytest.mark.parametrize(("firmware", "way"), ways_to_die())
async def test_a_program_that_just_dies_leaves_a_robot_that_stands_and_a_port_that_is_free(
    firmware: str, way: str
) -> None:
    async with served(way, firmware=firmware) as there:
        program = f"""
            import os, elib
            robot = elib.connect({there.url!r}, watchdog=True)
            robot.set_speed(0.4, 0.4)
            os._exit(3)
            """
        process = await asyncio.create_subprocess_exec(sys.executable, "-c", textwrap.dedent(program))
        assert await process.wait() == 3
        await there.until_it_stands()

        async def is_free() -> bool:
            with contextlib.suppress(elib.LinkError):
                async with elib.open(there.url) as robot:
                    await robot.proximity()
                    return True
            return False

        await until(is_free)


@pytest.mark.parametrize("way", short(["tcp", "pty"], "tcp"))
async def test_a_blocked_event_loop_stops_the_robot_and_the_program_goes_on(way: str) -> None:
    async with served(way) as there:
        outside = asyncio.get_running_loop()

        async def drive(robot: elib.Epuck) -> elib.Wheels:
            await robot.set_speed(0.4, 0.4)
            asyncio.run_coroutine_threadsafe(there.until_it_stands(), outside).result()  # blocks this loop
            await robot.set_speed(0.3, 0.3)
            return await robot.speed()

        found = await asyncio.to_thread(elib.run, drive, robot=there.url, watchdog=True)
        assert found == pytest.approx((0.3, 0.3), abs=0.001)
        assert not there.is_turning


@pytest.mark.parametrize("way", ["tcp", "pty"])
async def test_a_closed_robot_leaves_no_watchdog_and_a_port_that_is_free_at_once(
    way: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("elib.robot.watchdog.RELEASE_TIME", PATIENCE)  # of a busy machine
    async with served(way) as there:
        for _ in range(3):
            async with elib.open(there.url, watchdog=True) as robot:
                await robot.set_speed(0.4, 0.4)
                (watchdog,) = watchdogs()
                assert runs(watchdog)
            assert not runs(watchdog)
            assert not OPEN_STOPS


async def test_a_robot_that_comes_back_is_watched_on_its_new_link() -> None:
    async with served("tcp") as there, elib.reconnecting(there.url, first_delay=0.01, watchdog=True) as robot:
        (before,) = watchdogs()
        line = robot.session.transport.fileno()  # type: ignore[attr-defined]
        with socket.socket(fileno=os.dup(line)) as ours:
            ours.shutdown(socket.SHUT_RDWR)
        await robot.within(PATIENCE).proximity()
        (now,) = watchdogs()
        assert runs(now)
        await until(lambda: not runs(before))


async def test_a_watchdog_that_cannot_be_started_leaves_nothing_open(monkeypatch: pytest.MonkeyPatch) -> None:
    async with served("tcp") as there:
        with monkeypatch.context() as broken:
            broken.setattr(sys, "executable", "/nowhere/python")
            with pytest.raises(Unsupported, match="the watchdog cannot be started"):
                await elib.open(there.url, watchdog=True).__aenter__()
        assert not OPEN_STOPS
        assert not SIGNALS._loops
        async with elib.open(there.url) as robot:
            await robot.proximity()


async def test_a_robot_whose_program_asked_for_no_watchdog_opens_where_none_can_be_started(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with served("tcp") as there:
        monkeypatch.setattr(sys, "executable", "/nowhere/python")

        def drive() -> None:
            with elib.connect(there.url) as robot:
                robot.set_speed(0.2, 0.2)

        await asyncio.to_thread(drive)  # in this thread no signal ends the program in good order


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
        assert not watchdogs()


async def test_an_awaited_robot_that_nobody_closed_is_stopped_with_its_event_loop() -> None:
    async with served("tcp") as there:

        async def drive() -> None:
            robot = await elib.open(there.url)
            await robot.set_speed(0.4, 0.4)

        await asyncio.to_thread(asyncio.run, drive())
        await there.until_it_stands()


async def test_a_robot_left_behind_in_a_loop_that_was_never_finished_is_stopped_at_exit() -> None:
    async with served("tcp") as there:
        program = f"""
            import asyncio, elib
            async def drive():
                global robot
                robot = await elib.open({there.url!r})
                await robot.set_speed(0.4, 0.4)
            loop = asyncio.new_event_loop()
            loop.run_until_complete(drive())
            """
        process = await asyncio.create_subprocess_exec(sys.executable, "-c", textwrap.dedent(program))
        assert await process.wait() == 0
        await there.until_it_stands()
