"""The live view: a page in the browser that shows a running simulation from above and moves what is in it.

The page and all it needs come from here, over a port of this computer alone; what happens goes over one WebSocket.
Frames are made between two events of the loop, from an immutable snapshot, only while somebody looks, and at most
:data:`SHARE` of the time goes into them. A page that does not keep up gets fewer of them.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
from collections import deque
from collections.abc import AsyncIterator, Mapping
from importlib.resources import files
from io import BytesIO
from typing import TYPE_CHECKING, cast

from elib.emulator.control import Control
from elib.emulator.control_server import LONGEST, Pace, answer, parse, time_factor
from elib.emulator.loopback import LOOPBACK, bind, named
from elib.errors import ArgumentError, Unsupported, install
from elib.physics import Snapshot
from elib.view import wire
from elib.view.floor import floor_picture

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response
    from websockets.typing import Origin

PORT = 8600
"""The first port to try where none is named; the next ones follow."""
RATE = 25.0
"""Frames a second of the wall clock, at most."""
SHARE = 0.1
"""How much of the time may go into frames: of a huge crowd there are fewer."""
AHEAD = 2
"""Frames on their way to a page that has not drawn them yet, at most."""
EVERY = 3
"""Frames from one look at a robot's readings to the next: more could not be read."""
MOST_PAGES = 8

KINDS = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
}
KINDS |= {".svg": "image/svg+xml", ".png": "image/png"}


@contextlib.asynccontextmanager
async def watchable(control: Control, place: str = "") -> AsyncIterator[str]:
    """Serve the live view of a simulation until the block is left.

    Args:
        control: The simulation's control door.
        place: ``HOST:PORT`` or ``PORT`` on this computer; empty for the first free port from :data:`PORT` on, port 0
            for any.

    Yields:
        The page's URL.

    Raises:
        ArgumentError: *place* cannot be, or other computers could reach it.
        LinkBusy: The port is taken, or all that were tried are.
        LinkDenied: The port is not for this user.
        SimulationError: There is no world to be seen.
        Unsupported: The extra ``web`` is not installed.
    """
    try:
        from websockets.asyncio.server import serve
    except ImportError as error:
        raise Unsupported(
            "the live view needs the package websockets, which is not installed",
            hint=install("web"),
        ) from error
    logger = logging.getLogger("elib.view.live")
    logger.addHandler(logging.NullHandler())  # strangers at the port are not worth a line on the terminal
    view = _LiveView(control)
    sock = bind(place, PORT)
    view.place(named(sock))
    factor = time_factor()
    async with contextlib.AsyncExitStack() as stack:
        filming = asyncio.create_task(view.film())
        stack.push_async_callback(_end, filming)
        await stack.enter_async_context(
            serve(
                view.meet,
                sock=sock,
                process_request=view.respond,
                origins=view.origins,
                compression=None,  # costs more than it saves on the way from a computer to itself
                max_size=LONGEST,
                open_timeout=10 * factor,
                close_timeout=factor,
                ping_interval=None,  # a page that sleeps gets no frames; it need not be thrown out
                server_header=None,
                logger=logger,
            )
        )
        yield f"http://{named(sock)}/"


async def _end(task: asyncio.Task[None]) -> None:
    task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await task


class _Page:
    """One browser that looks on.

    Attributes:
        wants_rays: It draws the infrared rays.
        robot: Whose readings it shows; None for nobody's.
        seen: What it was told last.
        fresh: Set when there is something to send.
    """

    def __init__(self, connection: ServerConnection, seen: Snapshot, ambient: float) -> None:
        self.connection = connection
        self.wants_rays = False
        self.robot: int | None = None
        self.seen = seen
        self.ambient = ambient
        self.fresh = asyncio.Event()
        self._under_way: deque[int] = deque()
        self._is_sending = False

    @property
    def is_ready(self) -> bool:
        """Whether it would draw another frame at once."""
        return not self._is_sending and len(self._under_way) < AHEAD

    def draws(self, number: bytes) -> None:
        """Take note of a frame that it has drawn; of nonsense take none."""
        drawn = int.from_bytes(number, "little") if len(number) == 4 else 0
        while self._under_way and self._under_way[0] <= drawn:
            self._under_way.popleft()

    async def send(self, *messages: str | bytes, number: int) -> None:
        """Send all of it; while it takes its time, nothing else is made for this page."""
        self._is_sending = True
        self._under_way.append(number)
        try:
            for message in messages:
                await self.connection.send(message)
        finally:
            self._is_sending = False


