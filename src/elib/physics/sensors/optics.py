"""The camera's lens, and the light by which it sees: every law of brightness, each in one place.

A surface of colour C (0..255) at depth z, m, delivers

    C x shade x fade(z) x (room + lamps + front LED) x exposure,    at most 255

where light is counted in units of a normally lit room and shade says how the surface stands: 0.78 + 0.2 t^2 for a
wall, t being the x part of its direction, so that walls which meet in a corner look different; 0.6 + 0.4 f for what is
round, f being the cosine between its surface and the ray; 1 for the floor. The background is seen in the room's light
alone, a little darker higher up. No figures are published; chosen. What shines itself, such as an LED, does not depend
on light: it keeps its colour, and fades only where the exposure falls below 1.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Final

from elib.errors import ArgumentError
from elib.physics.engine import Engine, kernel
from elib.physics.floor import Floor, packed
from elib.physics.geometry import Colour
from elib.physics.layout import INTENSITY, LIGHT, LIGHT_TOP, Floats, Ints

FORWARD: Final = 0.030
"""The lens is this far ahead of the axle, m (Webots)."""

ABOVE: Final = 0.028
"""Height of the lens above the floor, m (Webots)."""

SENSOR = (640, 480)
"""Columns and rows of the chip."""


@dataclass(frozen=True, slots=True)
class Lens:
    """A pinhole.

    Attributes:
        name: Of the source it comes from.
        focal: Its distance from the chip, sensor pixels.
    """

    name: str
    focal: float

    @classmethod
    def seeing(cls, name: str, field: float, columns: float) -> Lens:
        """Return the lens through which so many sensor *columns* see *field*, rad."""
        return cls(name, columns / 2 / math.tan(field / 2))


LENSES = {
    lens.name: lens
    for lens in (
        Lens.seeing("epucklib", math.radians(56.0), SENSOR[0]),
        Lens.seeing("webots", 0.84, 52 * 8),
    )
}
"""epucklib: 56 degrees over all 640 columns. Webots: 0.84 rad over 52 columns of 8. The sources lie between 38 and 60
degrees."""


def lens_named(name: str) -> Lens:
    """Return the lens called *name*.

    Raises:
        ArgumentError: There is none of that name.
    """
    try:
        return LENSES[name]
    except KeyError:
        raise ArgumentError(f"there is no lens {name!r}", hint=f"choose one of {', '.join(LENSES)}") from None


FOCAL = LENSES["epucklib"].focal
"""Of the usual lens, sensor pixels."""

NORMAL_ROOM: Final = 3750.0
"""What the infrared sensors read in a room that is lit as usual, counts: the default of the model's ``ambient``."""

DARK_ROOM: Final = 4095.0
"""What they read in the dark, counts."""

LAMP: Final = DARK_ROOM / (DARK_ROOM - NORMAL_ROOM)
"""A lamp as close as can be, 11.9 in units of a normally lit room: in the dark it takes the infrared sensors from 4095
counts to 0 (:mod:`elib.physics.sensors.light`), a normal room's light only to 3750."""

BRIGHTEN: Final = 4.0
DARKEN: Final = 0.125
"""How far the chip's automatic exposure goes up and down. No figure is published; chosen: two stops and three."""

LED_LIGHT: Final = 1.0
"""The front LED right before a surface, in units of a normally lit room. No figure is published; chosen so that it
shows within 20 cm in a lit room and within a metre in the dark."""

LED_REACH: Final = 0.08
"""Where the front LED's light has fallen to half, m. No figure is published; chosen."""

LED_ASIDE: Final = 0.0125
"""The front LED sits this far to the right of the lens, m, and 1 mm ahead of it (Webots)."""

WARM_GREEN: Final = 0.62
WARM_BLUE: Final = 0.22
"""Green and blue part of the front LED's orange light, red being 1 (its colour: Webots; the parts: chosen)."""

FARTHEST: Final = 1e6
"""Depth of the floor in a row that all but looks along it, m."""

