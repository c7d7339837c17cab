"""``elib joystick`` with a page of three lines, which drives the first robot for as long as it is connected."""

from __future__ import annotations

import asyncio
import sys
import types

import elib.joystick
from elib.cli import main
from elib.joystick.state import Panel


def build(panel: Panel) -> None:
    """Register a page, and drive."""
    from nicegui import ui

    @ui.page("/")
    def index() -> None:
        ui.label("driving")

    async def drive() -> None:
        while True:
            await asyncio.sleep(0.05)
            for pilot in panel.pilots.values():
                if pilot.is_connected:
                    pilot.helm.steer("page", 0.4, 0.4)

    panel.begin(drive())


pages = types.ModuleType("elib.joystick.pages")
pages.build = build  # type: ignore[attr-defined]
sys.modules["elib.joystick.pages"] = elib.joystick.pages = pages  # type: ignore[attr-defined]
sys.exit(main())
