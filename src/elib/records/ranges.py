"""Readings of the infrared sensors and the time-of-flight sensor as points around the robot."""

from __future__ import annotations

import math
import struct
from binascii import b2a_base64
from bisect import bisect_right
from collections.abc import Iterable, Sequence

from elib.base.body import SENSOR_DIRECTIONS, SENSOR_RADIUS
from elib.base.infrared import SPACING, USUAL_RESPONSE

LEAST = 60
"""counts. Below it a wall is farther than 6.5 cm by the usual curve, and the sensors' noise of 10 counts is more than
5 mm."""
_FALLING = [-count for count in USUAL_RESPONSE]
"""Counts of a white wall at multiples of :data:`SPACING`, negative so that they rise: the simulator's usual curve."""
_RAYS = tuple((math.cos(angle), math.sin(angle)) for angle in SENSOR_DIRECTIONS)
_POINT = struct.Struct("<4f")
_PACKED = {
    "pose": {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}},
    "point_stride": _POINT.size,
    "fields": [{"name": name, "offset": 4 * k, "type": 7} for k, name in enumerate(("x", "y", "z", "range"))],
}
HEIGHT = 0.03
"""m. The sensors' height above the floor."""


def infrared_cloud(counts: Sequence[int]) -> dict[str, object]:
    """Return the message of ``/ranges/infrared``, without its times and frame, for the counts of the eight sensors."""
    seen = ((ray, _metres(count)) for ray, count in zip(_RAYS, counts, strict=True) if count >= LEAST)
    return _cloud(seen)


def distance_cloud(metres: float) -> dict[str, object]:
    """Return the message of ``/ranges/distance``, without its times and frame."""
    return _cloud([((1.0, 0.0), metres)] if math.isfinite(metres) else ())


def _cloud(points: Iterable[tuple[tuple[float, float], float]]) -> dict[str, object]:
    packed = b"".join(
        _POINT.pack(x * (SENSOR_RADIUS + metres), y * (SENSOR_RADIUS + metres), HEIGHT, metres)
        for (x, y), metres in points
    )
    return {**_PACKED, "data": b2a_base64(packed, newline=False).decode("ascii")}


def _metres(count: int) -> float:
    """Return the distance at which a white wall gives so many counts."""
    return SPACING * bisect_right(_FALLING, -count)
