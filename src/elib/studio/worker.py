"""What runs in the worker: a panel whose page is the studio, and the program with the worlds that it opens."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from elib.base.tasks import Tasks
from elib.link.transport import parse_url
from elib.panel.panel import Can, Panel
from elib.panel.recents import RecentRobots
from elib.panel.server.conversation import Told
from elib.simulator.emulator import simulation
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.settings import settings_of
from elib.simulator.emulator.simulation import Simulation
from elib.studio.messages import StudioPage
from elib.studio.place import napping
from elib.studio.program import Program

WORLD = "program"
"""The key of the world that the page shows."""

Post = Callable[[str | bytes], object]


class Port:
    """What carries messages to the page: it takes them at once.

    Args:
        post: Sends a text or bytes.
    """

    unread = 0

    def __init__(self, post: Post) -> None:
        self._post = post

    def put(self, message: Told) -> None:
        """Send a message now."""
        self._post(msgspec.json.encode(message).decode())

    async def send(self, data: bytes, *, is_text: bool) -> None:
        """Send a message."""
        self._post(data.decode() if is_text else data)

    async def close(self, code: int, reason: str) -> None:
        """Do nothing: page and worker end together."""


class Studio:
    """The panel, its one page, and the program.

    Args:
        post: Sends a text or bytes to the page.
        nap: Waits so many seconds, while the page is heard.
        begin: Calls a function later, in a way that lets it wait by *nap*.
        folder: Where programs and files lie.

    Attributes:
        program: Runs the programs.
        panel: The panel.
    """

    def __init__(
        self,
        post: Post,
        nap: Callable[[float], None],
        begin: Callable[[Callable[[], None]], object],
        folder: Path,
    ) -> None:
        self.panel = Panel(can=Can(edit=True, save=True), folder=folder, recents=RecentRobots(None))
        self._begin, self._tasks = begin, Tasks()
        self._simulation: Simulation | None = None
        self._shown: Simulation | None = None
        simulation.on_begin.append(self._began)
        port = Port(post)
        self.program = Program(nap, port.put, folder, self._time)
        self.page = StudioPage(self, port)

    def run(self, text: str, name: str, robot: str, breakpoints: list[int], speed: float) -> None:
        """Begin to run a program.

        Raises:
            ArgumentError: A program runs already, or the URL is wrong.
        """
        if robot:
            parse_url(robot)
        file = self.program.take(text, name)
        self._simulation = None
        self.program.debugger.breakpoints = set(breakpoints)
        self.program.place.speed = speed
        self._begin(lambda: self.program.run(file, robot))

    def show(self, robot: str) -> None:
        """Show the world of a URL, in which no program drives.

        Raises:
            ElibError: There is no such world.
        """
        if self.program.state == "idle":
            before, self._shown = self._shown, Simulation(settings_of(parse_url(robot)), is_connected=False)
            if before is not None:
                before.close()

    def hear(self, text: str) -> None:
        """Hear one message of the page; it is answered a moment later."""
        self._tasks.begin(self.page.hear(text), "elib studio")

    def _began(self, begun: Simulation) -> None:
        """Show a world that begins."""
        if self.program.state != "idle":
            self._simulation = begun
            if self._shown is not None:
                self._shown.close()
                self._shown = None
        if begun.world is not None:
            self.panel.worlds = {WORLD: Control(begun)}

    def _time(self) -> float:
        return 0.0 if self._simulation is None else self._simulation.time


def start(post: Any) -> Studio:
    """Begin in the worker of a browser.

    Args:
        post: The worker's own function that sends a text or bytes to the page.
    """
    import js  # type: ignore[import-not-found]  # only there
    from pyodide.ffi import create_once_callable, to_js  # type: ignore[import-not-found]

    folder = Path.home() / "programs"
    folder.mkdir(exist_ok=True)
    nap = napping(js.nap, asyncio.get_event_loop())
    return Studio(
        lambda data: post(data if isinstance(data, str) else to_js(data)),
        nap,
        lambda work: js.begin(create_once_callable(work)),
        folder,
    )
