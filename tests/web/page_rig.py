"""A page's end of the panel without a browser: what a stranger has who writes the protocol by hand."""

from __future__ import annotations

import asyncio
import contextlib
import html
import json
import re
import urllib.error
import urllib.request
import uuid
from collections.abc import AsyncIterator, Callable, Iterator

PATIENCE = 20.0


def fetch(url: str, **headers: str) -> tuple[int, str]:
    """Return status and text of an address."""
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(urllib.request.Request(url, headers=headers), timeout=PATIENCE) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read().decode()


async def until(is_so: Callable[[], bool]) -> None:
    """Wait for something that another task or process does."""
    async with asyncio.timeout(PATIENCE):
        while not is_so():  # noqa: ASYNC110  # nobody tells
            await asyncio.sleep(0.02)


class Page:
    """An open page.

    Attributes:
        client: Its name.
        listeners: Element and listener of everything that can be clicked, pushed or typed in.
        heard: Everything that the panel said, newest last.
    """

    def __init__(self, socket, client: str, elements: dict) -> None:
        self.client = client
        self.listeners: set[tuple[int, str, str]] = set()
        self.heard: list[str] = []
        self._socket = socket
        self._note(elements)

    async def listen(self) -> None:
        """Take note of what the panel says."""
        async for text in self._socket:
            if text == "2":
                await self._socket.send("3")
            self.heard.append(text)
            if text.startswith('42["update"'):
                self._note(json.loads(text[2:])[1])

    async def emit(self, element: int, listener: str, *arguments: str) -> None:
        """Let something happen on the page."""
        about = {"client_id": self.client, "id": element, "listener_id": listener, "args": arguments}
        await self._socket.send(f"42{json.dumps(['event', about])}")

    def of(self, kind: str) -> Iterator[tuple[int, str]]:
        """Return what listens to a kind of event."""
        return ((element, listener) for element, listener, name in sorted(self.listeners) if name == kind)

    def _note(self, elements: dict) -> None:
        for number, element in elements.items():
            for event in (element or {}).get("events", []) if number != "_id" else []:
                self.listeners.add((int(number), event["listener_id"], event["type"]))


@contextlib.asynccontextmanager
async def opened(url: str) -> AsyncIterator[Page]:
    """Open the panel's page."""
    from websockets.asyncio.client import connect

    status, text = await asyncio.to_thread(fetch, url)
    assert status == 200, text
    found = re.search(r'"client_id": "([0-9a-f-]+)"|\'client_id\': \'([0-9a-f-]+)\'', text)
    assert found is not None
    client = found[1] or found[2]
    elements = re.search(r"parseElements\(String.raw`(.*?)`\)", text, re.DOTALL)
    assert elements is not None
    tab = str(uuid.uuid4())
    query = f"client_id={client}&next_message_id=0&implicit_handshake=true&document_id={tab}&tab_id={tab}"
    place = url.removeprefix("http://").rstrip("/")
    async with connect(
        f"ws://{place}/_nicegui_ws/socket.io/?{query}&old_tab_id=null&EIO=4&transport=websocket",
        origin=f"http://{place}",
        proxy=None,
        compression=None,
        max_size=None,
        ping_interval=None,
    ) as socket:
        assert (await socket.recv()).startswith("0")
        await socket.send("40")
        page = Page(socket, client, json.loads(html.unescape(elements[1])))
        listening = asyncio.create_task(page.listen())
        try:
            await until(lambda: any(text.startswith("40") for text in page.heard))
            yield page
        finally:
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)
