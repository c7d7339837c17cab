"""Simulated time for a server and its clients in one program.

A file whose tests run in it says ``LOOP = LocalLoop``. Its connections are pairs of local sockets instead of TCP: what
one end writes the other end can read at once, so time never jumps over what is on its way, however busy the machine is.
"""

from __future__ import annotations

import asyncio
import itertools
import socket
from collections.abc import Callable, Mapping

import pytest

from elib.base.timebase import SimulatedLoop
from elib.simulator.emulator.loopback import LOOPBACK


class LocalLoop(SimulatedLoop):
    """A loop in simulated time whose clients reach the servers that run on it, and nothing else."""

    def __init__(self) -> None:
        super().__init__()
        self._servers: dict[int, Callable[[], asyncio.BaseProtocol]] = {}
        self._clients = itertools.count(50_000)

    async def create_server(self, make, host=None, port=None, *, sock=None, **options):  # type: ignore[no-untyped-def]
        """Serve the port of a socket, on which no connection comes by itself."""
        self._servers[sock.getsockname()[1]] = make
        return Listener(self._servers, sock)

    async def create_connection(self, make, host=None, port=None, *, sock=None, **options):  # type: ignore[no-untyped-def]
        """Connect to a port that is served here."""
        return await super().create_connection(make, sock=sock or self.connected(port))

    def connected(self, port: int, *, unsent: int = 0) -> socket.socket:
        """Return the client's end of a new connection.

        Args:
            port: A port that is served here.
            unsent: Bytes that the system keeps of what the client has not read; as many as usual unless given.
        """
        if port not in self._servers:
            raise ConnectionRefusedError(f"nobody serves port {port}")
        ours, theirs = socket.socketpair()
        for each in (ours, theirs):
            each.setblocking(False)
        if unsent:
            theirs.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, unsent)
        where = {"peername": (LOOPBACK, next(self._clients))}
        self._make_socket_transport(theirs, self._servers[port](), extra=where)  # type: ignore[attr-defined]
        return ours


class Listener:
    """What serves one port."""

    def __init__(self, servers: dict[int, Callable[[], asyncio.BaseProtocol]], sock: socket.socket) -> None:
        self._servers, self._sock, self._port = servers, sock, sock.getsockname()[1]

    def close(self) -> None:
        """Take no more connections."""
        self._servers.pop(self._port, None)
        self._sock.close()


def pytest_asyncio_loop_factories(item: pytest.Item) -> Mapping[str, Callable[[], asyncio.AbstractEventLoop]]:
    """Run the tests of a file on the loop that it names."""
    loop = getattr(getattr(item, "module", None), "LOOP", asyncio.new_event_loop)
    return {"loop": loop}