# What stands in a window's view: these, then one number a column of each of the first three tables, then two a row.
FIRST_ASIDE: Final = 0  # Tangent of the first column's angle to the right of the axis.
LAST_ASIDE: Final = 1
PER_ASIDE: Final = 2  # Columns to a tangent of 1.
FIRST_ROW: Final = 3  # Rows from the first one down to the horizon, with the fraction.
PER_RISE: Final = 4  # Rows to a tangent of 1.
LEVEL: Final = 5  # The brightness for which the backdrop was painted.
PAINT_SCALE: Final = 6  # Pixels a metre of the floor's picture.
VIEW: Final = 7
# Tables: tangent of each column's angle; 1 + its square; the root of that. Then of each row: depth of the floor, m, 0
# above the horizon; and shade of floor or sky.

# What stands in a window's plan.
COLUMNS: Final = 0
ROWS: Final = 1
ORIGIN: Final = 2  # Where the pixel of the leftmost column in the uppermost row lies.
ACROSS: Final = 3  # From there to the next column,
DOWN: Final = 4  # and to the next row.
HORIZON: Final = 5  # The first row that looks down.
FLOOR: Final = 6  # Colour of the unpainted floor.
BACKGROUND: Final = 7  # Colour behind everything.
PAINT_COLUMNS: Final = 8  # Of the floor's picture; 0 if nothing is painted.
PAINT_ROWS: Final = 9
# And how many there are, at each picture:
ROBOT_COUNT: Final = 10
WALL_COUNT: Final = 11
DISC_COUNT: Final = 12
LIGHT_COUNT: Final = 13
SHOWING: Final = 14  # Robots of which it is known what they show: all or none.
PLAN: Final = 15


@kernel
def room_light(ambient: float) -> float:
    """Return a room's light from the infrared sensors' reading, counts, higher is darker.

    (4095 - ambient) / (4095 - 3750): the sensor's current grows with the light that falls on it, and a normally lit
    room is 1.
    """
    return max(0.0, (DARK_ROOM - ambient) / (DARK_ROOM - NORMAL_ROOM))


@kernel
def exposure(light: float) -> float:
    """Return the factor by which the chip's automatic exposure answers to *light*.

    1 / light, from 1/8 to 4. So a normally lit room keeps its brightness, below a quarter of its light pictures get
    dark, and above eight times they are overexposed. No figure is published; chosen.
    """
    if light * BRIGHTEN < 1.0:
        return BRIGHTEN
    return max(DARKEN, 1.0 / light)


@kernel
def fade(near: float) -> float:
    """Return how bright things look at an inverse depth of *near*, 1/m: 0.82 + 0.18 / (1 + 2 z).

    A little darker far away, as under a lamp carried along; chosen, so that surfaces of one colour can be told apart.
    """
    return 0.82 + 0.18 * near / (near + 2.0)


@kernel
def decay(distance: float) -> float:
    """Return 1/e to the power of *distance* >= 0, the same to the last bit on every machine; within 0.1 % up to 10."""
    if distance > 60.0:
        return 0.0
    part = distance * (1.0 / 32.0)
    power = 1.0 + part * (1.0 + part * (0.5 + part * (1.0 / 6.0 + part * (1.0 / 24.0))))
    power *= power
    power *= power
    power *= power
    power *= power
    power *= power
    return 1.0 / power


@kernel
def lamp_light(x: float, y: float, z: float, lights: Floats, plan: Ints) -> float:
    """Return what the lamps shed on a place, m, in units of a normally lit room.

    The sum of 11.9 exp(-2 d / intensity) over all lamps, d the distance, m: the law of the infrared sensors
    (ARGoS), without its end at 2.5 m. Nothing casts a shadow for the camera.
    """
    total = 0.0
    for k in range(0, plan[LIGHT_COUNT] * LIGHT, LIGHT):
        intensity = lights[k + INTENSITY]
        if intensity > 0.0:
            dx = lights[k] - x
            dy = lights[k + 1] - y
            dz = lights[k + LIGHT_TOP] - z
            total += LAMP * decay(2.0 * sqrt(dx * dx + dy * dy + dz * dz) / intensity)
    return total


