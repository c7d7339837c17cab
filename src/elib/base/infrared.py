"""How much light a white wall sends back to an infrared sensor: the usual curve, as simulator and recordings use it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

SPACING: Final = 0.00025
"""Distance between the entries of a response table, m: finer than the kinks of every published curve."""


def response_table(reach: float, law: Callable[[float], float]) -> tuple[float, ...]:
    """Return the value of *law* at multiples of :data:`SPACING`, from 0 to *reach* m."""
    return tuple(law(k * SPACING) for k in range(round(reach / SPACING) + 1))


def _enki(distance: float) -> float:
    # Published in centimetres: m (c - x0^2) / (x^2 - 2 x0 x + c) with m 3731, x0 0.3, c 0.7; its maximum
    # holds below x0.
    x = max(distance * 100, 0.3)
    return 0.0 if x > 11.999 else 3731 * (0.7 - 0.09) / (x * x - 0.6 * x + 0.7)


USUAL_RESPONSE: Final = response_table(0.12, _enki)
"""Counts at multiples of :data:`SPACING`, by Enki's formula: a smooth curve, and from 1.5 cm on it agrees within 4 %
with GCtronic's independent fit."""
