"""Edges in a picture, and the line on the floor: by ratios of brightness, never by counts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

NEAR: Final = 4
"""The lowest quarter of the rows shows the floor next to the robot, where a line is widest."""

CONTRAST: Final = 0.15
"""Part of the floor's brightness by which a line differs, at least: the noise of the median of ten rows is 1 %."""


def brightness(pixels: NDArray[numpy.uint8]) -> NDArray[numpy.float32]:
    """Return the mean of red, green and blue, or what is grey already, 0 to 255."""
    return pixels.astype("f4") if pixels.ndim == 2 else pixels.mean(axis=2, dtype="f4")


def edges(pixels: NDArray[numpy.uint8]) -> NDArray[numpy.float32]:
    """Return how steeply the brightness changes around each pixel, counts a pixel."""
    import numpy as np

    grey = brightness(pixels)
    if min(grey.shape) < 2:
        return np.zeros_like(grey)
    steep: NDArray[numpy.float32] = np.hypot(*np.gradient(grey))
    return steep


def line(pixels: NDArray[numpy.uint8], *, is_bright: bool = False) -> float | None:
    """Return the middle column of the line on the floor; None if there is none.

    It is the run of columns around the darkest one that is darker than half way to the floor, and takes less than half
    of the picture. The floor is the median of all columns. A row that lost a byte changes no median.

    Args:
        pixels: A picture, in grey or in colours.
        is_bright: Whether the line is brighter than the floor.
    """
    import numpy as np

    grey = brightness(pixels)
    columns: NDArray[numpy.float32] = np.median(grey[-max(1, len(grey) // NEAR) :], axis=0)
    floor = float(np.median(columns))
    off = columns - floor if is_bright else floor - columns
    peak = int(off.argmax())
    if off[peak] < CONTRAST * max(floor, 1.0):
        return None
    others = np.flatnonzero(off < off[peak] / 2)
    first = int(others[others < peak].max(initial=-1)) + 1
    last = int(others[others > peak].min(initial=len(off)))
    return float(np.average(np.arange(first, last), weights=off[first:last]))
