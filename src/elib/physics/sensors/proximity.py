"""The eight infrared sensors: reflected and ambient light in counts of the robot's 12-bit converter.

The robot measures the room's light with its emitter off and on, and takes the difference: light pulls the
reading down, so the reflected value can never exceed the ambient one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from elib.errors import ArgumentError
from elib.physics.body import SENSOR_RADIUS
from elib.physics.geometry import unit
from elib.physics.kernels import Floats, Ints
from elib.physics.noise import AMBIENT, PROXIMITY, SPREAD, STRIDE, gauss
from elib.physics.sensors.fan import Fan

COUNT = 8
RAYS = 3
FULL_SCALE = 4095
"""Largest reading of the 12-bit converter."""

# Where each sensor sits and looks, degrees from straight ahead, positive to the left; 0 is front right,
# then clockwise. Bearings of Webots' positions and its directions, which agree with Enki's and Player's
# within 4 degrees (side and front) and 10 degrees (rear). Left and right are mirrored.
BEARINGS = (-18.43, -48.65, -90.0, -153.43, 153.43, 90.0, 48.65, 18.43)
DIRECTIONS = (-17.2, -45.9, -90.0, -151.5, 151.5, 90.0, 45.9, 17.2)

APERTURE = 15.0
"""Side rays stand this far from the middle one, degrees (Enki)."""

MIDDLE_SHARE = 0.5
SIDE_SHARE = 0.25
"""Weights of the rays. They add up to 1, so a flat wall ahead gives the published curve exactly."""

AMBIENT_DEVIATION = 7.0
"""Noise of one reading of the room's light, counts: the difference of two has Enki's 10. Webots gives 1 %."""

AMBIENT_MARGIN = 4 * AMBIENT_DEVIATION  # Beyond any noise: below it the cap need not be looked up.

SPACING = 0.00025
"""Distance between the entries of a response table, m: finer than the kinks of every published curve."""

TAIL = 20
"""Last entries of a table that repeat its end: the longest ray's place and its neighbour lie there, unchecked."""

# From a ray's length to its place in the table: by its depth along the sensor's axis.
STRAIGHT = 1 / SPACING
SLANTED = unit(math.radians(APERTURE))[0] / SPACING


@dataclass(frozen=True, slots=True)
class Profile:
    """How much light comes back from a white flat surface straight ahead.

    Attributes:
        name: As worlds call it.
        counts: Reflected light at multiples of :data:`SPACING`, counts; the last entry holds beyond.
        deviation: Standard deviation of the noise there, counts.
        source: Where the figures come from.
    """

    name: str
    counts: tuple[float, ...]
    deviation: tuple[float, ...]
    source: str

    @property
    def reach(self) -> float:
        """Length a ray must have, m: the side rays go further to the same depth."""
        return (len(self.counts) - TAIL - 1) / SLANTED


def profile(name: str) -> Profile:
    """Return the response profile called *name*.

    Raises:
        ArgumentError: There is none of that name.
    """
    try:
        return PROFILES[name]
    except KeyError:
        raise ArgumentError(
            f"there is no infrared profile {name!r}", hint=f"choose one of {', '.join(PROFILES)}"
        ) from None


def _table(reach: float, law: Callable[[float], float]) -> tuple[float, ...]:
    entries = [law(k * SPACING) for k in range(round(reach / SPACING) + 1)]
    return tuple(entries + entries[-1:] * TAIL)


def _between(knots: Sequence[tuple[float, float]]) -> Callable[[float], float]:
    """Return the straight-line interpolation of (x, value) pairs."""

    def law(x: float) -> float:
        for (x0, value0), (x1, value1) in pairwise(knots):
            if x <= x1:
                return value0 + (value1 - value0) * (x - x0) / (x1 - x0)
        return knots[-1][1]

    return law


def _enki(distance: float) -> float:
    # Published in centimetres: m (c - x0^2) / (x^2 - 2 x0 x + c) with m 3731, x0 0.3, c 0.7; its maximum
    # holds below x0.
    x = max(distance * 100, 0.3)
    return 0.0 if x > 11.999 else 3731 * (0.7 - 0.09) / (x * x - 0.6 * x + 0.7)


def _gctronic(distance: float) -> float:
    return min((0.5 / max(distance, SPACING)) ** 2, FULL_SCALE)


