"""Clients of a served robot that flood it, leave, fall silent, or are not meant for a robot at all."""

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from elib.base.errors import LinkLost
from elib.link.protocol.profiles import PROFILES
from elib.link.transport import open_transport
from elib.simulator.emulator import server, tcp_client
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from lanes import short
from shared import PATIENCE, until

METHODS = ("GET", "HEAD", "POST", "PUT", "DELETE", "CONNECT", "OPTIONS", "TRACE", "PATCH", "PRI", "PROPFIND", "D", "S")
"""Methods of requests: those of HTTP, and some that a page may make up."""


FIRST, *OTHERS = PROFILES


@pytest.fixture(params=short([FIRST, *OTHERS], FIRST))
async def port(request: pytest.FixtureRequest) -> AsyncIterator[int]:
    """TCP port of a robot of each kind, on a line eight times as quick as the real one."""
    async with serve(SimulationSettings(world="square", firmware=request.param, baud=1_000_000), tcp="0") as served:
        yield int(served[0].url.rpartition(":")[2])


@pytest.fixture
async def quick() -> AsyncIterator[int]:
    """TCP port of a robot on a line that takes no time."""
    async with serve(SimulationSettings(world="square", baud=0), tcp="0") as served:
        yield int(served[0].url.rpartition(":")[2])


