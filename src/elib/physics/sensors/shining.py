"""Kernels of the camera: what pixels look like, and how robots and lamps shine.

A colour is one number, 65536 red + 256 green + blue.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from math import sqrt
from typing import Final, cast

from elib.physics.engine import inner_kernel, kernel
from elib.physics.layout import HEADING_X, HEADING_Y, RADIUS, ROBOT, Floats, Ints, X, Y
from elib.physics.sensors.casting import HIT, MARKS, RISE, SKYLINE
from elib.physics.sensors.optics import (
    ABOVE,
    ACROSS,
    COLUMNS,
    DOWN,
    FIRST_ASIDE,
    FIRST_ROW,
    LAST_ASIDE,
    ORIGIN,
    PER_ASIDE,
    PER_RISE,
    ROWS,
    SHOWING,
    VIEW,
    WARM_BLUE,
    WARM_GREEN,
)

BODY_COLOUR: Final = 58 << 16 | 62 << 8 | 66
RING_COLOUR: Final = 148 << 16 | 196 << 8 | 140
RING_OUTER: Final = RING_COLOUR & 0xFF00FF
RING_INNER: Final = RING_COLOUR & 0x00FF00
"""Of the translucent ring that carries the LEDs; red and blue of it, and green."""

RING_LOW: Final = 0.036
RING_HIGH: Final = 0.046
"""The ring, m above the floor, around the LEDs' height of 41 mm (Webots)."""

GLOW: Final = 40 << 16 | 230 << 8 | 70
"""What the body LED adds to the body that it lights from within."""

FRONT_COLOUR: Final = 255 << 16 | 170 << 8 | 60
FRONT_LOW: Final = 0.025
FRONT_HIGH: Final = 0.032
"""The front LED's window, m above the floor, around its height of 28.5 mm (Webots)."""

_PLACES = ((33.7, 0.0), (22, -25), (0, -33.7), (-27, -20.1), (-33, 0.0), (-27, 20.1), (0, 33.7), (22, 25), (31, -12.5))
LED_X: Final = tuple(x / sqrt(x * x + y * y) for x, y in _PLACES)
LED_Y: Final = tuple(y / sqrt(x * x + y * y) for x, y in _PLACES)
"""Directions of the eight ring LEDs and of the front LED from the robot's middle, forward and left (Webots)."""

FRONT: Final = 8
LAMPS: Final = 10  # Integers a robot: colours of the ring, body, front.
LAMPS_BODY: Final = 8
LAMPS_FRONT: Final = 9

CORE: Final = 0.9962
HALO: Final = 0.92
"""Cosines of the angles around an LED within which the ring shows its full colour, 5 degrees, and any of it, 23
degrees: the ring scatters its light. No figure is published; chosen."""

LAMP_RADIUS: Final = 0.01
"""Of the bright ball that stands for a lamp, m; chosen."""

LAMP_COLOUR: Final = 255 << 16 | 252 << 8 | 236


@inner_kernel
def fill(pixels: Ints, start: int, count: int, step: int, colour: int) -> None:
    """Give *count* pixels, *step* apart from *start* on, one colour."""
    for pixel in range(start, start + count * step, step):
        pixels[pixel] = colour


def quick_fill() -> Callable[[Ints, int, int, int, int], None]:
    """Return what does the same as :func:`fill` to an ``array``, which the interpreter does faster in one go."""
    one = array("I", (0,))

    def fill_slice(pixels: Ints, start: int, count: int, step: int, colour: int) -> None:
        stop = start + count * step
        one[0] = colour
        # Steps that go down may end before the first pixel.
        cast("array[int]", pixels)[start : None if stop < 0 else stop : step] = one * count

    return fill_slice


@inner_kernel
def shine(colour: int, white: float, warm: float) -> int:
    """Return *colour* in so much white light and so much of the front LED's."""
    if warm == 0.0 and white <= 1.0:
        part = int(white * 256.0)
        return ((colour & 0xFF00FF) * part >> 8 & 0xFF00FF) | ((colour & 0x00FF00) * part >> 8 & 0x00FF00)
    red = int((colour >> 16) * (white + warm))
    green = int((colour >> 8 & 255) * (white + WARM_GREEN * warm))
    blue = int((colour & 255) * (white + WARM_BLUE * warm))
    return min(red, 255) << 16 | min(green, 255) << 8 | min(blue, 255)


