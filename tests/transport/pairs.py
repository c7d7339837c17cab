"""Connected pairs of every kind of transport that can run without a robot."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from elib.link.transport import Transport, parse_url
from elib.link.transport.memory import memory_pair
from elib.link.transport.pty import PtyTransport
from elib.link.transport.serial import SerialTransport, open_serial
from elib.link.transport.stream import StreamTransport
from elib.link.transport.tcp import open_tcp
from shared import until

Pair = tuple[Transport, Transport]


@asynccontextmanager
async def listening() -> AsyncIterator[tuple[str, "asyncio.Queue[StreamTransport]"]]:
    """Listen on a free port of the loopback; the queue gets who connected."""
    connected: asyncio.Queue[StreamTransport] = asyncio.Queue()

    class Peer(StreamTransport):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            super().connection_made(transport)
            connected.put_nowait(self)

    loop = asyncio.get_running_loop()
    server = await loop.create_server(lambda: Peer("tcp://peer"), "127.0.0.1", 0)
    try:
        yield f"tcp://127.0.0.1:{server.sockets[0].getsockname()[1]}", connected
    finally:
        server.close()


async def tcp_pair() -> Pair:
    async with listening() as (url, connected):
        transport = await open_tcp(parse_url(url))
        return transport, await connected.get()


class Port(PtyTransport):
    """A pty that vanishes only when all has arrived: the system throws away what is still on its way."""

    def __init__(self) -> None:
        super().__init__()
        self.on_its_way = 0
        self.other: SerialTransport | None = None

    async def connect(self) -> SerialTransport:
        self.other = await open_serial(parse_url(self.path))
        receive = self.other.data_received

        def count(data: bytes) -> None:
            self.on_its_way -= len(data)
            receive(data)

        self.other.data_received = count  # type: ignore[method-assign]
        return self.other

    async def write(self, data: bytes) -> None:
        self.on_its_way += len(data)
        await super().write(data)

    async def close(self) -> None:
        if self.other is not None:
            await until(lambda: not self.on_its_way or not self.other.is_open)
        await super().close()


async def serial_pair() -> Pair:
    peer = Port()
    return await peer.connect(), peer


async def in_memory_pair() -> Pair:
    return memory_pair()
