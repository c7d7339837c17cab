import asyncio
import contextlib
import os
import sys
import termios

import pytest

from elib.link.transport.pty import PtyTransport
from shared import PATIENCE

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells when a client leaves")


@pytest.fixture
async def port():
    pty = PtyTransport()
    yield pty
    await pty.close()


def join(port: PtyTransport) -> int:
    return os.open(port.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)


def read_now(client: int) -> bytes:
    """Return what has come to a client, or nothing."""
    with contextlib.suppress(BlockingIOError):
        return os.read(client, 100)
    return b""


async def hang_up_of(port: PtyTransport) -> asyncio.Event:
    left = asyncio.Event()
    port.on_hang_up = left.set
    await asyncio.sleep(0)
    return left


async def test_a_client_that_leaves_is_noticed_after_its_last_bytes(port: PtyTransport) -> None:
    left = await hang_up_of(port)
    heard = []
    port.listen(lambda data: heard.append((data, left.is_set())))
    client = join(port)
    os.write(client, b"D,1,2\r")
    os.close(client)
    async with asyncio.timeout(PATIENCE):
        await left.wait()
    assert heard == [(b"D,1,2\r", False)]


async def test_what_is_said_while_nobody_listens_is_lost(port: PtyTransport) -> None:
    assert not port.has_client
    assert not port.send_nowait(b"banner")
    await port.write(b"banner")
    client = join(port)
    assert port.has_client
    with pytest.raises(BlockingIOError):
        os.read(client, 100)
    os.close(client)


async def test_the_port_is_raw_again_after_a_client_changed_it(port: PtyTransport) -> None:
    left = await hang_up_of(port)
    client = join(port)
    mode = termios.tcgetattr(client)
    mode[3] |= termios.ICANON | termios.ECHO
    termios.tcsetattr(client, termios.TCSANOW, mode)
    os.close(client)
    async with asyncio.timeout(PATIENCE):
        await left.wait()
    client = join(port)
    assert not termios.tcgetattr(client)[3] & (termios.ICANON | termios.ECHO)
    os.close(client)


async def test_an_idle_port_does_not_keep_the_loop_busy(port: PtyTransport) -> None:
    left = await hang_up_of(port)
    turns = []
    read_all = port._read_all
    asyncio.get_running_loop().remove_reader(port._watched)
    asyncio.get_running_loop().add_reader(port._watched, lambda: (turns.append(1), read_all()))
    os.close(join(port))
    async with asyncio.timeout(PATIENCE):
        await left.wait()
    for _ in range(100):  # turns of the loop, each with a look at its files
        await asyncio.sleep(0)
    assert 1 <= len(turns) <= 4, "an edge for the hang-up, one for our own look at the port"


async def test_a_client_that_does_not_read_cannot_fill_the_memory(port: PtyTransport) -> None:
    client = join(port)
    while port.send_nowait(bytes(1000)):
        pass
    assert len(port._out) <= 65_536
    os.close(client)