async def ask(port: int, line: bytes) -> bytes:
    """Return the last line of the robot's answer to *line*, as a client that comes and goes; empty if there is none."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        writer.write(line)
        return await reader.readuntil(b"\r\n")
    except (ConnectionError, asyncio.IncompleteReadError):  # it has another client
        return b""
    finally:
        await leave(writer)


async def leave(writer: asyncio.StreamWriter) -> None:
    writer.close()
    with contextlib.suppress(ConnectionError):
        await writer.wait_closed()


async def until_free(port: int, line: bytes) -> bytes:
    """Ask until the robot has time for another client."""
    return await until(lambda: ask(port, line))


def flood(port: int, data: bytes) -> None:
    """Hand as much of *data* to the system as it takes at once, and leave without reading."""
    with socket.create_connection(("127.0.0.1", port)) as client:
        client.setblocking(False)
        view = memoryview(data)
        with contextlib.suppress(BlockingIOError):
            while view:
                view = view[client.send(view) :]


@pytest.mark.parametrize("size", [200_000, 7_000_000])
async def test_a_client_that_floods_a_robot_and_leaves_gives_it_back(
    port: int, size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "MAX_FLOOD", 0.3)
    flood(port, b"\r" * size)
    assert (await until_free(port, b"E\r")).startswith(b"e,")


async def test_a_client_that_never_ends_is_hung_up_on(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "MAX_FLOOD", 0.3)
    client = await open_transport(f"tcp://127.0.0.1:{port}")
    with pytest.raises(LinkLost):
        async with asyncio.timeout(PATIENCE):
            while True:
                await client.write(b"\r" * 10_000)
    await client.close()
    assert (await until_free(port, b"E\r")).startswith(b"e,")


async def test_a_client_that_writes_much_and_waits_for_the_answers_is_not(
    port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "MAX_FLOOD", 0.0)
    client = await open_transport(f"tcp://127.0.0.1:{port}")
    for _ in range(2):
        await client.write(b"\r" * 60_000 + b"E\r")
        answer = b""
        async with asyncio.timeout(PATIENCE):
            while not answer.endswith(b"\n"):
                answer += await client.read()
        assert answer.startswith(b"e,")
    await client.close()


async def hung_up_on(quick: int, request: bytes, chunk: int) -> bool:
    """Send *request* in pieces; return whether the connection ends without an answer."""
    reader, writer = await asyncio.open_connection("127.0.0.1", quick)
    answer = b""
    with contextlib.suppress(ConnectionError):
        for start in range(0, len(request), chunk):
            writer.write(request[start : start + chunk])
            await writer.drain()
            await asyncio.sleep(0)
        async with asyncio.timeout(PATIENCE):
            answer = await reader.read()
    await leave(writer)
    return answer == b""


@pytest.mark.parametrize("chunk", [1, 3, 4, 1000])
async def test_what_begins_like_a_request_of_a_web_page_never_reaches_the_robot(quick: int, chunk: int) -> None:
    for method in METHODS:
        head = f"{method} / HTTP/1.1\r\nHost: 127.0.0.1:{quick}\r\nContent-Length: 12\r\n\r\n".encode()
        assert await hung_up_on(quick, head + b"\rD,300,300\r", chunk), method
        assert await until_free(quick, b"E\r") == b"e,0,0\r\n", method


async def test_other_beginnings_of_requests_end_the_connection_too(quick: int) -> None:
    for beginning in (
        b"CONNECT 1.2.3.4:80 HTTP/1.1\r\n",
        b"OPTIONS * HTTP/1.1\r\n",
        b"\x16\x03\x01\x02\x00",
        b"D http://x/ ",
    ):
        assert await hung_up_on(quick, beginning + b"\rD,300,300\r", 1000), beginning
        assert await until_free(quick, b"E\r") == b"e,0,0\r\n", beginning


@pytest.mark.parametrize("beginning", [b"GET / HTTP/1.1\r\n", b"\r" * 3_000_000, b""])
async def test_a_robot_whose_client_was_hung_up_on_is_not_taken_for_connected(
    beginning: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "MAX_FLOOD", 0.1)
    controls: list[Control] = []
    settings = SimulationSettings(world="square", baud=1_000_000)
    async with serve(settings, tcp="0", control=controls.append) as served:
        reader, writer = await asyncio.open_connection("127.0.0.1", int(served[0].url.rpartition(":")[2]))
        await until(lambda: controls[0].link("epuck-1").is_connected)
        writer.write(beginning)
        if not beginning:
            await leave(writer)
        with contextlib.suppress(ConnectionError):
            async with asyncio.timeout(PATIENCE):
                await reader.read()
        await until(lambda: not controls[0].link("epuck-1").is_connected)
        await leave(writer)


@pytest.mark.parametrize("chunk", [1, 2, 1000])
async def test_commands_of_a_robots_client_are_taken_in_whatever_pieces_they_come(quick: int, chunk: int) -> None:
    for beginning, answer in (
        (b"\xbb\0", b"\0\0\0\0"),
        (b"P,1,2\r", b"p\r\n"),
        (b"G\r", b"g IR"),
        (b"D,100,200\r", b"d\r\n"),
        (b"D, 100,200\r", b"d\r\n"),
        (b"D 100,200\r", b"d\r\n"),
        (b"stop\r", b"s\r\n"),
        (b"\r\rT,1\r", b"t\r\n"),
        (bytes(37) + b"\rC\r", b"c,3\r\n"),
        (b"O\n", b"o,"),
    ):
        await until_free(quick, b"C\r")
        reader, writer = await asyncio.open_connection("127.0.0.1", quick)
        for start in range(0, len(beginning), chunk):
            writer.write(beginning[start : start + chunk])
            await asyncio.sleep(0)
        async with asyncio.timeout(PATIENCE):
            assert await reader.readexactly(len(answer)) == answer, beginning
        await leave(writer)


def test_a_method_without_end_is_waited_for_no_longer_than_any_command_is() -> None:
    assert [tcp_client.is_request(b"A" * count) for count in (1, 256, 257)] == [None, None, True]


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="only Linux shows the timers of its connections")
async def test_the_system_asks_whether_a_silent_client_is_still_there(quick: int) -> None:
    client = await open_transport(f"tcp://127.0.0.1:{quick}")
    await client.write(b"E\r")
    assert await client.read() == b"e,0,0\r\n"

    def timers() -> list[str]:
        rows = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
        return [row[5].partition(":")[0] for row in rows if row[1].endswith(f":{quick:04X}") and row[3] == "01"]

    await until(lambda: timers() == ["02"])  # of keep-alive; that of what is not acknowledged yet may be before it
    await client.close()
