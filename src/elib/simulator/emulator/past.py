"""The last minute of a world, for those who look at it and want to go on from a moment that they have seen."""

from __future__ import annotations

from collections import deque

from elib.base.errors import ArgumentError
from elib.simulator.physics.state import Moment
from elib.simulator.physics.world import World

KEPT = 60.0
"""s of the world's time."""
MAX_KEPT = 100_000
"""Robots and things of all moments together, some 30 MB at most: of up to 66 every frame of a page is kept, of 1000 one
each 0.6 s."""


class Past:
    """The moments of one world that somebody saw, the oldest first."""

    def __init__(self) -> None:
        self._moments: deque[Moment] = deque()

    def keep(self, world: World, since: float) -> bool:
        """Keep what the world is now, and return whether that was done.

        Args:
            world: The world, run up to now.
            since: When that was done last for the same one who looks, s: of a large world it may be too soon.
        """
        moments, time = self._moments, world.time
        if moments and time < moments[-1].time:  # it was begun anew
            moments.clear()
        size = world.robots + len(world.scene.boxes) + len(world.scene.cylinders)
        if moments and moments[-1].time == time:  # a hand may have moved something since
            moments.pop()
        elif since <= time < since + KEPT * size / MAX_KEPT:
            return False
        moments.append(world.moment())
        while len(moments) > 1 and (moments[0].time < time - KEPT or len(moments) * size > MAX_KEPT):
            moments.popleft()
        return True

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
