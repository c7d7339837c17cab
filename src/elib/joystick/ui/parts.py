"""The element that holds a part written in JavaScript, and small things of the page's layout."""

from __future__ import annotations

import inspect
import math
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Self

from nicegui import ui
from nicegui.element import Element
from nicegui.events import GenericEventArguments

import elib.view
from elib.body import SENSOR_DIRECTIONS
from elib.errors import ElibError
from elib.joystick.ui.messages import Message
from elib.view.robot import LED_ANGLES

VIEW = Path(elib.view.__file__).parent / "page"
RING: Mapping[str, list[float]] = {
    "sensors": [round(math.degrees(angle), 2) for angle in SENSOR_DIRECTIONS],
    "leds": list(LED_ANGLES),
}
"""Options of parts that draw a robot: where its sensors look and its LEDs sit, degrees from straight ahead, positive to
the left."""

Handler = Callable[[Message], "Awaitable[object] | object"]


class Part(Element, component="part.js", esm={"elib-joystick": "js", "elib-view": str(VIEW)}):
    """A part of the page that draws and listens by itself.

    Args:
        kind: Its file in ``js``.
        robot: Key of the robot whose news it hears; empty for none.
        options: What it is told once.
    """

    def __init__(self, kind: str, robot: str = "", **options: object) -> None:
        super().__init__()
        self._props["kind"] = kind
        self._props["robot"] = robot
        self._props["options"] = options

    def hear(self, name: str, handler: Handler) -> Self:
        """Call *handler* with what the part sends under a name; what goes wrong is said on the page."""

        async def take(event: GenericEventArguments) -> None:
            try:
                result = handler(Message(event.args))
                if inspect.isawaitable(result):
                    await result
            except ElibError as error:
                complain(error)

        self.on(name, take)
        return self

    def ask(self, name: str, *values: object) -> None:
        """Call a method of the part; before it is there, the wish waits for it."""
        self.run_method("ask", name, *values)


def complain(error: ElibError) -> None:
    """Say on the page what went wrong."""
    say(f"{error.message} ({error.hint})" if error.hint else error.message, is_bad=True)


def say(text: str, *, is_bad: bool = False) -> None:
    """Say something on the page, as text."""
    with suppress(RuntimeError):  # the page has gone meanwhile
        ui.notification(
            text,
            type="negative" if is_bad else "info",
            position="bottom",
            timeout=6 if is_bad else 3,
            close_button="Close",
        )


def guarded(work: Callable[[], Awaitable[object] | object]) -> Callable[[], Awaitable[None]]:
    """Return a handler of clicks that says on the page what went wrong."""

    async def click() -> None:
        try:
            result = work()
            if inspect.isawaitable(result):
                await result
        except ElibError as error:
            complain(error)

    return click


def button(text: str, work: Callable[[], Awaitable[object] | object], *, kind: str = "plain") -> ui.button:
    """Make a button.

    Args:
        text: On it.
        work: What a click does.
        kind: ``plain``, ``primary`` or ``danger``.
    """
    return ui.button(text, on_click=guarded(work), color=None).props("unelevated no-caps").classes(f"elib {kind}")


def card(title: str, *, area: str = "") -> ui.element:
    """Make a card with a heading; use it as a context."""
    box = ui.element("section").classes(f"card {area}").props(f'aria-label="{title}"')
    with box:
        heading(title)
    return box


def heading(text: str) -> None:
    """Make the heading of a card."""
    with ui.element("h2"):
        ui.label(text)


def hint(text: str) -> ui.label:
    """Make a line of explanation."""
    return ui.label(text).classes("hint")


__all__ = ["RING", "Handler", "Part", "button", "card", "complain", "guarded", "heading", "hint", "say"]
