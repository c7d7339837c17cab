"""Parts of a world's file that are no part of a scene as they stand."""

from __future__ import annotations

import math
from dataclasses import dataclass

from elib.physics.body import RADIUS
from elib.physics.fittings import FLOOR_COLOUR, Patch
from elib.physics.geometry import Colour
from elib.physics.keys import Mistake
from elib.physics.placement import MOST_ROBOTS
from elib.physics.scene import STEP
from elib.pose import Pose

SMALLEST_ARENA = 4 * RADIUS
"""m. Two robots side by side."""


@dataclass(frozen=True, slots=True)
class Arena:
    """How large the floor is: given, or as large as so many robots need.

    Attributes:
        width: m.
        depth: m.
        density: Robots a square metre.
        robots: How many there are unless somebody asks for another number; 0 means as many as are named.
    """

    width: float | None = None
    depth: float | None = None
    density: float | None = None
    robots: int = 0

    def __post_init__(self) -> None:
        if self.width is None and self.density is None:
            raise Mistake(
                "is missing; it must be two numbers, in m",
                path=("size",),
                hint="write size = [1.0, 1.0], or density = 10 for an arena that grows with its robots",
            )
        if self.width is not None and self.density is not None:
            raise Mistake(
                "contradicts size: each says how large the arena is", path=("density",), hint="leave one of them out"
            )

    def size(self, robots: int) -> tuple[float, float]:
        """Return width and depth for so many robots, m."""
        if self.width is not None and self.depth is not None:
            return self.width, self.depth
        assert self.density is not None
        side = max(SMALLEST_ARENA, math.sqrt(min(robots, MOST_ROBOTS) / self.density))
        return side, side


@dataclass(frozen=True, slots=True)
class Rules:
    """How time runs, and what is left to chance."""

    step: float = STEP
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Start:
    """Where a robot starts, and what runs on it."""

    x: float
    y: float
    heading: float = 0.0
    firmware: str = ""

    @property
    def pose(self) -> Pose:
        """Where it starts."""
        return Pose(self.x, self.y, self.heading)


@dataclass(frozen=True, slots=True)
class Ground:
    """The floor where nothing is painted on it."""

    colour: Colour = FLOOR_COLOUR


@dataclass(frozen=True, slots=True)
class Top:
    """What stands at the top of the file."""

    about: str = ""


def patch(x: float, y: float, width: float, depth: float, colour: Colour | None = None, hole: bool = False) -> Patch:
    """Return a patch of a colour, or a hole."""
    if (colour is None) != hole:
        what = "needs a colour" if colour is None else "is a hole, which has no colour"
        raise Mistake(what, hint='write colour = "#102030", or hole = true, one of them')
    return Patch(x, y, width, depth, colour)
