"""What a world has beside its solids: lights, sources of sound, and what is painted on the floor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, TypeAlias

from elib.base.rules import Mistake, Number, Text, check
from elib.simulator.physics.geometry import Colour, CourseRule, Length, Name, Painted, Place, Point

FLOOR_COLOUR = Colour(176, 172, 164)
"""Colour of a floor on which nothing is painted: grey linoleum."""

MAX_SQUARES = 1_000_000
"""Most fields of a checkered floor: more would be finer than the robot can see."""

Intensity = Annotated[float, Number(0, 10)]
Volume = Annotated[float, Number(0, 4095, "counts")]
Frequency = Annotated[float, Number(0, 8000, "Hz")]
Interval = Annotated[float, Number(0, 3600, "s", example="2.0")]
StripeWidth = Annotated[float, Number(0.001, 1, "m")]


Course = Annotated[tuple[Point, ...], CourseRule(example="[[0.1, 0.1], [0.9, 0.1]]")]


@dataclass(frozen=True, slots=True)
class Light:
    """A lamp that shines on all sides.

    Attributes:
        x: Place, m, -1000..1000.
        y: Place, m, -1000..1000.
        height: Above the floor, m, 0.001..1000. What is taller than the line from the lamp to a sensor casts a
            shadow on it.
        intensity: How far it reaches, 0..10: at a distance of half this many metres its light has fallen to 1/e
            (the law of ARGoS). 0 is switched off.
        name: To find it by; no two things of a world share one. Empty for none.
    """

    x: Place
    y: Place
    height: Length = 0.10
    intensity: Intensity = 1.0
    name: Name = ""

    def __post_init__(self) -> None:
        check(self, "the light's ")


@dataclass(frozen=True, slots=True)
class Sound:
    """A source of sound: a tone or a noise, steady or again and again.

    Attributes:
        x: Place, m, -1000..1000.
        y: Place, m, -1000..1000.
        volume: What a microphone that faces it reads at 0.1 m beyond the noise of the room, peak to peak, counts,
            0..4095. No loudness was ever published; the figure is uncalibrated. 0 is silent.
        frequency: The frequency of the tone, Hz, 0..8000; 0 is a noise without a tone, such as a clap.
        every: It begins again each time after this many seconds, 0..3600; 0 for a sound that never stops.
        lasts: How long it sounds each time, s, 0..3600, if it is not steady.
        name: To find it by; no two things of a world share one. Empty for none.
    """

    x: Place
    y: Place
    volume: Volume = 1000.0
    frequency: Frequency = 440.0
    every: Interval = 0.0
    lasts: Interval = 0.05
    name: Name = ""

    def __post_init__(self) -> None:
        check(self, "the sound's ")


@dataclass(frozen=True, slots=True)
class Stripe:
    """A line painted on the floor, such as one to follow.

    Attributes:
        points: Its course, m: 2 to 10000 places. It is rounded where they meet; equal first and last points close it.
        width: The width of the line, m, 0.001..1.
        colour: The colour of the paint.
    """

    points: Course
    width: StripeWidth = 0.015
    colour: Painted = Colour(16, 16, 16)

    def __post_init__(self) -> None:
        check(self, "the stripe's ")


@dataclass(frozen=True, slots=True)
class Checkers:
    """The whole floor in squares of two colours, the dark one in the corner (0, 0).

    Attributes:
        square: Side of a square, m, 0.001..1000.
        dark: First colour.
        light: Second colour.
    """

    square: Length = 0.05
    dark: Painted = Colour(40, 40, 40)
    light: Painted = Colour(230, 230, 230)

    def __post_init__(self) -> None:
        check(self, "the checkers' ")

    def count(self, width: float, depth: float) -> tuple[int, int]:
        """Return how many squares lie along x and along y on a floor.

        Args:
            width: The width of the floor, m.
            depth: The depth of the floor, m.

        Raises:
            Mistake: They are more than :data:`MAX_SQUARES`.
        """
        across, along = math.ceil(width / self.square), math.ceil(depth / self.square)
        if across * along > MAX_SQUARES:
            raise Mistake(
                f"is {self.square:g}, which makes {across * along} squares; at most {MAX_SQUARES} are possible",
                path=("square",),
                hint="make them larger",
            )
        return across, along


@dataclass(frozen=True, slots=True)
class Print:
    """A picture that lies on the floor, its upper edge at the greater y.

    Where it is transparent, it shows what lies beneath.

    Attributes:
        file: A PNG or JPEG file, absolute, or relative to the folder of the world's file.
        x: Its lower left corner, m, -1000..1000.
        y: Its lower left corner, m, -1000..1000.
        width: Along x, m, 0.001..1000.
        depth: Along y, m, 0.001..1000.
    """

    file: Annotated[str, Text(4096, example='"floor.png"')]
    x: Place
    y: Place
    width: Length
    depth: Length

    def __post_init__(self) -> None:
        check(self, "the picture's ")


@dataclass(frozen=True, slots=True)
class Patch:
    """A rectangle of the floor in one colour, or a hole that reflects nothing to the ground and cliff sensors.

    Attributes:
        x: Its lower left corner, m, -1000..1000.
        y: Its lower left corner, m, -1000..1000.
        width: Along x, m, 0.001..1000.
        depth: Along y, m, 0.001..1000.
        colour: The colour of the paint; None makes it a hole. Robots do not fall in: it only looks like one.
    """

    x: Place
    y: Place
    width: Length
    depth: Length
    colour: Painted | None = None

    def __post_init__(self) -> None:
        check(self, "the patch's ")


Paint: TypeAlias = Stripe | Checkers | Print | Patch
"""Anything on the floor; later ones cover earlier ones."""
