"""The server on a port of its own, and a stranger's end of the connection."""

from __future__ import annotations

import asyncio
import contextlib
import tempfile
from collections.abc import AsyncIterator, Iterable
from dataclasses import dataclass, field
from pathlib import Path

from elib.panel.panel import Panel
from elib.panel.recents import RecentRobots
from elib.panel.server import http as server
from elib.panel.server.http import Server, served
from elib.panel.server.listening import listen
from elib.panel.server.page import Page
from shared import PATIENCE

SOCKET = "/ws"


@dataclass
class Answer:
    """What came back."""

    status: int
    headers: dict[str, str]
    body: bytes


@dataclass
class Rig:
    """What a test has to do with.

    Attributes:
        panel: The robots.
        server: The server.
        host: Where it is.
        port: Where it is.
        pages: Pages that were opened, also those that have left.
        heard: Messages of pages that were heard.
    """

    panel: Panel
    server: Server
    host: str
    port: int
    pages: list[Page] = field(default_factory=list)
    heard: list[str] = field(default_factory=list)
    gone: asyncio.Event = field(default_factory=asyncio.Event)

    @property
    def name(self) -> str:
        """How a browser calls it."""
        return f"{self.host}:{self.port}"

    @property
    def url(self) -> str:
        return f"http://{self.name}/"

    async def raw(self, data: bytes, *, ends: bool = True) -> bytes:
        """Send bytes on a connection of their own, and return all that comes until the other side ends it."""
        reader, writer = await asyncio.open_connection(self.host, self.port)
        writer.write(data)
        if ends:
            with contextlib.suppress(OSError):
                await writer.drain()
        try:
            async with asyncio.timeout(PATIENCE):
                return await reader.read()
        except ConnectionError:
            return b""
        finally:
            writer.close()

    async def ask(
        self,
        path: str = "/",
        *,
        method: str = "GET",
        host: str | None = "",
        body: bytes = b"",
        headers: Iterable[tuple[str, str]] = (),
    ) -> Answer:
        """Make a request; without *host* by the server's own name, with None by none at all."""
        lines = [f"{method} {path} HTTP/1.1"]
        if host is not None:
            lines.append(f"Host: {host or self.name}")
        lines += [f"{name}: {value}" for name, value in headers]
        if body:
            lines.append(f"Content-Length: {len(body)}")
        lines.append("Connection: close")
        data = "\r\n".join([*lines, "", ""]).encode("latin-1") + body
        return parse(await self.raw(data))

    @contextlib.asynccontextmanager
    async def socket(self, path: str = SOCKET, *, origin: str | None = "", cookie: str = "") -> AsyncIterator:
        """Open a WebSocket as a browser does; without *origin* from the server's own page, with None from none."""
        from websockets.asyncio.client import connect

        async with connect(
            f"ws://{self.name}{path}",
            origin=f"http://{self.name}" if origin == "" else origin,
            additional_headers={"Cookie": cookie} if cookie else None,
            open_timeout=PATIENCE,
            compression=None,
            max_queue=None,  # a close is seen also behind many messages
            proxy=None,
            ping_interval=None,
        ) as socket:
            yield socket


def parse(data: bytes) -> Answer:
    """Take an answer apart."""
    head, _, body = data.partition(b"\r\n\r\n")
    first, *rest = head.decode("latin-1").split("\r\n")
    headers = dict(line.lower().split(": ", 1) for line in rest)
    if "set-cookie" in headers:  # its value counts letter by letter
        headers["set-cookie"] = next(line for line in rest if line.lower().startswith("set-cookie"))[12:]
    return Answer(int(first.split()[1]), headers, body)


@contextlib.asynccontextmanager
async def guarded(*, token: str | None = None, urls: Iterable[str] = ()) -> AsyncIterator[Rig]:
    """Serve a panel, whose pages note what they hear."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        panel = Panel(is_shared=token is not None, folder=folder, recents=RecentRobots(folder / "recents.json"))
        address = listen(port=0)

        class NotingPage(Page):
            def __init__(self, *arguments: object) -> None:
                super().__init__(*arguments)  # type: ignore[arg-type]
                rig.pages.append(self)

            async def hear(self, text: str) -> str:
                answer = await super().hear(text)
                if not answer:
                    rig.heard.append(text)
                return answer

            async def close(self) -> None:
                await super().close()
                rig.gone.set()

        usual, server.Page = server.Page, NotingPage  # type: ignore[misc]
        try:
            async with served(panel, address, token) as serving:
                rig = Rig(panel, serving, address.host, address.port)
                for url in urls:
                    for key in panel.add_all(url, is_trusted=True):
                        panel.connect(key)
                try:
                    yield rig
                finally:
                    await panel.close()
        finally:
            server.Page = usual  # type: ignore[misc]
