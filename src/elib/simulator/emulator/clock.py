"""The clock of a virtual world: it runs as its event loop's does, and a hand can stop it, or make it faster or slower.

Robots, links and physics of one simulation share it. Programs that drive the robots keep the time of their own loop.
"""

from __future__ import annotations

import asyncio
import math

from elib.base.errors import ArgumentError, SimulationError
from elib.base.rules import Number
from elib.base.timebase import ScaledLoop, SimulatedLoop

RATE = Number(0.1, 10)
"""How many times faster than its event loop a world may run. Slower, the robots would answer too late for programs."""


class WorldClock:
    """The time of one world, s, on the time scale of its event loop until it is first changed.

    Args:
        loop: The event loop.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._rate = 1.0
        self._is_paused = False
        self._began: tuple[float, float] | None = None  # loop time and world time when it was changed last

    @property
    def rate(self) -> float:
        """Seconds of the world in one second of its event loop, while it is not paused."""
        return self._rate

    @property
    def is_paused(self) -> bool:
        """Whether it stands still: by hand, or because the program has ended whose event loop it had."""
        return self._is_paused or self._loop.is_closed()

    @property
    def refusal(self) -> str:
        """Why its rate cannot be changed; empty if it can be."""
        if isinstance(self._loop, SimulatedLoop):
            return "this simulation computes its own time"
        if isinstance(self._loop, ScaledLoop):
            return f"the speed was set to {self._loop.factor:g} when the simulation was started"
        return ""

    def time(self) -> float:
        """Return the time of the world."""
        if self._began is None:
            return self._loop.time()
        at, time = self._began
        return time if self._is_paused else time + (self._loop.time() - at) * self._rate

    def loop_time(self, time: float) -> float:
        """Return when the event loop's clock shows that it is *time* in the world; infinite while it is paused."""
        if self._began is None:
            return time
        at, began = self._began
        if self._is_paused:
            return at if time <= began else math.inf
        return at + (time - began) / self._rate

    def set_rate(self, rate: float) -> None:
        """Let it run faster or slower.

        Raises:
            ArgumentError: *rate* is out of its range.
            SimulationError: The speed was chosen when the simulation was started.
        """
        rate = RATE.require(rate, "speed")
        if self.refusal:
            raise SimulationError(f"the speed cannot be changed: {self.refusal}", hint="start the simulation again")
        self._begin()
        self._rate = rate

    def pause(self) -> None:
        """Let it stand still.

        Raises:
            SimulationError: Its event loop computes its own time, and waits for no one.
        """
        if isinstance(self._loop, SimulatedLoop):
            raise SimulationError(f"it cannot be paused: {self.refusal}", hint="use speed=real, or a factor")
        self._begin()
        self._is_paused = True

    def resume(self) -> None:
        """Let it run again, if it is paused."""
        if self._is_paused:
            self._begin()
        self._is_paused = False

    def step(self, seconds: float) -> None:
        """Go on by some seconds at once, while it is paused.

        Raises:
            ArgumentError: It is not paused.
        """
        if not self._is_paused:
            raise ArgumentError("only a paused world can be stepped", hint="pause it first")
        self._begin(seconds)

    def _begin(self, seconds: float = 0.0) -> None:
        self._began = self._loop.time(), self.time() + seconds
