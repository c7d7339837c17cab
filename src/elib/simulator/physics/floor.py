"""The floor as a picture: what the ground sensors and the camera see where something is painted.

Painting is done once, when the world is made; to look a place up is then one multiplication each way. Where nothing
is painted there is no picture, and the floor has its one colour.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from elib.base.errors import ArgumentError
from elib.simulator.physics.fittings import Checkers, Patch, Print, Stripe
from elib.simulator.physics.geometry import Colour
from elib.simulator.physics.scene import Scene

if TYPE_CHECKING:
    from PIL.Image import Image

RESOLUTION = 0.002
"""Side of a pixel, m: a seventh of the usual line's width."""

MAX_PIXELS = 4_000_000
"""Larger floors get coarser pixels."""

OVERSAMPLING = 3
MAX_FINE = 1_000_000
"""Pixels. A larger floor is painted with hard edges, to save memory."""

HOLE = Colour(0, 0, 0)
"""What the camera sees of a hole; the ground sensors find :data:`HOLE_MARK` there."""

HOLE_MARK = 1 << 24
"""Added to the colour of a pixel that is a hole."""

MAX_PRINT = 64_000_000
"""Pixels of a picture file; a larger one is refused before it fills the memory."""


@dataclass(frozen=True, slots=True)
class Floor:
    """The painted floor.

    Attributes:
        colour: The colour of the floor where there is no picture, 65536 red + 256 green + blue.
        columns: The number of columns of the picture, along x; 0 if nothing is painted.
        rows: The number of rows of the picture, along y, from y = 0 on.
        scale: Pixels a metre.
        pixels: Row by row, each 65536 red + 256 green + blue, plus :data:`HOLE_MARK` for a hole.
    """

    colour: int
    columns: int = 0
    rows: int = 0
    scale: float = 0.0
    pixels: tuple[int, ...] = ()


def packed(colour: Colour) -> int:
    """Return *colour* as one number: 65536 red + 256 green + blue."""
    return colour.red << 16 | colour.green << 8 | colour.blue


def floor_of(scene: Scene) -> Floor:
    """Paint the floor of *scene*.

    Raises:
        ArgumentError: A picture file cannot be read or is too large, or the squares are too small.
    """
    if not scene.paint:
        return Floor(packed(scene.floor))
    prints = (Path(paint.file) for paint in scene.paint if isinstance(paint, Print))
    written = tuple(path.stat().st_mtime_ns if path.exists() else 0 for path in prints)
    return _painted(replace(scene, walls=(), boxes=(), cylinders=(), starts=(), lights=(), sounds=()), written)


@lru_cache(maxsize=8)
def _painted(scene: Scene, written: tuple[int, ...]) -> Floor:
    """Paint the floor once for all worlds that share it; *written* is when its picture files were."""
    from PIL import Image  # Worlds with a bare floor start faster without.

    scale = min(1 / RESOLUTION, math.sqrt(MAX_PIXELS / (scene.width * scene.depth)))
    size = math.ceil(scene.width * scale), math.ceil(scene.depth * scale)
    # Pillow draws hard edges: painted larger and scaled down, a slanted line is straight.
    finer = OVERSAMPLING if size[0] * size[1] <= MAX_FINE else 1
    scale *= finer
    columns, rows = size[0] * finer, size[1] * finer
    picture = Image.new("RGB", (columns, rows), tuple(scene.floor))
    holes = Image.new("1", (columns, rows), 0)
    for paint in scene.paint:
        match paint:
            case Stripe():
                _stripe(picture, holes, paint, scale)
            case Checkers():
                _checkers(picture, holes, paint, scene, scale)
            case Print():
                _print(picture, holes, paint, scale)
            case Patch():
                _patch(picture, holes, paint, scale)
    if finer > 1:
        picture = picture.resize(size, Image.Resampling.BOX)
        holes = holes.resize(size, Image.Resampling.NEAREST)
        scale /= finer
        columns, rows = size
    red, green, blue = (band.tobytes() for band in picture.split())
    hollow = holes.convert("L").tobytes()
    pixels = tuple(
        r << 16 | g << 8 | b | (HOLE_MARK if hole else 0)
        for r, g, b, hole in zip(red, green, blue, hollow, strict=True)
    )
    return Floor(packed(scene.floor), columns, rows, scale, pixels)


