"""Every key of a world's file, with its unit, range and meaning: what the reader and the reference page know.

A new key is a new line here. Its default is that of the argument it fills.
"""

from __future__ import annotations

from elib.physics.body import EpuckModel
from elib.physics.fittings import Checkers, Light, Print, Sound, Stripe
from elib.physics.geometry import Box, Cylinder, Wall
from elib.physics.keys import Choice, Course, Degrees, Flag, Key, Number, Paint, Pair, Text, Whole
from elib.physics.placement import MOST_ROBOTS
from elib.physics.scene import LARGEST_ARENA, LONGEST_STEP, SHORTEST_STEP
from elib.physics.schema import Section
from elib.physics.sensors.optics import LENSES
from elib.physics.sensors.proximity import PROFILES
from elib.physics.worldparts import SMALLEST_ARENA, Arena, Ground, Rules, Start, Top, patch

MOST_PAINTED = 1000
"""Of each kind: a floor is painted again whenever its world is made."""

SMALLEST = 0.001
"""m. Nothing finer can be seen or felt by the robot."""


def _place(name: str, meaning: str, *fills: str, example: str = "[0.5, 0.5]") -> Pair:
    return Pair(
        name=name,
        meaning=meaning,
        fills=fills or ("x", "y"),
        unit="m",
        low=-LARGEST_ARENA,
        high=LARGEST_ARENA,
        example=example,
    )


def _size(meaning: str, name: str = "size") -> Pair:
    return Pair(
        name=name,
        meaning=meaning,
        fills=("width", "depth"),
        unit="m",
        low=SMALLEST,
        high=LARGEST_ARENA,
        example="[0.1, 0.1]",
    )


def _length(name: str, meaning: str, example: str, high: float = LARGEST_ARENA, fills: tuple[str, ...] = ()) -> Number:
    return Number(name=name, meaning=meaning, unit="m", low=SMALLEST, high=high, example=example, fills=fills)


def _number(
    name: str, meaning: str, low: float, high: float, example: str, unit: str = "", otherwise: str = ""
) -> Number:
    return Number(name=name, meaning=meaning, low=low, high=high, example=example, unit=unit, otherwise=otherwise)


ARENA_SIZE = Pair(
    name="size",
    meaning="width along x and depth along y; walls stand all around",
    fills=("width", "depth"),
    unit="m",
    low=SMALLEST_ARENA,
    high=LARGEST_ARENA,
    example="[1.0, 1.0]",
    otherwise="from density",
)
POSITION = _place("position", "its centre")
CORNER = _place("corner", "its corner nearest to (0, 0)")
HEIGHT = _length("height", "of its top above the floor", "0.10")
COLOUR = Paint(name="colour", meaning="of all its sides")
REFLECTANCE = _number(
    "reflectance",
    "how much infrared light it sends back; 1 is white",
    0.05,
    1,
    "0.8",
    otherwise="from the red in its colour",
)
NAME = Text(name="name", meaning="to find it by; no two things share one", example='"ball"', otherwise="none")
SURFACE: tuple[Key, ...] = (HEIGHT, COLOUR, REFLECTANCE)
PUSHING: tuple[Key, ...] = (
    Flag(name="pushable", meaning="it gives way to a robot that drives against it", fills=("is_pushable",)),
    _number("mass", "what it weighs, if it can be pushed; a robot has 0.15", 0.001, 100, "0.1", "kg"),
    NAME,
)

TOP = Section(
    "",
    "What stands above all tables.",
    (
        Text(
            name="about",
            meaning="what the world is for, in a sentence",
            example='"A room to try things in."',
            otherwise="nothing",
        ),
    ),
    Top,
    is_array=False,
)

