"""The door: the address ``/v1`` of the panel's server, to which programs connect by WebSocket."""

from __future__ import annotations

import asyncio
import contextlib
import re
import socket
from collections.abc import AsyncIterator, Callable, Sequence

from aiohttp import web

from elib.base.errors import ArgumentError
from elib.doors.robots import connected, hold_open
from elib.doors.serve.answers import PROTOCOL
from elib.doors.serve.client import Client
from elib.doors.serve.messages import decode
from elib.panel.server.access import Access
from elib.panel.server.http import Server
from elib.panel.server.listening import Address
from elib.panel.server.sockets import Callers, Socket

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
    """The address for programs."""

    def __init__(self, origins: Sequence[str] = ()) -> None:
        self.path = PATH  # the path of its address
        for each in origins:
            if each != "null" and not ORIGIN.fullmatch(each):
                raise ArgumentError(
                    f"{each!r} is not the origin of a page", hint="like http://localhost:3000, without a path; or null"
                )
        self._origins = frozenset(each.lower() for each in origins)
        full = f"{MAX_PROGRAMS} programs are connected, and no more can be."
        self._callers = Callers(self._client, MAX_PROGRAMS, full, (MESSAGES, MESSAGES_AT_ONCE))
        self._server: Server | None = None

    def _client(self, connection: Socket) -> Client:
        assert self._server is not None
        _keep_little(connection.transport)
        return Client(self._server.panel, decode, connection, self._server.access, HELLO_TIME)

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
        if server.panel.is_ending:
            return web.Response(status=503, text="The program ends.")
        self._server = server
        self._callers.on_visit = server.panel.on_visit
        return await self._callers.answer(request)

    async def close(self) -> None:
        """Answer what programs wait for, and end their connections."""
        await self._callers.close("elib serve has ended")


def _keep_little(transport: asyncio.Transport) -> None:
    """Let little wait for a program that does not read; after some seconds the server then ends the connection."""
    transport.set_write_buffer_limits(high=0)
    sock = transport.get_extra_info("socket")
    if sock is not None:
        with contextlib.suppress(OSError):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, UNSENT)


async def serve(
    address: Address,
    urls: Sequence[str],
    *,
    token: str | None = None,
    origins: Sequence[str] = (),
    on_ready: Callable[[str, str], object] = print,
) -> None:
    """Serve robots to programs, and the panel's page to a person, until Ctrl-C, SIGTERM or SIGHUP; then stop them.

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
