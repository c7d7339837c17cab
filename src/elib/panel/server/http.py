"""The web server on the program's own event loop: the files of the page, the login, one WebSocket for each page."""

from __future__ import annotations

import asyncio
import contextlib
import gzip
import hashlib
import logging
import re
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Protocol
from urllib.parse import parse_qs

from aiohttp import web

from elib.base.extras import page_folder
from elib.panel.panel import Panel, check_standing
from elib.panel.server.access import Access, is_same
from elib.panel.server.listening import Address
from elib.panel.server.messages import decode
from elib.panel.server.page import Page
from elib.panel.server.pictures import world_picture
from elib.panel.server.sockets import CLOSING_TIME, Callers
from elib.robot.running import ending
from elib.simulator.emulator.control_server import Bucket, time_factor
from elib.simulator.emulator.loopback import bind

VIEW_PORT = 8600
"""The first port of the view of a simulation to try where none is named; the next ones follow."""
MAX_CONNECTIONS, MAX_OF_ONE = 192, 96
"""Connections at a time, and those from one address: a page opens six and one more."""
REQUEST_TIME = 10.0
"""s that the first request of a connection, or the next one, may take to come."""
READING_TIME = 10.0
"""s that a browser may leave unread what was sent to it, beyond what the buffers hold."""
MAX_LINE = 4096
"""Bytes of the first line of a request."""
MAX_HEADER = 16 * 1024
"""Bytes of a header: all programs on the ports of this computer set their cookies for the same name."""
MAX_FORM = 512
"""Bytes of a login form."""
FORM_TIME = 5.0
"""s that a login form may take to come."""
MAX_PAGES = 64
MAX_OF_STUDENT = 4
"""Pages of one student of a class at a time: one student cannot keep the others and the teacher out."""
OF_STUDENT = 7
"""Connections that each student of a class adds: a whole class opens its pages at the same moment."""
MESSAGES, MESSAGES_AT_ONCE = 100.0, 200.0
"""Messages of one page per second for long, and at once. A hand that drags sends 60 a second, one that drives 10."""
BYTES, BYTES_AT_ONCE = 64 * 1024.0, 256 * 1024.0
"""Bytes that one connection may send, per second for long and at once: a hand that drags sends a fifth of that."""

KINDS = {
    ".html": "text/html",
    ".js": "text/javascript",
    ".css": "text/css",
    ".svg": "image/svg+xml",
    ".txt": "text/plain",
    ".woff2": "font/woff2",
}
HASHED = re.compile(r"-[A-Z0-9]{8}\.\w+")
"""The end of a name that changes with the content of its file, as esbuild gives it."""
HEADERS: Mapping[str, str] = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",  # with no-referrer the login form would come without its origin
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(), payment=(), usb=()",
}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "font-src 'self'; connect-src 'self' ws://{host}; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
"""Scripts, styles, fonts and pictures come from this server; no other site may show the page in a frame."""
NO_STUDENTS: Mapping[str, Panel] = {}
NO_STUDENT = "There is no student with this number."
NOTE = b"<!-- note -->"
"""Stands in the login page where it says why it is shown again."""


class Door(Protocol):
    """One more address of the server, for programs: it checks itself from which site a request comes, and the token."""

    path: str  # the path of its address

    def refusal(self, request: web.Request, access: Access) -> tuple[int, str] | None:
        """Return status and text for a request that is refused; None if it may go on."""

    async def answer(self, request: web.Request, server: Server) -> web.StreamResponse:
        """Answer a request."""

    async def close(self) -> None:
        """End all connections, because the server ends."""


log = logging.getLogger("elib.panel")
SILENT = logging.Logger("elib.panel.http", logging.CRITICAL + 1)
"""Drops what aiohttp says of damaged requests: strangers send them, and should not be able to fill the terminal."""


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
            for key in keys:
                panel.connect(key)
            on_ready(address.url)
            await stop.wait()


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


def own_address(place: str) -> Address:
    """Take a port that this computer alone reaches: ``HOST:PORT``, ``PORT``, or "" for the first free one."""
    sock = bind(place, VIEW_PORT)
    return Address(sock, sock.getsockname()[0], is_shared=False)