SECTIONS = (
    Section(
        "arena",
        "The walled floor. It must be there.",
        (
            ARENA_SIZE,
            _number(
                "density",
                "instead of size: a square as large as its robots need",
                0.001,
                100,
                "10",
                "robots/m2",
                otherwise="from size",
            ),
            Whole(
                name="robots",
                meaning="how many there are where nobody asks for another number; those without a place of their own "
                "stand where there is room",
                low=1,
                high=MOST_ROBOTS,
                example="20",
                otherwise="as many as [[robot]] names",
            ),
        ),
        Arena,
        is_array=False,
        is_required=True,
    ),
    Section(
        "simulation",
        "How time runs, and what is left to chance.",
        (
            _number("step", "length of a tick", SHORTEST_STEP, LONGEST_STEP, "0.015625", "s"),
            Whole(
                name="seed", meaning="of all noise, and of places that nobody names", low=0, high=2**64 - 1, example="1"
            ),
        ),
        Rules,
        is_array=False,
    ),
    Section(
        "epuck",
        "What the robots are like.",
        (
            Choice(
                name="profile",
                meaning="whose published response the infrared sensors have",
                among=tuple(PROFILES),
                example=f'"{EpuckModel().profile}"',
            ),
            Choice(
                name="lens",
                meaning="whose published field of view the camera has",
                among=tuple(LENSES),
                example=f'"{EpuckModel().lens}"',
            ),
            Choice(
                name="rays",
                meaning="of each infrared sensor: the more, the softer the edges of things",
                among=(1, 3, 5),
                example="3",
            ),
            _number("sensor_noise", "factor on the noise of every sensor; 0 switches it off", 0, 10, "1.0"),
            _number("gain_spread", "standard deviation of each infrared sensor's gain around 1", 0, 0.3, "0.05"),
            _number(
                "offset_spread",
                "standard deviation of what each infrared sensor reads in the open",
                0,
                200,
                "20",
                "counts",
            ),
            _number(
                "ambient",
                "what the infrared sensors read in the room's light; higher is darker",
                0,
                4095,
                "3750",
                "counts",
            ),
            _number("motor_noise", "standard deviation of each wheel's travel in each tick, relative", 0, 0.3, "0.01"),
            _number("wheel_spread", "standard deviation of each wheel's radius, relative", 0, 0.1, "0.004"),
            _number("axle_spread", "standard deviation of the axle's length, relative", 0, 0.1, "0.004"),
            Choice(
                name="generation",
                meaning="whose step motors they have, the e-puck's or the e-puck2's, where a speed is set in steps/s",
                among=(1, 2),
                example="1",
            ),
            Flag(name="ground_module", meaning="the robots carry the ground sensor module"),
        ),
        EpuckModel,
        is_array=False,
    ),
    Section(
        "wall",
        "Thin upright walls inside the arena.",
        (
            _place("from", "one end", "x1", "y1"),
            _place("to", "the other end", "x2", "y2", example="[0.5, 0.9]"),
            *SURFACE,
        ),
        Wall,
    ),
    Section(
        "box",
        "Rectangular blocks.",
        (
            POSITION,
            _size("along its own x and y axes"),
            Degrees(name="angle", meaning="of its own x axis, to the left", example="30"),
            *SURFACE,
            *PUSHING,
        ),
        Box,
    ),
    Section(
        "cylinder",
        "Posts, and balls.",
        (POSITION, _length("radius", "of its round side", "0.05"), *SURFACE, *PUSHING),
        Cylinder,
    ),
    Section(
        "light",
        "Lamps that shine on all sides.",
        (
            POSITION,
            HEIGHT,
            _number(
                "intensity",
                "how far it reaches: at half this many metres its light has fallen to 1/e; 0 is off",
                0,
                10,
                "1.0",
            ),
            NAME,
        ),
        Light,
    ),
    Section(
        "sound",
        "Sources of a steady tone.",
        (
            POSITION,
            _number(
                "volume",
                "what a microphone facing it reads at 0.1 m, peak to peak; 0 is silent",
                0,
                4095,
                "1000",
                "counts",
            ),
            Number(name="frequency", meaning="of the tone", unit="Hz", low=20, high=8000, example="440"),
            NAME,
        ),
        Sound,
    ),
    Section(
        "floor",
        "The floor where nothing is painted on it.",
        (Paint(name="colour", meaning="of the floor"),),
        Ground,
        is_array=False,
    ),
    Section(
        "checkers",
        "Squares of two colours all over the floor, the dark one in the corner (0, 0).",
        (
            _length("square", "side of a square", "0.05"),
            Paint(name="dark", meaning="one colour"),
            Paint(name="light", meaning="the other colour"),
        ),
        Checkers,
        is_array=False,
    ),
    Section(
        "picture",
        "Pictures that lie on the floor, their upper edge at the greater y.",
        (
            Text(
                name="file",
                meaning="a PNG or JPEG file, seen from the folder of the world's file",
                example='"floor.png"',
            ),
            CORNER,
            _size("along x and y, at most four times the arena's"),
        ),
        Print,
        most=16,
    ),
    Section(
        "patch",
        "Rectangles of the floor in another colour, and holes.",
        (
            CORNER,
            _size("along x and y"),
            Paint(name="colour", meaning="of the paint", otherwise="none"),
            Flag(
                name="hole",
                meaning="instead of a colour: it sends nothing back to the ground and cliff sensors. Nobody falls in",
            ),
        ),
        patch,
        most=MOST_PAINTED,
    ),
    Section(
        "stripe",
        "Lines on the floor, such as one to follow.",
        (
            Course(
                name="points",
                meaning="its course; equal first and last points close it",
                unit="m",
                low=-LARGEST_ARENA,
                high=LARGEST_ARENA,
                example="[[0.1, 0.1], [0.9, 0.1]]",
            ),
            _length("width", "of the paint", "0.015", high=1),
            Paint(name="colour", meaning="of the paint"),
        ),
        Stripe,
        most=MOST_PAINTED,
    ),
    Section(
        "robot",
        "Where the robots start.",
        (
            POSITION,
            Degrees(name="heading", meaning="where it looks: 0 along x, positive to the left", example="90"),
            Text(
                name="firmware",
                meaning="what runs on it, such as epuck2",
                example='"epuck2"',
                otherwise="as the simulation is told",
            ),
        ),
        Start,
    ),
)
"""In the order of the reference page."""

PAINT = ("checkers", "picture", "patch", "stripe")
"""What lies on the floor, the lowest first; of one kind, in the order of the file."""

THINGS = ("box", "cylinder", "light", "sound")
"""What may have a name."""
