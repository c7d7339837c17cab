"""One robot on a page: how it is connected, the stick, what it senses, and all that can be done with it."""

from __future__ import annotations

import contextlib
from functools import partial
from typing import TYPE_CHECKING

from nicegui import ui

from elib.errors import ElibError
from elib.joystick.instruments import Cursor, scheme, tick
from elib.joystick.pilot import Phase
from elib.joystick.ui.feed import News
from elib.joystick.ui.messages import Message
from elib.joystick.ui.parts import RING, Part, button, card
from elib.joystick.ui.rooms import ROOMS, Room
from elib.protocol.actuators import ALL
from elib.protocol.quantities import CameraMode

if TYPE_CHECKING:
    from elib.joystick.ui.page import Page

OPEN = (Phase.CONNECTING, Phase.CONNECTED, Phase.GAP, Phase.PLAYING)
MODES = {"GREY": CameraMode.GREY, "COLOUR": CameraMode.COLOUR}


class Cockpit:
    """The page of one robot.

    Args:
        page: Whose it is.
        key: Of the robot in the panel.

    Attributes:
        page: As given.
        key: As given.
        pilot: The robot.
    """

    def __init__(self, page: Page, key: str) -> None:
        self.page, self.key = page, key
        self.pilot = page.panel.pilots[key]
        self._cursor = Cursor()
        self._scheme = -1
        self._phase: Phase | None = None
        self._room: Room | None = None
        page.viewer.sources.append(self._news)
        with ui.element("div").classes("cockpit"):
            self._build_connection()
            with card("Drive", area="drive"):
                part = Part("stick", key, page=page.name)
                part.hear("steer", self._steer).hear("beat", lambda _: self.pilot.helm.beat(page.name))
                part.hear("leave", lambda _: self.pilot.helm.leave(page.name))
                part.hear("limit", lambda message: self.pilot.helm.limit_to(message.number("limit", 0.0, 1.0)))
                part.hear("ask", lambda _: self._dialog.open())
            with card("Robot", area="seen"):
                self._face = Part("robot", key, **RING).hear("lamp", self._switch)
            with card("Camera", area="eye"):
                part = Part("camera", key).hear("camera", self._set_camera)
                part.hear("picture", lambda _: self.pilot.take_picture()).hear("live", self._watch)
            with card("Way", area="way"):
                Part("map", key)
            with card("Link", area="link"):
                Part("link", key)
            with card("Instruments", area="dials"):
                Part("instruments", key)
            self._build_rooms()
        self._build_dialog()

    def follow(self) -> None:
        """Show another phase in the buttons."""
        if self.pilot.phase is not self._phase:
            self._phase = self.pilot.phase
            is_open = self._phase in OPEN
            self._connect.set_text("Disconnect" if is_open else "Connect")
            self._connect.classes(remove="primary plain", add="plain" if is_open else "primary")
            if self._phase is Phase.CONNECTED and "image" not in self.pilot.readings:
                self.page.panel.begin(self._take_first_picture())
        if self._room is not None:
            self._room.follow()

    # -- the robot --

    def _steer(self, message: Message) -> None:
        self.pilot.helm.steer(self.page.name, message.number("left", -1.0, 1.0), message.number("right", -1.0, 1.0))

    async def _switch(self, message: Message) -> None:
        try:
            await self._switch_lamp(message)
        finally:
            self._face.ask("settle")

    async def _switch_lamp(self, message: Message) -> None:
        action = int(message.flag("on"))
        if message.flag("all"):
            await self.pilot.command("set_led", ALL, action)
        elif message.flag("body"):
            await self.pilot.command("set_body_led", action)
        elif message.flag("front"):
            await self.pilot.command("set_front_led", action)
        else:
            await self.pilot.command("set_led", message.whole("led", 0, 7), action)

    async def _set_camera(self, message: Message) -> None:
        size = message.whole("width", 1, 640), message.whole("height", 1, 640)
        mode = MODES[message.choice("mode", MODES)]
        await self.pilot.set_camera(*size, message.whole("zoom", 1, 8), mode)
        await self.pilot.take_picture()

    async def _take_first_picture(self) -> None:
        with contextlib.suppress(ElibError):  # nobody asked for it
            await self.pilot.take_picture()

    def _watch(self, message: Message) -> None:
        self.pilot.watch_camera(message.number("seconds", 0.4, 60.0) if message.has("seconds") else None)

    def _news(self) -> News:
        robot: dict[str, object] = {"tick": tick(self.pilot, self._cursor)}
        if self._scheme != self.pilot.edition:
            self._scheme = self.pilot.edition
            robot["scheme"] = scheme(self.pilot)
        return {"robots": {self.key: robot}}

    # -- the page --

    def _build_connection(self) -> None:
        with ui.element("section").classes("card connection").props('aria-label="connection"'):
            with ui.element("div").classes("row wrap"):
                with ui.element("h1"):
                    ui.label(self.pilot.name)
                self._connect = button("Connect", self._connect_or_not, kind="primary")
                button("Close tab", lambda: self.page.close_robot(self.key))
            Part("status", self.key)

    async def _connect_or_not(self) -> None:
        if self.pilot.phase in OPEN:
            await self.pilot.disconnect()
        else:
            self.page.panel.connect(self.key)

    def _build_dialog(self) -> None:
        with ui.dialog() as self._dialog, ui.element("div").classes("card dialog").props('role="alertdialog"'):
            ui.label("Take over?").classes("title")
            ui.label("Somebody drives this robot from another browser. It stops first; then you drive and they watch.")
            with ui.element("div").classes("row"):
                button("Take over", self._take_over, kind="primary")
                button("Keep watching", self._dialog.close)

    def _take_over(self) -> None:
        self._dialog.close()
        self.pilot.helm.take(self.page.name, by_force=True)

    def _build_rooms(self) -> None:
        with ui.element("section").classes("card rooms").props('aria-label="more"'):
            with ui.tabs().props("no-caps inline-label align=left outside-arrows mobile-arrows") as tabs:
                for name in ROOMS:
                    ui.tab(name)
            self._place = ui.element("div").classes("room").props('role="tabpanel"')
        tabs.on_value_change(partial(self._enter))
        tabs.set_value(next(iter(ROOMS)))

    def _enter(self, event: object) -> None:
        name = str(getattr(event, "value", ""))
        if name not in ROOMS:
            return
        if self._room is not None:
            self._room.leave()
        self._place.clear()
        with self._place:
            self._room = ROOMS[name](self)


__all__ = ["Cockpit"]
