import asyncio
import contextlib
import socket
from typing import Any

import pytest

from elib.base.errors import LinkClosed, LinkLost
from elib.link.transport.base import BUFFER_LIMIT
from elib.link.transport.stream import CLOSE_GRACE, StreamTransport
from elib.testing import simulated
from shared import now


class Channel(asyncio.Transport):
    """A system that takes so many bytes a second, and none if that is zero."""

    def __init__(self, protocol: StreamTransport, rate: int) -> None:
        super().__init__()
        self.protocol = protocol
        self.rate = rate
        self.unsent = 0
        self.is_reading = True
        self.aborted = False
        self._closing = False
        self._full_above = 65536
        protocol.connection_made(self)

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        self._full_above = high or 0

    def get_write_buffer_size(self) -> int:
        return self.unsent

    def write(self, data: Any) -> None:
        self.unsent += len(data)
        if self.unsent > self._full_above:
            self.protocol.pause_writing()
            asyncio.get_running_loop().call_later(1, self._send)

    def _send(self) -> None:
        self.unsent = max(0, self.unsent - self.rate)
        if self.unsent:
            asyncio.get_running_loop().call_later(1, self._send)
        else:
            self.protocol.resume_writing()
            self._finish()

    def is_closing(self) -> bool:
        return self._closing

    def close(self) -> None:
        self._closing = True
        self._finish()

    def abort(self) -> None:
        self._closing = self.aborted = True
        self.unsent = 0
        self._finish()

    def _finish(self) -> None:
        if self._closing and not self.unsent:
            asyncio.get_running_loop().call_soon(self.protocol.connection_lost, None)

    def pause_reading(self) -> None:
        self.is_reading = False

    def resume_reading(self) -> None:
        self.is_reading = True


def connect(rate: int) -> tuple[StreamTransport, Channel]:
    transport = StreamTransport("tcp://robot")
    return transport, Channel(transport, rate)


@simulated
async def test_a_write_ends_when_the_system_has_every_byte() -> None:
    transport, channel = connect(rate=10)
    await transport.write(b"x" * 95)
    assert (now(), channel.unsent) == (10, 0)


@simulated
async def test_a_system_that_takes_no_byte_for_five_seconds_is_lost() -> None:
    transport, _ = connect(rate=0)
    with pytest.raises(LinkLost, match="took no byte for 5 s"):
        await transport.write(b"x")
    assert now() == 5


@simulated
async def test_a_full_buffer_makes_the_other_side_wait_until_it_is_read() -> None:
    transport, channel = connect(rate=10)
    transport.data_received(bytes(BUFFER_LIMIT - 1))
    assert channel.is_reading
    transport.data_received(b"x")
    assert not channel.is_reading
    assert len(await transport.read()) == BUFFER_LIMIT
    assert channel.is_reading


@simulated
async def test_closing_gives_unsent_bytes_a_moment_and_then_drops_them() -> None:
    transport, channel = connect(rate=0)
    writing = asyncio.create_task(transport.write(b"x"))
    await asyncio.sleep(1)
    await transport.close()
    assert now() == 1 + CLOSE_GRACE
    assert channel.aborted
    with pytest.raises(LinkClosed):
        await writing


@simulated
async def test_a_cancelled_close_still_frees_the_port() -> None:
    transport, channel = connect(rate=0)
    channel.unsent = 1
    closing = asyncio.create_task(transport.close())
    await asyncio.sleep(0)
    closing.cancel()
    with pytest.raises(asyncio.CancelledError):
        await closing
    assert channel.aborted


@simulated
async def test_without_waiting_only_what_fits_is_sent() -> None:
    transport, channel = connect(rate=0)
    assert transport.send_nowait(bytes(BUFFER_LIMIT))
    assert not transport.send_nowait(b"x")
    channel.abort()
    assert not transport.send_nowait(b"x")
    assert not transport.is_open, "it noticed that the other side is gone"


@simulated
async def test_a_broken_link_tells_the_systems_reason() -> None:
    transport, _ = connect(rate=10)
    transport.data_received(b"last words")
    transport.connection_lost(OSError(104, "Connection reset by peer"))
    assert await transport.read() == b"last words"
    with pytest.raises(LinkLost, match=r"tcp://robot: the link broke \(Connection reset by peer\)"):
        await transport.read()


@simulated
async def test_a_connection_that_comes_after_closing_is_dropped() -> None:
    transport = StreamTransport("serial:///dev/rfcomm0")
    await transport.close()
    assert Channel(transport, rate=10).aborted


async def test_a_client_that_leaves_while_more_is_sent_to_it_ends_its_connection_once() -> None:
    loop = asyncio.get_running_loop()
    problems: list[dict[str, Any]] = []
    loop.set_exception_handler(lambda loop, context: problems.append(context))
    here, there = socket.socketpair()
    here.setblocking(False)
    transport = StreamTransport("tcp://client")
    await loop.connect_accepted_socket(lambda: transport, here)
    while transport.send_nowait(bytes(BUFFER_LIMIT)):
        pass
    left = asyncio.Event()

    def send_more() -> None:
        there.close()
        transport.send_nowait(b"more")
        left.set()

    transport.on_room = send_more
    there.setblocking(False)
    while transport.unsent:
        with contextlib.suppress(BlockingIOError):
            there.recv(BUFFER_LIMIT)
        await asyncio.sleep(0)
    await left.wait()
    await transport.close()
    for _ in range(10):  # turns of the loop in which a second end would come
        await asyncio.sleep(0)
    assert not problems
