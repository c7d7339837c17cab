"""The camera's lens and chip: where it sits, what its field of view is, and what its pictures are like."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final, NamedTuple

from elib.base.body import CHIP, FOCAL
from elib.base.errors import ArgumentError
from elib.simulator.physics.noise import CAMERA, PICTURE, gauss, uniform

ABOVE: Final = 0.028
"""Height of the lens above the floor, m (Webots)."""

GAIN_SPREAD: Final = 0.10
"""Deviation of a typical robot's red, green and blue around 1: a block that one robot shows in (136, 169, 235) is (136,
178, 190) to another (measured-robots: camera.epuck2_blue_block)."""

BROKEN_ROWS: Final = 0.05
"""Share of a typical robot's pictures in which a byte of one row is lost (measured-robots: camera.epuck1: 8 of 142)."""


LENSES: Final = {
    "measured": FOCAL,
    "epucklib": CHIP[0] / 2 / math.tan(math.radians(56.0) / 2),
    "webots": 52 * 8 / 2 / math.tan(0.84 / 2),
}
"""The focal length, sensor pixels, by its source. measured: what robots showed, the default. epucklib: 56 degrees over
all 640 columns. webots: 0.84 rad over 52 columns of 8. The sources lie between 38 and 60 degrees."""


class Chip(NamedTuple):
    """How the camera of one generation shows things, the mean of those that were measured."""

    level: float  # how bright, in units of the colours that things have
    colour: float  # how much of their saturation colours keep; brightness and hue stay as they are
    # deviation of the noise of red, green and blue in each pixel, counts, before they are rounded to 5, 6 and 5 bits
    noise: tuple[float, float, float]


CHIPS: Final = {1: Chip(0.5, 0.75, (1.0, 0.8, 1.2)), 2: Chip(1.1, 0.45, (2.4, 1.7, 2.6))}
"""By generation (measured-robots: camera.epuck1, epuck2_blue_block, epuck2_blocks). The e-puck1 shows a grey room with
62 of 255; its red and blue buckets have a saturation of 0.65 and 0.50. To the e-puck2 a white table is white almost
without noise, so it is overexposed, but not by much: one of two robots shows its red with 245. Coloured blocks have a
saturation of 0.27 to 0.49. The noise of a still pixel is 2.1, 1.35 and 2.3 counts in pictures of the e-puck1, of which
rounding makes a part: noise of s counts that is rounded to steps of q has, over many levels of brightness, a variance
of 0.56 q s. In those of the e-puck2 it is 3.4, 2.4 and 3.3. Corners are 3.5 % darker than the middle, less than a step
of RGB565 there; this is left out."""


def lens_named(name: str) -> float:
    """Return the focal length of the lens called *name*, sensor pixels.

    Raises:
        ArgumentError: No lens has this name.
    """
    try:
        return LENSES[name]
    except KeyError:
        raise ArgumentError(f"there is no lens {name!r}", hint=f"choose one of {', '.join(LENSES)}") from None


@lru_cache(maxsize=1024)
def gains(key: int, spread: float) -> tuple[float, float, float]:
    """Return how bright one robot's chip shows red, green and blue, the mean chip's being 1, from the robot's key."""
    red, green, blue = (1.0 + GAIN_SPREAD * spread * gauss(key, CAMERA + k) for k in range(3))
    mean = (red + green + blue) / 3.0  # The exposure makes up for it.
    return red / mean, green / mean, blue / mean


def broken_row(key: int, spread: float, rows: int) -> int | None:
    """Return in which row of a chip's picture a byte is lost; mostly None.

    Args:
        key: Key of the robot's noise at this tick.
        spread: Factor on all that tells real robots from ideal ones.
        rows: How many rows the picture has.
    """
    return int(uniform(key, PICTURE + 1) * rows) if uniform(key, PICTURE) < BROKEN_ROWS * spread else None
