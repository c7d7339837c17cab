"""A world before anything happens: the arena, what stands in it, where robots start, and the rules."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from elib.errors import ArgumentError
from elib.physics.body import RADIUS, EpuckModel
from elib.physics.fittings import FLOOR_COLOUR, Light, Paint, Sound
from elib.physics.geometry import Box, Colour, Cylinder, Wall
from elib.pose import Pose

STEP = 1 / 64
"""Default tick, s: exact in binary, and the rate at which an e-puck1 refreshes its infrared sensors."""

LONGEST_STEP = 0.1
"""s. At 12.9 cm/s a robot then moves 13 mm, well below its radius, so nothing can be passed through."""

SHORTEST_STEP = 1 / 4096
"""s. A shorter one computes more ticks than any computer can."""

LARGEST_ARENA = 1000.0
"""m. Beyond it a position has too few bits left behind the point to drive by."""

MOST_THINGS = 100_000
"""Walls, boxes, cylinders, lights and sounds of a world: more make a slow world, and are most likely a mistake."""


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything a :class:`~elib.physics.world.World` is made from.

    Attributes:
        width: Of the walled arena, m; x runs from 0 to it. At least two robots wide.
        depth: Of the arena, m; y runs from 0 to it. At least two robots wide.
        walls: Interior walls.
        boxes: Blocks, fixed or pushable.
        cylinders: Posts and balls, fixed or pushable.
        starts: Where the first robots start.
        step: Length of a tick, s, more than 0, at most 0.1.
        seed: Of all noise and of chosen places, 0 <= seed < 2**64.
        model: What the robots are like.
        name: For messages and captions.
        lights: Lamps.
        sounds: Steady tones.
        floor: Colour of the floor.
        paint: What is painted on it, the first one lowest.
        firmware: Of the first robots, as far as the world says, "" where it does not.
    """

    width: float
    depth: float
    walls: tuple[Wall, ...] = ()
    boxes: tuple[Box, ...] = ()
    cylinders: tuple[Cylinder, ...] = ()
    starts: tuple[Pose, ...] = ()
    step: float = STEP
    seed: int = 0
    model: EpuckModel = field(default_factory=EpuckModel)
    name: str = "world"
    lights: tuple[Light, ...] = ()
    sounds: tuple[Sound, ...] = ()
    floor: Colour = FLOOR_COLOUR
    paint: tuple[Paint, ...] = ()
    firmware: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for what in ("width", "depth"):
            value = getattr(self, what)
            if not (math.isfinite(value) and 4 * RADIUS <= value <= LARGEST_ARENA):
                raise ArgumentError(
                    f"the arena's {what} is {value} m; it must be from {4 * RADIUS} to {LARGEST_ARENA:g} m"
                )
        if not SHORTEST_STEP <= self.step <= LONGEST_STEP:
            raise ArgumentError(
                f"the step is {self.step} s; it must be from {SHORTEST_STEP} to {LONGEST_STEP}",
                hint="0.015625 is the usual one",
            )
        check_seed(self.seed)
        for what in ("walls", "boxes", "cylinders", "lights", "sounds", "paint"):
            count = len(getattr(self, what))
            if count > MOST_THINGS:
                raise ArgumentError(f"the world has {count} {what}; at most {MOST_THINGS} are possible")

    @property
    def edge(self) -> tuple[Wall, ...]:
        """The arena's four walls, counter-clockwise."""
        corners = ((0.0, 0.0), (self.width, 0.0), (self.width, self.depth), (0.0, self.depth))
        return tuple(Wall(*corners[i], *corners[(i + 1) % 4]) for i in range(4))

    @property
    def surfaces(self) -> tuple[Wall, ...]:
        """Every flat surface inside the arena: walls, then the sides of boxes."""
        return self.walls + tuple(side for box in self.boxes for side in box.sides)


def check_seed(seed: int) -> None:
    """Raise ArgumentError unless *seed* fits 64 bits."""
    if not 0 <= seed < 1 << 64:
        raise ArgumentError(f"the seed is {seed}; it must be from 0 to 2**64 - 1")