@kernel
def mix(colour: int, glow: int, part: float) -> int:
    """Return *colour* with a *part* of it, 0..1, replaced by *glow*."""
    rest = 1.0 - part
    red = int((colour >> 16) * rest + (glow >> 16) * part)
    green = int((colour >> 8 & 255) * rest + (glow >> 8 & 255) * part)
    blue = int((colour & 255) * rest + (glow & 255) * part)
    return red << 16 | green << 8 | blue


@kernel
def paint_robot(
    robot: int,
    eye_x: float,
    eye_y: float,
    forward_x: float,
    forward_y: float,
    near: float,
    white: float,
    warm: float,
    gain: float,
    robots: Floats,
    lamps: Ints,
    plan: Ints,
    first_row: float,
    per_metre: float,
    start: int,
    stop: int,
    cell: int,
    down: int,
    pixels: Ints,
) -> None:
    """Paint rows *start* to *stop* of one column where a robot is seen: body, ring, body, and the LEDs it shows."""
    high = start
    place = first_row - (RING_HIGH - ABOVE) * per_metre
    if place > start:
        high = int(place) + 1
    low = stop
    place = first_row - (RING_LOW - ABOVE) * per_metre
    if place < stop:
        low = 0 if place < 0.0 else int(place) + 1
    body = shine(BODY_COLOUR, white, warm)
    ring = shine(RING_COLOUR, white, warm)
    shown = robot * LAMPS
    is_front = False
    front = 0.0
    if plan[SHOWING] > 0:
        strength = min(gain, 1.0)
        if lamps[shown + LAMPS_BODY] != 0:
            body = mix(body, GLOW, 0.5 * strength)
            ring = mix(ring, GLOW, 0.4 * strength)
        # Where on the rim this is, seen from its middle, in its own frame.
        base = robot * ROBOT
        inverse = 1.0 / robots[base + RADIUS]
        dx = (eye_x + forward_x / near - robots[base + X]) * inverse
        dy = (eye_y + forward_y / near - robots[base + Y]) * inverse
        ahead = dx * robots[base + HEADING_X] + dy * robots[base + HEADING_Y]
        aside = dy * robots[base + HEADING_X] - dx * robots[base + HEADING_Y]
        for k in range(FRONT):
            colour = lamps[shown + k]
            if colour != 0:
                cosine = ahead * LED_X[k] + aside * LED_Y[k]
                if cosine > HALO:
                    ring = mix(ring, colour, strength * min(1.0, (cosine - HALO) / (CORE - HALO)))
        if lamps[shown + LAMPS_FRONT] != 0:
            cosine = ahead * LED_X[FRONT] + aside * LED_Y[FRONT]
            if cosine > HALO:
                is_front = True
                front = strength * min(1.0, (cosine - HALO) / (CORE - HALO))
    fill(pixels, cell + start * down, stop - start, down, body)
    if high < low:
        fill(pixels, cell + high * down, low - high, down, ring)
    if is_front:
        colour = mix(body, FRONT_COLOUR, front)
        for row in range(max(start, low), stop):
            height = ABOVE + (first_row - row) / per_metre
            if FRONT_LOW <= height <= FRONT_HIGH:
                pixels[cell + row * down] = colour


@kernel
def paint_lamp(
    near: float,
    tangent: float,
    height: float,
    view: Floats,
    plan: Ints,
    hits: Floats,
    marks: Ints,
    pixels: Ints,
) -> None:
    """Paint a lamp as a bright ball, never less than a pixel, where nothing nearer hides it."""
    columns = plan[COLUMNS]
    rise = (height - ABOVE) * near
    pixel_size = min(1.0 / view[PER_ASIDE], 1.0 / view[PER_RISE])
    radius = max(LAMP_RADIUS * near, 0.75 * pixel_size)
    if tangent + radius < view[FIRST_ASIDE] or tangent - radius > view[LAST_ASIDE]:
        return
    for column in range(columns):
        off = view[VIEW + column] - tangent
        if off < -radius or off > radius:
            continue
        half = sqrt(radius * radius - off * off)
        bottom = rise - half
        hit = column * SKYLINE
        for k in range(marks[column * MARKS]):
            if hits[hit + k * HIT] > near:
                bottom = max(bottom, hits[hit + k * HIT + RISE])
        place = view[FIRST_ROW] - (rise + half) * view[PER_RISE]
        for row in range(plan[ROWS]):
            if row >= place and (view[FIRST_ROW] - row) > bottom * view[PER_RISE]:
                pixels[plan[ORIGIN] + column * plan[ACROSS] + row * plan[DOWN]] = LAMP_COLOUR
