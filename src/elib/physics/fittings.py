"""What a world has beside its solids: lights, sources of sound, and what is painted on the floor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from elib.errors import ArgumentError
from elib.physics.geometry import Colour, require_finite, require_positive

FLOOR_COLOUR = Colour(176, 172, 164)
"""Of a floor on which nothing is painted: grey linoleum."""

MOST_SQUARES = 1_000_000
"""Of a checkered floor: more would be finer than the robot can see."""


@dataclass(frozen=True, slots=True)
class Light:
    """A lamp that shines on all sides.

    Attributes:
        x: Place, m.
        y: Place, m.
        height: Above the floor, m, more than 0. What is taller than the line from the lamp to a sensor casts a
            shadow on it.
        intensity: How far it reaches, 0..10: at a distance of half this many metres its light has fallen to 1/e
            (the law of ARGoS). 0 is switched off.
        name: To find it by; empty for none.
    """

    x: float
    y: float
    height: float = 0.10
    intensity: float = 1.0
    name: str = ""

    def __post_init__(self) -> None:
        require_finite("the light's x", self.x)
        require_finite("the light's y", self.y)
        require_positive("the light's height", self.height)
        if not 0.0 <= self.intensity <= 10.0:
            raise ArgumentError(f"the light's intensity is {self.intensity}; it must be from 0 to 10")


@dataclass(frozen=True, slots=True)
class Sound:
    """A source of a steady tone.

    Attributes:
        x: Place, m.
        y: Place, m.
        volume: What a microphone that faces it reads at 0.1 m beyond the noise of the room, counts peak to peak,
            0..4095. No loudness was ever published; the figure is uncalibrated. 0 is silent.
        frequency: Of the tone, Hz, 20..8000.
        name: To find it by; empty for none.
    """

    x: float
    y: float
    volume: float = 1000.0
    frequency: float = 440.0
    name: str = ""

    def __post_init__(self) -> None:
        require_finite("the sound's x", self.x)
        require_finite("the sound's y", self.y)
        if not 0.0 <= self.volume <= 4095.0:
            raise ArgumentError(f"the sound's volume is {self.volume}; it must be from 0 to 4095")
        if not 20.0 <= self.frequency <= 8000.0:
            raise ArgumentError(f"the sound's frequency is {self.frequency} Hz; it must be from 20 to 8000")


@dataclass(frozen=True, slots=True)
class Stripe:
    """A line painted on the floor, such as one to follow.

    Attributes:
        points: Its course, m, at least two; rounded where they meet. Equal first and last points close it.
        width: m, more than 0.
        colour: Of the paint.
    """

    points: tuple[tuple[float, float], ...]
    width: float = 0.015
    colour: Colour = Colour(16, 16, 16)

    def __post_init__(self) -> None:
        if len(self.points) < 2:
            raise ArgumentError(f"a stripe has {len(self.points)} points; it needs two or more")
        for x, y in self.points:
            require_finite("a stripe's x", x)
            require_finite("a stripe's y", y)
        require_positive("the stripe's width", self.width)


@dataclass(frozen=True, slots=True)
class Checkers:
    """The whole floor in squares of two colours, the dark one in the corner (0, 0).

    Attributes:
        square: Side of a square, m, more than 0.
        dark: First colour.
        light: Second colour.
    """

    square: float = 0.05
    dark: Colour = Colour(40, 40, 40)
    light: Colour = Colour(230, 230, 230)

    def __post_init__(self) -> None:
        require_positive("the squares' side", self.square)


@dataclass(frozen=True, slots=True)
class Print:
    """A picture that lies on the floor.

    Attributes:
        file: PNG or JPEG file, absolute, or relative to the folder of the world's file.
        x: Its lower left corner, m.
        y: Its lower left corner, m.
        width: m, more than 0.
        depth: m, more than 0.
    """

    file: str
    x: float
    y: float
    width: float
    depth: float

    def __post_init__(self) -> None:
        require_finite("the picture's x", self.x)
        require_finite("the picture's y", self.y)
        require_positive("the picture's width", self.width)
        require_positive("the picture's depth", self.depth)


@dataclass(frozen=True, slots=True)
class Patch:
    """A rectangle of the floor in one colour, or a hole that reflects nothing to the ground and cliff sensors.

    Attributes:
        x: Its lower left corner, m.
        y: Its lower left corner, m.
        width: m, more than 0.
        depth: m, more than 0.
        colour: Of the paint; None makes it a hole. Robots do not fall in: it only looks like one.
    """

    x: float
    y: float
    width: float
    depth: float
    colour: Colour | None = None

    def __post_init__(self) -> None:
        require_finite("the patch's x", self.x)
        require_finite("the patch's y", self.y)
        require_positive("the patch's width", self.width)
        require_positive("the patch's depth", self.depth)


Paint: TypeAlias = Stripe | Checkers | Print | Patch
"""Anything on the floor; later ones cover earlier ones."""
