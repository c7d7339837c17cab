"""Readings of the infrared sensors and the time-of-flight sensor as points around the robot."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Sequence

from elib.base.body import SENSOR_DIRECTIONS, SENSOR_RADIUS
from elib.base.infrared import wall_distance
from elib.base.pictures import base64_of
from elib.records.topics import PackedField, Placement, PointsData, Quaternion, Vector3

_RAYS = tuple((math.cos(angle), math.sin(angle)) for angle in SENSOR_DIRECTIONS)
_POINT = struct.Struct("<4f")
_AT_ROBOT = Placement(Vector3(0.0, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))
_PACKED = [PackedField(name, 4 * k, 7) for k, name in enumerate(("x", "y", "z", "range"))]
HEIGHT = 0.03
"""m. The sensors' height above the floor."""


ROBOT = "robot"
"""Name of the frame that moves with the robot: x forward, y to the left, on the floor between its wheels."""


def infrared_points(time: float, counts: Sequence[int]) -> PointsData:
    """Return the data of ``/ranges/infrared`` for the counts of the eight sensors."""
    seen = ((ray, wall_distance(count)) for ray, count in zip(_RAYS, counts, strict=True))
    return _points(time, (each for each in seen if math.isfinite(each[1])))


def distance_points(time: float, metres: float) -> PointsData:
    """Return the data of ``/ranges/distance``."""
    return _points(time, [((1.0, 0.0), metres)] if math.isfinite(metres) else ())


def _points(time: float, points: Iterable[tuple[tuple[float, float], float]]) -> PointsData:
    packed = b"".join(
        _POINT.pack(x * (SENSOR_RADIUS + metres), y * (SENSOR_RADIUS + metres), HEIGHT, metres)
        for (x, y), metres in points
    )
    return PointsData(
        time=time,
        frame_id=ROBOT,
        pose=_AT_ROBOT,
        point_stride=_POINT.size,
        fields=_PACKED,
        data=base64_of(packed),
    )
