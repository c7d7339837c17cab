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


def _measured(distance: float) -> float:
    return min(LIGHT / (distance + SETBACK) ** 2, MAX_LIGHT)


USUAL_RESPONSE: Final = (*response_table(REACH - SPACING, _measured), 0.0)
"""Light at multiples of :data:`SPACING`, counts; nothing from :data:`REACH` on."""

MIN_COUNT: Final = 60.0
"""Counts above the open air below which nothing is seen: a wall is then farther than 5.7 cm, and what the open air
differs by from place to place is more than 5 mm."""


def wall_distance(counts: float) -> float:
    """Return the distance of a white wall that gives so many counts above the open air, m; infinite if none is seen."""
    return max(0.0, math.sqrt(LIGHT / counts) - SETBACK) if counts >= MIN_COUNT else math.inf
