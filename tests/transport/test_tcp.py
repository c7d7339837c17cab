import asyncio
import socket

import pytest
from pairs import listening, tcp_pair

from elib.base.errors import LinkError, LinkNotFound, SimulationError
from elib.base.timebase import SimulatedLoop
from elib.link.transport import open_transport, parse_url, tcp
from elib.link.transport.tcp import open_tcp
from elib.link.transport.wifi import open_wifi
from shared import held_port


async def test_a_server_is_reached_without_waiting_for_full_packets() -> None:
    transport, peer = await tcp_pair()
    assert transport._channel.get_extra_info("socket").getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
    await transport.close()
    await peer.close()


async def test_the_url_opens_the_same_thing_again() -> None:
    async with listening() as (url, connected):
        first = await open_transport(url)
        second = await open_transport(first.url)
        assert second.url == url
        for transport in (first, second, await connected.get(), await connected.get()):
            await transport.close()


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
async def test_a_port_where_nobody_listens_is_not_found(host: str) -> None:
    said = "no program listens on port [0-9]+\nhint: start the server first"
    with held_port() as port, pytest.raises(LinkNotFound, match=said):
        await open_tcp(parse_url(f"tcp://{host}:{port}"))


async def test_an_unknown_host_is_not_found(monkeypatch: pytest.MonkeyPatch) -> None:
    async def resolve(*_: object, **__: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(asyncio.get_running_loop(), "getaddrinfo", resolve)
    with pytest.raises(LinkNotFound, match=r"no host 'epuck\.invalid'"):
        await open_tcp(parse_url("tcp://epuck.invalid:4000"))


@pytest.mark.parametrize("host", ["a..b", f"{'x' * 64}.local"])
async def test_a_name_that_no_host_can_have_is_not_found(host: str) -> None:
    with pytest.raises(LinkNotFound, match=f"no host {host!r}"):
        await open_tcp(parse_url(f"tcp://{host}:4000"))


async def test_a_host_that_does_not_answer_is_given_up_and_a_robot_on_wifi_may_be_in_use(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def resolve(*_: object, **__: object) -> None:
        await asyncio.Event().wait()

    monkeypatch.setattr(asyncio.get_running_loop(), "getaddrinfo", resolve)
    monkeypatch.setattr(tcp, "OPEN_TIMEOUT", 0.01)
    with pytest.raises(LinkNotFound, match=r"no answer within 0\.01 s"):
        await open_tcp(parse_url("tcp://epuck.invalid:4000"))
    with pytest.raises(LinkNotFound, match="no answer within") as caught:
        await open_wifi(parse_url("wifi://epuck.invalid"))
    assert "is the robot on" in caught.value.hint
    assert "other programs may hold it; it serves one program at a time" in caught.value.hint.lower()


async def test_a_network_that_cannot_be_reached_is_a_link_error(monkeypatch: pytest.MonkeyPatch) -> None:
    async def connect(*_: object, **__: object) -> None:
        raise OSError(101, "Network is unreachable")

    monkeypatch.setattr(asyncio.get_running_loop(), "create_connection", connect)
    with pytest.raises(LinkError, match="Network is unreachable") as caught:
        await open_tcp(parse_url("tcp://192.0.2.1:4000"))
    assert type(caught.value) is LinkError


def test_tcp_is_refused_in_simulated_time() -> None:
    with asyncio.Runner(loop_factory=SimulatedLoop) as runner, pytest.raises(SimulationError, match="speed=real"):
        runner.run(open_tcp(parse_url("tcp://127.0.0.1:4000")))
