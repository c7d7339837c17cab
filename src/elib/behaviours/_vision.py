"""Find red pixels in a picture: which they are, how many, and in which direction."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from elib.base.errors import ArgumentError

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

TENTHS_OF_RED = 7
"""Green and blue of a red pixel are at most this many tenths of its red (0.7 in Elib of 2011)."""


class Redness(NamedTuple):
    """How red a picture is; unpacks as ``fraction, direction``.

    Attributes:
        fraction: Fraction of the pixels that are red, 0 to 1.
        direction: Mean column of the red pixels, divided by the picture's width: 0 is the left edge, 0.5 the middle,
            1 the right edge; nan without red pixels.
    """

    fraction: float
    direction: float


def red_mask(pixels: NDArray[numpy.uint8]) -> NDArray[numpy.bool_]:
    """Return which pixels are red: red is their strongest channel, and the others are at most 0.7 of it.

    A black pixel is never red, whatever its ratios are.

    Args:
        pixels: A picture of shape (height, width, 3) in red, green, blue, as :attr:`elib.Image.pixels` gives it.

    Returns:
        Booleans of shape (height, width).

    Raises:
        ArgumentError: The picture does not have colours.
    """
    if pixels.ndim != 3 or pixels.shape[2] != 3:
        raise ArgumentError(
            f"a picture of shape {pixels.shape} has no colours; it must be (height, width, 3)",
            hint="set the camera to CameraMode.COLOUR",
        )
    # Compare integers, wider than a byte: a quotient of floats could miss the limit by one unit in the last place.
    red, green, blue = (pixels[:, :, channel].astype("u2") for channel in range(3))
    limit = TENTHS_OF_RED * red
    return (red > 0) & (10 * green <= limit) & (10 * blue <= limit)


def measure_redness(pixels: NDArray[numpy.uint8]) -> Redness:
    """Return how red a picture is, and in which direction the red is.

    Args:
        pixels: A picture of shape (height, width, 3) in red, green, blue.

    Raises:
        ArgumentError: The picture does not have colours.
    """
    mask = red_mask(pixels)
    count = int(mask.sum())
    if not count:
        return Redness(0.0, float("nan"))
    return Redness(count / mask.size, float(mask.nonzero()[1].mean()) / mask.shape[1])
