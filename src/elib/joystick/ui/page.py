"""One browser's page: its header, its tabs, and what is below them."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
from functools import partial

from nicegui import ui

from elib.errors import ArgumentError
from elib.joystick.pilot import Pilot
from elib.joystick.recents import Recents
from elib.joystick.state import Panel
from elib.joystick.ui.cockpit import Cockpit
from elib.joystick.ui.feed import Feed, Viewer
from elib.joystick.ui.labels import labels
from elib.joystick.ui.messages import Message
from elib.joystick.ui.overview import Overview
from elib.joystick.ui.parts import Part, button
from elib.joystick.ui.start import Start

OVERVIEW, START = "overview", "start"


class Page:
    """What one browser sees.

    Args:
        panel: The robots.
        feed: Sends the news.

    Attributes:
        name: Of the page, at the helms: nobody else can guess it.
        key: Of the robot it shows, or ``overview``, or ``start``.
    """

    def __init__(self, panel: Panel, feed: Feed) -> None:
        self.panel, self.feed = panel, feed
        self.name = f"page-{secrets.token_hex(8)}"
        self.key = ""
        self._recents = Recents()
        self._client = ui.context.client
        self.viewer = Viewer(self._client)
        self._shown: Cockpit | Overview | Start | None = None
        self._listed: tuple[tuple[str, str], ...] | None = None
        self._joined: set[Pilot] = set()

    @property
    def recents(self) -> list[str]:
        """URLs of robots used lately, newest first."""
        return self._recents.urls

    def build(self) -> None:
        """Put everything on the page."""
        with ui.element("header").classes("bar"):
            ui.element("span").classes("brand").props('role="img" aria-label="elib joystick"')
            self._tabs = ui.element("nav").classes("tabs").props('aria-label="robots"')
            Part("theme")
            self._stop = Part("stop", text="STOP").classes("stop-place").hear("stop", self._on_stop)
        self._body = ui.element("main")
        Part("wire").hear("drawn", lambda message: self.viewer.draws(message.whole("number", 0, 1 << 53)))
        self.viewer.before = self._follow
        self._client.on_connect(self._on_connect)
        self._client.on_delete(lambda: self.feed.leave(self.viewer))
        self._client.on_disconnect(self._on_disconnect)
        pilots = list(self.panel.pilots)
        self.open(START if not pilots else pilots[0] if len(pilots) == 1 else OVERVIEW)
        self.feed.enter(self.viewer)

    def open(self, key: str) -> None:
        """Show a robot, the overview, or the start page."""
        if key not in (OVERVIEW, START) and key not in self.panel.pilots:
            key = OVERVIEW if self.panel.pilots else START
        self._leave_helm()
        self.key = key
        self.viewer.sources.clear()
        self._body.clear()
        with self._body:
            match key:
                case "overview":
                    self._shown = Overview(self)
                case "start":
                    self._shown = Start(self)
                case _:
                    self._shown = Cockpit(self, key)
        self._listed = None
        self._list()
        is_one = key in self.panel.pilots
        self._stop.ask("attend", key if is_one else "", "STOP" if is_one else "STOP ALL")

    def connect(self, url: str) -> None:
        """Make a place for a robot, begin to connect it, and show it; once it is connected it is remembered.

        Raises:
            ArgumentError: The URL cannot be, or the panel is full.
        """
        key = self.panel.add(url)
        self.panel.begin(self._connect(self.panel.pilot(key)))
        self.open(key)

    async def close_robot(self, key: str) -> None:
        """Disconnect a robot and give its place up. Safe to repeat."""
        self.panel.begin(self._take_out(key))
        await asyncio.sleep(0)  # now it is out of the panel; that it parts takes longer
        self.open(OVERVIEW if self.panel.pilots else START)

    # -- how --

    async def _connect(self, pilot: Pilot) -> None:
        if await pilot.connect():
            self._recents.add(pilot.url)

    async def _take_out(self, key: str) -> None:
        with contextlib.suppress(ArgumentError):  # a second click, or another page, was faster
            await self.panel.remove(key)

    def _follow(self) -> None:
        """Show what has changed in the panel since the last tick."""
        with self._client:
            if self.key not in (OVERVIEW, START) and self.key not in self.panel.pilots:
                self.open(OVERVIEW)
            self._list()
            self._join()
            if self._shown is not None:
                self._shown.follow()

    def _list(self) -> None:
        listed = tuple(zip(self.panel.pilots, labels(self.panel.pilots.values()), strict=True))
        if listed == self._listed:
            return
        self._listed = listed
        self._tabs.clear()
        with self._tabs:
            entries = [(OVERVIEW, "All robots")] if len(listed) > 1 or self.key == OVERVIEW else []
            for key, name in [*entries, *listed, (START, "+")]:
                tab = button(name, partial(self.open, key), kind="tab")
                if key in self.panel.pilots:
                    tab.tooltip(self.panel.pilots[key].url)
                if key == START:
                    tab.props('aria-label="another robot"')
                if key == self.key:
                    tab.props('aria-current="page"')

    def _on_stop(self, message: Message) -> None:
        pilot = self.panel.pilots.get(self.key)
        if pilot is None:
            self.panel.stop_all()
        else:
            pilot.stop()

    def _on_connect(self) -> None:
        self.viewer.restart()

    def _on_disconnect(self) -> None:
        for pilot in self._joined:
            pilot.leave(self.name)
        self._joined.clear()

    def _join(self) -> None:
        """Look on at every robot, also those of other tabs: what one started there goes on."""
        there = set(self.panel.pilots.values())
        for pilot in there - self._joined:
            pilot.join(self.name)
        self._joined = there

    def _leave_helm(self) -> None:
        for pilot in self._joined:
            pilot.helm.leave(self.name)


__all__ = ["OVERVIEW", "START", "Page"]
