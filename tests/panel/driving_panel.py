"""``elib joystick`` without a page: it drives the first robot for as long as it is connected."""

from __future__ import annotations

import asyncio
import sys

from elib.cli import main
from elib.panel.panel import Panel
from elib.panel.server import http as server


class DrivingPanel(Panel):
    """A panel that drives its robots."""

    def __init__(self, *, is_shared: bool) -> None:
        super().__init__(is_shared=is_shared)
        self._tasks.begin(self._drive(), "drives")

    async def _drive(self) -> None:
        while True:
            await asyncio.sleep(0.05)  # clock: it drives until the program ends
            for slot in self.slots.values():
                if slot.is_connected:
                    slot.drive.steer("page", 0.4, 0.4)


server.Panel = DrivingPanel  # type: ignore[misc]
sys.exit(main())
