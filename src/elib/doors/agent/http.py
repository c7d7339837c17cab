"""The agent's server over HTTP, for programs of this computer: no page of a browser can use it."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Iterator

import uvicorn
from mcp.server.transport_security import TransportSecuritySettings
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from elib.doors.agent.pipes import MAX_LINE
from elib.doors.agent.server import AgentDoor
from elib.robot.running import ending

IDLE_TIME = 600.0
"""s without a request after which a session ends."""
MAX_SESSIONS, MAX_CONNECTIONS = 16, 64
PARTS_WAITING = 4
"""Parts of a request's body that wait for the application."""


class Departures:
    """Tells each request when its connection is closed, by the event ``elib.gone`` of its scope.

    Args:
        application: Answers the requests.
    """

    def __init__(self, application: ASGIApp) -> None:
        self._application = application

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._application(scope, receive, send)
            return
        gone = scope["elib.gone"] = asyncio.Event()
        parts: asyncio.Queue[Message] = asyncio.Queue(PARTS_WAITING)

        async def pump() -> None:
            while True:
                message = await receive()
                if message["type"] == "http.disconnect":
                    gone.set()
                    return
                await parts.put(message)

        async def next_part() -> Message:
            while parts.empty() and not gone.is_set():
                waiting = [asyncio.ensure_future(parts.get()), asyncio.ensure_future(gone.wait())]
                try:
                    await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
                    if waiting[0].done() and isinstance(message := waiting[0].result(), dict):
                        return message
                finally:
                    for each in waiting:
                        each.cancel()
            return {"type": "http.disconnect"} if parts.empty() else parts.get_nowait()

        pumping = asyncio.ensure_future(pump())
        try:
            await self._application(scope, next_part, send)
        finally:
            pumping.cancel()


class _Uvicorn(uvicorn.Server):
    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals to the program."""
        yield


async def serve_http(door: AgentDoor, sock: socket.socket) -> None:
    """Serve agents until a signal comes.

    A request that names an Origin comes from a page in a browser and is refused, and so is one for another host: a name
    of a stranger's that leads here.

    Args:
        door: The server.
        sock: A socket that is bound to a port of this computer.
    """
    port = sock.getsockname()[1]
    application = door.server.streamable_http_app(
        transport_security=TransportSecuritySettings(
            enable_dns_rebinding_protection=True,
            allowed_hosts=[f"127.0.0.1:{port}", f"localhost:{port}"],
            allowed_origins=[],
        ),
        max_request_body_size=MAX_LINE,
        session_idle_timeout=IDLE_TIME,
        max_sessions=MAX_SESSIONS,
    )
    config = uvicorn.Config(
        Departures(application),
        log_config=None,
        access_log=False,
        lifespan="on",
        limit_concurrency=MAX_CONNECTIONS,
        timeout_graceful_shutdown=1,
        ws="none",
    )
    server = _Uvicorn(config)
    stop = asyncio.Event()
    with ending(stop):
        serving = asyncio.ensure_future(server.serve([sock]))
        stopping = asyncio.ensure_future(stop.wait())
        try:
            sock.listen()  # a client that reads the address may connect at once, before the server has started
            print(f"http://127.0.0.1:{port}/mcp", flush=True)
            await asyncio.wait([serving, stopping], return_when=asyncio.FIRST_COMPLETED)
            server.should_exit = True
            await asyncio.wait([serving])
        finally:
            stopping.cancel()
            serving.cancel()
    serving.result()
