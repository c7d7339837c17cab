"""Where a robot is chosen: by its URL, from those used lately, or from the simulator's worlds."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from nicegui import ui

from elib.joystick.ui.parts import button, card, guarded, hint
from elib.physics.worldfile import gallery

if TYPE_CHECKING:
    from elib.joystick.ui.page import Page

FIRST = "arena"
"""The world that is offered first."""
WAYS = (
    ("serial:///dev/rfcomm0", "Bluetooth or a cable, on Linux"),
    ("serial://COM4", "Bluetooth or a cable, on Windows"),
    ("tcp://192.168.1.20:1000", "serial bytes over a network"),
    ("sim://arena", "a virtual robot"),
)


class Start:
    """The start page.

    Args:
        page: Whose it is.
    """

    def __init__(self, page: Page) -> None:
        self._page = page
        with ui.element("div").classes("start"):
            with card("Connect a robot"):
                with ui.element("form").classes("row").on("submit.prevent", guarded(self._submit)):
                    self._url = (
                        ui.input("URL of the robot", placeholder=WAYS[0][0], autocomplete=list(page.recents))
                        .props("outlined dense maxlength=500 spellcheck=false autocapitalize=none")
                        .classes("grow")
                    )
                    button("Connect", lambda: None, kind="primary").props("type=submit")
                with ui.element("dl").classes("ways"):
                    for url, text in WAYS:
                        with ui.element("dt"):
                            ui.label(url)
                        with ui.element("dd"):
                            ui.label(text)
            if page.recents:
                with card("Used lately"), ui.element("div").classes("choices"):
                    for url in page.recents:
                        button(url, partial(self._connect, url))
            with card("No robot at hand?"):
                hint("The simulator has one, in any of these worlds.")
                with ui.element("div").classes("choices"):
                    names = sorted(gallery(), key=lambda name: (name != FIRST, name))
                    for name in names:
                        button(
                            name, partial(self._connect, f"sim://{name}"), kind="primary" if name == FIRST else "plain"
                        )

    def follow(self) -> None:
        """Do nothing: it stands still."""

    def _submit(self) -> None:
        self._connect(str(self._url.value or "").strip())

    def _connect(self, url: str) -> None:
        self._page.connect(url)


__all__ = ["Start"]
