"""The last minute of a world, for those who look at it and want to go on from a moment that they have seen."""

from __future__ import annotations

from collections import deque

from elib.base.errors import ArgumentError
from elib.simulator.physics.state import Moment
from elib.simulator.physics.world import World

KEPT = 62.0
"""s of the world's time: the minute that a page shows, and the time that its request is on the way."""
MAX_KEPT = 100_000
"""Robots and things of all moments together, some 16 MB at most: of up to 64 every frame of a page is kept, of 1000 one
each 0.6 s."""


def is_due(size: int, time: float, kept: float) -> bool:
    """Return whether a page keeps another moment.

    Args:
        size: Robots and things of its world.
        time: Now, s.
        kept: When it kept the last one; if that is now, too, a hand may have moved something since.
    """
    return not kept < time < kept + KEPT * size / MAX_KEPT


class Past:
    """The moments of one world that pages keep, the oldest first."""

    def __init__(self) -> None:
        self._moments: deque[Moment] = deque()

    def keep(self, world: World) -> None:
        """Keep what the world is now."""
        moments, now = self._moments, world.moment()
        if moments and now.time < moments[-1].time:  # it began again
            moments.clear()
        if moments and moments[-1].time == now.time:
            moments.pop()
        moments.append(now)
        size = len(now.robots) + len(now.boxes) + len(now.cylinders)
        while len(moments) > 1 and (moments[0].time < now.time - KEPT or len(moments) * size > MAX_KEPT):
            moments.popleft()

    def at(self, time: float) -> Moment:
        """Return the last moment at or before a time.

        Raises:
            ArgumentError: No such moment is kept.
        """
        moments = self._moments
        if not moments or not moments[0].time <= time <= moments[-1].time:
            span = f"it knows {moments[0].time:.1f} to {moments[-1].time:.1f} s" if moments else "no page looks at it"
            raise ArgumentError(f"the world does not know how it was at {time:.1f} s", hint=span)
        return next(moment for moment in reversed(moments) if moment.time <= time)
