"""Robots that ``elib simulate --wifi`` offers, on true TCP connections."""

import asyncio
import contextlib
import socket
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from wifi_rig import command, packets

from elib.base.errors import ArgumentError, LinkBusy
from elib.link.transport import open_transport
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import STUCK, serve
from elib.simulator.emulator.settings import SimulationSettings
from shared import PATIENCE, until

WIFI = SimulationSettings(world="square", firmware="epuck2-wifi")


@pytest.fixture
async def port() -> AsyncIterator[int]:
    """TCP port of a robot."""
    async with serve(WIFI, wifi="0") as served:
        yield port_of(served[0].url)


def port_of(url: str) -> int:
    assert url.startswith("wifi://127.0.0.1:")
    return int(url.rpartition(":")[2])


@contextlib.asynccontextmanager
async def client(port: int) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        yield reader, writer
    finally:
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()


async def hears(reader: asyncio.StreamReader, count: int = 105) -> bytes:
    async with asyncio.timeout(PATIENCE):
        return await reader.readexactly(count)


class Served:
    """A robot that is served, and what went over its link, in order: ``to robot`` or ``to host``."""

    def __init__(self) -> None:
        self.ways: list[str] = []
        self.told: list[str] = []
        self.doors: list[Control] = []

    @contextlib.asynccontextmanager
    async def serve(self) -> AsyncIterator[int]:
        """Serve it on the port that is yielded."""
        traffic = lambda name, time, way, data: self.ways.append(way)  # noqa: E731
        async with serve(WIFI, wifi="0", control=self.doors.append, traffic=traffic, warn=self.told.append) as served:
            yield port_of(served[0].url)

    @property
    def control(self) -> Control:
        return self.doors[0]

    @property
    def is_connected(self) -> bool:
        return self.control.link(0).is_connected

    def go_on(self, seconds: float) -> None:
        """Let so much time of the world pass at once."""
        self.control.pause()
        self.control.simulation.step(seconds)
        self.control.resume()


async def test_a_client_gets_packets_as_soon_as_it_sent_a_command() -> None:
    robot = Served()
    async with robot.serve() as port, client(port) as (reader, writer):
        await until(lambda: robot.is_connected)
        robot.go_on(1)
        assert robot.ways == []
        writer.write(command(2))
        assert packets(await hears(reader, 2 * 105))[1][0] == 2


async def test_a_second_client_waits_and_is_served_when_the_first_has_left(port: int) -> None:
    async with client(port) as (first, write):
        write.write(command(2))
        await hears(first)
        async with client(port) as (second, other):
            other.write(command(0))
            assert {packet[0] for packet in packets(await hears(first, 20 * 105))} == {2}
            write.close()
            assert await hears(second, 1) == b"\x03"


@pytest.mark.skipif(sys.platform != "linux", reason="other systems let more clients wait")
async def test_a_third_client_does_not_get_a_connection(port: int) -> None:
    async with client(port) as (first, write), client(port):
        write.write(command(2))
        await hears(first)
        with socket.socket() as third:
            third.setblocking(False)
            address = ("127.0.0.1", port)
            connecting = asyncio.create_task(asyncio.get_running_loop().sock_connect(third, address))
            await hears(first, 20 * 105)
            assert not connecting.done()
            connecting.cancel()
            await asyncio.wait({connecting})


async def test_clients_may_come_and_go_and_the_robot_goes_on_with_the_last_command() -> None:
    robot = Served()
    async with robot.serve() as port:
        for speed in (100, 200, 300):
            async with client(port) as (reader, writer):
                writer.write(command(2, left=speed, right=speed))
                await hears(reader, 3 * 105)
            await until(lambda: not robot.is_connected)
            robot.go_on(1)
            wheels = robot.control.simulation.robots[0].emulator.firmware.report()["speed"]
            assert wheels == [speed, speed]


async def test_a_client_that_only_ends_its_input_still_hears(port: int) -> None:
    async with client(port) as (reader, writer):
        writer.write(command(2))
        await hears(reader)
        writer.write_eof()
        await hears(reader, 20 * 105)


async def test_after_a_client_without_a_command_no_other_is_served_until_a_restart() -> None:
    robot = Served()
    async with robot.serve() as port:
        async with client(port):
            await until(lambda: robot.is_connected)
        await until(lambda: robot.told)
        assert robot.told == [f"epuck-1: {STUCK}"]
        async with client(port) as (reader, writer):
            writer.write(command(2))
            for _ in range(10):  # its connection stands, and would have been taken by now
                await asyncio.sleep(0)
            robot.go_on(1)
            assert robot.ways == []
        robot.control.restart(0)
        robot.go_on(3)
        async with client(port) as (reader, writer):
            writer.write(command(0))
            assert await hears(reader, 1) == b"\x03"


