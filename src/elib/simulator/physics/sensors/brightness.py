"""How bright the camera sees things: every law of brightness and every colour of a robot, each in one place.

A surface of colour C (0..255) at depth z, m, is seen as

    C x shade x fade(z) x (room + lamps + front LED) x exposure x level

Light is counted in units of a normally lit room. The shade says how the surface stands to the eye. The background is
seen in the room's light alone. What shines itself, such as an LED, keeps its colour in any light; it gets darker only
where the exposure falls below 1. The chip then washes colours out, and each robot's chip weighs red, green and blue in
its own way (:mod:`elib.simulator.physics.optics`). Of the rest no figures are published; those without a source here
are chosen.

Numbers may be NumPy arrays, of any shapes that fit each other. A packed colour is 65536 red + 256 green + blue; a
colour's counts are an array whose last axis has red, green and blue, 0..255.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

DARK_ROOM: Final = 4095.0
"""What the infrared sensors read in the dark, counts."""

NORMAL_ROOM: Final = 3750.0
"""What they read in a room whose light is the unit, counts; a room with the default ``ambient`` has 0.88 of it."""

LAMP: Final = DARK_ROOM / (DARK_ROOM - NORMAL_ROOM)
"""A lamp as close as can be, 11.9 in units of a normally lit room: in the dark it takes the infrared sensors from 4095
counts to 0 (:mod:`elib.simulator.physics.sensors.ambient_light`), a normal room's light only to 3750."""

BRIGHTEN: Final = 4.0
DARKEN: Final = 0.125
"""How far the chip's automatic exposure goes up and down: two stops and three."""

LED_REACH: Final = 0.08
"""Where the front LED's light has fallen to half, m. It shows within 20 cm in a lit room, within 1 m in the dark."""

LED_ASIDE: Final = 0.0125
"""The front LED sits this far to the right of the lens, m, and 1 mm ahead of it (Webots)."""

WARM: Final = np.array((1.0, 0.62, 0.22))
"""Red, green and blue of the front LED's orange light (its colour: Webots; the numbers: chosen)."""

BODY_COLOUR: Final = 58 << 16 | 62 << 8 | 66
RING_COLOUR: Final = 148 << 16 | 196 << 8 | 140
"""Colour of the translucent ring that carries the LEDs."""

RING_LOW: Final = 0.036
RING_HIGH: Final = 0.046
"""The ring, m above the floor, around the LEDs' height of 41 mm (Webots)."""

FRONT_COLOUR: Final = 255 << 16 | 170 << 8 | 60
FRONT_LOW: Final = 0.025
FRONT_HIGH: Final = 0.032
"""The front LED's window, m above the floor, around its height of 28.5 mm (Webots)."""

GLOW: Final = 40 << 16 | 230 << 8 | 70
BODY_GLOW: Final = 0.5
RING_GLOW: Final = 0.4
"""Colour of the body LED, and how much of it body and ring take on: it lights the robot from within."""

LED_PLACES: Final = np.array(
    ((33.7, 0), (22, -25), (0, -33.7), (-27, -20.1), (-33, 0), (-27, 20.1), (0, 33.7), (22, 25), (31, -12.5))
)
"""The eight ring LEDs and the front LED, mm ahead of the robot's middle and to its left (Webots)."""

CORE: Final = 0.9962
HALO: Final = 0.92
"""Cosines of the angles around an LED within which the ring shows its full colour, 5 degrees, and any of it, 23
degrees: the ring scatters its light."""

LAMP_RADIUS: Final = 0.01
"""Radius of the bright ball that stands for a lamp, m."""

LAMP_COLOUR: Final = 255 << 16 | 252 << 8 | 236

BACKGROUND: Final = 214 << 16 | 222 << 8 | 230
"""Packed colour of what is seen above the walls."""


class LampArrays(NamedTuple):
    """The lamps of a world."""

    x: Floats  # place, m
    y: Floats  # place, m
    height: Floats  # above the floor, m
    intensity: Floats  # as in Light; a lamp of 0 is switched off


def room_light(ambient: float) -> float:
    """Return a room's light from the infrared sensors' reading, counts, higher is darker.

    (4095 - ambient) / (4095 - 3750): the sensor's current grows with the light that falls on it, and a normally lit
    room is 1.
    """
    return max(0.0, (DARK_ROOM - ambient) / (DARK_ROOM - NORMAL_ROOM))


def exposure(light: Floats) -> Floats:
    """Return the factor by which the chip's automatic exposure answers to *light*: 1 / light, from 1/8 to 4.

    So a normally lit room keeps its brightness, below a quarter of its light pictures get dark, and above eight times
    they are overexposed.
    """
    return np.maximum(DARKEN, 1.0 / np.maximum(light, 1.0 / BRIGHTEN))


