"""What goes to the pages: one message a tick to each, however much it shows, and none to a page that lags behind."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from nicegui import Client

    from elib.joystick.state import Panel

PERIOD = 0.1
"""s between two messages to a page."""
AHEAD = 10
"""Messages on their way to a page that has not drawn them; it answers every fourth."""

News = dict[str, object]


class Source(Protocol):
    """Something on a page that has news now and then."""

    def __call__(self) -> News | None:
        """Return the news for the message, or None."""


class Viewer:
    """One page's end of the feed.

    Args:
        client: NiceGUI's name for the page.

    Attributes:
        sources: Asked for news at every tick.
    """

    def __init__(self, client: Client) -> None:
        self.client = client
        self.sources: list[Source] = []
        self.before: Callable[[], object] = lambda: None
        self._number = 0
        self._drawn = 0

    def draws(self, number: int) -> None:
        """Note how far the page has come."""
        self._drawn = min(max(self._drawn, number), self._number)

    def restart(self) -> None:
        """Note that the page connected anew: what was on its way is lost, or was sent again."""
        self._drawn = self._number

    def tick(self) -> None:
        """Send what is new, if the page is there and keeps up."""
        if not self.client.has_socket_connection:
            return
        self.before()
        if self._number - self._drawn >= AHEAD:
            return
        message: News = {"robots": {}}
        for source in tuple(self.sources):
            news = source()
            if news is None:
                continue
            robots = news.pop("robots", None)
            if isinstance(robots, dict):
                message["robots"] |= robots  # type: ignore[operator]
            message |= news
        self._number += 1
        message["number"] = self._number
        # JSON is JavaScript; and a page whose parts have not come yet needs no news.
        self.client.run_javascript(f"window.elib?.take({json.dumps(message, separators=(',', ':'))})")


class Feed:
    """The clock of all pages.

    Args:
        panel: Whose loop it runs on.
    """

    def __init__(self, panel: Panel) -> None:
        self._panel = panel
        self._viewers: set[Viewer] = set()
        self._is_running = False

    def enter(self, viewer: Viewer) -> None:
        """Send news to a page from now on."""
        self._viewers.add(viewer)
        if not self._is_running:
            self._is_running = True
            self._panel.begin(self._run())

    def leave(self, viewer: Viewer) -> None:
        """Send none any more."""
        self._viewers.discard(viewer)

    async def _run(self) -> None:
        loop = asyncio.get_running_loop()
        due = loop.time()
        try:
            while self._viewers:
                for viewer in tuple(self._viewers):
                    if viewer.client.is_deleted:
                        self.leave(viewer)
                    else:
                        viewer.tick()
                due = max(due + PERIOD, loop.time())
                await asyncio.sleep(due - loop.time())
        finally:
            self._is_running = False


__all__ = ["AHEAD", "PERIOD", "Feed", "News", "Source", "Viewer"]