async def test_a_client_whose_connection_breaks_without_a_command_makes_room() -> None:
    robot = Served()
    async with robot.serve() as port:
        async with client(port) as (_, writer):
            await until(lambda: robot.is_connected)
            line = writer.get_extra_info("socket")
            line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")  # close() then resets
        async with client(port) as (reader, writer):
            writer.write(command(0))
            assert await hears(reader, 1) == b"\x03"


async def test_a_request_of_a_web_page_is_dropped_and_does_not_make_the_robot_stuck(port: int) -> None:
    async with client(port) as (reader, writer):
        writer.write(b"POST / HTTP/1.1\r\n\r\n" + command(2, left=500, right=500))
        with contextlib.suppress(ConnectionError):
            assert await reader.read() == b""
    async with client(port) as (reader, writer):
        writer.write(command(0))
        assert await hears(reader, 1) == b"\x03"


@pytest.mark.long
async def test_a_slow_reader_slows_the_robot_and_loses_nothing() -> None:
    robot = Served()
    async with robot.serve() as port:
        line = socket.socket()
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        line.setblocking(False)
        await asyncio.get_running_loop().sock_connect(line, ("127.0.0.1", port))
        reader, writer = await asyncio.open_connection(sock=line, limit=1)
        writer.write(command(1))
        time = robot.control.simulation.time
        await until(lambda: robot.control.simulation.time > time + 2)  # 23 pictures, if somebody read them
        reader._limit = 1 << 16  # type: ignore[attr-defined]
        writer.write(command(0))
        data = bytearray()
        async with asyncio.timeout(PATIENCE):
            while not data.endswith(b"\x03" * 10):
                data += await reader.read(1 << 16)
        pictures = [packet for packet in packets(bytes(data)) if packet[0] == 1]
        assert 1 <= len(pictures) <= 5
        writer.close()


async def test_while_the_link_is_cut_nobody_listens_and_then_the_same_port_does() -> None:
    doors: list[Control] = []
    async with serve(WIFI, wifi="0", control=doors.append) as served:
        port = port_of(served[0].url)
        async with client(port) as (reader, writer):
            writer.write(command(2))
            await hears(reader)
            doors[0].cut(0)
            with contextlib.suppress(ConnectionError):
                await reader.read()
        with pytest.raises(ConnectionRefusedError):
            async with client(port):
                pass
        doors[0].mend(0)
        async with client(port) as (reader, writer):
            writer.write(command(0))
            assert await hears(reader, 1) == b"\x03"


async def test_each_robot_has_a_port_of_its_own_and_they_count_up() -> None:
    async with serve(SimulationSettings(world="square", firmware="epuck2-wifi", robots=3), wifi="0") as served:
        assert len({port_of(each.url) for each in served}) == 3
        assert [each.name for each in served] == ["epuck-1", "epuck-2", "epuck-3"]
        for each in served:
            async with client(port_of(each.url)) as (reader, writer):
                writer.write(command(0))
                assert await hears(reader, 1) == b"\x03"
        taken = port_of(served[0].url)
        with pytest.raises(LinkBusy, match=f"port {taken}"):
            async with serve(WIFI, wifi=str(taken)):
                pass


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"wifi": "here"}, "neither HOST:PORT nor PORT"),
        ({"wifi": "65535"}, "pass port 65535"),
        ({"tcp": "0"}, "no serial line"),
        ({"pty": True}, "no serial line"),
        ({"wifi": "nowhere.invalid:0"}, "no host 'nowhere.invalid'"),
    ],
)
async def test_ports_that_these_robots_cannot_have_are_refused(options: dict[str, object], message: str) -> None:
    settings = SimulationSettings(world="square", firmware="epuck2-wifi", robots=2)
    with pytest.raises(ArgumentError, match=message):
        async with serve(settings, **options):  # type: ignore[arg-type]
            pass


async def test_robots_without_wifi_are_not_offered_over_wifi() -> None:
    with pytest.raises(ArgumentError, match="no robot of this simulation has Wi-Fi"):
        async with serve(SimulationSettings(world="square"), wifi="0"):
            pass


async def test_robots_with_and_without_wifi_share_a_world(tmp_path: Path) -> None:
    world = tmp_path / "mixed.toml"
    world.write_text(
        '[arena]\nsize = [1.0, 1.0]\n[[robot]]\nposition = [0.2, 0.5]\nfirmware = "epuck2-wifi"\n'
        '[[robot]]\nposition = [0.5, 0.5]\n[[robot]]\nposition = [0.8, 0.5]\nfirmware = "epuck2-wifi"\n'
    )
    async with serve(SimulationSettings(world=str(world)), tcp="0") as served:
        assert [each.url.partition("://")[0] for each in served] == ["wifi", "tcp", "wifi"]
        serial = await open_transport(served[1].url)
        await serial.write(b"V\r")
        assert await serial.read()
        await serial.close()
        for index in (0, 2):
            async with client(port_of(served[index].url)) as (reader, writer):
                writer.write(command(0))
                assert await hears(reader, 1) == b"\x03"