def _stripe(picture: Image, holes: Image, stripe: Stripe, scale: float) -> None:
    from PIL import ImageDraw

    points = [(x * scale - 0.5, y * scale - 0.5) for x, y in stripe.points]
    width = max(1, round(stripe.width * scale))
    for image, colour in ((picture, tuple(stripe.colour)), (holes, 0)):
        pen = ImageDraw.Draw(image)
        pen.line(points, fill=colour, width=width, joint="curve")
        for x, y in points:
            half = (width - 1) / 2  # Pillow counts the rim in.
            pen.ellipse((x - half, y - half, x + half, y + half), fill=colour)


def _checkers(picture: Image, holes: Image, checkers: Checkers, scene: Scene, scale: float) -> None:
    from PIL import ImageDraw

    across, along = checkers.count(scene.width, scene.depth)
    pen = ImageDraw.Draw(picture)
    side = checkers.square * scale
    for row in range(along):
        for column in range(across):
            colour = checkers.light if (row + column) % 2 else checkers.dark
            left, low = round(column * side), round(row * side)
            pen.rectangle((left, low, round((column + 1) * side) - 1, round((row + 1) * side) - 1), fill=tuple(colour))
    holes.paste(0, (0, 0, holes.width, holes.height))


@contextmanager
def opened(path: Path) -> Iterator[Image]:
    """Open the file of a picture; its pixels are not yet read.

    Raises:
        ArgumentError: It is not a PNG or JPEG file, is too large, or breaks off while the block reads it.
    """
    from PIL import Image, UnidentifiedImageError

    if not path.is_file():  # a pipe would keep us waiting
        raise ArgumentError("there is no such file", hint=f"it would be {path}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Of its size: that is what is looked at here.
            picture = Image.open(path, formats=("PNG", "JPEG"))
        with picture:
            pixels = picture.width * picture.height
            if pixels <= MAX_PRINT:
                yield picture
    except Image.DecompressionBombError:
        pixels = MAX_PRINT + 1
    except (OSError, SyntaxError, ValueError, UnidentifiedImageError) as error:
        reason = getattr(error, "strerror", None) or "it is not a PNG or JPEG picture"
        raise ArgumentError(reason, hint="give the path of a PNG or JPEG file") from error
    if pixels > MAX_PRINT:
        raise ArgumentError(f"it has more than {MAX_PRINT // 1_000_000} million pixels", hint="scale it down")


def _print(picture: Image, holes: Image, paint: Print, scale: float) -> None:
    from PIL import Image

    size = max(1, round(paint.width * scale)), max(1, round(paint.depth * scale))
    if size[0] * size[1] > MAX_PRINT:
        raise ArgumentError(f"the picture {paint.file} would cover {paint.width} x {paint.depth} m; that is too much")
    try:
        with opened(Path(paint.file)) as source:
            flat = source.convert("RGBA").resize(size).transpose(Image.Transpose.FLIP_TOP_BOTTOM)
    except ArgumentError as error:
        raise ArgumentError(f"the picture {paint.file} cannot be read: {error.message}", hint=error.hint) from error
    corner = round(paint.x * scale), round(paint.y * scale)
    opacity = flat.getchannel("A")
    picture.paste(flat, corner, opacity)
    holes.paste(0, corner, opacity.convert("1", dither=Image.Dither.NONE))  # A hole is there or not: half opaque, not.


def _patch(picture: Image, holes: Image, patch: Patch, scale: float) -> None:
    box = (
        round(patch.x * scale),
        round(patch.y * scale),
        round((patch.x + patch.width) * scale),
        round((patch.y + patch.depth) * scale),
    )
    picture.paste(tuple(HOLE if patch.colour is None else patch.colour), box)
    holes.paste(1 if patch.colour is None else 0, box)
