"""Find things of one colour in a picture as real cameras take it: by hue and by ratios, never by counts.

Two robots show one block in (136, 169, 235) and in (136, 178, 190), an e-puck1 shows a red bucket in (58, 20, 33), and
a byte that is lost puts a row of any colour into a picture (measured-robots: camera). So a colour is judged beside the
picture's own grey, rows that are unlike both of their neighbours are left out, and what counts is an area that hangs
together.
"""

from __future__ import annotations

import enum
import math
from typing import TYPE_CHECKING, Final, NamedTuple

from elib.base.errors import ArgumentError

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

    Floats = NDArray[numpy.float64]
    Mask = NDArray[numpy.bool_]


class Hue(enum.IntEnum):
    """Colours of things: their hue, degrees."""

    RED = 0
    ORANGE = 27
    YELLOW = 50
    GREEN = 125
    BLUE = 215


class Blob(NamedTuple):
    """The largest area of one colour in a picture.

    Attributes:
        pixels: How many it has.
        column: The mean of their columns; 0 is the left one.
        row: The mean of their rows; 0 is the upper one.
        left: Its first column.
        right: Its last column.
    """

    pixels: int
    column: float
    row: float
    left: int
    right: int


TORN: Final = 24
"""Counts by which a row that has lost a byte is unlike both of its neighbours: three steps of RGB565."""

FEW: Final = 8
"""Pixels of a row that cannot tell whether it has lost a byte."""

FARTHEST: Final = 60
"""Degrees between a pixel's hue and that of its colour, at most. It also has the nearest one of the colours."""

VIVID: Final = 0.18
"""Saturation, beside the picture's grey, below which a pixel has no colour. The e-puck2 shows blocks with 0.22 to 0.49
(measured-robots: camera.epuck2_blue_block, epuck2_blocks)."""

DARK: Final = 24
"""Counts, of 255, below which a pixel is black."""

DIFFERENCE: Final = 16
"""Counts between a pixel's channels below which it has no colour: two steps of RGB565."""

PALE: Final = 0.3
"""Saturation up to which a pixel may be grey, seen by a chip that weighs red, green and blue in its own way."""

CAST: Final = 0.14
"""Deviation of the logarithms of the ratios in which such a chip shows red and blue to green:
0.1 for each channel (measured-robots: proposals.camera)."""

CELL: Final = 0.1
"""Logarithms of ratios that differ by less are of one grey: a step of RGB565 in a dim room."""

FULL: Final = 248
"""Counts from which a channel may be brighter than the chip can tell."""

BEYOND: Final = 1.1
"""By how much, at most."""

WHITE: Final = 230
"""Counts of all three channels from which a pixel is white, overexposed or not."""

ALIKE: Final = 0.87
"""Ratio of two channels from which they are alike: one deviation, as below."""

ENOUGH: Final = 0.05
"""Share of a picture that must be white or grey to be its measure."""

MIN_SHARE: Final = 0.005
"""Share of a picture that a thing takes at least: 8 pixels of 40 x 40."""


def hue_named(name: str) -> Hue:
    """Return the hue of this name, in lower or upper case.

    Raises:
        ArgumentError: There is none.
    """
    try:
        return Hue[name.upper()]
    except (KeyError, AttributeError):
        choices = ", ".join(each.name.lower() for each in Hue)
        raise ArgumentError(f"there is no colour {name!r}", hint=f"choose one of {choices}") from None


def find(pixels: NDArray[numpy.uint8], hue: Hue, *, smallest: float = MIN_SHARE) -> Blob | None:
    """Return the largest area of one colour in a picture; None if there is none.

    Args:
        pixels: A picture of shape (height, width, 3) in red, green, blue, 0 to 255.
        hue: Hue of the colour.
        smallest: Share of the picture that it takes at least, 0 to 1.

    Raises:
        ArgumentError: The picture has no colours.
    """
    import numpy as np

    mask = coloured(pixels, hue)
    first, last, area = _areas(mask)
    if not len(area):
        return None
    sizes = np.bincount(area, weights=last - first)
    largest = int(sizes.argmax())
    if sizes[largest] < smallest * mask.size:
        return None
    chosen = np.zeros(mask.shape[0] * (mask.shape[1] + 1), bool)
    for start, end in zip(first[area == largest], last[area == largest], strict=True):
        chosen[start:end] = True
    rows, columns = chosen.reshape(len(mask), -1).nonzero()
    return Blob(len(rows), float(columns.mean()), float(rows.mean()), int(columns.min()), int(columns.max()))


