"""A page's end of the server without a browser: what a stranger has who writes the messages by hand."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import urllib.error
import urllib.request
from collections.abc import AsyncIterator

from shared import PATIENCE, until


def fetch(url: str, **headers: str) -> tuple[int, str]:
    """Return status and text of an address."""
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(urllib.request.Request(url, headers=headers), timeout=PATIENCE) as answer:
            return answer.status, answer.read().decode(errors="replace")
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read().decode()


class Page:
    """An open page, which draws all that it is sent.

    Attributes:
        socket: Its WebSocket.
        hello: What it was told first.
        robots: The robots of the panel, as it was told last.
        heard: All messages of the server, the newest last.
        frames: The frames of the world, the newest last.
    """

    def __init__(self, socket) -> None:
        self.socket = socket
        self.hello: dict = {}
        self.robots: list[dict] = []
        self.heard: list[dict] = []
        self.frames: list[bytes] = []
        self._answers: dict[int, asyncio.Future[dict]] = {}
        self._numbers = itertools.count(1)

    async def listen(self) -> None:
        """Take what the server says until it says no more."""
        async for message in self.socket:
            if isinstance(message, bytes):
                self.frames.append(message)
                number, channel = (int.from_bytes(message[at : at + 4], "little") for at in (0, 20))
                await self.tell("frames_drawn", frames=[[channel, number]])
            else:
                await self._take(json.loads(message))

    async def _take(self, message: dict) -> None:
        self.heard.append(message)
        match message["type"]:
            case "hello":
                self.hello = message
            case "update":
                self.robots = message.get("robots", self.robots)
                await self.tell("drawn", number=message["number"])
            case "answer" if message["id"] in self._answers:
                self._answers.pop(message["id"]).set_result(message)

    async def tell(self, what: str, /, **values: object) -> None:
        """Say something that needs no answer."""
        with contextlib.suppress(Exception):
            await self.socket.send(json.dumps({"do": what} | values))

    async def ask(self, what: str, /, **values: object) -> dict:
        """Ask for something and return the answer."""
        number = next(self._numbers)
        answer = self._answers[number] = asyncio.get_running_loop().create_future()
        await self.socket.send(json.dumps({"do": what, "id": number} | values))
        async with asyncio.timeout(PATIENCE):
            return await answer

    def of(self, kind: str) -> list[dict]:
        """Return what it was told of one kind."""
        return [message for message in self.heard if message["type"] == kind]

    @property
    def tick(self) -> dict:
        """The newest readings of a robot."""
        ticks = [each["robot"]["tick"] for each in self.of("update") if "robot" in each]
        return ticks[-1] if ticks else {}

    async def connected(self) -> str:
        """Subscribe to the first robot, wait until it is connected, and return its key."""
        await until(lambda: self.robots)
        key = str(self.robots[0]["key"])
        await self.ask("subscribe", what="robot", of=key)
        await until(lambda: self.tick.get("phase") == "connected")
        return key


@contextlib.asynccontextmanager
async def opened(url: str, *, cookie: str = "") -> AsyncIterator[Page]:
    """Open the page's WebSocket, as the browser does."""
    from websockets.asyncio.client import connect

    place = url.removeprefix("http://").rstrip("/")
    async with connect(
        f"ws://{place}/ws",
        origin=f"http://{place.partition('/')[0]}",
        additional_headers={"Cookie": cookie} if cookie else None,
        proxy=None,
        compression=None,
        max_size=None,
        ping_interval=None,
    ) as socket:
        page = Page(socket)
        listening = asyncio.create_task(page.listen())
        try:
            await until(lambda: page.hello or listening.done())
            yield page
        finally:
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)
