"""Measure how red a picture is, and in which direction the red is."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from elib.link.protocol.colours import Grey, Hue, coloured

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray


class Redness(NamedTuple):
    """How red a picture is; unpacks as ``fraction, direction``.

    Attributes:
        fraction: Fraction of the pixels that are red, 0 to 1.
        direction: Mean column of the red pixels, divided by the picture's width: 0 is the left edge, 0.5 the middle,
            1 the right edge; nan without red pixels.
    """

    fraction: float
    direction: float


def measure_redness(pixels: NDArray[numpy.uint8], grey: Grey | None = None) -> Redness:
    """Return how red a picture is, and in which direction the red is.

    Args:
        pixels: A picture of shape (height, width, 3) in red, green, blue.
        grey: What earlier pictures of the same robot told: its :attr:`elib.Image.grey`.

    Raises:
        ArgumentError: The picture does not have colours.
    """
    mask = coloured(pixels, Hue.RED, grey)
    count = int(mask.sum())
    if not count:
        return Redness(0.0, float("nan"))
    return Redness(count / mask.size, float(mask.nonzero()[1].mean()) / mask.shape[1])