def coloured(pixels: NDArray[numpy.uint8], hue: Hue) -> Mask:
    """Return which pixels have a colour: (height, width). It is the one of all hues that is nearest to theirs.

    A pixel with an overexposed channel may have two colours: that channel may be brighter than the chip can tell.

    Args:
        pixels: A picture of shape (height, width, 3) in red, green, blue, 0 to 255.
        hue: Hue of the colour.

    Raises:
        ArgumentError: The picture has no colours.
    """
    import numpy as np

    if pixels.ndim != 3 or pixels.shape[2] != 3:
        raise ArgumentError(
            f"a picture of shape {pixels.shape} has no colours; it must be (height, width, 3)",
            hint="set the camera to CameraMode.COLOUR",
        )
    wanted = list(Hue).index(hue)
    seen = _without_torn_rows(pixels.astype(float))
    seen = _without_torn_rows(seen.transpose(1, 0, 2)).transpose(1, 0, 2)  # The rows of a chip that is turned.
    grey, is_full = _grey(seen), seen >= FULL
    vivid = _is_vivid(seen / grey) & (_is_vivid(seen) | ~is_full.any(axis=2))  # Overexposed white has no cast.
    brighter = np.where(is_full, BEYOND * seen, seen)
    return vivid & (_has_hue(seen / grey, wanted) | _has_hue(brighter / grey, wanted))


def _is_vivid(pixels: Floats) -> Mask:
    """Return which pixels have a colour."""
    import numpy as np

    high, low = pixels.max(axis=2), pixels.min(axis=2)
    vivid: Mask = (high >= DARK) & (high - low >= np.maximum(VIVID * high, DIFFERENCE))
    return vivid


def _has_hue(pixels: Floats, wanted: int) -> Mask:
    """Return whose hue is nearest to that of the colour of this number."""
    import numpy as np

    red, green, blue = np.moveaxis(pixels, 2, 0)
    angle = np.degrees(np.arctan2(math.sqrt(3) * (green - blue), 2 * red - green - blue))
    off = np.stack([np.abs((angle - each + 180) % 360 - 180) for each in Hue])
    near: Mask = (off.argmin(axis=0) == wanted) & (off[wanted] <= FARTHEST)
    return near


def _without_torn_rows(pixels: Floats) -> Floats:
    """Return a picture with the row above in place of each row that a lost byte shifted.

    Three quarters of its pixels are unlike those above, and unlike those below.
    """
    import numpy as np

    if len(pixels) < 3 or pixels.shape[1] < FEW:
        return pixels
    change = np.quantile(np.abs(np.diff(pixels, axis=0)).max(axis=2), 0.25, axis=1)  # From each row to the next.
    torn = 1 + np.flatnonzero(np.minimum(change[:-1], change[1:]) >= TORN)
    source = np.arange(len(pixels))
    source[torn] -= 1
    return pixels[source]


def _grey(pixels: Floats) -> Floats:
    """Return how red, green and blue a picture's grey is; their mean is 1. All are 1 where nothing is white or grey.

    It is the most frequent of all colours that may be grey, and the paler ones are likelier.
    """
    import numpy as np

    high, low = pixels.max(axis=2), pixels.min(axis=2)
    # With one channel overexposed, orange may look like grey in warm light; then the two others must be alike.
    is_known = (high < FULL) | (low >= WHITE) | (low >= ALIKE * np.median(pixels, axis=2))
    some = pixels[is_known & (high >= DARK) & (low >= (1 - PALE) * high)]
    if len(some) < ENOUGH * high.size:
        return np.ones(3)
    ratios = np.log(some[:, ::2] / some[:, 1:2])  # Of red and of blue to green.
    cells = np.rint(ratios / CELL).astype(int)
    reach = int(math.log(1 / (1 - PALE)) / CELL) + 2
    size = 2 * reach + 1
    count = np.bincount((cells + reach) @ (size, 1), minlength=size * size).reshape(size, size)
    around = sum(np.roll(count, shift, axis=(0, 1)) for shift in np.ndindex(3, 3))  # Of the cell before each.
    off = CELL * np.arange(-reach, reach + 1)
    likely = np.exp(-(off**2) / (2 * CAST**2))
    best = np.array(
        np.unravel_index(np.argmax(np.roll(around, (-1, -1), axis=(0, 1)) * np.outer(likely, likely)), (size, size))
    )
    mean: Floats = some[(np.abs(cells + reach - best) <= 1).all(axis=1)].mean(axis=0)
    grey: Floats = mean / mean.mean()
    return grey


def _areas(mask: Mask) -> tuple[NDArray[numpy.int64], NDArray[numpy.int64], NDArray[numpy.int64]]:
    """Return the runs of a mask's rows: start, end, and the number of the area that each hangs together with.

    A place is row x (columns + 1) + column.
    """
    import numpy as np

    edges = np.diff(np.pad(np.pad(mask, ((0, 0), (0, 1))).ravel().astype(np.int8), 1))
    first, last = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    area = list(range(len(first)))

    def root(run: int) -> int:
        while area[run] != run:
            area[run] = run = area[area[run]]
        return run

    starts, ends, stride = first.tolist(), last.tolist(), mask.shape[1] + 1
    upper = 0
    for run, (start, end) in enumerate(zip(starts, ends, strict=True)):
        while ends[upper] <= start - stride:
            upper += 1
        other = upper
        while other < run and starts[other] < end - stride:
            area[root(run)] = root(other)
            other += 1
    return first, last, np.array([root(run) for run in range(len(area))], np.int64)
