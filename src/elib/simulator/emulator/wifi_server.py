"""The TCP port of a served robot with Wi-Fi: as the ESP32, it accepts the next client when the last one has left."""

from __future__ import annotations

import asyncio
import socket
import sys

from elib.base.errors import ArgumentError
from elib.link.transport.stream import StreamTransport
from elib.simulator.emulator.loopback import LOOPBACK, bound, named
from elib.simulator.emulator.tcp_client import is_request, notice_absence
from elib.simulator.emulator.wifi import SEND_BUFFER
from elib.simulator.emulator.wifi_link import WifiLink

BACKLOG = 0 if sys.platform == "linux" else 1
"""For one client that waits, as on the robot (wire-protocol.md, 4.1); Linux lets one more wait than it is told."""


class WifiPort:
    """The port of one robot, which is closed while its link is down.

    Args:
        link: The robot's link.
        host: Address on this computer to listen at.
        port: Port, 0 for any free one.

    Raises:
        ArgumentError: There is no such host.
        LinkBusy: The port is taken.
        LinkDenied: This user may not use the port.
        LinkError: The system does not give the port.
    """

    def __init__(self, link: WifiLink, host: str, port: int) -> None:
        self._link = link
        self._host, self._port = host, port
        self._client: _Client | None = None
        self._socket: socket.socket | None = None
        self._serving: asyncio.Task[None] | None = None
        self.url = ""  # what opens it
        self._open()
        link.on_down = self.close
        link.on_up = self._open

    def close(self) -> None:
        """Listen no more, and drop the client."""
        if self._serving is not None:
            self._serving.cancel()
            self._serving = None
        if self._socket is not None:
            self._socket.close()
            self._socket = None
        if self._client is not None:
            self._client.abort()
            self._client = None

    def _open(self) -> None:
        try:
            address = socket.gethostbyname(self._host) if ":" not in self._host else self._host
        except socket.gaierror as error:
            raise ArgumentError(
                f"there is no host {self._host!r} ({error.strerror})", hint=f"try {LOOPBACK}"
            ) from error
        listener = bound(address, self._port)
        listener.listen(BACKLOG)
        listener.setblocking(False)  # the socket's own argument
        self._socket = listener
        self._port = listener.getsockname()[1]  # the same one after an outage
        self.url = f"wifi://{named(listener)}"
        self._serving = asyncio.get_running_loop().create_task(self._serve(listener))

    async def _serve(self, listener: socket.socket) -> None:
        """Serve one client after the other."""
        loop = asyncio.get_running_loop()
        while True:
            connection, _ = await loop.sock_accept(listener)
            # Little waits in this computer on its way to a slow client: it waits in the robot's own buffer.
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
            client = self._client = _Client(self._link)
            try:
                await loop.connect_accepted_socket(lambda client=client: client, connection)  # type: ignore[misc]
            except OSError:  # it has left already
                connection.close()
                continue
            await client.wait_until_left()
            self._client = None


class _Client(StreamTransport):
    """A client's connection. One that brings a web page's request is dropped; the robot does not see it."""

    def __init__(self, link: WifiLink) -> None:
        super().__init__("wifi://client", origin="simulator")
        self._link = link
        self._held: bytes | None = b""

    async def wait_until_left(self) -> None:
        """Return when the connection is closed."""
        await asyncio.wait({self._gone})

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        connection = transport.get_extra_info("socket")
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        notice_absence(connection)
        self._link.attach(self)

    def data_received(self, data: bytes) -> None:
        if self._held is not None:
            self._held += data
            verdict = is_request(self._held)
            if verdict:
                self._link.detach(reset=True)
                self.abort()
            if verdict is not False:
                return
            data, self._held = self._held, None
        super().data_received(data)

    def eof_received(self) -> bool:
        """Let a client that sends no more go on reading."""
        if self._held and not self._closed:
            super().data_received(self._held)
            self._held = None
        if self._link.serves(self):
            self._link.end_of_input()
        return True

    def connection_lost(self, exc: Exception | None) -> None:
        if self._link.serves(self):
            self._link.detach(reset=exc is not None)
        super().connection_lost(exc)
