"""What is painted on the floor, as an image for the drawings and the page."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from elib.simulator.physics import Colour
from elib.simulator.physics.fittings import FLOOR_COLOUR
from elib.simulator.physics.floor import HOLE_MARK, Floor, packed

if TYPE_CHECKING:
    from PIL.Image import Image

PIT = Colour(22, 24, 30)
"""Of a hole."""
MAX_PIXELS = 1600
"""Pixels of the longer side: more could not be seen on a screen."""


def floor_picture(floor: Floor, bare: Colour | None = None) -> Image:
    """Return the picture of a painted floor, north up.

    Args:
        floor: One with a picture.
        bare: What bare linoleum looks like; None leaves it transparent.

    Returns:
        Red, green, blue and opacity.
    """
    from PIL import Image  # Only painted floors need Pillow.

    numbers = np.array(floor.pixels, np.uint32).reshape(floor.rows, floor.columns)[::-1]
    image = np.empty((*numbers.shape, 4), np.uint8)
    for channel, shift in enumerate((16, 8, 0)):
        image[:, :, channel] = (numbers >> shift) & 0xFF
    image[:, :, 3] = 255
    image[numbers >= HOLE_MARK] = (*PIT, 255)
    image[numbers == packed(FLOOR_COLOUR)] = (0, 0, 0, 0) if bare is None else (*bare, 255)
    picture = Image.fromarray(image, "RGBA")
    picture.thumbnail((MAX_PIXELS, MAX_PIXELS))
    return picture
