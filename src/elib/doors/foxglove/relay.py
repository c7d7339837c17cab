"""The port that clients of Foxglove open: it checks where a client comes from, and bounds what it sends.

The server of the Foxglove SDK does not ask who a client is: any page in a browser of this computer could open it and
drive. So it listens at an address that is hard to guess, and this port passes on the WebSockets of those who may
connect. The first message of each connection, which only this port can send, tells the door which client of the SDK it
is; the door does nothing for other clients.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import secrets
import struct
from collections.abc import Callable, Collection
from hmac import compare_digest

from elib.panel.server.listening import Address
from elib.simulator.emulator.control_server import Bucket

ORIGINS = ("https://app.foxglove.dev", "file://")
"""Pages that may connect unless others are named: the app in the browser, and the app on the desktop."""
SECRET = "/elib/"
"""Begins the topic by which a connection shows itself."""
SECRET_CHANNEL = 2**32 - 2
"""Number of that channel; clients count theirs from 1."""
MAX_FRAME = 64 * 1024
"""Bytes of a message of a client: an advertisement with a long schema."""
MAX_HEAD = 16 * 1024
HEAD_TIME = 10.0
"""s that the head of a request may take to come."""
MAX_CONNECTIONS = 32
MESSAGES, MESSAGES_AT_ONCE = 200.0, 400.0
"""Messages of a client per second for long, and at once: a Teleop panel sends ten, for each robot."""
CLOSING_TIME = 1.0
BLOCK = 64 * 1024
BINARY, CONTROL = 0x2, 0x8
"""Opcodes of a message on a topic, and of the first of WebSocket's own: close, ping, pong."""
MAX_CONTROL = 125


class Refused(Exception):
    """A request is refused, with this status and text."""

    def __init__(self, status: str, text: str) -> None:
        super().__init__(text)
        self.status = status


class Relay:
    """Passes WebSockets on to the server of the SDK.

    Args:
        address: A bound port.
        target: Host and port of the server.
        origins: Pages that may connect; ``*`` lets all in.
        token: What a client must have as the path of its URL; None asks for nothing.
        on_refused: Called with the origin of a page that was refused.
    """

    def __init__(
        self,
        address: Address,
        target: tuple[str, int],
        origins: Collection[str],
        token: str | None,
        on_refused: Callable[[str], object],
    ) -> None:
        self._address, self._target, self._token, self._on_refused = address, target, token, on_refused
        self._origins = {origin.rstrip("/").lower() if origin != "file://" else origin for origin in origins}
        self._tasks: dict[asyncio.Task[None], str] = {}
        self._server: asyncio.Server | None = None

    async def open(self) -> None:
        """Begin to listen."""
        self._server = await asyncio.start_server(self._serve, sock=self._address.socket, limit=MAX_HEAD)

    def owns(self, secret: str) -> bool:
        """Return whether an open connection has this secret."""
        return secret in self._tasks.values()

    def drop(self, secret: str) -> None:
        """Close the connection with this secret."""
        for task, each in self._tasks.items():
            if each == secret:
                task.cancel()

    async def close(self) -> None:
        """Close the port and all connections."""
        if self._server is not None:
            self._server.close()
        tasks = tuple(self._tasks)
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks, timeout=CLOSING_TIME)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        secret = secrets.token_urlsafe(16)
        behind: asyncio.StreamWriter | None = None
        try:
            if len(self._tasks) >= MAX_CONNECTIONS:
                raise Refused("503 Service Unavailable", f"{MAX_CONNECTIONS} clients are connected")
            self._tasks[task] = secret
            async with asyncio.timeout(HEAD_TIME):
                head = self._checked(await reader.readuntil(b"\r\n\r\n"))
                source, behind = await asyncio.open_connection(*self._target, limit=MAX_HEAD)
                behind.write(head)
                answer = await source.readuntil(b"\r\n\r\n")
            writer.write(answer)
            if not answer.startswith(b"HTTP/1.1 101 "):
                return
            behind.write(_introduction(secret))
            await self._pass_on(reader, writer, source, behind)
        except Refused as refused:
            text = str(refused).encode() + b"\n"
            writer.write(
                f"HTTP/1.1 {refused.status}\r\nContent-Type: text/plain\r\nContent-Length: {len(text)}\r\n"
                "Connection: close\r\n\r\n".encode()
                + text
            )
        except (OSError, EOFError, TimeoutError, asyncio.LimitOverrunError, asyncio.CancelledError):
            pass  # gone, too slow, not HTTP, or the door closes; no one waits for this task
        finally:
            self._tasks.pop(task, None)
            for each in (writer, behind):
                if each is not None:
                    each.close()

    def _checked(self, head: bytes) -> bytes:
        """Return the head of the request for the server behind.

        Raises:
            Refused: The request does not come from who may connect.
        """
        try:
            first, *lines = head.decode("ascii").split("\r\n")[:-2]
            method, path, version = first.split(" ")
            fields = [
                (name.strip().lower(), value.strip()) for name, _, value in (each.partition(":") for each in lines)
            ]
        except (UnicodeDecodeError, ValueError):
            raise Refused("400 Bad Request", "not a request") from None
        origins = [value for name, value in fields if name == "origin"]
        upgrades = [value.lower() for name, value in fields if name == "upgrade"]
        if origins and (len(origins) > 1 or not self._is_allowed(origins[0])):
            self._on_refused(origins[0])
            raise Refused("403 Forbidden", "this page may not connect; --allow-origin lets it in")
        if self._token is not None and not compare_digest(path, f"/{self._token}"):
            raise Refused("403 Forbidden", "the address of a client ends with the token")
        if method != "GET" or version != "HTTP/1.1" or upgrades != ["websocket"]:
            raise Refused("426 Upgrade Required", "open this address in Foxglove: Open connection, Foxglove WebSocket")
        return "\r\n".join(("GET / HTTP/1.1", *lines, "", "")).encode()

    def _is_allowed(self, origin: str) -> bool:
        return "*" in self._origins or origin.rstrip("/").lower() in self._origins or origin in self._origins

    async def _pass_on(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        source: asyncio.StreamReader,
        behind: asyncio.StreamWriter,
    ) -> None:
        """Pass on both directions until one of them ends."""
        both = [asyncio.ensure_future(_pass_frames(reader, behind)), asyncio.ensure_future(_pass_bytes(source, writer))]
        try:
            await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for each in both:
                each.cancel()
            await asyncio.gather(*both, return_exceptions=True)


