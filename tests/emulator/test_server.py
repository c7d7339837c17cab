import asyncio
import contextlib
import os
import socket
import subprocess
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from fault_rig import ask
from served_rig import Seen

from elib.base.errors import ArgumentError, LinkBusy, LinkError, LinkLost, LinkNotFound, SimulationError
from elib.base.timebase import ScaledLoop, SimulatedLoop
from elib.link.protocol.commands import SPECS
from elib.link.session import Session
from elib.link.transport import open_transport
from elib.simulator.emulator.loopback import reachable
from elib.simulator.emulator.server import Served, serve
from elib.simulator.emulator.settings import SimulationSettings
from shared import PATIENCE, until

FAST = SimulationSettings(world="square", baud=0)


@pytest.fixture
async def pty() -> AsyncIterator[str]:
    """URL of a robot on a pty."""
    async with serve(FAST) as served:
        yield served[0].url


@pytest.fixture
async def tcp() -> AsyncIterator[str]:
    """URL of a robot on a TCP port."""
    async with serve(FAST, tcp="0") as served:
        yield served[0].url


@pytest.fixture(params=["pty", "tcp"])
def url(request: pytest.FixtureRequest) -> str:
    """URL of a robot on either."""
    return request.getfixturevalue(request.param)


async def test_a_robot_answers_the_program_that_opens_it(url: str) -> None:
    transport = await open_transport(url)
    assert await ask(transport, b"D,100,200\r") == b"d\r\n"
    assert await ask(transport, b"E\r") == b"e,100,200\r\n"
    await transport.close()


async def test_the_robot_keeps_its_state_from_client_to_client(url: str, seen: Seen) -> None:
    for speed in (b"10", b"20", b"30"):
        transport = await open_transport(url)
        if speed != b"10":
            assert await ask(transport, b"E\r") == b"e,%d,5\r\n" % (int(speed) - 10)
        assert await ask(transport, b"D,%s,5\r" % speed) == b"d\r\n"
        left = seen.gone
        await transport.close()
        await until(lambda left=left: seen.gone > left)


async def test_what_one_client_left_unread_the_next_does_not_get(url: str, seen: Seen) -> None:
    first = await open_transport(url)
    await first.write(b"H\r")
    await until(lambda: first.unread)
    await first.close()
    await until(lambda: seen.gone)
    second = await open_transport(url)
    assert await ask(second, b"E\r") == b"e,0,0\r\n"
    await second.close()


async def test_a_shell_can_poke_a_robot(pty: str, seen: Seen) -> None:
    port = pty.removeprefix("serial://")
    await asyncio.to_thread(subprocess.run, f"printf 'D,500,500\\r' > {port}", shell=True, check=True)
    await until(lambda: seen.gone)
    transport = await open_transport(pty)
    assert await ask(transport, b"E\r") == b"e,500,500\r\n"
    await transport.close()


async def test_a_second_client_on_tcp_is_turned_away_and_the_first_goes_on(tcp: str) -> None:
    first = await open_transport(tcp)
    assert await ask(first, b"E\r") == b"e,0,0\r\n"
    second = await open_transport(tcp)
    with pytest.raises(LinkLost):
        async with asyncio.timeout(PATIENCE):
            await second.read()
    await second.close()
    assert await ask(first, b"E\r") == b"e,0,0\r\n"
    await first.close()


async def test_a_program_that_opens_a_robot_of_another_program_on_tcp_is_told_so(tcp: str) -> None:
    first = await Session.open(await open_transport(tcp))
    with pytest.raises(LinkBusy, match=r"closed it before it sent anything") as caught:
        await Session.open(await open_transport(tcp))
    assert "close the other one" in caught.value.hint
    assert isinstance(caught.value.__cause__, LinkLost)
    assert (await first.execute(SPECS["version"].request(first.context), 1.0)).hardware
    await first.close()
    await (await Session.open(await open_transport(tcp))).close()


