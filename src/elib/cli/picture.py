"""A picture in a terminal: two pixels a character cell, one above the other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elib.protocol.image import Image

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

RAMP = " .:-=+*#%@"
"""From dark to bright, for terminals without colours: a light character on a dark ground."""

UPPER_HALF = "▀"


def draw(image: Image, columns: int, *, colour: bool) -> str:
    """Return *image* as text, at most *columns* wide.

    Args:
        image: A grey or colour picture.
        columns: How wide it may be; a wider picture is thinned out.
        colour: Use 24-bit colours and half blocks; else characters for brightness.
    """
    pixels = _thinned(image.pixels, columns)
    if colour:
        return "\n".join(_coloured(pixels[row : row + 2]) for row in range(0, len(pixels), 2))
    bright = pixels if pixels.ndim == 2 else pixels.mean(axis=2)
    # A character is about twice as high as wide: every second row.
    return "\n".join(
        "".join(RAMP[min(int(value) * len(RAMP) // 256, len(RAMP) - 1)] for value in row).rstrip()
        for row in bright[::2]
    )


def _thinned(pixels: NDArray[numpy.uint8], columns: int) -> NDArray[numpy.uint8]:
    step = -(-pixels.shape[1] // max(columns, 1))
    return pixels[::step, ::step]


def _coloured(pair: NDArray[numpy.uint8]) -> str:
    upper = pair[0]
    lower = pair[1] if len(pair) > 1 else None
    cells = []
    for place in range(len(upper)):
        above = _sgr("38", upper[place])
        below = _sgr("48", lower[place]) if lower is not None else ""
        cells.append(f"{above}{below}{UPPER_HALF}")
    return "".join(cells) + "\x1b[0m"


def _sgr(ground: str, pixel: NDArray[numpy.uint8]) -> str:
    parts = [int(pixel)] * 3 if pixel.ndim == 0 else [int(part) for part in pixel]
    return f"\x1b[{ground};2;{parts[0]};{parts[1]};{parts[2]}m"
