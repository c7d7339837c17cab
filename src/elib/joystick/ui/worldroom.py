"""The world of a virtual robot on its page: seen from above, moved by hand, and made worse."""

from __future__ import annotations

import base64
from io import BytesIO
from typing import TYPE_CHECKING

from nicegui import ui

from elib.emulator.control import Control
from elib.emulator.control_server import answer
from elib.joystick.ui.feed import News
from elib.joystick.ui.messages import Message
from elib.joystick.ui.parts import Part, hint
from elib.physics import Snapshot
from elib.view import wire
from elib.view.floor import floor_picture

if TYPE_CHECKING:
    from elib.emulator.simulation import Simulation
    from elib.joystick.ui.cockpit import Cockpit

EVERY = 3
"""Frames from one look at a robot's readings to the next."""


class WorldRoom:
    """The world, where there is one.

    Args:
        cockpit: Of the robot in it.
    """

    def __init__(self, cockpit: Cockpit) -> None:
        self._cockpit = cockpit
        self._control: Control | None = None
        self._place = ui.element("div")
        self._part: Part | None = None
        self._seen: Snapshot | None = None
        self._ambient = 0.0
        self._number = 0
        self._robot: int | None = None
        self._world: Simulation | None = None
        self._is_built = False
        cockpit.page.viewer.sources.append(self._news)
        self.follow()

    def follow(self) -> None:
        """Build the view anew when the world is another, or gone."""
        control = self._cockpit.pilot.control
        world = None if control is None else control.simulation
        if self._is_built and world is self._world:
            return
        self._is_built, self._world, self._control, self._seen = True, world, control, None
        self._place.clear()
        with self._place:
            if control is None:
                self._part = None
                hint("Here stands the world of a virtual robot, once it is connected. A real robot has its own.")
            else:
                self._part = (
                    Part("world", own=self._cockpit.pilot.index).hear("act", self._act).hear("watch", self._watch)
                )
                self._part.hear("ready", lambda _: setattr(self, "_seen", None))

    def leave(self) -> None:
        """Send no more of it."""
        sources = self._cockpit.page.viewer.sources
        if self._news in sources:
            sources.remove(self._news)

    def _act(self, message: Message) -> None:
        if self._control is None or not isinstance(message.values, dict):
            return
        reply = answer(self._control, message.values)
        if self._part is not None:
            error, hint_text = str(reply.get("error", "")), str(reply.get("hint", ""))
            self._part.ask("tell", bool(reply["ok"]), f"{error} ({hint_text})" if hint_text else error)

    def _watch(self, message: Message) -> None:
        count = 0 if self._control is None else len(self._control.names)
        self._robot = message.whole("robot", 0, count - 1) if message.has("robot") and count else None

    def _news(self) -> News | None:
        control = self._control
        if control is None or self._part is None or self._cockpit.pilot.control is None:
            return None
        self._number += 1
        looks = self._robot is not None and self._number % EVERY == 0
        snapshot = control.snapshot(beams=looks)
        world: News = {"frame": _text(wire.frame(snapshot, self._number & 0xFFFFFFFF, control.is_cut))}
        if self._seen is None:
            world["scene"] = wire.scene(control, snapshot)
            if snapshot.floor.columns:
                world["floor"] = _floor(snapshot)
        else:
            change = wire.change(self._seen, snapshot) or {}
            if self._ambient != control.ambient:
                change["ambient"] = control.ambient
            if change:
                world["change"] = change
        self._seen, self._ambient = snapshot, control.ambient
        if looks and self._robot is not None and snapshot.robots[self._robot].beams:
            world["readings"] = wire.readings(control, snapshot, self._robot)
        return {"world": world}


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _floor(snapshot: Snapshot) -> str:
    out = BytesIO()
    floor_picture(snapshot.floor).save(out, "PNG")
    return f"data:image/png;base64,{_text(out.getvalue())}"


__all__ = ["WorldRoom"]
