"""``elib joystick`` with a page of three lines, which drives the first robot for as long as it is connected."""

from __future__ import annotations

import asyncio
import sys
import types

import elib.web
from elib.cli import main
from elib.web.panel import Panel


def build(panel: Panel) -> None:
    """Register a page, and drive."""
    from nicegui import ui

    @ui.page("/")
    def index() -> None:
        ui.label("driving")

    async def drive() -> None:
        while True:
            await asyncio.sleep(0.05)
            for slot in panel.slots.values():
                if slot.is_connected:
                    slot.drive.steer("page", 0.4, 0.4)

    panel.begin(drive())


pages = types.ModuleType("elib.web.pages")
pages.build = build  # type: ignore[attr-defined]
sys.modules["elib.web.pages"] = elib.web.pages = pages  # type: ignore[attr-defined]
sys.exit(main())
