"""Walls, boxes, cylinders, polygons and colours, and how far a point is from them.

Lengths are metres. x and y span the floor; a heading of 0 looks along x and grows to the left
(counter-clockwise seen from above).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, NamedTuple, TypeAlias

from elib.base.errors import ArgumentError
from elib.base.rules import Choice, Mistake, Number, Rule, Several, Text, Whole, check
from elib.base.tags import FACES

_HEX_DIGITS = frozenset("0123456789abcdefABCDEF")


class Colour(NamedTuple):
    """A surface colour, each part 0..255."""

    red: int
    green: int
    blue: int

    @classmethod
    def parse(cls, text: str) -> Colour:
        """Return the colour written as ``#rrggbb``.

        Raises:
            ArgumentError: *text* is written differently.
        """
        digits = text[1:]
        if not text.startswith("#") or len(digits) != 6 or not _HEX_DIGITS.issuperset(digits):
            raise ArgumentError(f"{text!r} is not a colour", hint='write it as "#rrggbb", for example "#d04030"')
        return cls(*bytes.fromhex(digits))

    def __str__(self) -> str:
        return f"#{self.red:02x}{self.green:02x}{self.blue:02x}"


WALL_COLOUR = Colour(236, 232, 222)
"""Off-white of painted wood: reflects infrared as the response profiles assume."""

WALL_HEIGHT = 0.10
"""m. Seen from 0.25 m it fills the upper half of a 30 degree picture."""

MAX_ARENA = 1000.0
"""m. Beyond it a position has too few bits left behind the point to drive by."""

MAX_POINTS = 10_000
"""Most points of one stripe or polygon: more would be closer together than a pixel of the floor."""

MIN_WALL = 1e-6
"""m. Below it the arithmetic of contacts and rays loses its digits."""

OBJECT_MASS = 0.1
"""kg. What a pushable thing weighs unless its world says otherwise: two thirds of an e-puck."""


OBJECT_FRICTION = 0.5
"""Friction of a pushable thing with the floor, unless its world says otherwise (e-puck.md, 1)."""


@dataclass(frozen=True, slots=True)
class ColourRule(Rule):
    """A colour: a :class:`Colour`, or its text."""

    def __str__(self) -> str:
        return 'a colour, "#rrggbb"'

    def accept(self, value: object) -> Colour:
        """Return *value* as a Colour."""
        try:
            if isinstance(value, str):
                return Colour.parse(value)
            if isinstance(value, tuple):
                return Colour(*map(_PART.accept, value))
        except (ArgumentError, TypeError):  # not three parts
            pass
        raise self.refuse(value)


_PART = Whole(0, 255)

Point: TypeAlias = tuple[float, float]
"""x and y, m."""

Place = Annotated[float, Number(-MAX_ARENA, MAX_ARENA, "m")]
"""x or y of something."""

WallEnd = Annotated[float, Number(-2 * MAX_ARENA, 2 * MAX_ARENA, "m")]
"""x or y: the sides of a box are walls, too, and may reach beyond every place."""


@dataclass(frozen=True, slots=True)
class FaceRule(Choice):
    """What a surface shows: one of the values, or the path of a picture."""

    def __str__(self) -> str:
        return 'a tag of 16h5, "tag:0" to "tag:29", or of 36h11, "tag36h11:0" to "tag36h11:99", or a PNG or JPEG file'

    def accept(self, value: object) -> str | int:
        """Return *value*."""
        is_picture = isinstance(value, str) and value.lower().endswith((".png", ".jpg", ".jpeg"))
        return str(value) if is_picture else super(FaceRule, self).accept(value)


Length = Annotated[float, Number(0.001, MAX_ARENA, "m", example="0.05")]
"""Nothing finer can be seen or felt by the robot."""

Turn = Annotated[float, Number(unit="rad")]

Reflectance = Annotated[float, Number(0.05, 1, otherwise="from the red in its colour")]
Mass = Annotated[float, Number(0.001, 100, "kg")]
Friction = Annotated[float, Number(0, 2, example="0.02")]
Name = Annotated[str, Text(example='"ball"', otherwise="none")]
Painted = Annotated[Colour, ColourRule(example='"#d04030"')]
Switch = Annotated[str, Text(example='"plate"', otherwise="none")]
Face = Annotated[str, FaceRule(FACES, example='"tag:7"', otherwise="nothing")]


@dataclass(frozen=True, slots=True)
class CourseRule(Rule):
    """Several places in a row.

    Attributes:
        fewest: How many there must be.
    """

    fewest: int = 2

    def __str__(self) -> str:
        return f"{self.fewest} to {MAX_POINTS} places, each two numbers {_POINT.rule.range}"

    def accept(self, value: object) -> tuple[tuple[float, ...], ...]:
        """Return *value* as a tuple of pairs."""
        if not isinstance(value, list | tuple) or not self.fewest <= len(value) <= MAX_POINTS:
            raise self.refuse(value)
        points = []
        for index, point in enumerate(value):
            try:
                points.append(_POINT.accept(point))
            except Mistake as mistake:
                raise mistake.at(index) from None
        return tuple(points)


_POINT = Several(Number(-MAX_ARENA, MAX_ARENA, "m"), 2)
Outline = Annotated[tuple[Point, ...], CourseRule(fewest=3, example="[[0.1, 0.1], [0.3, 0.1], [0.2, 0.3]]")]


@dataclass(frozen=True, slots=True)
class Wall:
    """A straight, thin, upright surface that stands on the floor.

    Attributes:
        x1: First end, m, -2000..2000.
        y1: First end, m, -2000..2000.
        x2: Other end, m, -2000..2000; must differ from the first.
        y2: Other end, m, -2000..2000.
        height: The height of its top above the floor, m, 0.001..1000.
        colour: The colour of all its sides.
        reflectance: How much infrared light it sends back, 0.05..1; 1 is white. None takes it from the colour
            (:func:`infrared_reflectance`).
        face: What both sides show to cameras: an AprilTag, the file of a picture, or nothing. It is as large as fits,
            in the middle. A tag has a white rim of one cell: the black square of one of 16h5 has 3/4 of the height, or
            of the length, that of one of 36h11 4/5. A picture is seen as at most 64 x 64 cells.
    """

    x1: WallEnd
    y1: WallEnd
    x2: WallEnd
    y2: WallEnd
    height: Length = WALL_HEIGHT
    colour: Painted = WALL_COLOUR
    reflectance: Reflectance | None = None
    face: Face = ""

    def __post_init__(self) -> None:
        check(self, "the wall's ")
        if math.hypot(self.x2 - self.x1, self.y2 - self.y1) < MIN_WALL:
            raise ArgumentError(f"the wall at ({self.x1}, {self.y1}) has no length", hint="give it two different ends")

    def distance(self, x: float, y: float) -> float:
        """Return how far the point (x, y) is from it, m."""
        return segment_distance(x, y, self.x1, self.y1, self.x2, self.y2)


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangular block.

    Attributes:
        x: Centre, m, -1000..1000.
        y: Centre, m, -1000..1000.
        width: Along its own x axis, m, 0.001..1000.
        depth: Along its own y axis, m, 0.001..1000.
        angle: From the world's x axis to its own, positive to the left, rad.
        height: The height of its top above the floor, m, 0.001..1000.
        colour: The colour of all its sides.
        reflectance: How much infrared light it sends back, 0.05..1; 1 is white. None takes it from the colour
            (:func:`infrared_reflectance`).
        is_pushable: Whether it gives way to a robot that drives against it.
        mass: What it weighs, kg, 0.001..100; matters only if it can be pushed. A robot weighs 0.15 kg.
        friction: Force over weight at which it begins to slide or roll, 0..2; matters only if it can be pushed. A ball
            that rolls has about 0.02.
        name: To find it by; no two things of a world share one. Empty for none.
        face: What each of its four sides shows to cameras, as that of a wall.
        switch: The zone that opens it: it is a door then, which is closed where it stands. Empty for none.
        slide: How far an open door is from where it is closed, along x and y, m, -10..10.
        swing: How far it opens about its left end, rad, -3..3.
        takes: How long it takes to open or to close, s, 0.1..60. A door waits for what is in its way.
    """

    x: Place
    y: Place
    width: Length
    depth: Length
    angle: Turn = 0.0
    height: Length = WALL_HEIGHT
    colour: Painted = WALL_COLOUR
    reflectance: Reflectance | None = None
    is_pushable: bool = False
    mass: Mass = OBJECT_MASS
    friction: Friction = OBJECT_FRICTION
    name: Name = ""
    face: Face = ""
    switch: Switch = ""
    slide: Annotated[tuple[float, float], Several(Number(-10, 10, "m"), 2, example="[0.2, 0.0]")] = (0.0, 0.0)
    swing: Annotated[float, Number(-3, 3, "rad")] = 0.0
    takes: Annotated[float, Number(0.1, 60, "s")] = 1.0

    def __post_init__(self) -> None:
        check(self, "the box's ")
        if self.switch and (self.is_pushable or (self.slide == (0.0, 0.0) and not self.swing)):
            raise Mistake(
                "makes it a door, which has a slide or a swing and cannot be pushed",
                path=("switch",),
                hint="write slide = [0.2, 0.0] or swing = 90, and leave out pushable",
            )

    @property
    def can_move(self) -> bool:
        """Whether it gives way to a robot, or is a door."""
        return self.is_pushable or bool(self.switch)

    def distance(self, x: float, y: float) -> float:
        """Return how far the point (x, y) is from its surface, m; below 0 inside."""
        cosine, sine = unit(self.angle)
        dx, dy = x - self.x, y - self.y
        across = abs(cosine * dx + sine * dy) - self.width / 2
        along = abs(cosine * dy - sine * dx) - self.depth / 2
        return max(across, along) if across <= 0 or along <= 0 else math.sqrt(across * across + along * along)

    @property
    def corners(self) -> tuple[tuple[float, float], ...]:
        """Four corners, m, counter-clockwise from the lower left one of the unturned box."""
        cosine, sine = unit(self.angle)
        half_width, half_depth = self.width / 2, self.depth / 2
        return tuple(
            (self.x + cosine * u - sine * v, self.y + sine * u + cosine * v)
            for u, v in (
                (-half_width, -half_depth),
                (half_width, -half_depth),
                (half_width, half_depth),
                (-half_width, half_depth),
            )
        )

    @property
    def sides(self) -> tuple[Wall, ...]:
        """Its four sides as walls, counter-clockwise."""
        corners = self.corners
        return tuple(
            Wall(*corners[i], *corners[(i + 1) % 4], self.height, self.colour, self.reflectance, self.face)
            for i in range(4)
        )


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A round post, or a ball seen from above.

    Attributes:
        x: Centre, m, -1000..1000.
        y: Centre, m, -1000..1000.
        radius: The radius of its round side, m, 0.001..1000.
        height: The height of its top above the floor, m, 0.001..1000.
        colour: The colour of its side.
        reflectance: How much infrared light it sends back, 0.05..1; 1 is white. None takes it from the colour
            (:func:`infrared_reflectance`).
        is_pushable: Whether it gives way to a robot that drives against it.
        mass: What it weighs, kg, 0.001..100; matters only if it can be pushed. A robot weighs 0.15 kg.
        friction: Force over weight at which it begins to slide or roll, 0..2; matters only if it can be pushed. A ball
            that rolls has about 0.02.
        name: To find it by; no two things of a world share one. Empty for none.
        collect: The zone that collects it, or `robots` if a robot does that touches it: it is a puck then. Empty for
            none.
        score: Points of the robot that collects it, or of the one that is nearest then, -1000..1000.
        energy: What that robot gets of its whole energy, -1..1.
        respawn: The zone in which it comes back, at a place that the seed draws. Empty if it is gone for good.
        after: How long it is gone, s, 0..3600.
    """

    x: Place
    y: Place
    radius: Length
    height: Length = WALL_HEIGHT
    colour: Painted = WALL_COLOUR
    reflectance: Reflectance | None = None
    is_pushable: bool = False
    mass: Mass = OBJECT_MASS
    friction: Friction = OBJECT_FRICTION
    name: Name = ""
    collect: Switch = ""
    score: Annotated[float, Number(-1000, 1000)] = 1.0
    energy: Annotated[float, Number(-1, 1)] = 0.0
    respawn: Switch = ""
    after: Annotated[float, Number(0, 3600, "s")] = 0.0

    def __post_init__(self) -> None:
        check(self, "the cylinder's ")
        if self.collect and not self.is_pushable:
            raise Mistake("makes it a puck, which can be pushed", path=("collect",), hint="write pushable = true")

    @property
    def can_move(self) -> bool:
        """Whether it gives way to a robot."""
        return self.is_pushable

    def distance(self, x: float, y: float) -> float:
        """Return how far the point (x, y) is from its surface, m; below 0 inside."""
        dx, dy = x - self.x, y - self.y
        return math.sqrt(dx * dx + dy * dy) - self.radius


@dataclass(frozen=True, slots=True)
class Polygon:
    """A fixed block of any outline, dents too: its sides are walls, and no robot starts inside.

    Attributes:
        points: Its corners in order around it, m: 3 to 10000 places, each unlike the next; the last one is joined to
            the first.
        height: The height of its top above the floor, m, 0.001..1000.
        colour: The colour of all its sides.
        reflectance: How much infrared light it sends back, 0.05..1; 1 is white. None takes it from the colour
            (:func:`infrared_reflectance`).
    """

    points: Outline
    height: Length = WALL_HEIGHT
    colour: Painted = WALL_COLOUR
    reflectance: Reflectance | None = None

    def __post_init__(self) -> None:
        check(self, "the polygon's ")
        _ = self.sides  # a wall without length is refused

    def distance(self, x: float, y: float) -> float:
        """Return how far the point (x, y) is from its surface, m; below 0 inside."""
        crossed = sum(
            (y1 > y) != (y2 > y) and x < x1 + (y - y1) / (y2 - y1) * (x2 - x1) for (x1, y1), (x2, y2) in self._edges
        )
        away = min(segment_distance(x, y, *a, *b) for a, b in self._edges)
        return -away if crossed % 2 else away

    @property
    def sides(self) -> tuple[Wall, ...]:
        """Its sides as walls, in the order of its corners."""
        return tuple(Wall(*a, *b, self.height, self.colour, self.reflectance) for a, b in self._edges)

    @property
    def _edges(self) -> list[tuple[Point, Point]]:
        return list(pairwise((*self.points, self.points[0])))


Solid: TypeAlias = Wall | Box | Cylinder
"""What stands in the way of a robot."""


def unit(angle: float) -> tuple[float, float]:
    """Return the cosine and sine of *angle*, rad, the same to the last bit on every machine.

    The C library's own differ in the last bit between systems, and one bit is enough to send two runs
    apart. Multiples of a quarter turn come out exact.
    """
    quarters = round(angle / (math.pi / 2))
    rest = angle - quarters * (math.pi / 2)
    square = rest * rest
    cosine = sine = 0.0
    for order in range(20, -2, -2):  # |rest| <= pi/4: the first term left out is below 1e-23.
        cosine = 1.0 - square / ((order + 1) * (order + 2)) * cosine
        sine = 1.0 - square / ((order + 2) * (order + 3)) * sine
    sine *= rest
    match quarters % 4:
        case 0:
            return cosine, sine
        case 1:
            return -sine, cosine
        case 2:
            return -cosine, -sine
        case _:
            return sine, -cosine


def infrared_reflectance(colour: Colour) -> float:
    """Return how much infrared light a surface of this colour reflects, 0.2..1; the white of a wall gives 1.

    The law of Webots' distance sensor: 0.2 + 0.8 red, with the red part taken against :data:`WALL_COLOUR`,
    for which the published curves stand.
    """
    return 0.2 + 0.8 * min(1.0, colour.red / WALL_COLOUR.red)


def segment_distance(x: float, y: float, x1: float, y1: float, x2: float, y2: float) -> float:
    """Return how far the point (x, y) is from the straight line between two ends, m."""
    dx, dy = x2 - x1, y2 - y1
    square = dx * dx + dy * dy
    along = min(max(((x - x1) * dx + (y - y1) * dy) / square, 0.0), 1.0) if square > 0 else 0.0
    dx, dy = x - x1 - along * dx, y - y1 - along * dy
    return math.sqrt(dx * dx + dy * dy)


def outline(solid: Solid) -> tuple[tuple[Point, ...], float]:
    """Return what a solid covers of the floor: the points of a convex shape, and how far it reaches beyond them, m.

    A wall has two points, a box four, counter-clockwise, and a cylinder its centre.
    """
    match solid:
        case Wall():
            return ((solid.x1, solid.y1), (solid.x2, solid.y2)), 0.0
        case Box():
            return solid.corners, 0.0
        case Cylinder():
            return ((solid.x, solid.y),), solid.radius


def extent(solid: Solid | Polygon) -> tuple[float, float, float, float]:
    """Return what a solid covers, m: least and greatest x, least and greatest y."""
    points, radius = (solid.points, 0.0) if isinstance(solid, Polygon) else outline(solid)
    xs, ys = zip(*points, strict=True)
    return min(xs) - radius, max(xs) + radius, min(ys) - radius, max(ys) + radius


def gap(one: Solid, other: Solid) -> float:
    """Return how far two solids are apart, m; where they overlap, minus how far one must move to be clear."""
    (points, radius), (others, reach) = outline(one), outline(other)
    reach += radius
    # Two convex shapes are apart if and only if a side of one of them has the whole of the other before it.
    before = max((*_before(points, others), *_before(others, points)), default=0.0)
    if before < 0:
        return before - reach
    return min(_between(a, b, c, d) for a, b in _sides(points) for c, d in _sides(others)) - reach


def _sides(points: tuple[Point, ...]) -> list[tuple[Point, Point]]:
    """Return the straight edges of a shape; a single point is one without length."""
    return [(points[0], points[-1])] if len(points) < 3 else list(pairwise((*points, points[0])))


def _before(points: tuple[Point, ...], others: tuple[Point, ...]) -> Iterator[float]:
    """Yield for each side of a shape how far before it the nearest of other points lies, m."""
    for a, b in _sides(points):
        length = math.dist(a, b)
        if length == 0:
            continue
        heights = [((b[1] - a[1]) * (x - a[0]) - (b[0] - a[0]) * (y - a[1])) / length for x, y in others]
        yield min(heights)
        if len(points) == 2:  # a wall has two faces
            yield -max(heights)


def _between(a: Point, b: Point, c: Point, d: Point) -> float:
    """Return the distance between the segments *ab* and *cd*, which do not cross."""
    return min(
        segment_distance(*a, *c, *d),
        segment_distance(*b, *c, *d),
        segment_distance(*c, *a, *b),
        segment_distance(*d, *a, *b),
    )
