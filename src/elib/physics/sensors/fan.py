"""The rays of a group of sensors, laid out flat for the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Fan:
    """Sensors of one kind in the robot's frame (x forward, y left), equally many rays each, the middle one the axis.

    Attributes:
        place_x: Of each sensor, m.
        place_y: Of each sensor, m.
        ray_x: Direction of each ray, unit vectors, sensor by sensor.
        ray_y: Direction of each ray.
        spread: Sine of the angle between a sensor's axis and its outermost ray.
    """

    place_x: list[float]
    place_y: list[float]
    ray_x: list[float]
    ray_y: list[float]
    spread: float

    @classmethod
    def of(
        cls,
        places: Sequence[tuple[float, float]],
        rays: Sequence[Sequence[tuple[float, float]]],
        *,
        spread: float,
    ) -> Fan:
        """Lay out *places*, m, and the directions of each one's *rays*."""
        return cls(
            [x for x, _ in places],
            [y for _, y in places],
            [x for group in rays for x, _ in group],
            [y for group in rays for _, y in group],
            spread,
        )