class _LiveView:
    """The server behind one port."""

    def __init__(self, control: Control) -> None:
        self._control = control
        self._loop = asyncio.get_running_loop()
        self._factor = time_factor()
        self._pages: set[_Page] = set()
        self._wanted = asyncio.Event()
        self._number = 0
        self._latest = control.snapshot()
        self._frame = b""
        self._files = _page_files()
        self._hosts: frozenset[str] = frozenset()
        self.origins: list[Origin] = []

    def place(self, address: str) -> None:
        """Take the names by which a browser may call the port: another one is a stranger's page (DNS rebinding)."""
        port = address.rpartition(":")[2]
        self._hosts = frozenset({address, f"{LOOPBACK}:{port}", f"localhost:{port}"})
        self.origins = [cast("Origin", f"http://{host}") for host in self._hosts]

    async def respond(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a plain request; None lets the WebSocket open."""
        path = request.path.partition("?")[0]
        hosts = request.headers.get_all("Host")
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return connection.respond(403, "this view answers to its own address alone\n")
        if path == "/live":
            full = len(self._pages) >= MOST_PAGES
            return connection.respond(503, f"{MOST_PAGES} pages are open already\n") if full else None
        if path == "/floor.png" and path not in self._files and self._latest.floor.columns:
            self._files[path] = await asyncio.to_thread(_png, self._latest)
        name = "/index.html" if path == "/" else path
        if name not in self._files:
            return connection.respond(404, "there is no such page\n")
        return self._page(name, connection)

    def _page(self, name: str, connection: ServerConnection) -> Response:
        body = self._files[name]
        response = connection.respond(200, "")
        for header in ("Content-Type", "Content-Length"):
            del response.headers[header]
        response.headers.update(
            {
                "Content-Type": KINDS[name[name.rindex(".") :]],
                "Content-Length": str(len(body)),
                "Cache-Control": "no-store",
                "X-Content-Type-Options": "nosniff",
                "Referrer-Policy": "no-referrer",
                # Nothing from elsewhere, and no other page around this one, in which somebody could be led to click.
                "Content-Security-Policy": "default-src 'self'; connect-src 'self' "
                + " ".join(f"ws://{host}" for host in sorted(self._hosts))
                + "; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
            }
        )
        response.body = body
        return response

    async def meet(self, connection: ServerConnection) -> None:
        """Serve one page until it leaves."""
        from websockets.exceptions import ConnectionClosed

        snapshot = self._control.snapshot()
        page = _Page(connection, snapshot, self._control.ambient)
        sender = asyncio.create_task(self._send(page))
        with contextlib.suppress(ConnectionClosed):
            try:
                await connection.send(_text(wire.scene(self._control, snapshot)))
                self._pages.add(page)
                self._wanted.set()
                await self._listen(page)
            finally:
                self._pages.discard(page)
                await _end(sender)

    async def _listen(self, page: _Page) -> None:
        pace = Pace(self._factor)
        async for message in page.connection:
            if isinstance(message, bytes):
                page.draws(message)
            else:
                await page.connection.send(_text(self._do(page, message)))
            await pace.wait()

    def _do(self, page: _Page, text: str) -> Mapping[str, object]:
        try:
            message = parse(text)
            wish = wire.wish(message, len(self._latest.robots))
        except ArgumentError as error:
            return {"ok": False, "error": error.message, "hint": error.hint}
        match wish:
            case None:
                return answer(self._control, message)
            case "rays", bool(on):
                page.wants_rays = on
            case _, robot:
                page.robot = robot
        number = message.get("id")
        return {"ok": True} | ({"id": number} if isinstance(number, int) else {})

    async def film(self) -> None:
        """Make frames for as long as anybody looks."""
        while True:
            await self._wanted.wait()
            self._control.simulation.catch_up()
            began = self._loop.time()
            ready = [page for page in self._pages if page.is_ready]
            if ready:
                self._shoot(ready)
            if not self._pages:
                self._wanted.clear()
            cost = self._loop.time() - began
            await asyncio.sleep(max(self._factor / RATE - cost, cost / SHARE))

    def _shoot(self, pages: list[_Page]) -> None:
        looks = self._number % EVERY == 0 and any(page.robot is not None for page in pages)
        beams = looks or any(page.wants_rays for page in pages)
        self._latest = self._control.snapshot(beams=beams)
        self._number += 1
        self._frame = wire.frame(self._latest, self._number, self._control.is_cut)
        for page in pages:
            page.fresh.set()

    async def _send(self, page: _Page) -> None:
        """Send the newest frame whenever there is one; those that came while the last one was sent are skipped."""
        from websockets.exceptions import ConnectionClosed

        with contextlib.suppress(ConnectionClosed):
            while True:
                await page.fresh.wait()
                page.fresh.clear()
                await page.send(*self._news(page), self._frame, number=self._number)

    def _news(self, page: _Page) -> list[str]:
        """Return what a page has to be told beside the frame."""
        latest, told = self._latest, []
        change = wire.change(page.seen, latest) or {}
        if page.ambient != self._control.ambient:
            page.ambient = self._control.ambient
            change["ambient"] = page.ambient
        if change:
            told.append(_text({"kind": "change"} | change))
        page.seen = latest
        if page.robot is not None and latest.robots[page.robot].beams:
            told.append(_text(wire.readings(self._control, latest, page.robot)))
        return told


def _text(message: Mapping[str, object]) -> str:
    return json.dumps(message, separators=(",", ":"))


def _page_files() -> dict[str, bytes]:
    """Return what can be asked for, by its path; nothing else is ever read."""
    there = files("elib.view").joinpath("page").iterdir()
    return {f"/{file.name}": file.read_bytes() for file in there if file.name.endswith(tuple(KINDS))}


def _png(snapshot: Snapshot) -> bytes:
    out = BytesIO()
    floor_picture(snapshot.floor).save(out, "PNG")
    return out.getvalue()
