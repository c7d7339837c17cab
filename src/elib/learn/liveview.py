"""Pictures of a world for programs that learn: an array, or a page in the browser while the program runs."""

from __future__ import annotations

import asyncio
import contextlib
import os
import sys
import threading
import webbrowser
from collections.abc import Mapping
from typing import TYPE_CHECKING, NoReturn, cast

from elib.base.errors import SimulationError
from elib.base.extras import check_web
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.watched import BROWSER, has_display
from elib.simulator.physics import Snapshot, World

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from elib.simulator.emulator.simulation import Simulation

SIZE = 480
"""Pixels of the arena's longer side: a picture takes 30 ms."""


def picture(world: World) -> NDArray[np.uint8]:
    """Return the world seen from above, with the rays of the infrared sensors, (rows, columns, 3)."""
    import numpy as np

    from elib.simulator.drawing.png import render
    from elib.simulator.drawing.top import top_view

    return np.array(render(top_view(world.snapshot(beams=True), (), None, SIZE)), dtype=np.uint8)


class _Program:
    """Stands where the page expects a simulation with a world and a clock: the program that learns runs all three.

    Whatever the page asks for that would change something is refused.

    Args:
        world: The world as it is now.
    """

    refusal = "the program that learns runs this world"
    is_paused = False
    rate = 1.0

    def __init__(self, world: World) -> None:
        self.names = tuple(f"epuck-{index + 1}" for index in range(world.robots))
        self.robots: Mapping[int, object] = {}
        self.clock, self.scene = self, world.scene
        self.see(world)

    def see(self, world: World) -> None:
        """Take over how the world is now."""
        self.seen = world.snapshot(beams=True)
        self.ambient = world.ambient
        self._encoders = [world.encoders(robot) for robot in range(world.robots)]

    def encoders(self, robot: int) -> tuple[int, int]:
        """Return the steps that a robot's wheels were told to make."""
        return self._encoders[robot]

    def __getattr__(self, name: str) -> NoReturn:
        raise SimulationError(
            "this world cannot be changed here: the program that learns runs it", hint="use elib simulate --view"
        )


class _Look(Control):
    """What the page sees of a program's world."""

    def __init__(self, program: _Program) -> None:
        super().__init__(cast("Simulation", program))

    def follow(self, program: _Program) -> None:
        """Look at another world."""
        self.simulation, self.names = cast("Simulation", program), program.names

    @property
    def program(self) -> _Program:
        """What runs the world."""
        return cast("_Program", self.simulation)

    @property
    def world(self) -> World:
        """What the page may ask of the world."""
        return cast("World", self.simulation)

    @property
    def ambient(self) -> float:
        """What the infrared sensors read in the room's light, counts."""
        return self.program.ambient

    def snapshot(self, *, beams: bool = False) -> Snapshot:
        """Return the world as the program showed it last."""
        return self.program.seen


class LiveView:
    """A page in the browser that shows a world, as often as the program shows it, and in real time.

    The page can be opened on this computer alone. Its URL is printed on stderr.

    Args:
        period: Time between two calls of :meth:`show`, s.

    Raises:
        Unsupported: The packages of the page are not installed.
    """

    def __init__(self, period: float) -> None:
        check_web()
        self._period = period
        self._due = 0.0
        self._look: _Look | None = None
        self._page = contextlib.ExitStack()

    def show(self, world: World, *, is_new: bool = False) -> None:
        """Show the world as it is now, and wait until its time has come.

        Args:
            world: The world.
            is_new: Whether an episode has begun.

        Raises:
            LinkBusy: All ports that were tried for the page are taken.
        """
        if self._look is None:
            self._open(_Look(_Program(world)))
        else:
            asyncio.run_coroutine_threadsafe(self._put(self._look, world, is_new), self._loop).result()

    def _open(self, look: _Look) -> None:
        from elib.panel.panel import Can, Panel
        from elib.panel.server.http import own_address, served
        from elib.panel.server.inthread import in_thread

        server, self._loop = self._page.enter_context(
            in_thread(lambda: served(Panel(is_shared=True, can=Can(), worlds={"": look}), own_address("")))
        )
        self._look = look
        print(f"view {server.url}", file=sys.stderr, flush=True)
        if os.environ.get(BROWSER) != "no" and has_display():
            threading.Thread(target=webbrowser.open, args=(server.url,), daemon=True).start()

    async def _put(self, look: _Look, world: World, is_new: bool) -> None:
        if is_new:
            look.follow(_Program(world))
        else:
            look.program.see(world)
        now = self._loop.time()
        self._due = max(self._due + self._period, now)  # a program that was late is not hurried afterwards
        await asyncio.sleep(self._due - now)

    def close(self) -> None:
        """Close the page. Safe to repeat."""
        self._look = None
        self._page.close()
