"""Virtual robots without their program: those whose link broke, until the same URL is opened again."""

from __future__ import annotations

import asyncio
import itertools
import math
import weakref
from typing import TYPE_CHECKING

from elib.errors import LinkNotFound
from elib.transport.keeping import Stay, stay_of

if TYPE_CHECKING:
    from elib.emulator.sim import Simulation

AFTERLIFE = 60.0
"""Seconds of loop time for which a robot waits, counted from the last look for it or, if later, the end of its cut."""

_RANKS = itertools.count()


class LostRobot:
    """A robot of a simulation that its program has lost, and how long it waits.

    Only its timer and those who mean to come back hold it, so it goes with its event loop.

    Attributes:
        url: What its program had opened.
        rank: The lower, the earlier lost.
        simulation: The robot's world and its robots; all go on.
        index: Which of them it is.
    """

    def __init__(self, url: str, simulation: Simulation, index: int) -> None:
        self.url = url
        self.rank = next(_RANKS)
        self.simulation = simulation
        self.index = index
        self._timer: asyncio.TimerHandle | None = None
        self._stay: Stay | None = None
        self.wait()

    @property
    def mends_in(self) -> float:
        """Seconds until its link can be opened: 0 if it can, infinite if its fault script never lets it."""
        return self.simulation.robots[self.index].mends_in

    def wait(self) -> None:
        """Wait as long as if it had been lost now."""
        self._let_go()
        loop = self.simulation.loop
        self._stay = stay_of(self.url, loop)
        if self._stay is not None:
            self._stay.endings.append(self._end)
        elif not loop.is_closed():
            mends_in = self.mends_in
            self._timer = loop.call_later(AFTERLIFE + (mends_in if math.isfinite(mends_in) else 0.0), self._end)

    def find(self) -> Simulation:
        """Return the simulation to somebody who opened its URL: the robot is lost no more, but still taken.

        Raises:
            LinkNotFound: Its link is still cut.
        """
        try:
            self.simulation.robots[self.index].check_link(self.url)
        except LinkNotFound:
            self.wait()
            raise
        self._leave()
        return self.simulation

    def _end(self) -> None:
        self._leave()
        self.simulation.release(self.index)

    def _leave(self) -> None:
        self._let_go()
        _LOST.discard(self)

    def _let_go(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._stay is not None:
            self._stay.endings.remove(self._end)
            self._stay = None


_LOST: weakref.WeakSet[LostRobot] = weakref.WeakSet()


def wait(url: str, simulation: Simulation, index: int) -> None:
    """Let a robot of *simulation* wait for somebody to open *url* again on its event loop."""
    _LOST.add(LostRobot(url, simulation, index))


def find(url: str) -> Simulation | None:
    """Return the simulation that *url* named before on the running event loop, if it waits; the one lost first.

    Raises:
        LinkNotFound: Its link is still cut.
    """
    loop = asyncio.get_running_loop()
    waiting = [robot for robot in _LOST if robot.url == url and robot.simulation.loop is loop]
    return min(waiting, key=lambda robot: (robot.mends_in, robot.rank)).find() if waiting else None


def find_in(simulation: Simulation, index: int) -> bool:
    """Return whether a robot of *simulation* waits; it is lost no more.

    Raises:
        LinkNotFound: Its link is still cut.
    """
    for robot in _LOST:
        if robot.simulation is simulation and robot.index == index:
            robot.find()
            return True
    return False
