"""All robots at a glance, and one stop for all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

from elib.joystick.instruments import summary
from elib.joystick.ui.feed import News
from elib.joystick.ui.labels import labels
from elib.joystick.ui.messages import Message
from elib.joystick.ui.parts import RING, Part, button, heading

if TYPE_CHECKING:
    from elib.joystick.ui.page import Page

EVERY = 2
"""Ticks for one message: five a second."""


class Overview:
    """The overview.

    Args:
        page: Whose it is.
    """

    def __init__(self, page: Page) -> None:
        self._page = page
        self._count = 0
        with ui.element("section").classes("card all").props('aria-label="all robots"'):
            with ui.element("div").classes("row wrap"):
                heading("All robots")
                button("Connect all", self._connect)
            Part("overview", "", **RING).hear("open", self._open).hear("stop", self._stop)
        page.viewer.sources.append(self._news)

    def follow(self) -> None:
        """Do nothing: the news tell all."""

    def _news(self) -> News | None:
        self._count += 1
        if self._count % EVERY != 1:
            return None
        pilots = self._page.panel.pilots
        names = labels(pilots.values())
        pairs = zip(pilots.items(), names, strict=True)
        return {"overview": {key: summary(pilot) | {"name": name} for (key, pilot), name in pairs}}

    def _connect(self) -> None:
        for key in self._page.panel.pilots:
            self._page.panel.connect(key)

    def _open(self, message: Message) -> None:
        self._page.open(message.choice("robot", self._page.panel.pilots.keys()))

    def _stop(self, message: Message) -> None:
        self._page.panel.pilot(message.choice("robot", self._page.panel.pilots.keys())).stop()


__all__ = ["Overview"]
