"""Infrared readings without what the sensors read in the open, and the distances that follow from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

from elib.base.infrared import wall_distance
from elib.link.protocol.values import FieldInfo, Numbers, Proximity

MAX_OPEN_AIR: Final = 1500.0
"""Counts that a sensor reads in the open at most: real ones read 70 to 570 (measured-robots: infrared.open_offset).
More is something near, 1 cm away, even if the robot has never read less."""

SMOOTHING: Final = 0.2
"""Weight of the newest reading in the mean whose least value counts: the least single reading would be three deviations
of the noise too low."""


class OpenAir:
    """Takes off each infrared reading what that sensor reads in the open: the least that it has read so far.

    No two sensors of real robots read the same in the open, and none reads 0. ``calibrate_proximity()`` makes a robot
    take that off by itself, but needs seconds and an empty place around it. This learns while the robot drives. Where
    it starts near something, it takes that for the open until it has been elsewhere, and sees only what is nearer.

    Example:
        >>> open_air = OpenAir()
        >>> open_air(Proximity(200, 90, 310, 150, 120, 480, 260, 210)).front_right
        0
        >>> open_air(Proximity(650, 90, 310, 150, 120, 480, 260, 230)).front_right
        450
    """

    def __init__(self) -> None:
        self._mean: list[float] = []
        self._least = [MAX_OPEN_AIR] * len(Proximity())

    def __call__(self, near: Proximity) -> Proximity:
        """Return *near* without what its sensors read in the open, 0 or more."""
        self._mean = [mean + SMOOTHING * (now - mean) for mean, now in zip(self._mean or near, near, strict=True)]
        self._least = [min(pair) for pair in zip(self._least, self._mean, strict=True)]
        return Proximity(
            *(max(now - round(least), 0) for now, least in zip(near, self._least, strict=True)),
            time=near.time,
            origin=near.origin,
        )


_METRES = {"info": FieldInfo(unit="m", low=0, high=0.06, span=0.01, form=".3f")}


@dataclass(frozen=True, slots=True, eq=False)
class Distances(Numbers[float]):
    """Eight distances, m, clockwise from the front right; infinite (``math.inf``) where nothing is seen within 5.7 cm.

    Each is that of a white wall which the sensor faces. Something darker, narrower or aslant is nearer than it says.
    """

    front_right: float = field(default=math.inf, metadata=_METRES)
    diagonal_right: float = field(default=math.inf, metadata=_METRES)
    right: float = field(default=math.inf, metadata=_METRES)
    rear_right: float = field(default=math.inf, metadata=_METRES)
    rear_left: float = field(default=math.inf, metadata=_METRES)
    left: float = field(default=math.inf, metadata=_METRES)
    diagonal_left: float = field(default=math.inf, metadata=_METRES)
    front_left: float = field(default=math.inf, metadata=_METRES)

    @property
    def ahead(self) -> float:
        """The least of the four sensors in front, m."""
        return min(self.front_left, self.front_right, self.diagonal_left, self.diagonal_right)

    @property
    def nearest(self) -> float:
        """The least of all, m."""
        return min(self)


def distances(above: Proximity) -> Distances:
    """Return the distances that readings without the open air mean, by the usual curve of real sensors."""
    return Distances(*map(wall_distance, above), time=above.time, origin=above.origin)
