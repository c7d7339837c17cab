"""Take pictures over a link that loses answers, save them to a file, and draw them in a terminal."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from elib.base.errors import LinkLost, RemoteProtocolError, ReplyTimeout
from elib.base.plaintext import is_live
from elib.behaviours._run.context import RunContext
from elib.link.protocol.image import Image
from elib.link.protocol.styles import Pending

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

T = TypeVar("T")

TRIES = 5
"""How often a picture is asked for: if one answer in twenty is lost, all tries fail once in three million times."""
SCALE = 6
"""Pixels of the file for each pixel of the picture, which is no larger than a thumbnail."""
MAX_COLUMNS = 100
"""Columns of a picture in a terminal, however wide it is."""
RAMP = " .:-=+*#%@"
"""Characters from dark to bright, for terminals without colours: light characters on a dark background."""
UPPER_HALF = "▀"


def retry(run: RunContext, work: Callable[[], T]) -> T | None:
    """Call *work* until its answers are neither lost nor garbled, and return its result; None if the run ends before.

    Raises:
        LinkLost: All tries failed.
    """
    for left in reversed(range(TRIES)):
        if run.is_over:
            break
        try:
            return work()
        except (ReplyTimeout, RemoteProtocolError) as error:
            if not left:
                raise LinkLost(
                    f"no picture came in {TRIES} tries: {error.message}",
                    hint="the connection is damaged: connect again, nearer to the robot",
                ) from error
            run.say(f"{error.message}; trying again")
    return None


def image_of(pending: Pending[Image]) -> Image:
    """Wait for a picture and return it, even if it is complete but late.

    Raises:
        ReplyTimeout: No picture came.
    """
    try:
        return pending.end()
    except ReplyTimeout as error:
        if isinstance(error.image, Image):
            return error.image
        raise


def show(run: RunContext, pixels: NDArray[numpy.uint8], path: str | os.PathLike[str]) -> None:
    """Save a picture to a file and tell the user where; draw it if stdout is a terminal.

    Args:
        run: The run.
        pixels: Shape (height, width), or (height, width, 3) in red, green, blue.
        path: Path of the file, which is replaced; its ending names the format.
    """
    from PIL import Image as Files

    picture = Files.fromarray(pixels)
    height, width = pixels.shape[:2]
    try:
        picture.resize((width * SCALE, height * SCALE), Files.Resampling.NEAREST).save(path)
    except OSError as error:
        run.say(f"the picture could not be saved in {path}: {error.strerror or error}")
    else:
        run.say(f"the picture is in {Path(path).absolute()}")
    if is_live(sys.stdout):
        columns = min(shutil.get_terminal_size().columns, MAX_COLUMNS)
        # A live line may be here already: the picture replaces it.
        print("\r\x1b[K" + draw(pixels, columns, colour=not os.environ.get("NO_COLOR")), flush=True)


def draw(pixels: NDArray[numpy.uint8], columns: int, *, colour: bool) -> str:
    """Return a picture as text, at most *columns* wide.

    Args:
        pixels: Shape (height, width), or (height, width, 3) in red, green, blue.
        columns: Width at most; a wider picture loses columns and rows.
        colour: Use 24-bit colours, two pixels in each cell; otherwise characters for brightness.
    """
    step = -(-pixels.shape[1] // max(columns, 1))
    pixels = pixels[::step, ::step]
    if colour:
        return "\n".join(_cells(pixels[row : row + 2]) for row in range(0, len(pixels), 2))
    bright = pixels if pixels.ndim == 2 else pixels.mean(axis=2)
    # A character is about twice as high as wide: every second row.
    return "\n".join("".join(RAMP[int(value) * len(RAMP) // 256] for value in row).rstrip() for row in bright[::2])


def _cells(pair: NDArray[numpy.uint8]) -> str:
    """Return one row of cells, from two rows of pixels or from the last one alone."""
    cells = []
    for place in range(pair.shape[1]):
        grounds = (_colour(ground, pixel) for ground, pixel in zip((38, 48), pair[:, place], strict=False))
        cells.append("".join(grounds) + UPPER_HALF)
    return "".join(cells) + "\x1b[0m"


def _colour(ground: int, pixel: NDArray[numpy.uint8]) -> str:
    red, green, blue = (int(pixel),) * 3 if pixel.ndim == 0 else (int(part) for part in pixel)
    return f"\x1b[{ground};2;{red};{green};{blue}m"
