"""Browsers for tests: chromium and Firefox without a window, each driven by its own protocol over a WebSocket.

Chromium speaks its DevTools protocol, Firefox WebDriver BiDi (https://w3c.github.io/webdriver-bidi/).
"""

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

from shared import PATIENCE, until

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
FIREFOX = next((path for name in ("firefox-esr", "firefox") if (path := shutil.which(name))), None)

needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no chromium: apt-get install chromium")
needs_firefox = pytest.mark.skipif(FIREFOX is None, reason="no Firefox: apt-get install firefox-esr")

CHROMIUM_FLAGS = [
    "--headless=new",
    "--no-sandbox",  # it refuses to run as root otherwise
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",  # WebGL without a graphics card; the page is our own
    "--disable-gpu-compositing",  # the rest of a page is drawn sooner without an emulated graphics card
    "--disable-gpu-rasterization",
    "--disable-accelerated-2d-canvas",
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
    "--user-data-dir={}",
    "about:blank",
]
FIREFOX_FLAGS = ["--headless", "--no-remote", "--remote-debugging-port=0", "--profile", "{}"]
BIDI_KEYS = {
    "ArrowUp": "\ue013",
    "ArrowDown": "\ue015",
    "ArrowLeft": "\ue012",
    "ArrowRight": "\ue014",
    "Enter": "\ue007",
    "Escape": "\ue00c",
    "Tab": "\ue004",
}
"""WebDriver's characters for keys that have none (https://www.w3.org/TR/webdriver2/#keyboard-actions)."""


OF_DRIVER = "GL Driver Message (OpenGL, Performance"
"""How chromium begins to say that its emulated graphics card is slow, which is nothing of the page."""

LEFT = ["Inspected target navigated", "Execution context was destroyed", "Cannot find default execution context"]
"""What chromium answers while one page goes and the next one comes."""


class PageLeft(Exception):
    """The page went to another address before it answered."""


class NotThere(AssertionError):
    """An expression asked for what the page does not have: a TypeError of JavaScript, such as one of ``null``."""


def thrown(result: dict) -> AssertionError:
    """Return the error that an expression ended in."""
    return (NotThere if "TypeError: " in str(result) else AssertionError)(result)


class Wire:
    """Our end of a browser's protocol: results find their calls, and events go to whoever listens.

    Attributes:
        on_event: Called with each event.
    """

    def __init__(self, socket) -> None:
        self.on_event: Callable[[dict], None] = lambda event: None
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
            else:
                self.on_event(message)

    async def call(self, method: str, params: dict, **more: object) -> dict:
        number = next(self._numbers)
        future = self._waiting[number] = asyncio.get_running_loop().create_future()
        await self._socket.send(json.dumps({"id": number, "method": method, "params": params, **more}))
        async with asyncio.timeout(PATIENCE):
            answer = await future
        if any(each in str(answer.get("error")) for each in LEFT):
            raise PageLeft(method)
        assert "error" not in answer, (method, answer)
        return answer["result"]


