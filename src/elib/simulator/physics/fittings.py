"""What a world has beside its solids: lights, sources of sound, zones, and what is painted on the floor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, TypeAlias

from elib.base.rules import Mistake, Number, Text, check, shown
from elib.simulator.physics.geometry import (
    MAX_ARENA,
    Colour,
    CourseRule,
    Length,
    Name,
    Painted,
    Place,
    Point,
    Switch,
    unit,
)

FLOOR_COLOUR = Colour(176, 172, 164)
"""Colour of a floor on which nothing is painted: grey linoleum."""

MAX_SQUARES = 1_000_000
"""Most fields of a checkered floor: more would be finer than the robot can see."""

MIN_INTERVAL = 0.001
"""s. A sound that begins again sooner is a tone."""

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
        switch: The zone that switches it on and off. Empty if it always shines.
    """

    x: Place
    y: Place
    height: Length = 0.10
    intensity: Intensity = 1.0
    name: Name = ""
    switch: Switch = ""

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
        every: It begins again each time after this many seconds, 0..3600: at least 0.001, or 0 for a sound that never
            stops.
        lasts: How long it sounds each time, s, 0..3600, if it is not steady.
        name: To find it by; no two things of a world share one. Empty for none.
        switch: The zone that switches it on and off. Empty if it always sounds.
    """

    x: Place
    y: Place
    volume: Volume = 1000.0
    frequency: Frequency = 440.0
    every: Interval = 0.0
    lasts: Interval = 0.05
    name: Name = ""
    switch: Switch = ""

    def __post_init__(self) -> None:
        check(self, "the sound's ")
        if 0 < self.every < MIN_INTERVAL:
            raise Mistake(f"is {shown(self.every)} s; it must be 0, or from {MIN_INTERVAL} to 3600 s", path=("every",))


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


ZONE_COLOUR = Colour(38, 130, 98)
ROUND = 48
"""Corners of the outline of a round zone: it then differs from a circle by 0.2 % of its radius."""

Middle = Annotated[float, Number(-MAX_ARENA, MAX_ARENA, "m", otherwise="none")]
Share = Annotated[float, Number(0, 1)]
Flow = Annotated[float, Number(-100, 100, "1/s")]
Points = Annotated[float, Number(-1000, 1000)]
Area = Annotated[tuple[Point, ...], CourseRule(example="[[0.1, 0.1], [0.3, 0.1], [0.2, 0.3]]", otherwise="none")]
ROBOTS = "robots"
"""What switches a zone, or collects a puck, if it is not a thing or a zone."""


@dataclass(frozen=True, slots=True)
class Zone:
    """A part of the floor that knows what is in it: it gives energy and points, and switches other things.

    Its shape is a disc, a rectangle, a polygon, a stripe, or the dark parts of a picture. A zone without a shape is
    switched by programs alone.

    Attributes:
        name: To find it by; no two things of a world share one.
        x: Its middle, m, -1000..1000.
        y: Its middle, m, -1000..1000.
        radius: The radius of a disc, m, 0.001..1000.
        width: Of a rectangle or a picture, along x, m, 0.001..1000.
        depth: Of a rectangle or a picture, along y, m, 0.001..1000.
        points: The corners of a polygon, or the course of a stripe, m.
        band: The width of a stripe, m, 0..1000; 0 for a polygon.
        file: A PNG or JPEG file, absolute, or relative to the folder of the world's file: its dark parts are the zone.
        by: What switches it on while it is inside: `robots`, the name of a box or cylinder that can be pushed, or
            nothing if it is empty.
        stays: Whether it stays on when that has left.
        is_on: Whether it is on at the start.
        energy: What each robot inside gets of its whole energy, 1/s, -100..100; below 0 it loses that.
        store: The energy it can give until it is empty, in wholes of a robot, 0..1000; None for no limit.
        refill: What its store gets back, 1/s, 0..100, up to what it began with.
        score: Points of a robot that comes in, -1000..1000.
        rate: Points of each robot inside, 1/s, -100..100.
        colour: How it is drawn; it is not painted on the floor.
    """

    name: Annotated[str, Text(example='"nest"')]
    x: Middle | None = None
    y: Middle | None = None
    radius: Annotated[float, Number(0.001, 1000, "m", example="0.1", otherwise="none")] | None = None
    width: Annotated[float, Number(0.001, 1000, "m", otherwise="none")] | None = None
    depth: Annotated[float, Number(0.001, 1000, "m", otherwise="none")] | None = None
    points: Area = ()
    band: Annotated[float, Number(0, 1000, "m")] = 0.0
    file: Annotated[str, Text(4096, example='"zone.png"', otherwise="none")] = ""
    by: Annotated[str, Text(shortest=0, example='"robots"')] = ROBOTS
    stays: bool = False
    is_on: bool = False
    energy: Flow = 0.0
    store: Annotated[float, Number(0, 1000, example="2", otherwise="no limit")] | None = None
    refill: Annotated[float, Number(0, 100, "1/s")] = 0.0
    score: Points = 0.0
    rate: Flow = 0.0
    colour: Painted = ZONE_COLOUR

    def __post_init__(self) -> None:
        check(self, "the zone's ")
        shapes = [bool(self.radius), bool(self.width), bool(self.points)]
        if sum(shapes) > 1:
            raise Mistake("is of two shapes", path=("name",), hint="give it a radius, a size or points, one of them")
        is_placed = self.x is not None
        if any(shapes[:2]) != is_placed or (self.file and not self.width):
            there, lacks = ("position", "radius and no size") if is_placed else ("radius or size", "position")
            if self.file and not self.width:
                there, lacks = "file", "size"
            raise Mistake(
                f'is "{self.name}": the zone has a {there}, but no {lacks}',
                path=("name",),
                hint="a disc has position and radius, a rectangle position and size, a picture a file too",
            )
        if self.band and not self.points:
            hint = "give the course of the stripe: points"
            raise Mistake("is of a stripe, but the zone has no points", path=("band",), hint=hint)
        if self.points and not self.band and len(self.points) < 3:
            raise Mistake("has too few corners", path=("points",), hint="give three, or the width of a stripe: band")

    @property
    def outline(self) -> tuple[Point, ...]:
        """The corners of its shape, m, in order around it; of a picture, those of the picture."""
        x, y = self.x or 0.0, self.y or 0.0
        if self.radius:
            turns = (unit(math.tau * k / ROUND) for k in range(ROUND))
            return tuple((x + self.radius * cosine, y + self.radius * sine) for cosine, sine in turns)
        if self.width and self.depth:
            u, v = self.width / 2, self.depth / 2
            return (x - u, y - v), (x + u, y - v), (x + u, y + v), (x - u, y + v)
        return _banked(self.points, self.band / 2) if self.band else self.points


def _banked(points: tuple[Point, ...], half: float) -> tuple[Point, ...]:
    """Return the outline of a stripe with cut ends: along its left bank, and back along the right one."""
    ways = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(points) if a != b] or [(1.0, 0.0)]
    ways = [(u / math.hypot(u, v), v / math.hypot(u, v)) for u, v in ways]
    kept = [points[0], *(b for a, b in pairwise(points) if a != b)]
    left, right = [], []
    for (x, y), (u1, v1), (u2, v2) in zip(kept, [ways[0], *ways], [*ways, ways[-1]], strict=False):
        # Where two stretches meet, both sides are as far out as the half turn needs, but no corner is a thorn.
        far = half / max(0.5, 1 + u1 * u2 + v1 * v2)
        left.append((x - far * (v1 + v2), y + far * (u1 + u2)))
        right.append((x + far * (v1 + v2), y - far * (u1 + u2)))
    return (*left, *reversed(right))


@dataclass(frozen=True, slots=True)
class Energy:
    """What robots use of their energy, of which the whole is 1. A robot without energy stands.

    Attributes:
        idle: What a robot uses whether or not it drives, 1/s, 0..100.
        start: What it begins with, 0..1.
        driving: What it uses for each metre that its wheels roll, 1/m, 0..100.
    """

    idle: Annotated[float, Number(0, 100, "1/s", example="0.01")]
    start: Share = 1.0
    driving: Annotated[float, Number(0, 100, "1/m")] = 0.0

    def __post_init__(self) -> None:
        check(self, "the energy's ")