@kernel
def led_light(depth: float, aside: float) -> float:
    """Return what the robot's own front LED sheds on what it faces, in units of a normally lit room.

    1 / (1 + (d / 8 cm)^2) x cos^4: with the square of the distance d from the LED, and less the further from its
    axis, cos being that of the angle to it. No figure is published; chosen.

    Args:
        depth: Along the camera's axis, m, more than 0.
        aside: To the right of it, m.
    """
    off = aside - LED_ASIDE
    square = depth * depth + off * off
    cosine = depth * depth / square
    return LED_LIGHT * cosine * cosine / (1.0 + square * (1.0 / (LED_REACH * LED_REACH)))


class Window:
    """What one window of the chip needs: its angles, and the sequences the kernels fill.

    Attributes:
        columns: Of the picture.
        rows: Of the picture.
        view: Numbers and tables laid out as above.
        plan: Integers laid out as above.
        blank: Floor and sky as they are without anything else.
        pixels: The picture, row by row, each pixel 65536 red + 256 green + blue.
        size: Number of pixels.
        shape: Of the picture as an array.
        sequences: View, plan, blank and pixels, as the kernels take them.
    """

    def __init__(
        self,
        lens: Lens,
        engine: Engine,
        right: Sequence[float],
        up: Sequence[float],
        floor: Floor,
        background: Colour,
    ) -> None:
        """Prepare a window.

        Args:
            lens: Through which it looks.
            engine: Of the kernels.
            right: Offset of each column's centre to the right of the axis, sensor pixels, evenly spaced.
            up: Offset of each row's centre above the axis, the same.
            floor: On which everything stands.
            background: Colour behind everything.

        Raises:
            ArgumentError: Offsets are not finite or not evenly spaced.
        """
        self.columns, self.rows = columns, rows = len(right), len(up)
        turned, flipped = _step("right", right) < 0, _step("up", up) > 0
        aside = [offset / lens.focal for offset in (reversed(right) if turned else right)]
        rise = [offset / lens.focal for offset in (reversed(up) if flipped else up)]
        per_aside, per_rise = (
            lens.focal / (abs(_step("right", right)) or 1.0),
            lens.focal / (abs(_step("up", up)) or 1.0),
        )
        ends = (aside[0], aside[-1]) if columns else (0.0, 0.0)
        squares = [1.0 + tangent * tangent for tangent in aside]
        depths = [min(ABOVE / -tangent, FARTHEST) if tangent < 0 else 0.0 for tangent in rise]
        shades = [
            fade(1 / depth) if depth else min(1.0, max(0.6, 1 - t / 2)) for depth, t in zip(depths, rise, strict=True)
        ]
        self.view = engine.floats(
            [
                *ends,
                per_aside,
                rise[0] * per_rise if rows else 0.0,
                per_rise,
                -1.0,
                floor.scale,
                *aside,
                *squares,
                *map(sqrt, squares),
                *depths,
                *shades,
            ]
        )
        origin = (columns - 1 if turned else 0) + ((rows - 1) * columns if flipped else 0)
        horizon = sum(tangent >= 0 for tangent in rise)
        colours = floor.colour, packed(background)
        steps = -1 if turned else 1, -columns if flipped else columns
        self.plan = engine.ints(
            [columns, rows, origin, *steps, horizon, *colours, floor.columns, floor.rows, 0, 0, 0, 0, 0]
        )
        self.size, self.shape = columns * rows, (rows, columns, 3)
        self.blank, self.pixels = self._pixels(engine), self._pixels(engine)
        self.sequences = self.view, self.plan, self.blank, self.pixels

    def _pixels(self, engine: Engine) -> Ints:
        if engine.name == "compiled":
            return engine.ints([0] * self.size)
        return array("I", bytes(self.size * array("I").itemsize))  # Copied in no time, and numpy reads it.


def _step(name: str, offsets: Sequence[float]) -> float:
    """Return what lies between two neighbours of *offsets*, 0 if there are none."""
    if not all(math.isfinite(offset) for offset in offsets):
        raise ArgumentError(f"{name} holds an offset that is no finite number")
    if len(offsets) < 2:
        return 0.0
    step = (offsets[-1] - offsets[0]) / (len(offsets) - 1)
    for k, offset in enumerate(offsets):
        if step == 0.0 or abs(offsets[0] + k * step - offset) > 1e-6:
            raise ArgumentError(
                f"{name}[{k}] is {offset}; the offsets of a picture's pixels must be evenly spaced",
                hint="take several pictures for several windows",
            )
    return step
