"""Pictures of a world for programs that learn: an array, or a page in the browser while the program runs."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from elib.base.browser import show_page
from elib.base.extras import check_web
from elib.simulator.emulator.control import Control
from elib.simulator.physics import World

if TYPE_CHECKING:
    from elib.panel.panel import Panel
    from elib.simulator.emulator.simulation import Simulation

SIZE = 480
"""Pixels of the arena's longer side: a picture takes 30 ms."""


def picture(world: World) -> NDArray[np.uint8]:
    """Return the world seen from above, with the rays of the infrared sensors, (rows, columns, 3)."""
    from elib.simulator.drawing.png import render
    from elib.simulator.drawing.top import top_view

    return np.array(render(top_view(world.snapshot(beams=True), (), None, SIZE)), dtype=np.uint8)


class _Shown(Control):
    """A world as the program that runs it showed it last; the page is told of it, and can change nothing."""

    def __init__(self, world: World) -> None:
        clock = SimpleNamespace(is_paused=False, rate=1.0, refusal="the program that learns runs this world")
        names = tuple(f"epuck-{index + 1}" for index in range(world.robots))
        shown = SimpleNamespace(clock=clock, robots={}, names=names, world=world, catch_up=lambda: None)
        super().__init__(cast("Simulation", shown))

    def keep(self) -> None:
        """Keep nothing: the world does not go back."""


class LiveView:
    """A page in the browser that shows a world, as often as the program shows it, and in real time.

    The page can be opened on this computer alone. Its URL is printed on stderr. :meth:`show` is called every *period*.
    """

    def __init__(self, period: float) -> None:
        check_web()
        self._period = period
        self._due = 0.0
        self._panel: Panel | None = None
        self._page = contextlib.ExitStack()

    def show(self, world: World, *, is_new: bool = False) -> None:
        """Show the world as it is now, of a new episode or not, and wait until its time has come.

        It belongs to the page from now on: it must be a copy.
        """
        if self._panel is None:
            self._open(world)
        else:
            asyncio.run_coroutine_threadsafe(self._put(self._panel, world, is_new), self._loop).result()

    def _open(self, world: World) -> None:
        from elib.panel.panel import Can, Panel
        from elib.panel.server.http import own_address, served
        from elib.panel.server.inthread import in_thread

        panel = Panel(is_shared=True, can=Can(), worlds={"": _Shown(world)})
        server, self._loop = self._page.enter_context(in_thread(lambda: served(panel, own_address(""))))
        self._panel = panel
        print(f"view {server.url}", file=sys.stderr, flush=True)
        show_page(server.url)

    async def _put(self, panel: Panel, world: World, is_new: bool) -> None:
        shown = panel.worlds[""]
        if is_new or not isinstance(shown, _Shown):
            panel.worlds[""] = _Shown(world)
        else:
            shown.simulation.world = world
        now = self._loop.time()
        self._due = max(self._due + self._period, now)  # a program that was late is not hurried afterwards
        await asyncio.sleep(self._due - now)

    def close(self) -> None:
        """Close the page. Safe to repeat."""
        self._panel = None
        self._page.close()