@contextlib.asynccontextmanager
async def served(
    panel: Panel,
    address: Address,
    token: str | None = None,
    door: Door | None = None,
    students: Mapping[str, Panel] = NO_STUDENTS,
) -> AsyncIterator[Server]:
    """Serve the pages of a panel until the block is left; then stop and disconnect every robot.

    Args:
        panel: The panel.
        address: Its port, which is closed at the end.
        token: What a browser is asked for before it sees anything; None asks for nothing.
        door: One more address for programs.
        students: What the students of a class see without the token, each at ``/student/KEY``.

    Raises:
        SimulationError: There is no world to be seen.
        LinkLost: At the end, a robot did not confirm that it stands.
    """
    with contextlib.closing(address.socket):
        for control in panel.worlds.values():
            control.snapshot()
        server = Server(panel, address, token, door, students)
        runner = web.AppRunner(server.application(), shutdown_timeout=CLOSING_TIME)
        await runner.setup()
        assert runner.server is not None
        connections: dict[_Connection, str] = {}
        connect = partial(_Connection, runner.server, connections, OF_STUDENT * len(students))
        listener = await asyncio.get_running_loop().create_server(connect, sock=address.socket)
        try:
            yield server
        finally:
            for each in (panel, *students.values()):
                each.is_ending = True  # before the robots are stopped: no page drives them again
            moving = await panel.close()
            listener.close()
            await server.close()
            for connection in tuple(connections):
                connection.abort()
            await runner.cleanup()
    check_standing(moving)


