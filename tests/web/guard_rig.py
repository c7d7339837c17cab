"""A guarded server with a plain application behind it, on a port of its own, and a stranger's end of the wire."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Iterable
from dataclasses import dataclass, field

from elib.web.bounded import served
from elib.web.guard import Guard, Surroundings

from elib.web.access import Access, Message, Receive, Scope, Send
from elib.web.listening import listen

PATIENCE = 20.0
PAGE = "11111111-2222-4333-8444-555555555555"
LISTENER = "aaaaaaaa-2222-4333-8444-555555555555"
SOCKET = (
    f"/_nicegui_ws/socket.io/?client_id={PAGE}&next_message_id=0&implicit_handshake=true&document_id={LISTENER}"
    f"&tab_id={LISTENER}&old_tab_id=null&EIO=4&transport=websocket"
)
DOCUMENT = b"<!doctype html><title>panel</title><script>let a = 1</script><script type=module src=x></script>"


@dataclass
class Behind:
    """The application: it keeps what reached it.

    Attributes:
        seen: The scopes of requests.
        heard: The messages of WebSockets.
        left: Close codes of WebSockets that ended.
        asked: Said to the next WebSocket when it opens.
    """

    seen: list[Scope] = field(default_factory=list)
    heard: list[str] = field(default_factory=list)
    left: list[int] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)
    gone: asyncio.Event = field(default_factory=asyncio.Event)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        match scope["type"]:
            case "lifespan":
                for word in ("startup", "shutdown"):
                    assert (await receive())["type"] == f"lifespan.{word}"
                    await send({"type": f"lifespan.{word}.complete"})
            case "http":
                self.seen.append(scope)
                kind, body = (b"text/html; charset=utf-8", DOCUMENT) if scope["path"] == "/" else (b"text/plain", b"ok")
                headers = [(b"content-type", kind), (b"content-length", str(len(body)).encode())]
                await send({"type": "http.response.start", "status": 200, "headers": headers})
                await send({"type": "http.response.body", "body": body[:9], "more_body": True})
                await send({"type": "http.response.body", "body": body[9:]})
            case "websocket":
                await self._listen(receive, send)

    async def _listen(self, receive: Receive, send: Send) -> None:
        assert (await receive())["type"] == "websocket.connect"
        await send({"type": "websocket.accept"})
        for text in self.asked:
            await send({"type": "websocket.send", "text": text})
        while True:
            message: Message = await receive()
            if message["type"] == "websocket.disconnect":
                self.left.append(message["code"])
                self.gone.set()
                return
            self.heard.append(message["text"])


@dataclass
class Answer:
    """What came back."""

    status: int
    headers: dict[str, str]
    body: bytes


@dataclass
class Rig:
    """What a test has to do with."""

    behind: Behind
    host: str
    port: int
    access: Access

    @property
    def name(self) -> str:
        """How a browser calls it."""
        return f"{self.host}:{self.port}"

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
        """Make a request; without *host* by the panel's own name, with None by none at all."""
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
        """Open a WebSocket as a browser does; without *origin* from the panel's own page, with None from none."""
        from websockets.asyncio.client import connect

        async with connect(
            f"ws://{self.name}{path}",
            origin=f"http://{self.name}" if origin == "" else origin,
            additional_headers={"Cookie": cookie} if cookie else None,
            open_timeout=PATIENCE,
            compression=None,
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


def click(**changes: object) -> str:
    """Return the message of a click on a page."""
    about = {"client_id": PAGE, "id": 7, "listener_id": LISTENER, "args": ["1"]}
    return f"42{json.dumps(['event', about | changes])}"


@contextlib.asynccontextmanager
async def guarded(*, token: str | None = None, around: Surroundings | None = None) -> AsyncIterator[Rig]:
    """Serve the application behind the guard."""
    behind = Behind()
    address = listen(port=0)
    access = Access(address.host, address.port, token)
    async with served(Guard(behind, access, around), address.socket):
        yield Rig(behind, address.host, address.port, access)