class Tab:
    """One page in chromium.

    Attributes:
        requests: URLs of everything it asked for.
        complaints: What its console said that was no mere note, and exceptions.
    """

    def __init__(self, wire: Wire, name: str) -> None:
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self._wire = wire
        self._name = name

    async def run(self, expression: str) -> object:
        """Return what a JavaScript expression gives."""
        result = await self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in result:
            raise thrown(result)
        return result["result"].get("value")

    async def until(self, expression: str) -> object:
        """Wait until a JavaScript expression is true, also on the page that comes next, and return it.

        What it asks for may come later, or be away for a moment.
        """
        missing: NotThere | None = None

        async def now() -> object:
            nonlocal missing
            missing = None
            try:
                return await self.run(expression)
            except PageLeft:
                return None
            except NotThere as error:
                missing = error
                return None

        try:
            return await until(now)
        except AssertionError as error:
            raise error from missing

    async def drawn(self) -> None:
        """Wait until what has changed is drawn."""
        await self.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done())))")

    async def reload(self) -> None:
        """Load the page anew, and return when the old one is gone."""
        with contextlib.suppress(PageLeft):
            await self.run("void (window.isOld = true, location.reload())")  # clock: the place for it
        await self.until("!window.isOld")

    async def go(self, url: str) -> None:
        """Open a page in this tab."""
        await self.call("Page.navigate", url=url)

    async def middle(self, element: str) -> tuple[float, float]:
        """Return where the middle of an element is, a JavaScript expression, as soon as nothing is before it.

        It is scrolled there if need be. What slides in, like a dialog, or is moved by what comes above it, is waited
        for. A shape may have its middle outside of itself.
        """
        x, y = await self.until(  # type: ignore[misc]
            f"(async () => {{ const it = {element}; if (!it) return false;"
            " const place = () => { const b = it.getBoundingClientRect();"
            " return [b.left + b.width / 2, b.top + b.height / 2]; }, before = place();"
            " await new Promise((done) => setTimeout(done, 50));"
            " const there = it.getRootNode().elementFromPoint(...before);"
            " const isFree = it.contains(there) || (it instanceof SVGElement && there?.contains(it));"
            " if (!isFree) it.scrollIntoView({ block: 'center', behavior: 'instant' });"
            " return isFree && place().join() === before.join() && before; })()"
        )
        return x, y

    async def click(self, element: str) -> None:
        """Click the middle of an element, a JavaScript expression; again if it was moved before the mouse was there."""
        listen = (
            "void (window.clicked?.abort(), window.clicked = new AbortController(), clicked.kinds = [],"
            " ['pointerdown', 'click'].forEach((kind) => document.addEventListener(kind, (event) =>"
            f" event.composedPath().includes({element}) && clicked.kinds.push(kind),"
            " { capture: true, signal: clicked.signal })))"
        )
        # What acts when the mouse is pressed, such as a line of the editor, may be another element when it is released.
        is_hit = (
            "clicked.kinds.includes('click') ||"
            f" (clicked.kinds.includes('pointerdown') && !({element})?.matches('a, button, input, [role=tab]'))"
        )

        async def hit() -> object:
            x, y = await self.middle(element)
            await self.run(listen)
            for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
                await self.mouse(kind, x, y)
            return await self.run(is_hit)

        await until(hit)

    async def mouse(self, kind: str, x: float, y: float) -> None:
        """Move, press or release the mouse at a place on the page."""
        pressed = 0 if kind == "mouseReleased" else 1
        button = "none" if kind == "mouseMoved" and not pressed else "left"
        await self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=pressed, clickCount=1)

    async def key(self, key: str, code: str = "", *, kind: str = "", shift: bool = False) -> None:
        """Press and release a key, or only one of both (``keyDown``, ``keyUp``)."""
        number = {"Tab": 9, "Enter": 13, "Space": 32}.get(code, 0)
        text = {"text": "\r"} if code == "Enter" else {"text": " "} if code == "Space" else {}
        for each in (kind,) if kind else ("keyDown", "keyUp"):
            await self.call(
                "Input.dispatchKeyEvent",
                type=each,
                key=key,
                code=code,
                modifiers=8 if shift else 0,
                windowsVirtualKeyCode=number,
                **(text if each == "keyDown" else {}),
            )

    async def type(self, text: str) -> None:
        """Type a text into what has the focus."""
        await self.call("Input.insertText", text=text)

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

    async def close(self) -> None:
        """Close the page."""
        await self.call("Page.close")

    async def call(self, method: str, **params: object) -> dict:
        """Call a method of the protocol on this page."""
        return await self._wire.call(method, params, sessionId=self._name)

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
            case "Log.entryAdded" if (entry := params["entry"])["level"] in ("error", "warning"):
                if OF_DRIVER not in entry["text"]:
                    self.complaints.append(entry["text"] + " " + entry.get("url", ""))


class FirefoxTab(Tab):
    """One page in Firefox."""

    async def run(self, expression: str) -> object:
        result = await self.call(
            "script.evaluate",
            expression=f"(async () => JSON.stringify(await ({expression})) ?? 'null')()",
            target={"context": self._name},
            awaitPromise=True,
        )
        if result["type"] != "success":
            raise thrown(result)
        return json.loads(result["result"]["value"])

    async def go(self, url: str) -> None:
        await self.call("browsingContext.navigate", url=url, wait="interactive")

    async def mouse(self, kind: str, x: float, y: float) -> None:
        press = {"mousePressed": "pointerDown", "mouseReleased": "pointerUp"}.get(kind)
        actions: list[dict] = [{"type": "pointerMove", "x": round(x), "y": round(y)}]
        if press:
            actions.append({"type": press, "button": 0})
        await self._act({"type": "pointer", "id": "mouse", "actions": actions})

    async def key(self, key: str, code: str = "", *, kind: str = "", shift: bool = False) -> None:
        assert not shift
        value = BIDI_KEYS.get(key, key)
        kinds = (kind,) if kind else ("keyDown", "keyUp")
        await self._act({"type": "key", "id": "keys", "actions": [{"type": each, "value": value} for each in kinds]})

    async def type(self, text: str) -> None:
        for letter in text:
            await self.key(letter)

    async def size(self, width: int, height: int, *, dark: bool = False, phone: bool = False) -> None:
        assert not dark
        assert not phone
        await self.call("browsingContext.setViewport", viewport={"width": width, "height": height})

    async def shot(self) -> bytes:
        return base64.b64decode((await self.call("browsingContext.captureScreenshot"))["data"])

    async def close(self) -> None:
        await self.call("browsingContext.close")

    async def call(self, method: str, **params: object) -> dict:
        return await self._wire.call(method, params if "target" in params else {"context": self._name, **params})

    def note(self, method: str, params: dict) -> None:
        if method == "network.beforeRequestSent":
            self.requests.append(params["request"]["url"])
        elif params["level"] in ("error", "warn"):
            self.complaints.append(json.dumps(params))

    async def _act(self, source: dict) -> None:
        await self.call("input.performActions", actions=[source])