class Server:
    """Answers the requests of browsers.

    Its arguments are those of :func:`served`.

    Attributes:
        panel: The robots.
        access: Who may use the page.
        url: The URL of the page.
    """

    def __init__(
        self, panel: Panel, address: Address, token: str | None, door: Door | None, students: Mapping[str, Panel]
    ) -> None:
        self.panel, self._door = panel, door
        self.access, self.url = Access(address.host, address.port, token), address.url
        self._files = _static_files()
        self._pages = self._callers(panel, MAX_PAGES)
        self._students = {key: self._callers(each, MAX_OF_STUDENT) for key, each in students.items()}
        # What is called may change as long as the panel lives.
        self._pages.on_visit, self._pages.on_empty = lambda: panel.on_visit(), lambda: panel.on_empty()

    @property
    def pages(self) -> int:
        """The number of open pages."""
        return len(self._pages.open)

    def application(self) -> web.Application:
        """Build the aiohttp application."""
        application = web.Application(middlewares=[self._guard], client_max_size=MAX_FORM)
        application.on_response_prepare.append(self._add_headers)
        application.router.add_get("/ws", self._socket)
        application.router.add_get("/student/{key}", self._student)
        application.router.add_get("/student/{key}/ws", self._socket)
        if self._door is not None:
            application.router.add_get(self._door.path, partial(self._door.answer, server=self), allow_head=False)
        application.router.add_get("/worlds/{name}.png", self._picture)
        application.router.add_post("/login", self._login)
        application.router.add_get("/{path:.*}", self._file)
        return application

    async def close(self) -> None:
        """Close all pages, and the door."""
        if self._door is not None:
            await self._door.close()
        all_pages = self._pages, *self._students.values()
        await asyncio.gather(*(pages.close("the program has ended") for pages in all_pages))

    # -- before every request --

    @web.middleware
    async def _guard(self, request: web.Request, handler: Callable[[web.Request], object]) -> web.StreamResponse:
        refusal = self._refusal(request)
        if refusal is not None:
            return web.Response(status=refusal[0], text=refusal[1])
        is_open = request.path in ("/login", "/login.css") or self._is_for_door(request) or self._is_of_student(request)
        if not is_open and not self.access.is_let_in(request):
            return self._login_page(401)
        try:
            return await handler(request)  # type: ignore[misc,no-any-return]
        except web.HTTPException as error:  # aiohttp's own, such as 404 and 405
            return web.Response(status=error.status, text=error.reason)
        except ConnectionError:  # the browser is gone
            raise
        except Exception as error:
            log.error("a request failed", exc_info=error)
            return web.Response(status=500, text="The program made a mistake. Its terminal says more.")

    def _refusal(self, request: web.Request) -> tuple[int, str] | None:
        """Return status and text for a request that is refused; None if it may go on."""
        if self.access.host_of(request) is None:
            return 403, "This page answers to its own address alone."
        try:
            "".join((request.raw_path, *request.headers.values())).encode()
        except UnicodeEncodeError:  # answers that repeat such bytes cannot be written
            return 400, "That request holds bytes that are not text."
        if not request.raw_path.startswith("/"):  # a request to a proxy
            return 400, "That is not the address of a page."
        if request.method not in ("GET", "HEAD", "POST"):
            return 405, "Pages can only be looked at."
        if self._door is not None and self._is_for_door(request):
            if (refusal := self._door.refusal(request, self.access)) is not None:
                return refusal
        elif not self.access.is_own(request):
            return 403, "Another site may not use this page."
        if request.method != "POST" and request.body_exists:
            return 400, "A request for a page has no body."
        return None

    def _is_for_door(self, request: web.Request) -> bool:
        return self._door is not None and request.path == self._door.path

    def _is_of_student(self, request: web.Request) -> bool:
        """Return whether a student may ask for it: his page, and the files that all pages load."""
        is_part = request.path in self._files and request.path != "/index.html"
        return bool(self._students) and (is_part or request.path.startswith("/student/"))

    async def _add_headers(self, request: web.Request, response: web.StreamResponse) -> None:
        host = self.access.host_of(request)
        response.headers.update(HEADERS)
        response.headers["Content-Security-Policy"] = POLICY.format(host=host or "invalid.invalid")
        response.headers.setdefault("Cache-Control", "no-store")
        response.headers.pop("Server", None)

    # -- requests --

    async def _file(self, request: web.Request) -> web.StreamResponse:
        path = "/index.html" if request.path == "/" else request.path
        if path == "/login" and self.access.token is not None:
            return self._login_page(200)
        if path not in self._files or path == "/login.html":
            return web.Response(status=404, text="There is no such page.")
        return self._send(request, path)

    async def _student(self, request: web.Request) -> web.StreamResponse:
        if request.match_info["key"] not in self._students:
            return web.Response(status=404, text=NO_STUDENT)
        return self._send(request, "/index.html")

    def _send(self, request: web.Request, path: str) -> web.Response:
        file = self._files[path]
        is_packed = file.packed is not None and _takes_gzip(request)
        tag = f'"{file.digest}{"-gzip" * is_packed}"'
        headers = {"Cache-Control": file.caching, "ETag": tag, "Vary": "Accept-Encoding"}
        if request.headers.get("If-None-Match") == tag:
            return web.Response(status=304, headers=headers)
        if is_packed:
            headers["Content-Encoding"] = "gzip"
        headers["Content-Type"] = file.kind
        return web.Response(body=file.packed if is_packed else file.body, headers=headers)

    def _login_page(self, status: int, note: str = "") -> web.Response:
        body = self._files["/login.html"].body.replace(NOTE, note.encode())
        return web.Response(status=status, body=body, content_type="text/html", charset="utf-8")

    async def _picture(self, request: web.Request) -> web.StreamResponse:
        body = await world_picture(request.match_info["name"], is_dark=request.query_string == "dark")
        if body is None:
            return web.Response(status=404, text="There is no such world.")
        return web.Response(body=body, content_type="image/png", headers={"Cache-Control": "max-age=3600"})

    async def _login(self, request: web.Request) -> web.StreamResponse:
        token, address = self.access.token, request.remote or ""
        if token is None:
            return web.Response(status=404, text="There is no such page.")
        if not self.access.may_try(address):
            return self._login_page(429, "Too many wrong tokens. Wait ten seconds, then try again.")
        try:
            async with asyncio.timeout(FORM_TIME * time_factor()):
                form = parse_qs((await request.read()).decode("ascii"), max_num_fields=4)
        except (ValueError, TimeoutError):
            return web.Response(status=400, text="That is not a login.")
        shown = form.get("token", [""])
        if len(shown) != 1 or not is_same(shown[0].strip(), token):
            return self._login_page(403, "That is not the token.")
        response = web.Response(status=303, headers={"Location": "/"})
        response.set_cookie(self.access.cookie, self.access.session, path="/", httponly=True, samesite="Strict")
        return response

    def _callers(self, panel: Panel, most: int) -> Callers[Page]:
        """Return the pages of a panel, of which there are none yet."""
        full = f"{most} pages are open. Close some, and try again."
        return Callers(partial(Page, panel, decode), most, full, (MESSAGES, MESSAGES_AT_ONCE))

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        # Browsers name it for every WebSocket, and not when the page asks why it got none.
        if "Upgrade" in request.headers and "Origin" not in request.headers:
            return web.Response(status=403, text="Only the page itself may connect.")
        if "Sec-WebSocket-Protocol" in request.headers:
            return web.Response(status=400, text="This address is for WebSockets.")
        if self.panel.is_ending:
            return web.Response(status=503, text="The program ends.")
        key = request.match_info.get("key")
        pages = self._pages if key is None else self._students.get(key)
        if pages is None:
            return web.Response(status=404, text=NO_STUDENT)
        return await pages.answer(request)