async def _pass_bytes(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(BLOCK):
        writer.write(data)
        await writer.drain()


async def _pass_frames(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Pass on the frames of a client, until it sends too much, or what no client sends.

    Messages on topics that come too fast are dropped, not delayed: a robot must not obey what was sent long ago.
    """
    messages = Bucket(MESSAGES, MESSAGES_AT_ONCE)
    size = 0
    while True:
        head = await reader.readexactly(2)
        opcode, length, is_last = head[0] & 0xF, head[1] & 0x7F, bool(head[0] & 0x80)
        if length == 126:
            more = await reader.readexactly(2)
            length = int.from_bytes(more)
        elif length == 127:
            more = await reader.readexactly(8)
            length = int.from_bytes(more)
        else:
            more = b""
        is_control = opcode >= CONTROL
        if not is_control:
            size = length if opcode else size + length  # a continuation has opcode 0
        if not head[1] & 0x80 or size > MAX_FRAME or (is_control and (length > MAX_CONTROL or not is_last)):
            return
        frame = head + more + await reader.readexactly(4 + length)
        if messages.take():
            writer.write(frame)
            await writer.drain()
        elif opcode != BINARY or not is_last:
            return


def _introduction(secret: str) -> bytes:
    """Return a frame that advertises the topic of a connection, as the client itself would send it."""
    channel = {"id": SECRET_CHANNEL, "topic": SECRET + secret, "encoding": "json", "schemaName": ""}
    text = json.dumps({"op": "advertise", "channels": [channel]}).encode()
    return struct.pack(">BBH4x", 0x81, 0x80 | 126, len(text)) + text


async def free_target() -> str:
    """Return a loopback address where no page finds a server by trying ports; 127.0.0.1 if the system has no other."""
    host = f"127.{1 + secrets.randbelow(254)}.{secrets.randbelow(256)}.{1 + secrets.randbelow(254)}"
    with contextlib.suppress(OSError):
        server = await asyncio.start_server(lambda reader, writer: writer.close(), host, 0)
        server.close()
        return host
    return "127.0.0.1"
