"""Response curves of the eight infrared sensors, and where the sensors sit: data, in counts of the 12-bit converter.

The robot measures the room's light with its emitter off and on, and takes the difference: light pulls the
reading down, so the reflected value can never exceed the ambient one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Final

from elib.base.body import SENSOR_DIRECTIONS, SENSOR_RADIUS
from elib.base.curves import interpolated
from elib.base.errors import ArgumentError
from elib.base.infrared import NOISE, SPACING, USUAL_RESPONSE, response_table
from elib.simulator.physics.geometry import unit

COUNT: Final = 8
FULL_SCALE = 4095
"""Largest reading of the 12-bit converter."""

# Where each sensor sits, degrees from straight ahead, positive to the left; 0 is front right, then clockwise. Bearings
# of Webots' positions. Left and right are mirrored.
BEARINGS = (-18.43, -48.65, -90.0, -153.43, 153.43, 90.0, 48.65, 18.43)

PLACES = tuple((SENSOR_RADIUS * x, SENSOR_RADIUS * y) for x, y in (unit(math.radians(a)) for a in BEARINGS))
"""m"""

AXES = tuple(unit(angle) for angle in SENSOR_DIRECTIONS)

APERTURE = 30.0
"""Side rays stand this far from the middle one, degrees: front and diagonal sensors of robots that face a wall then
read what they should to 10 and 4 % (measured-robots: infrared.head_on_front_sensors). A robot that turned at a touching
box had twice this light at 35 to 50 degrees (infrared.angle_at_contact). No rays give both: at 45 degrees that robot
has 1.3 of A / (d + d0)^2, the light of a sensor that faces a wall, and the diagonal sensors of the others have 0.5 to
0.6."""

NARROW = 15.0
"""The same in Enki, degrees."""

SHARES = {
    1: ((0.0, 1.0),),
    3: ((0.0, 0.5), (1.0, 0.25), (-1.0, 0.25)),
    5: ((0.0, 0.2), (0.5, 0.2), (-0.5, 0.2), (1.0, 0.2), (-1.0, 0.2)),
}
"""Angles of the rays in units of the aperture, the middle one first, and their weights. They add up to 1, so a flat
wall ahead gives the profile's curve exactly, as far as the side rays reach. Five rays have the mean square angle of
three."""

MAX_RAY = 0.12
"""m. No ray is longer, so that wide side rays let a robot see hardly farther than narrow ones: what a wall costs grows
with that. Beyond a depth of 10.4 cm rays at 30 degrees are left out, each of which would bring 4 counts at most."""


@dataclass(frozen=True, slots=True)
class Profile:
    """How much light comes back from a white flat surface straight ahead.

    Attributes:
        name: As worlds call it.
        counts: Reflected light at multiples of :data:`SPACING`, counts; the last entry holds beyond.
        deviation: Standard deviation of the noise there, counts.
        source: Where the figures come from.
        aperture: Angle between the outermost rays and the middle one, degrees.
    """

    name: str
    counts: tuple[float, ...]
    deviation: tuple[float, ...]
    source: str
    aperture: float = APERTURE

    @property
    def reach(self) -> float:
        """Length of the rays, m: the side rays go further to the same depth, up to :data:`MAX_RAY`."""
        table = (len(self.counts) - 1) * SPACING
        return max(table, min(table / unit(math.radians(self.aperture))[0], MAX_RAY))


def profile(name: str | Profile) -> Profile:
    """Return the response profile called *name*, or *name* itself if it is one.

    Raises:
        ArgumentError: No profile has this name.
    """
    if isinstance(name, Profile):
        return name
    try:
        return PROFILES[name]
    except KeyError:
        raise ArgumentError(
            f"there is no infrared profile {name!r}", hint=f"choose one of {', '.join(PROFILES)}"
        ) from None


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
    # The default.
    "measured": Profile(
        "measured",
        USUAL_RESPONSE,
        tuple(NOISE[0] + NOISE[1] * min(counts, FULL_SCALE) for counts in USUAL_RESPONSE),
        "fitted to recordings of real robots; noise of 3 counts and 1 %",
    ),
    "enki": Profile(
        "enki",
        response_table(0.12, _enki),
        response_table(0.12, lambda _: 10.0),
        "Enki's formula; noise of 10 counts",
        NARROW,
    ),
    "webots": Profile(
        "webots",
        response_table(0.07, partial(interpolated, [(x, counts) for x, counts, _ in _WEBOTS])),
        response_table(0.07, partial(interpolated, [(x, counts * relative) for x, counts, relative in _WEBOTS])),
        "Webots' and epuck_ros2's calibration table; 67 counts remain in the open",
        NARROW,
    ),
    "gctronic": Profile(
        "gctronic",
        response_table(0.12, _gctronic),
        response_table(0.12, lambda _: 10.0),
        "inverse of GCtronic's ROS driver, (0.5 m / d)^2 capped at full scale; it states no noise, so Enki's",
        NARROW,
    ),
}