# (m, counts, relative deviation): the calibration published with Webots and, under Apache-2.0, with
# epuck_ros2.
_WEBOTS = (
    (0.0, 4095.0, 0.002),
    (0.005, 2133.33, 0.003),
    (0.01, 1465.73, 0.007),
    (0.015, 601.46, 0.0406),
    (0.02, 383.84, 0.01472),
    (0.03, 234.93, 0.0241),
    (0.04, 158.03, 0.0287),
    (0.05, 120.0, 0.04225),
    (0.06, 104.09, 0.03065),
    (0.07, 67.19, 0.04897),
)

PROFILES = {
    # The default: a smooth curve, and from 1.5 cm on it agrees within 4 % with GCtronic's independent fit.
    "enki": Profile("enki", _table(0.12, _enki), _table(0.12, lambda _: 10.0), "Enki's formula; noise of 10 counts"),
    "webots": Profile(
        "webots",
        _table(0.07, _between([(x, counts) for x, counts, _ in _WEBOTS])),
        _table(0.07, _between([(x, counts * relative) for x, counts, relative in _WEBOTS])),
        "Webots' and epuck_ros2's calibration table; 67 counts remain in the open",
    ),
    "gctronic": Profile(
        "gctronic",
        _table(0.12, _gctronic),
        _table(0.12, lambda _: 10.0),
        "inverse of GCtronic's ROS driver, (0.5 m / d)^2 capped at full scale; it states no noise, so Enki's",
    ),
}


FAN = Fan.of(
    [(SENSOR_RADIUS * x, SENSOR_RADIUS * y) for x, y in (unit(math.radians(angle)) for angle in BEARINGS)],
    [[unit(math.radians(angle + side)) for side in (APERTURE, 0.0, -APERTURE)] for angle in DIRECTIONS],
    spread=unit(math.radians(APERTURE))[1],
)
"""Three rays a sensor, left to right."""


def reflect(
    key: int,
    distances: Floats,
    reach: float,
    counts: Floats,
    deviation: Floats,
    gain: Floats,
    noise: float,
    ambient: float,
    values: Ints,
) -> None:
    """Turn what the rays met into reflected light.

    Each ray counts by its depth along the sensor's axis, so a flat wall ahead gives the published curve
    exactly and the edge of a wall fades in by the rays' weights.

    Args:
        key: The robot's noise key of this tick.
        distances: Of each ray, m.
        reach: What a ray measures that meets nothing, m.
        counts: The profile's table.
        deviation: The profile's table.
        gain: Factor of each sensor around 1.
        noise: Factor on the deviation.
        ambient: The room's light, counts.
        values: Out: one a sensor, counts, 0..4095, higher is nearer.
    """
    last = len(counts) - 1
    ceiling = ambient - AMBIENT_MARGIN * noise
    word = key + PROXIMITY * STRIDE
    for i in range(len(values)):
        light = counts[last]
        spread = deviation[last]
        k = i * 3
        left = distances[k]
        middle = distances[k + 1]
        right = distances[k + 2]
        if left < reach or middle < reach or right < reach:
            place = left * SLANTED
            below = int(place)
            side = counts[below] + (place - below) * (counts[below + 1] - counts[below])
            place = right * SLANTED
            below = int(place)
            side += counts[below] + (place - below) * (counts[below + 1] - counts[below])
            place = middle * STRAIGHT
            below = int(place)
            ahead = counts[below] + (place - below) * (counts[below + 1] - counts[below])
            light = SIDE_SHARE * side + MIDDLE_SHARE * ahead
            spread = deviation[below]
        light *= gain[i]
        if noise > 0.0:
            # noise.gauss(key, PROXIMITY + i), written out: interpreted, two calls cost more than the arithmetic.
            bits = word & 0xFFFFFFFF
            bits = ((bits ^ (bits >> 16)) * 0x21F0AAAD) & 0xFFFFFFFF
            bits = ((bits ^ (bits >> 15)) * 0x735A2D97) & 0xFFFFFFFF
            bits ^= bits >> 15
            pairs = (bits & 0xFF00FF) + ((bits >> 8) & 0xFF00FF)
            light += noise * spread * (((pairs & 0xFFFF) + (pairs >> 16) - 510) / SPREAD)
            word += STRIDE
        if light > ceiling:
            light = min(light, darkness(key, i, noise, ambient))
        values[i] = int(light + 0.5) if light > 0.0 else 0


def darkness(key: int, sensor: int, noise: float, ambient: float) -> int:
    """Return one sensor's reading with its emitter off, counts, 0..4095, higher is darker."""
    level = ambient + noise * AMBIENT_DEVIATION * gauss(key, AMBIENT + sensor)
    return int(min(max(level, 0.0), 4095.0) + 0.5)
