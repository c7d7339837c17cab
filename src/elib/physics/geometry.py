"""Where things are and what stands there: poses, walls, boxes and cylinders.

Lengths are metres. x and y span the floor; a heading of 0 looks along x and grows to the left
(counter-clockwise seen from above).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from elib.errors import ArgumentError

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
            raise ArgumentError(f"{text!r} is no colour", hint='write it as "#rrggbb", for example "#d04030"')
        return cls(*bytes.fromhex(digits))

    def __str__(self) -> str:
        return f"#{self.red:02x}{self.green:02x}{self.blue:02x}"


WALL_COLOUR = Colour(236, 232, 222)
"""Off-white of painted wood: reflects infrared as the response profiles assume."""

WALL_HEIGHT = 0.10
"""m. Seen from 0.25 m it fills the upper half of a 30 degree picture."""

SHORTEST_WALL = 1e-6
LONGEST_WALL = 1e4
"""m. Beyond these the arithmetic of contacts and rays loses its digits."""

OBJECT_MASS = 0.1
"""kg. What a pushable thing weighs unless its world says otherwise: two thirds of an e-puck."""


@dataclass(frozen=True, slots=True)
class Wall:
    """A straight, thin, upright surface that stands on the floor.

    Attributes:
        x1: First end, m.
        y1: First end, m.
        x2: Other end, m; must differ from the first.
        y2: Other end, m.
        height: Above the floor, m, more than 0.
        colour: Of both sides.
        reflectance: How much infrared light it reflects, 0.05..1, 1 is white; None takes it from the colour
            (:func:`infrared_reflectance`).
    """

    x1: float
    y1: float
    x2: float
    y2: float
    height: float = WALL_HEIGHT
    colour: Colour = WALL_COLOUR
    reflectance: float | None = None

    def __post_init__(self) -> None:
        _require_reflectance("wall", self.reflectance)
        for name in ("x1", "y1", "x2", "y2"):
            require_finite(f"the wall's {name}", getattr(self, name))
        require_positive("the wall's height", self.height)
        length = math.hypot(self.x2 - self.x1, self.y2 - self.y1)
        if length < SHORTEST_WALL:
            raise ArgumentError(f"the wall at ({self.x1}, {self.y1}) has no length", hint="give it two different ends")
        if length > LONGEST_WALL:
            raise ArgumentError(f"the wall at ({self.x1}, {self.y1}) is {length:g} m long; at most {LONGEST_WALL:g}")


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangular block.

    Attributes:
        x: Centre, m.
        y: Centre, m.
        width: Along its own x axis, m, more than 0.
        depth: Along its own y axis, m, more than 0.
        angle: Its x axis from the world's, positive to the left, rad.
        height: Above the floor, m, more than 0.
        colour: Of all its sides.
        reflectance: Of infrared light, as of a :class:`Wall`.
        is_pushable: It gives way to a robot that drives against it.
        mass: kg, 0.001..100; matters only if it can be pushed.
        name: To find it by; empty for none.
    """

    x: float
    y: float
    width: float
    depth: float
    angle: float = 0.0
    height: float = WALL_HEIGHT
    colour: Colour = WALL_COLOUR
    reflectance: float | None = None
    is_pushable: bool = False
    mass: float = OBJECT_MASS
    name: str = ""

    def __post_init__(self) -> None:
        _require_reflectance("box", self.reflectance)
        _require_mass("box", self.mass)
        for name in ("x", "y", "angle"):
            require_finite(f"the box's {name}", getattr(self, name))
        for name in ("width", "depth", "height"):
            require_positive(f"the box's {name}", getattr(self, name))

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
            Wall(*corners[i], *corners[(i + 1) % 4], self.height, self.colour, self.reflectance) for i in range(4)
        )


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A round post, or a ball seen from above.

    Attributes:
        x: Centre, m.
        y: Centre, m.
        radius: m, more than 0.
        height: Above the floor, m, more than 0.
        colour: Of its side.
        reflectance: Of infrared light, as of a :class:`Wall`.
        is_pushable: It gives way to a robot that drives against it.
        mass: kg, 0.001..100; matters only if it can be pushed.
        name: To find it by; empty for none.
    """

    x: float
    y: float
    radius: float
    height: float = WALL_HEIGHT
    colour: Colour = WALL_COLOUR
    reflectance: float | None = None
    is_pushable: bool = False
    mass: float = OBJECT_MASS
    name: str = ""

    def __post_init__(self) -> None:
        _require_reflectance("cylinder", self.reflectance)
        _require_mass("cylinder", self.mass)
        for name in ("x", "y"):
            require_finite(f"the cylinder's {name}", getattr(self, name))
        for name in ("radius", "height"):
            require_positive(f"the cylinder's {name}", getattr(self, name))


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


def _require_reflectance(what: str, value: float | None) -> None:
    if value is not None and not 0.05 <= value <= 1.0:
        raise ArgumentError(f"the {what}'s reflectance is {value}; it must be from 0.05 to 1")


def _require_mass(what: str, value: float) -> None:
    if not 0.001 <= value <= 100.0:
        raise ArgumentError(f"the {what}'s mass is {value} kg; it must be from 0.001 to 100")


def require_finite(what: str, value: float) -> None:
    """Raise ArgumentError unless *value* is a finite number."""
    if not math.isfinite(value):
        raise ArgumentError(f"{what} is {value}; it must be a finite number")


def require_positive(what: str, value: float) -> None:
    """Raise ArgumentError unless *value*, m, is finite and above 0."""
    if not (math.isfinite(value) and value > 0):
        raise ArgumentError(f"{what} is {value} m; it must be a finite number above 0")
