"""Find things of one colour in a picture as real cameras take it: by hue and by ratios, never by counts.

Two robots show one block in (136, 169, 235) and in (136, 178, 190), an e-puck1 shows a red bucket in (58, 20, 33), and
a byte that is lost puts a row of any colour into a picture (measured-robots: camera). So a colour is judged beside the
picture's own grey, rows that are unlike both of their neighbours are left out, and what counts is an area that hangs
together.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, NamedTuple

from elib.base.errors import ArgumentError

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

    Bytes = NDArray[numpy.uint8]
    Floats = NDArray[numpy.float32]
    Planes = Bytes | Floats
    Mask = NDArray[numpy.bool_]


class Hue(enum.IntEnum):
    """Colours of things: their hue, degrees."""

    RED = 0
    ORANGE = 27
    YELLOW = 50
    GREEN = 125
    BLUE = 215


class Blob(NamedTuple):
    """An area of one colour in a picture."""

    pixels: int  # how many it has
    column: float  # the mean of their columns; 0 is the left one
    row: float  # the mean of their rows; 0 is the upper one
    left: int  # its first column
    right: int  # its last column
    share: float
    # direction in which the camera sees its middle column, rad from straight ahead, positive to the left
    bearing: float
    width: float  # angle from its left to its right edge, rad


class Grey:
    """How red, green and blue grey is in the pictures of one camera.

    It is the most frequent of all colours that may be grey, in all pictures together, and the paler ones are likelier.
    A thing near the camera may hide all that is grey, so keep one for all pictures of a robot.
    """

    def __init__(self) -> None:
        """Know nothing."""
        self._shares: NDArray[numpy.float64] | None = None

    def learn(self, planes: Bytes) -> Floats:
        """Return the grey of the pictures so far and of this one: its mean is 1, its shape (3, 1, 1).

        All three are 1 where nothing is white or grey.

        Args:
            planes: A picture of shape (3, height, width).
        """
        import numpy as np

        shares = _shares(planes)
        learned = shares * np.minimum(1.0, MUCH / np.maximum(shares[0], MUCH))
        if self._shares is not None:
            shares = learned = learned + FADE * self._shares
        self._shares = learned
        off = CELL * np.arange(1 - REACH, REACH)
        likely = np.exp(-(off**2) / (2 * CAST**2))
        row, column = np.divmod(np.argmax(shares[0] * np.outer(likely, likely)), len(off))
        mean = shares[1:, row, column, np.newaxis, np.newaxis]
        if shares[0, row, column] < ENOUGH:
            mean = np.ones((3, 1, 1))
        grey: Floats = (mean / mean.mean()).astype(np.float32)
        return grey


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

REACH: Final = int(math.log(1 / (1 - PALE)) / CELL) + 2
"""Cells from the middle to the edge of the table of what may be grey."""

FULL: Final = 248
"""Counts from which a channel may be brighter than the chip can tell."""

BEYOND: Final = 1.1
"""By how much, at most."""

WHITE: Final = 230
"""Counts of all three channels from which a pixel is white, overexposed or not."""

ALIKE: Final = 0.87
"""Ratio of two channels from which they are alike: one deviation, as below."""

MUCH: Final = 0.2
"""Share of a picture from which more of a colour is no likelier to be grey, except in the first picture: grey is what
many show, and one thing may fill some of them."""

FADE: Final = 0.998
"""What is left of the shares of earlier pictures after another one: half in 350, so that another light is learned."""

ENOUGH: Final = 0.05
"""Share of a picture that must be white or grey to be its measure."""

MIN_SHARE: Final = 0.005
"""Share of a picture that a thing takes at least: 8 pixels of 40 x 40."""


def hue_named(name: str | Hue) -> Hue:
    """Return the hue of this name, in lower or upper case.

    Raises:
        ArgumentError: There is none.
    """
    try:
        return name if isinstance(name, Hue) else Hue[name.upper()]
    except (KeyError, AttributeError):
        choices = ", ".join(each.name.lower() for each in Hue)
        raise ArgumentError(f"there is no colour {name!r}", hint=f"choose one of {choices}") from None


def blobs(
    pixels: NDArray[numpy.uint8],
    hue: Hue,
    bearing: Callable[[float], float],
    *,
    smallest: float = MIN_SHARE,
    grey: Grey | None = None,
) -> list[Blob]:
    """Return the areas of one colour in a picture, the largest first.

    Args:
        pixels: A picture of shape (height, width, 3) in red, green, blue, 0 to 255.
        hue: Hue of the colour.
        bearing: Returns in which direction a column is, rad.
        smallest: Share of the picture that each takes at least, 0 to 1.
        grey: What earlier pictures of the same robot told.

    Raises:
        ArgumentError: The picture has no colours.
    """
    import numpy as np

    mask = coloured(pixels, hue, grey)
    first, last, area = _areas(mask)
    sizes = np.bincount(area, weights=last - first)
    found = []
    for number in np.argsort(-sizes, kind="stable"):
        if not sizes[number] or sizes[number] < smallest * mask.size:
            break
        begin, end = first[area == number], last[area == number]
        row, left = np.divmod(begin, mask.shape[1] + 1)
        lengths = end - begin
        right = left + lengths - 1
        column, row = (float(np.average(each, weights=lengths)) for each in ((left + right) / 2, row))
        ends = int(left.min()), int(right.max())
        sides = bearing(ends[0] - 0.5), bearing(ends[1] + 0.5)
        size = int(sizes[number])
        found.append(Blob(size, column, row, *ends, size / mask.size, bearing(column), sides[0] - sides[1]))
    return found


def coloured(pixels: NDArray[numpy.uint8], hue: Hue, grey: Grey | None = None) -> Mask:
    """Return which pixels have a colour: (height, width). It is the one of all hues that is nearest to theirs.

    A pixel with an overexposed channel may have two colours: that channel may be brighter than the chip can tell.

    Args:
        pixels: A picture of shape (height, width, 3) in red, green, blue, 0 to 255.
        hue: Hue of the colour.
        grey: What earlier pictures of the same robot told.

    Raises:
        ArgumentError: The picture has no colours.
    """
    import numpy as np

    if pixels.ndim != 3 or pixels.shape[2] != 3:
        raise ArgumentError(
            f"a picture of shape {pixels.shape} has no colours; it must be (height, width, 3)",
            hint="set the camera to CameraMode.COLOUR",
        )
    seen = np.ascontiguousarray(np.moveaxis(pixels, 2, 0), np.uint8)  # Red, green, blue.
    seen = _without_torn_rows(seen)
    seen = _without_torn_rows(seen.swapaxes(1, 2)).swapaxes(1, 2)  # The rows of a chip that is turned.
    is_full = seen >= FULL
    weighed: Floats = np.divide(seen, (grey or Grey()).learn(seen), dtype=np.float32)
    vivid = _is_vivid(weighed)
    has_hue = _has_hue(weighed, hue)
    if is_full.any():
        vivid &= _is_vivid(seen) | ~is_full.any(axis=0)  # Overexposed white has no cast.
        has_hue |= _has_hue(np.where(is_full, np.float32(BEYOND) * weighed, weighed), hue)
    return vivid & has_hue


def _is_vivid(planes: Planes) -> Mask:
    """Return which pixels have a colour."""
    high, low = planes.max(axis=0), planes.min(axis=0)
    vivid: Mask = (high >= DARK) & (high - low >= DIFFERENCE) & (low <= (1 - VIVID) * high)
    return vivid


def _has_hue(planes: Planes, hue: Hue) -> Mask:
    """Return whose hue is nearest to that of a colour: it lies between two rays in the plane of hues."""
    import numpy as np

    nearest = [(each - hue + 180) % 360 - 180 for each in Hue if each is not hue]
    after = min(min(each for each in nearest if each > 0) / 2, FARTHEST)
    before = max(max(each for each in nearest if each < 0) / 2, -FARTHEST)
    sides = []
    for off, side in ((before, 1), (after, -1)):
        x, y = (side * part(math.radians(hue + off)) for part in (math.cos, math.sin))
        sides.append((-2 * y, math.sqrt(3) * x + y, y - math.sqrt(3) * x))  # x times sqrt(3) (G - B) - y (2 R - G - B)
    left, right = np.tensordot(np.array(sides, np.float32), planes, 1)
    mask: Mask = (left >= 0) & (right >= 0)
    return mask


def _without_torn_rows(planes: Bytes) -> Bytes:
    """Return a picture with the row above in place of each row that a lost byte shifted.

    More than three quarters of its pixels are unlike those above, and unlike those below.
    """
    import numpy as np

    _, rows, columns = planes.shape
    if rows < 3 or columns < FEW:
        return planes
    upper, lower = planes[:, :-1], planes[:, 1:]
    change = (np.maximum(upper, lower) - np.minimum(upper, lower)).max(axis=0)
    differs = (change >= TORN).sum(axis=1) > 0.75 * columns  # From each row to the next.
    torn = 1 + np.flatnonzero(differs[:-1] & differs[1:])
    if not len(torn):
        return planes
    source = np.arange(rows)
    source[torn] -= 1
    return planes[:, source]


def _shares(planes: Bytes) -> NDArray[numpy.float64]:
    """Return how much of a picture shows each colour that may be grey, and the sums of its red, green and blue.

    Of shape (4, n, n): rows and columns are logarithms of the ratios of red and of blue to green.
    """
    import numpy as np

    red, green, blue = planes
    high, low = planes.max(axis=0), planes.min(axis=0)
    middle = np.maximum(np.minimum(red, green), np.minimum(np.maximum(red, green), blue))
    # With one channel overexposed, orange may look like grey in warm light; then the two others must be alike.
    is_known = (high < FULL) | (low >= WHITE) | (low >= np.float32(ALIKE) * middle)
    is_known &= (high >= DARK) & (low >= np.float32(1 - PALE) * high)
    some = planes.reshape(3, -1)[:, np.flatnonzero(is_known)]
    red, green, blue = (np.log(np.maximum(np.arange(256), 1)) / CELL).astype(np.float32)[some]
    size = 2 * REACH + 1
    cell = (size * np.rint(red - green) + np.rint(blue - green)).astype(np.int64) + (size + 1) * REACH
    sums = [np.bincount(cell, weights, size * size) for weights in (None, *some)]
    cells = np.array(sums).reshape(4, size, size) / high.size
    shares: NDArray[numpy.float64] = sum(cells[:, i : size - 2 + i, k : size - 2 + k] for i, k in np.ndindex(3, 3))
    return shares


def _areas(mask: Mask) -> tuple[NDArray[numpy.int64], NDArray[numpy.int64], NDArray[numpy.int64]]:
    """Return the runs of a mask's rows: start, end, and the number of the area that each hangs together with.

    A place is row x (columns + 1) + column.
    """
    import numpy as np

    stride = mask.shape[1] + 1
    edges = np.flatnonzero(np.diff(np.pad(mask, ((0, 0), (0, 1))).ravel(), prepend=False))
    first, last = edges[::2], edges[1::2]
    # The runs of the row above that touch each one follow one another.
    begin = np.searchsorted(last, first - stride, side="right")
    touching = np.searchsorted(first, last - stride) - begin
    lower = np.repeat(np.arange(len(first)), touching)
    upper = np.arange(len(lower)) + np.repeat(begin - np.cumsum(touching) + touching, touching)
    area = np.arange(len(first))
    while not np.array_equal(area[lower], area[upper]):  # Each area joins the one with the lowest number beside it.
        one, other = area[lower], area[upper]
        np.minimum.at(area, one, other)
        np.minimum.at(area, other, one)
        area = area[area]
    return first, last, area
