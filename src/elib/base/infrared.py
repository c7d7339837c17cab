"""How much light a white wall sends back to an infrared sensor: the usual curve, as simulator and recordings use it.

It is that of real robots, counts = A / (d + d0)^2, where d is the distance from the sensor's own place. A and d0 are
fitted to recordings of three robots: eight distances in front of a sensor, a drive away from an object, and turns at a
touching box (measured-robots: infrared.distance_8_sensors, infrared.head_on_front_sensors, infrared.angle_at_contact).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

SPACING: Final = 0.00025
"""Distance between the entries of a response table, m: finer than the kinks of every published curve."""

LIGHT: Final = 0.20
"""A, counts m2: 2000 counts at 1 cm. The sensors of one robot have 1780 on average, those of others 2210, and 1270 to
2700 each (measured-robots: infrared.distance_8_sensors, infrared.head_on_front_sensors)."""

ROOM_READING: Final = 3790.0
"""What a sensor reads of the light of a normal room, and so the most that it reads of its own: real ones saturate at
3761 to 3843 counts (measured-robots: infrared.saturation)."""

SETBACK: Final = 0.001
"""d0, m. Of the eight sensors of a robot it is 0.0014, on average (measured-robots: infrared.distance_8_sensors)."""

REACH: Final = 0.12
"""m. Farther walls send nothing back: 14 counts are left there, and by then a robot sees the room's own unevenness."""

MAX_LIGHT: Final = 40950.0
"""Light that no table of responses exceeds, counts: ten times what the converter holds. A sensor saturates by the sum
of what its rays bring, so one of them may bring more than the converter holds."""


def response_table(reach: float, law: Callable[[float], float]) -> tuple[float, ...]:
    """Return the value of *law* at multiples of :data:`SPACING`, from 0 to *reach* m."""
    return tuple(law(k * SPACING) for k in range(round(reach / SPACING) + 1))


def usual_light(distance: float) -> float:
    """Return the light that a white wall sends back to a usual sensor, counts."""
    return min(LIGHT / (distance + SETBACK) ** 2, MAX_LIGHT)


USUAL_RESPONSE: Final = (*response_table(REACH - SPACING, usual_light), 0.0)
"""Light at multiples of :data:`SPACING`, counts; nothing from :data:`REACH` on."""

GAIN_SPREAD: Final = 0.17
"""Standard deviation of the gains of real sensors (measured-robots: infrared.distance_8_sensors)."""

FITTED_SPREAD: Final = 0.025
"""What is left of it where ``elib fit`` has found the gains: 2.9 % at most, of 24 virtual robots (parity.md)."""

NOISE: Final = (3.0, 0.01)
"""Standard deviation of the readings of a standing robot: counts, and part of the reading
(measured-robots: infrared.noise_at_rest)."""

OPEN_AIR_ERROR: Final = 4.0
"""Counts by which the reading in the open is wrong: the mean that it is learned from has noise too."""

TOUCHING: Final = 3000.0
"""Counts above the open air from which a sensor may be saturated: then all from a touch on is as likely."""

NINE_IN_TEN: Final = 1.645
"""Standard deviations to both sides, within which nine of ten errors lie."""

MIN_COUNT: Final = 60.0
"""Counts above the open air below which nothing is seen: a wall is then farther than 5.7 cm, and what the open air
differs by from place to place is more than 5 mm."""


def wall_distance(counts: float, gain: float = 1.0) -> float:
    """Return the distance of a white wall that gives so many counts above the open air, m; infinite if none is seen.

    Args:
        counts: What the sensor reads without what it reads in the open.
        gain: Its own factor on the usual light, as far as it is known.
    """
    return max(0.0, math.sqrt(LIGHT * gain / counts) - SETBACK) if counts >= MIN_COUNT else math.inf


def wall_error(counts: float, gain: float = 1.0, spread: float = GAIN_SPREAD) -> float:
    """Return by how much that distance may be wrong, m: of ten walls that a sensor faces, nine are nearer to it.

    Args:
        counts: What the sensor reads without what it reads in the open.
        gain: Its own factor on the usual light.
        spread: Standard deviation of what is not known of that factor.
    """
    if counts < MIN_COUNT:
        return math.inf
    distance = math.sqrt(LIGHT * gain / counts)
    error = NINE_IN_TEN * distance / 2 * math.hypot(spread, NOISE[1], NOISE[0] / counts, OPEN_AIR_ERROR / counts)
    return error if counts < TOUCHING else max(error, distance)
