"""Pictures for a person: taken in spite of lost answers, kept in a file, drawn on a terminal."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TextIO, TypeVar

from elib.behaviours._run.context import RunContext
from elib.errors import LinkLost, RemoteProtocolError, ReplyTimeout
from elib.protocol.image import Image
from elib.robot.blocking import PendingCall

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

T = TypeVar("T")

TRIES = 5
"""Times a picture is asked for: where one answer in twenty is lost, all fail once in a million times."""
MAGNIFIED = 6
"""Pixels of the file for one of the picture, which is no larger than a thumbnail."""
WIDEST = 100
"""Columns a picture is drawn on, however wide the terminal is."""
RAMP = " .:-=+*#%@"
"""From dark to bright, for terminals without colours: a light character on a dark ground."""
UPPER_HALF = "▀"


def insist(run: RunContext, work: Callable[[], T]) -> T | None:
    """Do *work* again while its answers are lost or garbled; None if the performance is over before it is done.

    Raises:
        LinkLost: It failed five times.
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
            run.say(f"{error.message}; once more")
    return None


def picture_of(pending: PendingCall[Image]) -> Image:
    """Wait for a picture and return it; one that is complete but late is as good.

    Raises:
        ReplyTimeout: There is none.
    """
    try:
        return pending.end()
    except ReplyTimeout as error:
        if isinstance(error.image, Image):
            return error.image
        raise


def show(run: RunContext, pixels: NDArray[numpy.uint8], path: str | os.PathLike[str]) -> None:
    """Keep a picture in a file and say where; draw it where stdout is a terminal.

    Args:
        run: Where it is said.
        pixels: Shape (height, width), or (height, width, 3) in red, green, blue.
        path: Of the file, which is replaced; its ending names the format.
    """
    from PIL import Image as Files

    picture = Files.fromarray(pixels)
    height, width = pixels.shape[:2]
    try:
        picture.resize((width * MAGNIFIED, height * MAGNIFIED), Files.Resampling.NEAREST).save(path)
    except OSError as error:
        run.say(f"the picture could not be kept in {path}: {error.strerror or error}")
    else:
        run.say(f"the picture is in {Path(path).absolute()}")
    if is_terminal(sys.stdout):
        columns = min(shutil.get_terminal_size().columns, WIDEST)
        # A live line may stand here already: it is written over.
        print("\r\x1b[K" + draw(pixels, columns, colour=not os.environ.get("NO_COLOR")), flush=True)


def is_terminal(stream: TextIO) -> bool:
    """Return whether pictures can be drawn on *stream*."""
    return stream.isatty() and os.environ.get("TERM") != "dumb"


def draw(pixels: NDArray[numpy.uint8], columns: int, *, colour: bool) -> str:
    """Return a picture as text, at most *columns* wide.

    Args:
        pixels: Shape (height, width), or (height, width, 3) in red, green, blue.
        columns: How wide it may be; a wider picture is thinned out.
        colour: Use 24-bit colours, two pixels a cell; else characters for brightness.
    """
    step = -(-pixels.shape[1] // max(columns, 1))
    pixels = pixels[::step, ::step]
    if colour:
        return "\n".join(_cells(pixels[row : row + 2]) for row in range(0, len(pixels), 2))
    bright = pixels if pixels.ndim == 2 else pixels.mean(axis=2)
    # A character is about twice as high as wide: every second row.
    return "\n".join("".join(RAMP[int(value) * len(RAMP) // 256] for value in row).rstrip() for row in bright[::2])


def _cells(pair: NDArray[numpy.uint8]) -> str:
    """Return one row of cells: of two rows of pixels, or the last one alone."""
    cells = []
    for place in range(pair.shape[1]):
        grounds = (_colour(ground, pixel) for ground, pixel in zip((38, 48), pair[:, place], strict=False))
        cells.append("".join(grounds) + UPPER_HALF)
    return "".join(cells) + "\x1b[0m"


def _colour(ground: int, pixel: NDArray[numpy.uint8]) -> str:
    red, green, blue = (int(pixel),) * 3 if pixel.ndim == 0 else (int(part) for part in pixel)
    return f"\x1b[{ground};2;{red};{green};{blue}m"


__all__ = ["draw", "insist", "is_terminal", "picture_of", "show"]