def fade(near: Floats) -> Floats:
    """Return how bright things look at an inverse depth of *near*, 1/m: 0.82 + 0.18 / (1 + 2 z).

    A little darker far away, so that surfaces of one colour can be told apart.
    """
    return 0.82 + 0.18 * near / (near + 2.0)


def wall_shade(tangent_x: Floats) -> Floats:
    """Return the shade of a wall from the x part of its direction: walls that meet in a corner look different."""
    return 0.78 + 0.2 * tangent_x * tangent_x


def round_shade(facing: Floats) -> Floats:
    """Return the shade of what is round from the cosine between its surface's normal and the ray."""
    return 0.6 + 0.4 * facing


def sky_shade(rise: Floats) -> Floats:
    """Return the shade of the background, a little darker higher up, from the tangent of the ray's elevation."""
    return np.clip(1.0 - rise / 2.0, 0.6, 1.0)


def decay(distance: Floats) -> Floats:
    """Return 1/e to the power of *distance* >= 0, the same to the last bit on every machine; within 0.1 % up to 10."""
    part = np.minimum(distance, 60.0) / 32.0
    power: Floats = 1.0 + part * (1.0 + part * (0.5 + part * (1.0 / 6.0 + part * (1.0 / 24.0))))
    for _ in range(5):  # To the power of 32.
        power = power * power
    return np.where(distance > 60.0, 0.0, 1.0 / power)


def lamp_light(x: Floats, y: Floats, z: float, lights: LampArrays) -> Floats:
    """Return what the lamps shed on places, m, in units of a normally lit room.

    The sum of 11.9 exp(-2 d / intensity) over all lamps, d the distance, m: the law of the infrared sensors
    (ARGoS), without its end at 2.5 m. Nothing casts a shadow for the camera.
    """
    total = np.zeros_like(x)
    for lamp_x, lamp_y, height, intensity in zip(*lights, strict=True):
        if intensity > 0.0:
            distance = np.sqrt((lamp_x - x) ** 2 + (lamp_y - y) ** 2 + (height - z) ** 2)
            total += LAMP * decay(2.0 * distance / intensity)
    return total


def led_light(depth: Floats, aside: Floats) -> Floats:
    """Return what the robot's own front LED sheds on what it faces, in units of a normally lit room.

    1 / (1 + (d / 8 cm)^2) x cos^4: with the square of the distance d from the LED, and less the further from its
    axis, cos being that of the angle to it.

    Args:
        depth: Along the camera's axis, m, more than 0.
        aside: To the right of it, m.
    """
    square = depth * depth + (aside - LED_ASIDE) ** 2
    cosine = depth * depth / square
    return cosine * cosine / (1.0 + square / (LED_REACH * LED_REACH))


def counts(colour: Ints | int, keep: float) -> Floats:
    """Return packed colours as a chip shows them: red, green and blue, 0..255, on a further axis.

    Args:
        colour: Packed.
        keep: How much of their saturation they keep.
    """
    packed = np.asarray(colour, np.int64)
    return washed(np.stack((packed >> 16, packed >> 8 & 255, packed & 255), axis=-1).astype(np.float64), keep)


one = lru_cache(maxsize=64)(counts)
"""The same for one colour, kept."""


def washed(seen: Floats, keep: float) -> Floats:
    """Return red, green and blue, on the last axis, with only part of their saturation; the brightest stays as it is.

    What a light multiplies may be washed out before, and so once for a thing, not for each of its pixels.
    """
    brightest = np.maximum(np.maximum(seen[..., :1], seen[..., 1:2]), seen[..., 2:])
    less: Floats = brightest - (brightest - seen) * keep
    return less


def packed(seen: Floats) -> NDArray[np.uint32]:
    """Return the packed form of colours' counts; what is brighter than 255 is 255."""
    whole = np.minimum(seen, 255.0).astype(np.uint32)
    words: NDArray[np.uint32] = whole[..., 0] << np.uint32(16) | whole[..., 1] << np.uint32(8) | whole[..., 2]
    return words


def mix(seen: Floats, glow: Floats, part: Floats) -> Floats:
    """Return colours' counts with a *part* of each, 0..1, replaced by those of *glow*."""
    share = part[..., np.newaxis]
    mixed: Floats = seen * (1.0 - share) + glow * share
    return mixed


def led_parts(ahead: Floats, left: Floats) -> Floats:
    """Return how much of each LED's colour, 0..1, a robot's rim shows at places; further axis: 8 of the ring, front.

    Args:
        ahead: How far ahead of the robot's middle, in units of its radius.
        left: How far to the left of it, in the same units.
    """
    directions = LED_PLACES / np.sqrt((LED_PLACES**2).sum(axis=1, keepdims=True))
    cosine = ahead[..., np.newaxis] * directions[:, 0] + left[..., np.newaxis] * directions[:, 1]
    part: Floats = np.clip((cosine - HALO) / (CORE - HALO), 0.0, 1.0)
    return part
