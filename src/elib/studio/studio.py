"""The studio without its page: a panel that shows the worlds that the program opens, and the program."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Mapping
from pathlib import Path

from elib.base.timebase import outside
from elib.behaviours import StateChanged
from elib.link.transport import parse_url
from elib.panel.panel import Can, Panel
from elib.panel.server.conversation import Told
from elib.panel.slot import Slot
from elib.robot.aio import Epuck, on_open
from elib.robot.link import stop_bytes
from elib.simulator.emulator import simulation
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.settings import settings_of
from elib.simulator.emulator.simulation import Simulation
from elib.studio import webserial
from elib.studio.labs import Labs, Report
from elib.studio.program import Program, no_goals

WORLD = "program"
"""The key of the world that the page shows."""


class Watched:
    """A robot of the program, as long as that has it open.

    Args:
        slot: Its place in the panel.
    """

    def __init__(self, slot: Slot) -> None:
        self.is_closed = False  # whether the program has closed it
        self._slot = slot

    def close(self) -> None:
        """Note that the program has closed it."""
        self.is_closed = True
        if webserial.port is not None:
            webserial.port.guard(b"")
        self._slot.unwatch()


class Studio:
    """The panel of the page, and the program with the worlds that it opens.

    Args:
        tell: Tells the page something.
        nap: Waits so many seconds, while the page is heard.
        begin: Calls a function later, in a way that lets it wait by *nap*.
        folder: Where programs and files lie.
    """

    def __init__(
        self,
        tell: Callable[[Told], object],
        nap: Callable[[float], None],
        begin: Callable[[Callable[[], None]], object],
        folder: Path,
    ) -> None:
        self.panel = Panel(can=Can(edit=True), folder=folder)
        self._begin, self._loop = begin, asyncio.get_event_loop()
        self._simulation: Simulation | None = None
        self._lab = ""
        self.labs = Labs(folder)
        self._shown: Simulation | None = None
        simulation.on_begin.append(self._began)
        self.program = Program(nap, tell, folder, self._time, self._states, self._moment)  # runs the programs
        self._robot: Epuck | None = None

    def run(
        self,
        text: str,
        name: str,
        imported: Mapping[str, str],
        robot: str,
        breakpoints: list[int],
        speed: float,
        lab: str,
    ) -> None:
        """Begin to run a program, which may import others, in the first variant of a lab if there is one.

        Raises:
            ArgumentError: A program runs already, the URL is wrong, or there is no such lab.
        """
        if lab:
            robot = self.labs.robot(lab)
        if robot:
            parse_url(robot)
        file = self.program.take(text, name, imported)
        self._simulation = self._robot = None
        self._lab, self.program.goals = lab, no_goals
        self.panel.forget_watched()
        self.program.debugger.breakpoints = set(breakpoints)
        self.program.place.speed = speed

        def run() -> None:
            with on_open(self._opened):
                self.program.run(file, robot)

        self._begin(run)

    async def check(self, lab: str, text: str) -> Report:
        """Run a program in all variants of a lab, and return what became of it.

        Raises:
            ArgumentError: A program runs already, or there is no such lab.
        """
        self.labs.lab(lab)
        self.program.take(text, f"{lab}.py")
        ended: asyncio.Future[Report] = self._loop.create_future()

        def check() -> None:
            try:
                ended.set_result(self.labs.check(lab, text, self.program.printed_by))
            except BaseException as error:
                ended.set_exception(error)
            finally:
                self.program.leave()

        self._simulation = self._robot = None
        self._lab, self.program.goals = "", no_goals
        self.program.place.speed, self.program.debugger.breakpoints = math.inf, set()
        self._begin(check)
        return await ended

    def show(self, robot: str, lab: str) -> None:
        """Show the world of a URL, or of a lab if there is one, in which no program drives.

        Raises:
            ElibError: There is no such world.
        """
        if self.program.state == "idle":
            robot = self.labs.robot(lab) if lab else robot
            before, self._shown = self._shown, Simulation(settings_of(parse_url(robot)), is_connected=False)
            if before is not None:
                before.close()

    def _began(self, begun: Simulation) -> None:
        """Show a world that begins."""
        if self.program.state != "idle":
            self._simulation = begun
            if self._shown is not None:
                self._shown.close()
                self._shown = None
        if self._lab:
            self.program.goals = self.labs.watch(self._lab, begun).goals
            self._lab = ""
        if begun.world is not None:
            self.panel.worlds = {WORLD: Control(begun)}

    def _opened(self, robot: Epuck) -> list[Watched]:
        """Show what a robot tells the program, and let the page know what stops it if it is on its port."""
        if webserial.port is not None and isinstance(robot.session.transport, webserial.WebSerial):
            webserial.port.guard(robot.context.profile.line_end + stop_bytes(robot.session))
        self._robot = self._robot or robot
        with outside(self._loop):  # its place lives on the loop of the page
            slot = self.panel.watch(robot)
        return [] if slot is None else [Watched(slot)]

    def _time(self) -> float:
        return 0.0 if self._simulation is None else self._simulation.time

    def _moment(self) -> object:
        """Return the world and its time while a robot in it is open. A program may open one world after another."""
        begun = self._simulation
        is_open = begun is not None and any(each.link.is_connected for each in begun.robots.values())
        return (begun, self._time()) if is_open else None

    def _states(self) -> tuple[str, str]:
        """Return the state of the first robot's machine, and the one before."""
        happened = self._robot.events.recent if self._robot is not None else ()
        entered = ["", "", *(each.state for each in happened if isinstance(each, StateChanged))]
        return entered[-1], entered[-2]