async def test_a_link_that_breaks_after_something_was_heard_is_lost_and_not_busy() -> None:
    async def speak_and_leave(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"hello")
        await writer.drain()
        writer.close()

    async with await asyncio.start_server(speak_and_leave, "127.0.0.1", 0) as server:
        port = server.sockets[0].getsockname()[1]
        with pytest.raises(LinkLost):
            await Session.open(await open_transport(f"tcp://127.0.0.1:{port}"))


async def test_leaving_hangs_up_on_the_client(url: str) -> None:
    async with serve(FAST, pty="serial" in url, tcp=None if "serial" in url else "0") as served:
        transport = await open_transport(served[0].url)
        assert await ask(transport, b"E\r") == b"e,0,0\r\n"
    with pytest.raises(LinkLost):
        async with asyncio.timeout(PATIENCE):
            await transport.read()
    await transport.close()
    with pytest.raises(LinkNotFound):
        await open_transport(served[0].url)


async def test_names_links_and_ports_count_up(tmp_path: Path) -> None:
    three = SimulationSettings(world="square", baud=0, robots=3)
    link = str(tmp_path / "robot")
    async with serve(three, link=link) as served:
        assert served == [
            Served("epuck-1", f"serial://{link}"),
            Served("epuck-2", f"serial://{link}-2"),
            Served("epuck-3", f"serial://{link}-3"),
        ]
        for index, robot in enumerate(served):
            transport = await open_transport(robot.url)
            assert await ask(transport, b"D,%d,0\r" % index) == b"d\r\n"
            await transport.close()
    assert os.listdir(tmp_path) == [], "links are removed"


async def test_a_link_with_a_number_counts_on_from_it(tmp_path: Path) -> None:
    two = SimulationSettings(world="square", baud=0, robots=2)
    async with serve(two, link=str(tmp_path / "rfcomm7")) as served:
        assert [robot.url.rpartition("/")[2] for robot in served] == ["rfcomm7", "rfcomm8"]


def a_free_port() -> int:
    """Return a port that is free now."""
    with socket.socket() as line:
        line.bind(("127.0.0.1", 0))
        port: int = line.getsockname()[1]
        return min(port, 65534)


async def test_ports_count_up_from_the_first() -> None:
    two = SimulationSettings(world="square", baud=0, robots=2)

    for _ in range(100):  # somebody may have its neighbour, or be quicker
        with contextlib.suppress(LinkBusy):
            port = a_free_port()
            async with serve(two, tcp=f"127.0.0.1:{port}") as served:
                assert [robot.url for robot in served] == [f"tcp://127.0.0.1:{port}", f"tcp://127.0.0.1:{port + 1}"]
                return
    pytest.fail("no port has a free neighbour")


async def test_only_this_computer_is_served_unless_asked_otherwise(tcp: str) -> None:
    assert tcp.startswith("tcp://127.0.0.1:")


@pytest.mark.parametrize("scheme", ["tcp", "wifi"])
async def test_a_robot_at_all_addresses_is_named_by_one_that_others_can_open(scheme: str) -> None:
    firmware = "epuck2-wifi" if scheme == "wifi" else "asercom-1.2.2"
    settings = SimulationSettings(world="square", baud=0, firmware=firmware)
    async with serve(settings, pty=False, **{scheme: "0.0.0.0:0"}) as served:
        (url,) = [robot.url for robot in served]
        host, _, port = url.removeprefix(f"{scheme}://").rpartition(":")
        assert host == reachable("0.0.0.0") != "0.0.0.0"
        _, writer = await asyncio.open_connection(host, int(port))
        writer.close()


