"""The tables of a world's file: what the reader and the reference page know.

Their keys, units and ranges are those of the classes that they make.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from elib.base.errors import ArgumentError
from elib.base.pose import Pose
from elib.base.rules import Choice, Degrees, Mistake, Number, Text, Whole, fields_of
from elib.base.tables import Key, Pair, Table, keys_of
from elib.simulator.physics.body import EpuckModel
from elib.simulator.physics.fittings import Checkers, Energy, Light, Patch, Print, Sound, Stripe, Zone
from elib.simulator.physics.geometry import (
    Box,
    Colour,
    ColourRule,
    Cylinder,
    Length,
    Painted,
    Place,
    Polygon,
    Turn,
    Wall,
)
from elib.simulator.physics.optics import LENSES
from elib.simulator.physics.placement import MAX_ROBOTS
from elib.simulator.physics.profiles import PROFILES
from elib.simulator.physics.scene import MAX_ZONES, MIN_ARENA, Scene, Size

ABOUT = Text(example='"A room to try things in."', otherwise="nothing")

MAX_PAINTED = 1000
"""Most painted things of each kind: a floor is painted again whenever its world is made."""


@dataclass(frozen=True, slots=True)
class Arena:
    """How large the floor is: given, or as large as so many robots need.

    Attributes:
        width: m.
        depth: m.
        density: Instead of size: a square as large as its robots need.
        robots: The number of robots unless a program asks for another; robots without a place of their own stand where
            there is room.
    """

    width: Size | None = None
    depth: Size | None = None
    density: Annotated[float, Number(0.001, 100, "robots/m2", example="10", otherwise="from size")] | None = None
    robots: Annotated[int, Whole(1, MAX_ROBOTS, example="20", otherwise="as many as [[robot]] names")] | None = None

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
        side = max(MIN_ARENA, math.sqrt(min(robots, MAX_ROBOTS) / self.density))
        return side, side


@dataclass(frozen=True, slots=True)
class Start:
    """Where a robot starts, and what runs on it.

    Attributes:
        x: m.
        y: m.
        heading: Where it looks: 0 along x, positive to the left.
        firmware: What runs on it, such as epuck2.
        energy: What it begins with.
        pen: The colour in which it draws where it drives; its ground sensors see black.
    """

    x: Place
    y: Place
    heading: Turn = 0.0
    firmware: Annotated[str, Text(example='"epuck2"', otherwise="as the simulation is told")] = ""
    energy: Annotated[float, Number(0, 1, otherwise="as [energy] says")] | None = None
    pen: Annotated[Colour, ColourRule(example='"#101010"', otherwise="none")] | None = None

    @property
    def pose(self) -> Pose:
        """Where it starts."""
        return Pose(self.x, self.y, self.heading)


def patch(x: Place, y: Place, width: Length, depth: Length, colour: Painted | None = None, hole: bool = False) -> Patch:
    """Return a patch of a colour, or a hole.

    Args:
        x: Its lower left corner, m.
        y: Its lower left corner, m.
        width: Along x, m.
        depth: Along y, m.
        colour: The colour of the paint.
        hole: Instead of a colour: it reflects nothing to the ground and cliff sensors. No robot falls in.
    """
    if (colour is None) != hole:
        what = "needs a colour" if colour is None else "is a hole, which has no colour"
        raise ArgumentError(what, hint='write colour = "#102030", or hole = true, one of them')
    return Patch(x, y, width, depth, colour)


HEADING = Degrees(example="90")
POSITION = Pair("position", ("x", "y"), "its centre", "[0.5, 0.5]")
CORNER = Pair("corner", ("x", "y"), "its corner nearest to (0, 0)", "[0.5, 0.5]")


def _size(meaning: str, example: str = "[0.1, 0.1]") -> Pair:
    return Pair("size", ("width", "depth"), meaning, example)


def _straight(name: str, meaning: str, field: str = "") -> Key:
    """Return a key that fills a field of the scene as it is."""
    found = next(each for each in fields_of(Scene) if each.name == (field or name))
    return Key(name, found.rule, (found.name,), (found.default,), meaning)


TOP = Table(
    "",
    "What stands above all tables.",
    dict,
    (Key("about", ABOUT, ("about",), ("",), "what the world is for, in a sentence"),),
    is_array=False,
)

TABLES = (
    Table(
        "arena",
        "The walled floor. It must be there.",
        Arena,
        keys_of(Arena, _size("width along x and depth along y; walls stand all around", "[1.0, 1.0]")),
        is_array=False,
        is_required=True,
    ),
    Table(
        "simulation",
        "How time runs, and what is left to chance.",
        dict,
        (_straight("step", "length of a tick"), _straight("seed", "of all noise, and of places the file leaves open")),
        is_array=False,
    ),
    Table(
        "epuck",
        "What the robots are like.",
        EpuckModel,
        keys_of(EpuckModel, profile=Choice(tuple(PROFILES)), lens=Choice(tuple(LENSES))),
        is_array=False,
    ),
    Table(
        "wall",
        "Thin upright walls inside the arena.",
        Wall,
        keys_of(
            Wall,
            Pair("from", ("x1", "y1"), "one end", "[0.5, 0.5]"),
            Pair("to", ("x2", "y2"), "the other end", "[0.5, 0.9]"),
        ),
    ),
    Table(
        "box",
        "Rectangular blocks, and doors.",
        Box,
        keys_of(
            Box,
            POSITION,
            _size("along its own x and y axes"),
            angle=HEADING,
            swing=Degrees(-170, 170, example="90"),
        ),
    ),
    Table("cylinder", "Posts, balls, and pucks.", Cylinder, keys_of(Cylinder, POSITION)),
    Table("polygon", "Fixed blocks of any outline: their sides are walls.", Polygon, keys_of(Polygon)),
    Table("light", "Lamps that shine on all sides.", Light, keys_of(Light, POSITION)),
    Table("sound", "Sources of sound: tones and noises, steady or again and again.", Sound, keys_of(Sound, POSITION)),
    Table(
        "zone",
        "Parts of the floor that know what is in them: they give energy and points, open doors, switch lamps and "
        "sounds, and collect pucks. A zone is a disc, a rectangle, a polygon, a stripe, or what is dark of a picture; "
        "one without a shape is switched by programs alone.",
        Zone,
        keys_of(Zone, POSITION, _size("of a rectangle or a picture, along x and y")),
        most=MAX_ZONES,
    ),
    Table(
        "energy",
        "What robots use of their energy, of which the whole is 1. A robot without energy stands.",
        Energy,
        keys_of(Energy),
        is_array=False,
    ),
    Table(
        "floor",
        "The floor where nothing is painted on it.",
        dict,
        (_straight("colour", "of the floor", "floor"),),
        is_array=False,
    ),
    Table(
        "checkers",
        "Squares of two colours all over the floor, the dark one in the corner (0, 0).",
        Checkers,
        keys_of(Checkers),
        is_array=False,
    ),
    Table(
        "picture",
        "Pictures that lie on the floor, their upper edge at the greater y.",
        Print,
        keys_of(Print, CORNER, _size("along x and y, at most four times the arena's")),
        most=16,
    ),
    Table(
        "patch",
        "Rectangles of the floor in another colour, and holes.",
        patch,
        keys_of(patch, CORNER, _size("along x and y")),
        most=MAX_PAINTED,
    ),
    Table("stripe", "Lines on the floor, such as one to follow.", Stripe, keys_of(Stripe), most=MAX_PAINTED),
    Table("robot", "Where the robots start.", Start, keys_of(Start, POSITION, heading=HEADING)),
)
"""In the order of the reference page."""

PAINT = ("checkers", "picture", "patch", "stripe")
"""What lies on the floor, the lowest first; of one kind, in the order of the file."""

THINGS = ("box", "cylinder", "light", "sound", "zone")
"""What may have a name."""
