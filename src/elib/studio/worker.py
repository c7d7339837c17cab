"""What runs in the worker of a page: :func:`start` begins it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from elib.base.tasks import Tasks
from elib.panel.server.conversation import Told
from elib.studio import webserial
from elib.studio.messages import StudioPage
from elib.studio.place import napping
from elib.studio.studio import Studio

Post = Callable[[str | bytes], object]


class Messages:
    """What carries messages to the page: it takes them at once.

    Args:
        post: Sends a text or bytes.
    """

    unread = 0

    def __init__(self, post: Post) -> None:
        self._post = post

    def put(self, message: Told) -> None:
        """Send a message now."""
        self._post(msgspec.json.encode(message).decode())

    async def send(self, data: bytes, *, is_text: bool) -> None:
        """Send a message."""
        self._post(data.decode() if is_text else data)

    async def close(self, code: int, reason: str) -> None:
        """Do nothing: page and worker end together."""


class Worker:
    """The studio and its page.

    Args:
        post: Sends a text or bytes to the page.
        nap: Waits so many seconds, while the page is heard.
        begin: Calls a function later, in a way that lets it wait by *nap*.
        folder: Where programs and files lie.
        write: Gives bytes to the page for the robot on its serial port.
        guard: Gives the page the bytes that stop this robot.

    Attributes:
        port: That serial port.
    """

    def __init__(
        self,
        post: Post,
        nap: Callable[[float], None],
        begin: Callable[[Callable[[], None]], object],
        folder: Path,
        write: webserial.Send,
        guard: webserial.Send,
    ) -> None:
        messages = Messages(post)
        self.studio = Studio(messages.put, nap, begin, folder)
        self._page, self._tasks = StudioPage(self.studio, messages), Tasks()
        self.port = webserial.port = webserial.Port(write, guard, self.studio.program.place.wake)

    def hear(self, text: str) -> None:
        """Hear one message of the page; it is answered a moment later."""
        self._tasks.begin(self._page.hear(text), "elib studio")

    def receive(self, data: Any) -> None:
        """Take bytes of JavaScript that came from the robot on the serial port."""
        self.port.received(data.to_bytes())


def start(post: Any) -> Worker:
    """Begin in the worker of a browser.

    Args:
        post: The worker's own function that sends a text or bytes to the page.
    """
    import js  # type: ignore[import-not-found]  # only there
    from pyodide.ffi import create_proxy, to_js  # type: ignore[import-not-found]

    folder = Path.home() / "programs"
    folder.mkdir(exist_ok=True)
    nap = napping(js.nap, asyncio.get_event_loop())

    def send(data: str | bytes) -> None:
        post(data if isinstance(data, str) else to_js(data))

    return Worker(
        send,
        nap,
        lambda work: js.begin(create_proxy(work)),
        folder,
        lambda data: js.write(to_js(data)),
        lambda data: js.guard(to_js(data)),
    )
