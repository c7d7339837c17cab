"""When the sounds of the robots of one world end, whichever of them lets time pass."""

from __future__ import annotations

import math
import weakref

RECORDINGS = {1: 2112 / 7200, 2: 1760 / 7200, 3: 3412 / 7200, 4: 3732 / 7200, 5: 8016 / 7200}
"""Length of each of the e-puck1's recordings, s: samples at 7200 Hz (protocol.md, 5.9)."""

MELODY = 10.0
"""Length of a melody of the e-puck2, s. Chosen: no source tells it."""

MELODIES_AND_TONES = {1: MELODY, 2: MELODY, 3: MELODY, 4: math.inf, 5: math.inf}
"""Of the e-puck2: three melodies, and two tones that sound until they are stopped (protocol.md, 5.9)."""


class Speakers:
    """The loudspeakers of the robots of one world, as far as they have something to end."""

    def __init__(self) -> None:
        self._ends: dict[int, float] = {}

    def start(self, robot: int, end: float) -> None:
        """Note that *robot* sounds until *end*, s; infinity means until it is told otherwise."""
        self._ends.pop(robot, None)
        if math.isfinite(end):
            self._ends[robot] = end

    def ended(self, time: float) -> list[int]:
        """Return which robots fell silent up to *time*, s; each sound is told once."""
        over = [robot for robot, end in self._ends.items() if end <= time]
        for robot in over:
            del self._ends[robot]
        return over


_SPEAKERS: weakref.WeakKeyDictionary[object, Speakers] = weakref.WeakKeyDictionary()


def speakers_of(world: object) -> Speakers:
    """Return the loudspeakers of the robots of *world*."""
    return _SPEAKERS.setdefault(world, Speakers())
