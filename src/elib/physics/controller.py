"""Laws that drive every robot of a world from within its run, as fast as the engine goes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

from elib.errors import ArgumentError
from elib.physics import kernels


@dataclass(frozen=True, slots=True)
class Controller:
    """A law and its numbers.

    The law is called once a robot and tick as ``law(near, first, parameters, wheels)``: the robot's eight infrared
    readings are ``near[first]`` to ``near[first + 7]``, counts; it sets ``wheels[0]`` and ``wheels[1]``, steps/s as one
    would ask of the firmware, both 0 unless it does. For the compiled engine it keeps to the Python that Numba
    compiles; there nobody checks its indices, and what is no number stands for 0.

    Attributes:
        law: The function.
        parameters: Its numbers, finite.
    """

    law: Callable[..., Any]
    parameters: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not callable(self.law):
            raise ArgumentError(f"{self.law!r} is no law", hint="give a function of (near, first, parameters, wheels)")
        given: tuple[object, ...] = self.parameters
        for k, value in enumerate(given):
            # NumPy's numbers are these, too; what is a truth value, also one of its, is none.
            if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
                raise ArgumentError(f"parameter {k} of the controller is {value!r}; it must be a finite number")

    def try_out(self) -> None:
        """Call the law once on readings of 0, with everything it must not touch out of its reach.

        Compiled, nobody checks an index: what would be an error here would be somebody else's memory there.

        Raises:
            ArgumentError: It fails, or writes to what it may only read.
        """
        try:
            self.law((0,) * 8, 0, tuple(float(value) for value in self.parameters), [0.0, 0.0])
        except Exception as error:
            raise ArgumentError(
                f"the law {getattr(self.law, '__name__', self.law)!r} fails on readings of 0: {error!r}",
                hint="it reads near[first] to near[first + 7] and parameters, and sets wheels[0] and wheels[1]",
            ) from error

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
