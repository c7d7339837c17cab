"""Laws that drive every robot of a world from within its run, as fast as the engine goes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from elib.errors import ArgumentError
from elib.physics import kernels


@dataclass(frozen=True, slots=True)
class Controller:
    """A law and its numbers.

    The law is called once a robot and tick as ``law(near, first, parameters, wheels)``: the robot's eight infrared
    readings are ``near[first]`` to ``near[first + 7]``, counts; it sets ``wheels[0]`` and ``wheels[1]``, steps/s as one
    would ask of the firmware. For the compiled engine it keeps to the Python that Numba compiles; there nobody checks
    its indices, and a division by zero gives an infinite speed, which the firmware clips, or none.

    Attributes:
        law: The function.
        parameters: Its numbers, finite.
    """

    law: Callable[..., Any]
    parameters: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for k, value in enumerate(self.parameters):
            if not math.isfinite(value):
                raise ArgumentError(f"parameter {k} of the controller is {value}; it must be a finite number")

    @classmethod
    def braitenberg(
        cls,
        left: Sequence[float] = (-0.9, -0.6, -0.1, 0.0, 0.0, 0.1, 0.3, 0.4),
        right: Sequence[float] = (0.4, 0.3, 0.1, 0.0, 0.0, -0.1, -0.6, -0.7),
        *,
        base: float = 600.0,
    ) -> Controller:
        """Return the law of Braitenberg's vehicles: each wheel turns at *base* plus the weighted sum of the readings.

        Args:
            left: Eight weights of the left wheel, steps/s a count, sensor 0 (front right) first.
            right: Eight weights of the right wheel.
            base: Speed in the open, steps/s.

        Raises:
            ArgumentError: There are not eight weights, or a number is not finite.
        """
        for side, weights in (("left", left), ("right", right)):
            if len(weights) != 8:
                raise ArgumentError(f"{side} has {len(weights)} weights; it takes one for each of the 8 sensors")
        return cls(kernels.braitenberg, (base, *left, base, *right))