async def test_while_a_client_talks_over_tcp_the_pty_is_not_heard(seen: Seen) -> None:
    async with serve(FAST, pty=True, tcp="0") as (on_pty, on_tcp):
        local = await open_transport(on_pty.url)
        client = await open_transport(on_tcp.url)
        assert await ask(client, b"D,1,1\r") == b"d\r\n"
        seen.data.clear()
        await local.write(b"D,500,500\r")
        await until(lambda: seen.data == b"D,500,500\r")
        await client.close()
        await until(lambda: seen.gone)
        assert await ask(local, b"E\r") == b"e,1,1\r\n", "what was said meanwhile is not answered, nor done later"
        await local.close()


async def test_the_traffic_of_every_robot_can_be_watched() -> None:
    seen: list[tuple[str, str, bytes]] = []
    async with serve(FAST, traffic=lambda name, _, way, data: seen.append((name, way, data))) as served:
        transport = await open_transport(served[0].url)
        await ask(transport, b"E\r")
        await transport.close()
    assert seen == [("epuck-1", "to robot", b"E\r"), ("epuck-1", "to host", b"e,0,0\r\n")]


async def test_the_link_of_a_crashed_server_is_replaced(tmp_path: Path) -> None:
    link = tmp_path / "robot"
    link.symlink_to("/dev/pts/99999")
    async with serve(FAST, link=str(link)) as served:
        await (await open_transport(served[0].url)).close()
    assert not link.is_symlink()


async def test_a_name_that_is_taken_is_not_touched(tmp_path: Path) -> None:
    file = tmp_path / "notes"
    file.write_text("mine")
    with pytest.raises(LinkBusy, match="exists already"):
        async with serve(FAST, link=str(file)):
            pass
    assert file.read_text() == "mine"


async def test_a_link_somebody_else_put_in_its_place_is_left_alone(tmp_path: Path) -> None:
    link = tmp_path / "robot"
    async with serve(FAST, link=str(link)):
        link.unlink()
        link.symlink_to("elsewhere")
    assert os.readlink(link) == "elsewhere"


async def test_a_link_where_none_can_be_made_is_refused() -> None:
    with pytest.raises(LinkError, match="cannot make the link"):
        async with serve(FAST, link="/nowhere/at/all"):
            pass


async def test_a_port_that_is_taken_is_busy(tcp: str) -> None:
    with pytest.raises(LinkBusy, match="choose another, or port 0"):
        async with serve(FAST, tcp=tcp.removeprefix("tcp://")):
            pass


@pytest.mark.parametrize("tcp", ["robot", "127.0.0.1:", "127.0.0.1:70000", "-1"])
async def test_an_impossible_address_is_refused(tcp: str) -> None:
    with pytest.raises(ArgumentError, match="HOST:PORT"):
        async with serve(FAST, tcp=tcp):
            pass


async def test_a_failure_half_way_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "robot-2").write_text("in the way")
    with pytest.raises(LinkBusy):
        async with serve(SimulationSettings(world="square", robots=2), link=str(tmp_path / "robot"), tcp="127.0.0.1:0"):
            pass
    assert os.listdir(tmp_path) == ["robot-2"]
    assert asyncio.all_tasks() == {asyncio.current_task()}


def test_a_server_runs_faster_than_real_time_if_asked() -> None:
    async def main() -> bytes:
        async with serve(SimulationSettings(world="square", speed=20.0)) as served:
            transport = await open_transport(served[0].url)
            answer = await ask(transport, b"E\r")
            await transport.close()
            return answer

    with asyncio.Runner(loop_factory=lambda: ScaledLoop(20)) as runner:
        assert runner.run(main()) == b"e,0,0\r\n"


def test_a_server_needs_a_loop_of_its_speed() -> None:
    async def main(settings: SimulationSettings) -> None:
        async with serve(settings):
            pass

    with asyncio.Runner() as runner, pytest.raises(SimulationError, match="needs an event loop made for it"):
        runner.run(main(SimulationSettings(speed=2.0)))
    with asyncio.Runner(loop_factory=SimulatedLoop) as runner, pytest.raises(SimulationError, match="real time"):
        runner.run(main(FAST))
