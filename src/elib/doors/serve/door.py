"""The door: the address ``/v1`` of the panel's server, to which programs connect by WebSocket."""

from __future__ import annotations

import asyncio
import contextlib
import re
import socket
from collections.abc import AsyncIterator, Callable, Sequence

from aiohttp import WSCloseCode, web

from elib.base.errors import ArgumentError
from elib.doors.robots import connected, hold_open
from elib.doors.serve.answers import PROTOCOL
from elib.doors.serve.client import Client
from elib.doors.serve.messages import decode
from elib.panel.server.access import Access
from elib.panel.server.conversation import close_all, web_socket
from elib.panel.server.http import Server
from elib.panel.server.listening import Address
from elib.simulator.emulator.control_server import Bucket, time_factor

PATH = f"/v{PROTOCOL}"
MAX_PROGRAMS = 32
MESSAGES, MESSAGES_AT_ONCE = 1000.0, 2000.0
"""Messages of one program per second for long, and at once. One that waits for its answers sends fewer, because answers
beyond 500 a second wait."""
HELLO_TIME = 5.0
"""s that a program may take to show the token."""
UNSENT = 64 * 1024
"""Bytes that the system keeps of what a program has not read yet: old readings for a second or two, not for minutes."""
ORIGIN = re.compile(r"https?://(\[[0-9a-f:.]+\]|[a-z0-9._-]+)(:[0-9]{1,5})?", re.IGNORECASE)


class ProgramDoor:
    """The address for programs.

    Args:
        origins: Sites whose pages may connect, such as ``https://example.org``; ``null`` for pages from files.

    Attributes:
        path: The path of its address.

    Raises:
        ArgumentError: An origin is not one.
    """

    def __init__(self, origins: Sequence[str] = ()) -> None:
        self.path = PATH
        for each in origins:
            if each != "null" and not ORIGIN.fullmatch(each):
                raise ArgumentError(
                    f"{each!r} is not the origin of a page", hint="like http://localhost:3000, without a path; or null"
                )
        self._origins = frozenset(each.lower() for each in origins)
        self._clients: dict[web.WebSocketResponse, Client] = {}

    @property
    def programs(self) -> int:
        """The number of programs that are connected."""
        return len(self._clients)

    def refusal(self, request: web.Request, access: Access) -> tuple[int, str] | None:
        """Return status and text for a request that is refused; None if it may go on.

        Browsers name the site of a page that connects; programs name none.
        """
        origins = [each.lower() for each in request.headers.getall("Origin", [])]
        if origins and not (len(origins) == 1 and origins[0] in self._origins) and not access.is_own(request):
            return 403, "Pages of this site may not connect. elib serve --allow-origin URL lets them."
        if request.query_string:
            return 400, "This address takes no parameters. The token comes in the first message."
        return None

    async def answer(self, request: web.Request, server: Server) -> web.StreamResponse:
        """Hear one program until it leaves, or until it breaks a rule."""
        if server.is_ending:
            return web.Response(status=503, text="The program ends.")
        if len(self._clients) >= MAX_PROGRAMS:
            return web.Response(status=503, text=f"{MAX_PROGRAMS} programs are connected, and no more can be.")
        ws = web_socket()
        if not ws.can_prepare(request):
            return web.Response(status=400, text="This address is for WebSockets.")
        client = Client(server, request, ws, decode)
        self._clients[ws] = client
        try:
            _keep_little(request)
            await ws.prepare(request)
            server.panel.on_visit()
            code, reason = await self._converse(ws, client)
            await client.close()  # before the program is told, which may take its time
            await ws.close(code=code, message=reason.encode())
        finally:
            del self._clients[ws]
            await client.close()
        return ws

    async def _converse(self, ws: web.WebSocketResponse, client: Client) -> tuple[WSCloseCode, str]:
        """Hear a program; return why it is heard no longer."""
        late = asyncio.get_running_loop().call_later(HELLO_TIME * time_factor(), _end_stranger, client, ws)
        if client.is_let_in:
            client.meet()
        try:
            return await client.converse(Bucket(MESSAGES, MESSAGES_AT_ONCE))
        finally:
            late.cancel()

    async def close(self) -> None:
        """Answer what programs wait for, and end their connections."""
        await asyncio.gather(*(client.close() for client in self._clients.values()))
        await close_all(list(self._clients), "elib serve has ended")


def _keep_little(request: web.Request) -> None:
    """Let little wait for a program that does not read; after some seconds the server then ends the connection."""
    transport = request.transport
    assert isinstance(transport, asyncio.Transport)
    transport.set_write_buffer_limits(high=0)
    sock = transport.get_extra_info("socket")
    if sock is not None:
        with contextlib.suppress(OSError):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, UNSENT)


def _end_stranger(client: Client, ws: web.WebSocketResponse) -> None:
    if not client.is_let_in:
        task = asyncio.ensure_future(ws.close(code=WSCloseCode.POLICY_VIOLATION, message=b"no token came"))
        task.add_done_callback(lambda ended: ended.cancelled() or ended.exception())


async def serve(
    address: Address,
    urls: Sequence[str],
    *,
    token: str | None = None,
    origins: Sequence[str] = (),
    on_ready: Callable[[str, str], object] = print,
) -> None:
    """Serve robots to programs, and the panel's page to a person, until Ctrl-C, SIGTERM or SIGHUP; then stop them.

    Args:
        address: A bound port.
        urls: URLs of the robots.
        token: What programs and browsers must show; None asks for nothing.
        origins: Sites whose pages may connect.
        on_ready: Called with the address for programs and the one of the page, when all robots are connected.

    Raises:
        ArgumentError: A URL is wrong.
        ElibError: A robot could not be connected.
        LinkLost: At the end, a robot did not confirm that it stands.
    """
    door = ProgramDoor(origins)

    @contextlib.asynccontextmanager
    async def opened() -> AsyncIterator[None]:
        async with connected(urls, page=address, token=token, door=door):
            on_ready(address.url.replace("http:", "ws:", 1).rstrip("/") + PATH, address.url)
            yield

    await hold_open(opened())
