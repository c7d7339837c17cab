"""The web server on the program's own event loop: the files of the page, the login, one WebSocket for each page."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from importlib.resources import files
from urllib.parse import parse_qs

from aiohttp import WSCloseCode, WSMsgType, web

from elib.emulator.control import Control
from elib.emulator.loopback import bind
from elib.errors import LinkLost
from elib.robot.running import ending
from elib.web.access import Access, Bucket, is_same
from elib.web.listening import Address
from elib.web.messages import LONGEST
from elib.web.page import Page
from elib.web.panel import Panel
from elib.web.pictures import world_picture

VIEW_PORT = 8600
"""The first port of the view of a simulation to try where none is named; the next ones follow."""
MOST_CONNECTIONS, MOST_OF_ONE = 192, 96
"""Connections at a time, and those from one address: a page opens six and one more."""
REQUEST_TIME = 10.0
"""s that the first request of a connection, or the next one, may take to come."""
LONGEST_LINE = 4096
"""Bytes of the first line of a request, and of each header."""
LONGEST_FORM = 512
"""Bytes of a login form."""
FORM_TIME = 5.0
"""s that a login form may take to come."""
MOST_PAGES = 64
MESSAGES, MESSAGES_AT_ONCE = 100.0, 200.0
"""Messages of one page per second for long, and at once. A hand that drags sends 60 a second, one that drives 10."""
BYTES, BYTES_AT_ONCE = 64 * 1024.0, 256 * 1024.0
"""Bytes of the messages of one page, per second for long and at once."""
CLOSING_TIME = 2.0
"""s that the connections get to end when the server ends."""
HEARTBEAT = 20.0
"""s between two pings, which find pages that went away without a word."""

KINDS = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
HEADERS: Mapping[str, str] = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",  # with no-referrer the login form would come without its origin
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(), payment=(), usb=()",
}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self' ws://{host}; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
"""Scripts, styles and pictures come from this server; no other site may show the page in a frame."""


async def serve(
    address: Address,
    urls: Sequence[str],
    *,
    token: str | None = None,
    close_after: float | None = None,
    on_ready: Callable[[str], object] = print,
) -> None:
    """Serve the panel until Ctrl-C, SIGTERM or SIGHUP; then stop and disconnect every robot.

    Args:
        address: A bound port.
        urls: URLs of the robots that are in the panel from the beginning.
        token: What a browser is asked for before it sees anything; None asks for nothing.
        close_after: s without any open page, after the first one, until the panel ends by itself; None never ends it.
        on_ready: Called with the URL of the page when it can be opened.

    Raises:
        ArgumentError: A URL of a robot is wrong.
        LinkLost: At the end, a robot did not confirm that it stands.
    """
    panel = Panel(is_shared=token is not None)
    keys = [key for url in urls for key in panel.add_all(url, is_trusted=True)]
    stop = asyncio.Event()
    if close_after is not None:
        _end_when_empty(panel, close_after, stop)
    # Until all is over: a second Ctrl-C must not keep the robots from being stopped, which takes some seconds at most.
    with ending(stop):
        async with served(panel, address, token):
            try:
                for key in keys:
                    panel.connect(key)
                on_ready(address.url)
                await stop.wait()
            finally:
                moving = await panel.close()
    if moving:
        raise LinkLost(
            f"{', '.join(moving)} did not confirm that it stands: it may still be moving",
            hint="switch it off, or hold it",
        )


def _end_when_empty(panel: Panel, seconds: float, stop: asyncio.Event) -> None:
    """Set *stop* when no page was open for so many seconds after the first one."""
    loop = asyncio.get_running_loop()
    expiry: list[asyncio.TimerHandle] = []

    def visit() -> None:
        while expiry:
            expiry.pop().cancel()

    def leave() -> None:
        expiry.append(loop.call_later(seconds, stop.set))

    panel.on_visit, panel.on_empty = visit, leave


@contextlib.asynccontextmanager
async def view_of(control: Control, place: str = "") -> AsyncIterator[str]:
    """Serve the page of a simulation until the block is left.

    Args:
        control: Control of the simulation.
        place: ``HOST:PORT`` or ``PORT`` on this computer; empty for the first free port from :data:`VIEW_PORT` on,
            port 0 for any.

    Yields:
        The page's URL.

    Raises:
        ArgumentError: *place* is not an address, or other computers could reach it.
        LinkBusy: The port is taken, or all that were tried are.
        LinkDenied: This user may not use the port.
        SimulationError: There is no world to be seen.
    """
    control.snapshot()
    sock = bind(place, VIEW_PORT)
    address = Address(sock, sock.getsockname()[0], is_shared=False)
    panel = Panel(control=control)
    async with served(panel, address):
        try:
            yield address.url
        finally:
            await panel.close()


@contextlib.asynccontextmanager
async def served(panel: Panel, address: Address, token: str | None = None) -> AsyncIterator[Server]:
    """Serve the page until the block is left.

    Args:
        panel: The robots.
        address: A bound port.
        token: What a browser is asked for before it sees anything; None asks for nothing.
    """
    server = Server(panel, Access(address.host, address.port, token))
    runner = web.AppRunner(
        server.application(),
        access_log=None,
        keepalive_timeout=REQUEST_TIME,
        max_line_size=LONGEST_LINE,
        max_field_size=LONGEST_LINE,
        shutdown_timeout=CLOSING_TIME,
    )
    await runner.setup()
    make = runner.server
    assert make is not None
    gatekeepers = _Connections(make)
    listener = await asyncio.get_running_loop().create_server(gatekeepers.protocol, sock=address.socket)
    try:
        yield server
    finally:
        listener.close()
        await server.close()
        await runner.cleanup()
        gatekeepers.close()


class Server:
    """Answers the requests of browsers.

    Attributes:
        pages: How many pages are open.
    """

    def __init__(self, panel: Panel, access: Access) -> None:
        self._panel, self._access = panel, access
        self._files = _static_files()
        self._sockets: set[web.WebSocketResponse] = set()

    @property
    def pages(self) -> int:
        """The number of open pages."""
        return len(self._sockets)

    def application(self) -> web.Application:
        """Build the aiohttp application."""
        application = web.Application(middlewares=[self._guard], client_max_size=LONGEST_FORM)
        application.on_response_prepare.append(self._add_headers)
        application.router.add_get("/ws", self._socket)
        application.router.add_get("/worlds/{name}.png", self._picture)
        application.router.add_post("/login", self._login)
        application.router.add_get("/{path:.*}", self._file)
        return application

    async def close(self) -> None:
        """Close all pages."""
        closing = [ws.close(code=WSCloseCode.GOING_AWAY, message=b"the program has ended") for ws in self._sockets]
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(CLOSING_TIME):
                await asyncio.gather(*closing, return_exceptions=True)

    # -- before every request --

    @web.middleware
    async def _guard(self, request: web.Request, handler: Callable[[web.Request], object]) -> web.StreamResponse:
        refusal = self._refusal(request)
        if refusal is not None:
            return web.Response(status=refusal[0], text=refusal[1])
        if not self._access.is_let_in(request) and request.path not in ("/login", "/login.css"):
            return self._file_named("/login.html", status=401)
        try:
            return await handler(request)  # type: ignore[misc,no-any-return]
        except web.HTTPException as error:  # aiohttp's own, such as 404 and 405
            return web.Response(status=error.status, text=error.reason)

    def _refusal(self, request: web.Request) -> tuple[int, str] | None:
        """Return status and text for a request that nobody may make; None if it may go on."""
        if self._access.host_of(request) is None:
            return 403, "This page answers to its own address alone."
        if request.method not in ("GET", "HEAD", "POST"):
            return 405, "Pages can only be looked at."
        if not self._access.is_own(request):
            return 403, "Another site may not use this page."
        if request.method != "POST" and request.body_exists:
            return 400, "A request for a page has no body."
        return None

    async def _add_headers(self, request: web.Request, response: web.StreamResponse) -> None:
        host = self._access.host_of(request)
        response.headers.update(HEADERS)
        response.headers["Content-Security-Policy"] = POLICY.format(host=host or "invalid.invalid")
        response.headers.setdefault("Cache-Control", "no-store")
        response.headers.pop("Server", None)

    # -- requests --

    async def _file(self, request: web.Request) -> web.StreamResponse:
        path = "/index.html" if request.path == "/" else request.path
        if path not in self._files or path == "/login.html":
            return web.Response(status=404, text="There is no such page.")
        if request.headers.get("If-None-Match") == self._files[path][1]:
            return web.Response(status=304)
        return self._file_named(path)

    def _file_named(self, path: str, *, status: int = 200) -> web.Response:
        body, tag = self._files[path]
        kind = KINDS[path[path.rindex(".") :]]
        caching = {"Cache-Control": "no-cache", "ETag": tag} if status == 200 else {}
        return web.Response(status=status, body=body, content_type=kind, charset="utf-8", headers=caching)

    async def _picture(self, request: web.Request) -> web.StreamResponse:
        body = await world_picture(request.match_info["name"])
        if body is None:
            return web.Response(status=404, text="There is no such world.")
        return web.Response(body=body, content_type="image/png", headers={"Cache-Control": "max-age=3600"})

    async def _login(self, request: web.Request) -> web.StreamResponse:
        token, address = self._access.token, request.remote or ""
        if token is None:
            return web.Response(status=404, text="There is no such page.")
        if not self._access.may_try(address):
            return web.Response(status=429, text="Too many wrong tokens. Wait some seconds and try again.")
        try:
            async with asyncio.timeout(FORM_TIME):
                form = parse_qs((await request.read()).decode("ascii"), max_num_fields=4)
        except (ValueError, TimeoutError):
            return web.Response(status=400, text="That is not a login.")
        shown = form.get("token", [""])
        if len(shown) != 1 or not is_same(shown[0].strip(), token):
            return self._file_named("/login.html", status=401)
        response = web.Response(status=303, headers={"Location": "/"})
        response.set_cookie(self._access.cookie, self._access.session, path="/", httponly=True, samesite="Strict")
        return response

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        if "Origin" not in request.headers:  # browsers name it for every WebSocket
            return web.Response(status=403, text="Only the page itself may connect.")
        if len(self._sockets) >= MOST_PAGES:
            return web.Response(status=503, text=f"{MOST_PAGES} pages are open. Close some, and try again.")
        ws = web.WebSocketResponse(max_msg_size=LONGEST, compress=False, heartbeat=HEARTBEAT, timeout=CLOSING_TIME)
        if not ws.can_prepare(request):
            return web.Response(status=400, text="This address is for WebSockets.")
        await ws.prepare(request)
        self._sockets.add(ws)
        self._panel.page_opened()
        try:
            await self._converse(ws)
        finally:
            self._sockets.discard(ws)
            self._panel.page_closed(self.pages)
        return ws

    async def _converse(self, ws: web.WebSocketResponse) -> None:
        clock = asyncio.get_running_loop().time
        messages, amount = Bucket(MESSAGES, MESSAGES_AT_ONCE, clock), Bucket(BYTES, BYTES_AT_ONCE, clock)
        page = Page(self._panel, ws)
        try:
            async for message in ws:
                if message.type is not WSMsgType.TEXT:
                    await ws.close(code=WSCloseCode.UNSUPPORTED_DATA, message=b"only text is understood")
                elif not (messages.take() and amount.take(len(message.data))):
                    await ws.close(code=WSCloseCode.POLICY_VIOLATION, message=b"too many messages")
                elif not page.hear(message.data):
                    await ws.close(code=WSCloseCode.POLICY_VIOLATION, message=b"not a message of the page")
        finally:
            await page.close()


class _Connections:
    """Bounds the connections: how many there are, and how long each may wait for its first request.

    Args:
        make: Makes a protocol that serves requests.
    """

    def __init__(self, make: web.Server) -> None:
        self._make = make
        self._open: dict[asyncio.Transport, str] = {}

    def protocol(self) -> asyncio.Protocol:
        return _Newcomer(self)

    def admit(self, transport: asyncio.Transport) -> bool:
        """Count a new connection; return False if there are too many."""
        self._open = {each: address for each, address in self._open.items() if not each.is_closing()}
        address = str((transport.get_extra_info("peername") or ("",))[0])
        same = sum(each == address for each in self._open.values())
        if len(self._open) >= MOST_CONNECTIONS or same >= MOST_OF_ONE:
            return False
        self._open[transport] = address
        return True

    def serve(self) -> asyncio.Protocol:
        """Return what answers the requests of one connection."""
        return self._make()

    def close(self) -> None:
        for transport in self._open:
            transport.abort()


class _Newcomer(asyncio.Protocol):
    """A connection until its first request is complete; aiohttp itself would wait for ever."""

    def __init__(self, connections: _Connections) -> None:
        self._connections = connections
        self._buffer = bytearray()
        self._expiry: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        if not self._connections.admit(transport):
            transport.abort()
            return
        self._expiry = asyncio.get_running_loop().call_later(REQUEST_TIME, transport.abort)

    def data_received(self, data: bytes) -> None:
        self._buffer += data
        if len(self._buffer) > 4 * LONGEST_LINE:
            self._transport.abort()
        elif b"\r\n\r\n" in self._buffer:
            self._hand_over()

    def connection_lost(self, error: Exception | None) -> None:
        if self._expiry is not None:
            self._expiry.cancel()

    def _hand_over(self) -> None:
        assert self._expiry is not None
        self._expiry.cancel()
        protocol = self._connections.serve()
        self._transport.set_protocol(protocol)
        protocol.connection_made(self._transport)
        protocol.data_received(bytes(self._buffer))


def _static_files() -> dict[str, tuple[bytes, str]]:
    """Return every file that can be asked for with its tag, by its path; nothing else is ever read."""
    found = {}
    for file in files("elib.web").joinpath("static").iterdir():
        if file.name.endswith(tuple(KINDS)):
            body = file.read_bytes()
            found[f"/{file.name}"] = body, f'"{hashlib.sha256(body).hexdigest()[:16]}"'
    return found


__all__ = ["Server", "serve", "served", "view_of"]
