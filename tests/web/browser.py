"""A browser for tests: Debian's chromium without a window, driven by its own DevTools protocol over a WebSocket."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import itertools
import json
import os
import re
import shutil
import tempfile
from collections.abc import AsyncIterator, Awaitable, Callable

import pytest

PATIENCE = 60.0
"""s. A browser may take its time on a busy machine; it is only waited for so long when something is wrong."""

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)

needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no chromium: apt-get install chromium")

FLAGS = [
    "--headless=new",
    "--no-sandbox",  # it refuses to run as root otherwise
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-extensions",
    "--disable-sync",
    "--hide-scrollbars",
    "--no-first-run",
    "--mute-audio",
    "--remote-debugging-port=0",
]


class Wire:
    """The browser's end of the protocol: calls find their results, events their tabs."""

    def __init__(self, socket) -> None:
        self.tabs: dict[str, Tab] = {}
        self._socket = socket
        self._numbers = itertools.count(1)
        self._waiting: dict[int, asyncio.Future[dict]] = {}

    async def listen(self) -> None:
        async for text in self._socket:
            message = json.loads(text)
            if "id" in message:
                future = self._waiting.pop(message["id"])
                if not future.done():
                    future.set_result(message)
            elif message.get("sessionId") in self.tabs:
                self.tabs[message["sessionId"]].note(message["method"], message.get("params", {}))

    async def call(self, method: str, session: str = "", **params: object) -> dict:
        number = next(self._numbers)
        future = self._waiting[number] = asyncio.get_running_loop().create_future()
        message: dict[str, object] = {"id": number, "method": method, "params": params}
        if session:
            message["sessionId"] = session
        await self._socket.send(json.dumps(message))
        async with asyncio.timeout(PATIENCE):
            answer = await future
        assert "error" not in answer, (method, answer["error"])
        return answer["result"]

    async def open(self, url: str) -> Tab:
        """Open a page and return its tab."""
        target = (await self.call("Target.createTarget", url="about:blank"))["targetId"]
        session = (await self.call("Target.attachToTarget", targetId=target, flatten=True))["sessionId"]
        tab = self.tabs[session] = Tab(self, session, target)
        for domain in ("Page", "Runtime", "Network", "Log"):
            await tab.call(f"{domain}.enable")
        await tab.call("Page.navigate", url=url)
        return tab


class Tab:
    """One page in the browser.

    Attributes:
        requests: URLs of everything it asked for.
        complaints: What its console said that was no mere note, and exceptions.
    """

    def __init__(self, wire: Wire, session: str, target: str) -> None:
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self._wire = wire
        self._session = session
        self._target = target

    def note(self, method: str, params: dict) -> None:
        """Take note of what happened on the page."""
        match method:
            case "Network.requestWillBeSent":
                self.requests.append(params["request"]["url"])
            case "Network.webSocketCreated":
                self.requests.append(params["url"])
            case "Runtime.exceptionThrown":
                self.complaints.append(json.dumps(params["exceptionDetails"]))
            case "Runtime.consoleAPICalled" if params["type"] in ("error", "warning", "assert"):
                self.complaints.append(json.dumps(params["args"]))
            case "Log.entryAdded" if params["entry"]["level"] in ("error", "warning"):
                self.complaints.append(params["entry"]["text"] + " " + params["entry"].get("url", ""))

    async def call(self, method: str, **params: object) -> dict:
        """Call a method of the protocol on this page."""
        return await self._wire.call(method, self._session, **params)

    async def close(self) -> None:
        """Close the page."""
        del self._wire.tabs[self._session]
        await self._wire.call("Target.closeTarget", targetId=self._target)

    async def run(self, expression: str) -> object:
        """Return what a JavaScript expression gives."""
        result = await self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    async def until(self, expression: str) -> object:
        """Wait until a JavaScript expression is true and return it."""
        async with asyncio.timeout(PATIENCE):
            while True:
                if value := await self.run(expression):
                    return value
                await asyncio.sleep(0.02)

    async def mouse(self, kind: str, x: float, y: float) -> None:
        """Move, press or release the mouse at a place on the page."""
        pressed = 0 if kind == "mouseReleased" else 1
        button = "none" if kind == "mouseMoved" and not pressed else "left"
        await self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=pressed, clickCount=1)

    async def key(self, key: str, *, shift: bool = False) -> None:
        """Press and release a key."""
        for kind in ("keyDown", "keyUp"):
            await self.call("Input.dispatchKeyEvent", type=kind, key=key, modifiers=8 if shift else 0)

    async def size(self, width: int, height: int, *, dark: bool = False, phone: bool = False) -> None:
        """Give the page another size and colour scheme."""
        await self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=2 if phone else 1,
            mobile=phone,
        )
        await self.call(
            "Emulation.setEmulatedMedia",
            features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}],
        )

    async def shot(self) -> bytes:
        """Return a picture of the page, PNG."""
        return base64.b64decode((await self.call("Page.captureScreenshot", format="png"))["data"])


@contextlib.asynccontextmanager
async def browser() -> AsyncIterator[Callable[[str], Awaitable[Tab]]]:
    """Start a browser; what it yields opens a page and returns its tab."""
    from websockets.asyncio.client import connect

    assert CHROMIUM is not None
    with tempfile.TemporaryDirectory(prefix="elib-browser-", ignore_cleanup_errors=True) as profile:
        process = await asyncio.create_subprocess_exec(
            CHROMIUM,
            *FLAGS,
            f"--user-data-dir={profile}",
            "about:blank",
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
            env={**os.environ, "HOME": profile},
            start_new_session=True,
        )
        assert process.stderr is not None
        try:
            async with asyncio.timeout(PATIENCE):
                address = None
                while address is None:
                    line = (await process.stderr.readline()).decode(errors="replace")
                    assert line, "the browser ended"
                    address = re.search(r"ws://\S+", line)
            drained = asyncio.create_task(process.stderr.read())
            async with connect(address[0], max_size=None, ping_interval=None) as socket:
                wire = Wire(socket)
                tasks = [drained, asyncio.create_task(wire.listen())]
                try:
                    yield wire.open
                finally:
                    for task in tasks:
                        task.cancel()
                    await asyncio.gather(*tasks, return_exceptions=True)
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, 9)  # its own group, helpers included
            await process.wait()