class _Connection(web.RequestHandler):
    """aiohttp's end of a connection. It ends one that is one too many, sends too much, or does not read.

    Args:
        server: aiohttp's own server.
        others: All connections that are open, with their addresses; this one is added.
        more: How many there may be beyond the usual.
    """

    def __init__(self, server: web.Server, others: dict[_Connection, str], more: int) -> None:
        super().__init__(
            server,
            loop=asyncio.get_running_loop(),
            access_log=None,  # type: ignore[arg-type]  # as its own runner takes it
            logger=SILENT,
            keepalive_timeout=REQUEST_TIME * time_factor(),
            lingering_time=0.0,  # do not wait for the rest of a body after the answer
            max_line_size=MAX_LINE,
            max_field_size=MAX_HEADER,
        )
        self.abort: Callable[[], None] = lambda: None
        self._others, self._more = others, more
        self._bytes = Bucket(BYTES, BYTES_AT_ONCE)
        self._reading_time = READING_TIME * time_factor()
        self._unread: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self.abort = transport.abort
        address = str((transport.get_extra_info("peername") or ("",))[0])
        there = list(self._others.values())
        if len(there) >= MAX_CONNECTIONS + self._more or there.count(address) >= MAX_OF_ONE:
            self.abort()
            return
        self._others[self] = address
        super().connection_made(transport)

    def data_received(self, data: bytes) -> None:
        if not self._bytes.take(len(data)):
            self.abort()
            return
        try:
            super().data_received(data)
        except ValueError:  # what no parser has thought of
            self.abort()

    def pause_writing(self) -> None:
        self._unread = self._loop.call_later(self._reading_time, self.abort)
        super().pause_writing()

    def resume_writing(self) -> None:
        self._end_timer()
        super().resume_writing()

    def connection_lost(self, exc: BaseException | None) -> None:
        self._end_timer()
        if self._others.pop(self, None) is not None:
            super().connection_lost(exc)

    def _end_timer(self) -> None:
        if self._unread is not None:
            self._unread.cancel()
            self._unread = None

    def handle_error(
        self,
        request: web.BaseRequest,
        status: int = 500,
        exc: BaseException | None = None,
        message: str | None = None,
    ) -> web.StreamResponse:
        """Answer by itself what cannot be read as a request: like everywhere, and repeating nothing of what came."""
        response = super().handle_error(request, status, exc, "That is not a request.")
        response.headers.update(HEADERS)
        response.headers["Content-Security-Policy"] = "default-src 'none'; frame-ancestors 'none'"
        response.headers["Cache-Control"] = "no-store"
        response.headers["Server"] = "elib"  # no application removes aiohttp's own
        return response


@dataclass(frozen=True, slots=True)
class _File:
    """A file of the page."""

    kind: str  # its content type
    caching: str  # how long a browser may keep it
    body: bytes  # what it holds
    packed: bytes | None  # the same for browsers that take gzip; None for a font, which is compressed
    digest: str  # changes with the content


def _takes_gzip(request: web.Request) -> bool:
    """Return whether a browser takes gzip: it names it, and not with a weight of 0."""
    named = request.headers.get("Accept-Encoding", "").lower().replace(" ", "").split(",")
    return any(re.fullmatch(r"gzip(;q=(?!0(\.0*)?$).*)?", each) for each in named)


@cache
def _static_files() -> Mapping[str, _File]:
    """Return every file that can be asked for, by its path; nothing else is ever read.

    They are compressed here and not when the page is built: not every build of zlib gives the same bytes.
    """
    found = {}
    for file in page_folder().iterdir():
        if (kind := KINDS.get(file.suffix)) is not None:
            is_text, is_hashed = file.suffix != ".woff2", HASHED.search(file.name)
            body = file.read_bytes()
            found[f"/{file.name}"] = _File(
                f"{kind}; charset=utf-8" if is_text else kind,
                "private, max-age=31536000, immutable" if is_hashed else "no-cache",
                body,
                gzip.compress(body, 6, mtime=0) if is_text else None,
                hashlib.sha256(body).hexdigest()[:16],
            )
    return found
