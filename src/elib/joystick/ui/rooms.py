"""What one does with a robot beside driving it: a room each, and only one of them is open."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol

from nicegui import ui

from elib.errors import ElibError
from elib.joystick.console import LONGEST, answer, complete, help_line
from elib.joystick.ui.behaviourroom import BehaviourRoom
from elib.joystick.ui.messages import Message
from elib.joystick.ui.parts import Part, button
from elib.joystick.ui.records import Records
from elib.joystick.ui.worldroom import WorldRoom

if TYPE_CHECKING:
    from elib.joystick.ui.cockpit import Cockpit


class Room(Protocol):
    """What stands under a tab."""

    def __init__(self, cockpit: Cockpit) -> None:
        """Put it on the page, in the current place."""

    def follow(self) -> None:
        """Show what has changed; ten times a second."""

    def leave(self) -> None:
        """Make an end: another room is opened."""


class Charts:
    """Strip charts, as many as one likes up to six."""

    FIRST = ("proximity", "speed")
    MOST = 6

    def __init__(self, cockpit: Cockpit) -> None:
        self._key = cockpit.key
        self._place = ui.element("div").classes("charts")
        for name in self.FIRST:
            self._add(name)
        button("Add a chart", lambda: self._add("accelerometer"))

    def _add(self, name: str) -> None:
        if len(self._place.default_slot.children) >= self.MOST:
            return
        with self._place:
            part = Part("chart", self._key, name=name)

        def remove(message: Message) -> None:
            part.delete()

        part.hear("remove", remove)

    def follow(self) -> None:
        """Do nothing: the charts hear the news themselves."""

    def leave(self) -> None:
        """Do nothing."""


class Events:
    """The event log."""

    def __init__(self, cockpit: Cockpit) -> None:
        Part("events", cockpit.key)

    def follow(self) -> None:
        """Do nothing: it hears the news itself."""

    def leave(self) -> None:
        """Do nothing."""


class Console:
    """A line to the robot."""

    def __init__(self, cockpit: Cockpit) -> None:
        self._cockpit = cockpit
        self._part = Part("console").hear("typed", self._typed).hear("send", self._send)

    def _typed(self, message: Message) -> None:
        text, firmware = message.text("text", LONGEST), self._cockpit.pilot.firmware
        choices = complete(text, firmware) if text.strip() else []
        try:
            help_text = help_line(text, firmware) if text.strip() else ""
        except ElibError:
            help_text = "" if choices else "There is no such command; help lists them all."
        self._part.ask("hint", text, choices, help_text)

    async def _send(self, message: Message) -> None:
        text = message.text("text", LONGEST)
        said = await answer(self._cockpit.pilot, text, self._cockpit.page.name)
        self._part.ask("answer", said.text, said.is_bad)

    def follow(self) -> None:
        """Do nothing: it speaks when it is spoken to."""

    def leave(self) -> None:
        """Do nothing."""


ROOMS: Mapping[str, type[Room]] = {
    "World": WorldRoom,
    "Charts": Charts,
    "Behaviours": BehaviourRoom,
    "Console": Console,
    "Events": Events,
    "Files": Records,
}
"""By the words on their tabs, in their order."""

__all__ = ["ROOMS", "Room"]
