"""What a drawing is made of: five kinds of shape in image coordinates, so every format draws the same picture.

Coordinates are pixels, x to the right and y down. Colours are opaque: what should look translucent is blended
beforehand, since the formats blend differently.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from elib.simulator.physics import Colour
from elib.simulator.physics.floor import Floor

Point: TypeAlias = tuple[float, float]
Anchor: TypeAlias = Literal["start", "middle", "end"]


@dataclass(frozen=True, slots=True)
class Area:
    """A filled area; with an outline of *width* pixels if there is one."""

    points: tuple[Point, ...]
    fill: Colour
    outline: Colour | None = None
    width: float = 0.0


@dataclass(frozen=True, slots=True)
class Circle:
    """A circle; without *fill* only its outline of *width* pixels."""

    centre: Point
    radius: float
    fill: Colour | None
    outline: Colour | None = None
    width: float = 0.0


@dataclass(frozen=True, slots=True)
class Stroke:
    """A line through *points* with round ends and corners, *width* pixels."""

    points: tuple[Point, ...]
    colour: Colour
    width: float


@dataclass(frozen=True, slots=True)
class Text:
    """One line of text, *size* pixels high; its baseline runs through *place*, its end there is *anchor*."""

    place: Point
    text: str
    size: float
    colour: Colour
    anchor: Anchor = "start"


@dataclass(frozen=True, slots=True)
class Picture:
    """A floor's own picture, *size* pixels wide and high, with its upper left corner at *place*."""

    place: Point
    size: Point
    floor: Floor
    bare: Colour  # what its bare places look like


Shape: TypeAlias = Area | Circle | Stroke | Text | Picture


@dataclass(frozen=True, slots=True)
class Drawing:
    """A picture of *width* x *height* pixels on *background*; later shapes cover earlier ones."""

    width: int
    height: int
    background: Colour
    shapes: tuple[Shape, ...]


def blend(colour: Colour, other: Colour, share: float) -> Colour:
    """Return *colour* with *share*, 0..1, of *other* in it."""
    return Colour(*(round(a + (b - a) * share) for a, b in zip(colour, other, strict=True)))
