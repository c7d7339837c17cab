"""The camera's lens: where it sits, and what its field of view is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from elib.base.errors import ArgumentError

FORWARD: Final = 0.030
"""The lens is this far ahead of the axle, m (Webots)."""

ABOVE: Final = 0.028
"""Height of the lens above the floor, m (Webots)."""

SENSOR: Final = (640, 480)
"""Columns and rows of the chip."""


@dataclass(frozen=True, slots=True)
class Lens:
    """A pinhole.

    Attributes:
        name: The name of the source that it comes from.
        focal: Its distance from the chip, sensor pixels.
    """

    name: str
    focal: float

    @classmethod
    def seeing(cls, name: str, field: float, columns: float) -> Lens:
        """Return the lens through which so many sensor *columns* see *field*, rad."""
        return cls(name, columns / 2 / math.tan(field / 2))


LENSES = {
    lens.name: lens
    for lens in (
        Lens.seeing("epucklib", math.radians(56.0), SENSOR[0]),
        Lens.seeing("webots", 0.84, 52 * 8),
    )
}
"""epucklib: 56 degrees over all 640 columns. Webots: 0.84 rad over 52 columns of 8. The sources lie between 38 and 60
degrees."""

FOCAL = LENSES["epucklib"].focal
"""Focal length of the usual lens, sensor pixels."""


def lens_named(name: str) -> Lens:
    """Return the lens called *name*.

    Raises:
        ArgumentError: No lens has this name.
    """
    try:
        return LENSES[name]
    except KeyError:
        raise ArgumentError(f"there is no lens {name!r}", hint=f"choose one of {', '.join(LENSES)}") from None
