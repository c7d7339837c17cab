"""The server below the panel: uvicorn, with bounds on how many connections there are, how slow and how full."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import weakref
from collections.abc import AsyncIterator, Iterator

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import Frame

from elib.joystick.access import Application, Bucket
from elib.joystick.packets import LONGEST

MOST, MOST_OF_ONE = 192, 96
"""Connections at a time, and those from one address: a page opens six and one more."""
REQUEST_TIME = 10.0
"""s that a request may take to come."""
LONGEST_HEAD = 16 * 1024
"""Bytes of a request without its body."""
BYTES, BYTES_AT_ONCE = 64 * 1024.0, 256 * 1024.0
"""What one WebSocket may send, bytes a second for long and at once: a hand that drags sends a fifth."""
MOST_FRAGMENTS = 64
"""Frames of one message; browsers send one."""
LONGEST_BYTES = 4 * LONGEST
"""Bytes of a message: the longest, all of characters of four bytes."""
CLOSING_TIME = 2
"""s that the connections of browsers get to end."""


_TRANSPORTS: weakref.WeakSet[asyncio.Transport] = weakref.WeakSet()
"""The connections of this process's one server; those that became WebSockets too."""


class BoundedHttp(H11Protocol):
    """A connection for requests.

    Attributes:
        patience: s that a request may take to come.
    """

    patience = REQUEST_TIME
    _waiting: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as uvicorn has it
        """Take a connection, unless there are too many."""
        super().connection_made(transport)
        _TRANSPORTS.add(transport)
        address = self.client[0] if self.client else ""
        same = [each for each in self.connections if (getattr(each, "client", None) or ("",))[0] == address]
        if len(self.connections) > MOST or len(same) > MOST_OF_ONE:
            transport.abort()
        else:
            self._arm()

    def connection_lost(self, exc: Exception | None) -> None:
        """Note the end."""
        super().connection_lost(exc)
        self._disarm()

    def data_received(self, data: bytes) -> None:
        """Take what came; what can be no request ends the connection."""
        try:
            super().data_received(data)
        except (h11.ProtocolError, UnicodeError):
            self.transport.abort()
        is_coming = self.conn.their_state is h11.SEND_BODY or bool(self.conn.trailing_data[0])
        if self in self.connections and is_coming:
            self._arm()
        else:
            self._disarm()

    def _arm(self) -> None:
        if self._waiting is None:
            self._waiting = self.loop.call_later(self.patience, self.transport.abort)

    def _disarm(self) -> None:
        if self._waiting is not None:
            self._waiting.cancel()
            self._waiting = None


class BoundedWebSocket(WebSocketsSansIOProtocol):
    """A WebSocket on which also counts what is no message: pings, and frames with nothing in them."""

    _bytes: Bucket | None = None

    def data_received(self, data: bytes) -> None:
        """Take what came, unless it is too much."""
        if self._bytes is None:
            self._bytes = Bucket(BYTES, BYTES_AT_ONCE, self.loop.time)
        if self._bytes.take(len(data)):
            super().data_received(data)
        else:
            self.transport.abort()

    def handle_cont(self, event: Frame) -> None:
        """Take a part of a message, unless there are too many."""
        if len(self.frames) < MOST_FRAGMENTS:
            super().handle_cont(event)
        else:
            self.transport.abort()

    def send_receive_event_to_app(self) -> None:
        """Pass a message on; text that is none ends the connection."""
        try:
            if self.curr_msg_data_type == "text":
                b"".join(self.frames).decode()
        except UnicodeDecodeError:
            self.frames = []
            self.transport.abort()
        else:
            super().send_receive_event_to_app()


class Server(uvicorn.Server):
    """It leaves the signals to its caller, whose robots come first."""

    def __init__(self, application: Application) -> None:
        config = uvicorn.Config(
            application,
            http=BoundedHttp,
            ws=BoundedWebSocket,
            ws_max_size=LONGEST_BYTES,
            ws_per_message_deflate=False,
            h11_max_incomplete_event_size=LONGEST_HEAD,
            limit_concurrency=MOST,
            timeout_graceful_shutdown=CLOSING_TIME,
            log_config=None,
            log_level="error",
            access_log=False,
            proxy_headers=False,
            server_header=False,
            lifespan="on",
        )
        super().__init__(config)
        self.is_up, self._is_over = asyncio.Event(), asyncio.Event()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to listen."""
        await super().startup(sockets)
        self.is_up.set()

    async def main_loop(self) -> None:
        """Wait for the end, and keep the date meanwhile."""
        while not await self.on_tick(0):
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._is_over.wait(), 1)

    def leave(self) -> None:
        """End soon."""
        self.should_exit = True
        self._is_over.set()

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Capture none."""
        yield


@contextlib.asynccontextmanager
async def served(application: Application, sock: socket.socket) -> AsyncIterator[Server]:
    """Serve until the block is left.

    Args:
        application: What answers.
        sock: Bound, and not listening yet.
    """
    server = Server(application)
    task = asyncio.create_task(server.serve([sock]), name="elib joystick server")
    rising = asyncio.create_task(server.is_up.wait(), name="elib joystick rises")
    try:
        await asyncio.wait((task, rising), return_when=asyncio.FIRST_COMPLETED)
        if task.done():
            await task
        yield server
    finally:
        rising.cancel()
        server.leave()
        try:
            await task
        finally:
            sock.close()
            for transport in tuple(_TRANSPORTS):  # those that were still being written to when their time was over
                transport.abort()
            await asyncio.sleep(0)