Opener = Callable[[str], Awaitable[Tab]]


@contextlib.asynccontextmanager
async def browser() -> AsyncIterator[Opener]:
    """Start chromium; what it yields opens a page and returns its tab."""
    assert CHROMIUM is not None
    tabs: dict[str, Tab] = {}

    async def opened(url: str) -> Tab:
        # Each in a window of its own: a tab behind another draws nothing, and the mouse moves on it only after 5 s.
        target = (await wire.call("Target.createTarget", {"url": "about:blank", "newWindow": True}))["targetId"]
        name = (await wire.call("Target.attachToTarget", {"targetId": target, "flatten": True}))["sessionId"]
        tab = tabs[name] = Tab(wire, name)
        for domain in ("Page", "Runtime", "Network", "Log"):
            await tab.call(f"{domain}.enable")
        await tab.go(url)
        return tab

    def note(event: dict) -> None:
        if tab := tabs.get(event.get("sessionId", "")):
            tab.note(event["method"], event.get("params", {}))

    async with _started(CHROMIUM, *CHROMIUM_FLAGS) as address, _wire(address) as wire:
        wire.on_event = note
        yield opened


@contextlib.asynccontextmanager
async def firefox() -> AsyncIterator[Opener]:
    """Start Firefox; what it yields opens a page and returns its tab."""
    assert FIREFOX is not None
    tabs: dict[str, Tab] = {}

    async def opened(url: str) -> Tab:
        name = (await wire.call("browsingContext.create", {"type": "tab"}))["context"]
        tab = tabs[name] = FirefoxTab(wire, name)
        await tab.go(url)
        return tab

    def note(event: dict) -> None:
        params = event["params"]
        if tab := tabs.get(params.get("context") or params.get("source", {}).get("context", "")):
            tab.note(event["method"], params)

    async with _started(FIREFOX, *FIREFOX_FLAGS) as address, _wire(f"{address}/session") as wire:
        wire.on_event = note
        await wire.call("session.new", {"capabilities": {}})
        await wire.call("session.subscribe", {"events": ["log.entryAdded", "network.beforeRequestSent"]})
        yield opened


@contextlib.asynccontextmanager
async def _started(*command: str) -> AsyncIterator[str]:
    """Run a browser with a profile of its own, ``{}`` in the command; yield where it listens and kill it at the end."""
    with tempfile.TemporaryDirectory(prefix="elib-browser-", ignore_cleanup_errors=True) as profile:
        process = await asyncio.create_subprocess_exec(
            *(word.format(profile) for word in command),
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
            env={**os.environ, "HOME": profile},
            start_new_session=True,
        )
        assert process.stderr is not None
        try:
            async with asyncio.timeout(PATIENCE):
                said = ""
                while not (address := re.search(r"ws://\S+", said)):
                    line = (await process.stderr.readline()).decode(errors="replace")
                    assert line, f"the browser ended: {said}"
                    said += line
            drained = asyncio.create_task(process.stderr.read())
            try:
                yield address[0]
            finally:
                drained.cancel()
                await asyncio.gather(drained, return_exceptions=True)
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, 9)  # its own group, helpers included
            await process.wait()


@contextlib.asynccontextmanager
async def _wire(address: str) -> AsyncIterator[Wire]:
    """Talk to a browser at its address."""
    from websockets.asyncio.client import connect

    async with connect(address, max_size=None, ping_interval=None, open_timeout=PATIENCE) as socket:
        wire = Wire(socket)
        listening = asyncio.create_task(wire.listen())
        try:
            yield wire
        finally:
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)
