"""Pages and programs over WebSockets, by aiohttp."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from collections.abc import Callable
from typing import Generic, TypeVar

from aiohttp import WSCloseCode, WSMsgType, web

from elib.panel.server.conversation import MAX_MESSAGE, Caller
from elib.simulator.emulator.control_server import Bucket, time_factor

HEARTBEAT = 20.0
"""s between two pings, which find callers that went away without a word."""
CLOSING_TIME = 1.0
"""s that callers get to close when the server ends, and requests to be answered."""

C = TypeVar("C", bound=Caller)


class Socket:
    """A WebSocket that carries the messages of one caller.

    Attributes:
        transport: The connection below it.
    """

    def __init__(self, request: web.BaseRequest, ws: web.WebSocketResponse) -> None:
        assert isinstance(request.transport, asyncio.Transport)
        self.address = request.remote or ""  # where the caller is
        self.transport, self._ws = request.transport, ws

    @property
    def unread(self) -> int:
        """Bytes that the caller has not taken yet of what it was sent."""
        return self.transport.get_write_buffer_size()

    async def send(self, data: bytes, *, is_text: bool) -> None:
        """Send a message, and wait for nothing; a caller that is gone gets none."""
        if not self._ws.closed:
            with contextlib.suppress(ConnectionError):
                await self._ws.send_frame(data, WSMsgType.TEXT if is_text else WSMsgType.BINARY)

    async def close(self, code: int, reason: str) -> None:
        """End it."""
        await self._ws.close(code=code, message=reason.encode())

    async def converse(self, caller: Caller, messages: Bucket) -> tuple[WSCloseCode, str]:
        """Hear the caller until it leaves, breaks a rule or sends too much; return why it is heard no longer."""
        async for message in self._ws:
            if not messages.take():
                return WSCloseCode.POLICY_VIOLATION, "too many messages"
            if message.type is WSMsgType.PING:
                await self._ws.pong(message.data)
            elif message.type is WSMsgType.BINARY:
                return WSCloseCode.UNSUPPORTED_DATA, "only text is understood"
            elif message.type is WSMsgType.TEXT and (reason := await caller.hear(message.data)):
                return WSCloseCode.POLICY_VIOLATION, reason
            await asyncio.sleep(0)  # answers leave before the next message is heard
        return WSCloseCode.OK, ""


def web_socket() -> web.WebSocketResponse:
    """Return the answer to a request for a WebSocket. Nothing waits for a caller that does not read."""
    return web.WebSocketResponse(
        max_msg_size=MAX_MESSAGE,
        compress=False,
        autoping=False,  # so that pings count like messages
        heartbeat=HEARTBEAT * time_factor(),
        timeout=CLOSING_TIME * time_factor(),
        writer_limit=sys.maxsize,
    )


class Callers(Generic[C]):
    """The callers of one kind, whose number is bounded."""

    def __init__(
        self,
        make: Callable[[Socket], C],
        most: int,
        full: str,
        pace: tuple[float, float],
    ) -> None:
        self.open: dict[web.WebSocketResponse, C] = {}  # those that are connected, by their WebSockets
        self.on_visit: Callable[[], object] = lambda: None  # called when one comes
        self.on_empty: Callable[[], object] = lambda: None  # called when the last one has left
        self._make, self._most, self._full, self._pace = make, most, full, pace
        self._sockets: set[web.WebSocketResponse] = set()

    async def answer(self, request: web.Request) -> web.StreamResponse:
        """Hear one caller until it leaves, or until it breaks a rule."""
        if len(self._sockets) >= self._most:
            return web.Response(status=503, text=self._full)
        ws = web_socket()
        if not ws.can_prepare(request):
            return web.Response(status=400, text="This address is for WebSockets.")
        self._sockets.add(ws)
        try:
            await ws.prepare(request)
            self.on_visit()
            socket = Socket(request, ws)
            caller = self.open[ws] = self._make(socket)
            try:
                code, reason = await socket.converse(caller, Bucket(*self._pace))
            finally:
                await caller.close()  # before it is told, which may take its time
            await ws.close(code=code, message=reason.encode())
        finally:
            self._sockets.discard(ws)
            self.open.pop(ws, None)
            if not self._sockets:
                self.on_empty()
        return ws

    async def close(self, reason: str) -> None:
        """Answer what they wait for, and end them, because the server ends; each gets a moment for it."""
        await asyncio.gather(*(caller.close() for caller in self.open.values()))
        closing = [ws.close(code=WSCloseCode.GOING_AWAY, message=reason.encode()) for ws in self._sockets]
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(CLOSING_TIME * time_factor()):
                await asyncio.gather(*closing, return_exceptions=True)
