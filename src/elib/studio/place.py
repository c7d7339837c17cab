"""The worker of a page as the place of a program: how it waits there, is held, and is ended."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable

from elib.base.timebase import Host, outside
from elib.robot.signals import SIGNALS
from elib.robot.waiting import TURN

BREATH = 0.04
"""s after which a program that computes lets the page speak."""
UNWATCHED = 16
"""Lines without a look at the clock, which takes longer in a browser than a line does, while a program runs quickly."""
QUICK = 0.002
"""s within which a program that runs quickly has run so many lines."""
NAP = 0.05
"""s after which a program that waits, or is held, looks whether it is to go on or to end."""


class Place(Host):
    """The only thread of a worker, which the program shares with the page.

    Args:
        nap: Waits so many seconds, while the worker hears the page.
        turned: Called after each of these waits.

    Attributes:
        is_held: Whether the program stands still, and with it the time of its robots.
        is_ending: Whether the program is to end, as Ctrl-C would end it.
    """

    def __init__(self, nap: Callable[[float], None], turned: Callable[[], object]) -> None:
        super().__init__()
        self.is_held = self.is_ending = self._is_woken = False
        self._nap, self._turned = nap, turned
        self._last = self._looked = 0.0
        self._unwatched = 0

    def line(self, *_: object) -> None:
        """Let the page go on if it has not for a while; a line of the program, or a turn of a loop, is about to run."""
        self._unwatched -= 1
        if self._unwatched < 0 or self.is_held:
            now = time.perf_counter()
            self._unwatched = UNWATCHED if now - self._looked < QUICK else 0
            self._looked = now
            self.wait(0.0)

    def wait(self, seconds: float) -> None:
        """Let the page go on for so long; with 0 only if it has not for a while."""
        until = time.perf_counter() + seconds
        if seconds <= 0 and not self.is_held and until - self._last < BREATH:
            return
        self._is_woken = False
        self._turn(min(max(0.0, seconds), NAP))
        while not self.is_ending and (
            self.is_held or ((left := until - time.perf_counter()) > 0 and not self._is_woken)
        ):
            self._turn(NAP if self.is_held else min(left, NAP))
        if self.is_ending:
            self.is_ending = False
            SIGNALS.interrupt()

    def wake(self) -> None:
        """End the wait that goes on: something has come for the program."""
        self._is_woken = True

    def sleep(self, seconds: float) -> None:
        """Do what ``time.sleep`` does on a computer: robots in real time go on meanwhile."""
        portals = [each for each in self.portals if not (each.is_closed or each.loop.is_running())]
        portals = [each for each in portals if each.loop.factor < math.inf]
        if not portals:
            self.wait(seconds / self.speed)
            return
        slices = 1 if len(portals) == 1 else max(1, round(seconds / TURN))
        for _ in range(slices):
            for portal in portals:
                portal.call(asyncio.sleep(seconds * portal.loop.factor / slices))

    def _turn(self, seconds: float) -> None:
        self._nap(seconds)
        self._last = time.perf_counter()
        self._turned()


def napping(nap: Callable[[float], object], web: asyncio.AbstractEventLoop) -> Callable[[float], None]:
    """Return how Python waits in a browser: *nap* gives a promise of JavaScript, and *web* runs meanwhile.

    Where Python was not called in a way that lets it wait for a promise, it holds the worker up instead.
    """
    from pyodide.ffi import can_run_sync, run_sync  # type: ignore[import-not-found]  # only there

    sleep = time.sleep  # noqa: TID251  # while a program runs, it is another one

    def wait(seconds: float) -> None:
        if can_run_sync():
            with outside(web):
                run_sync(nap(1000 * seconds))
        elif seconds > 0:
            sleep(seconds)

    return wait
