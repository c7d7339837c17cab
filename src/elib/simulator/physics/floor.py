"""The floor as a picture: what the ground sensors and the camera see where something is painted.

Painting is done once, when the world is made; to look a place up is then one multiplication each way. Where nothing
is painted there is no picture, and the floor has its one colour.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
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
    return _painted(Scene(scene.width, scene.depth, floor=scene.floor, paint=scene.paint), written)


@lru_cache(maxsize=8)
def _painted(scene: Scene, written: tuple[int, ...]) -> Floor:
    """Paint the floor once for all worlds that share it; *written* is when its picture files were."""
    scale = min(1 / RESOLUTION, math.sqrt(MAX_PIXELS / (scene.width * scene.depth)))
    canvas = _Canvas(math.ceil(scene.width * scale), math.ceil(scene.depth * scale), scale, packed(scene.floor))
    for paint in scene.paint:
        match paint:
            case Stripe():
                canvas.stripe(paint)
            case Checkers():
                canvas.checkers(paint, *paint.count(scene.width, scene.depth))
            case Print():
                canvas.print(paint)
            case Patch():
                hole = packed(HOLE) | HOLE_MARK
                colour = hole if paint.colour is None else packed(paint.colour)
                canvas.fill(paint.x, paint.y, paint.x + paint.width, paint.y + paint.depth, colour)
    return Floor(packed(scene.floor), canvas.columns, canvas.rows, scale, tuple(canvas.pixels))


class _Canvas:
    """The floor while it is painted, with its first row at y = 0."""

    def __init__(self, columns: int, rows: int, scale: float, colour: int) -> None:
        self.columns, self.rows, self.scale = columns, rows, scale
        self.pixels = [colour] * (columns * rows)

    def fill(self, left: float, low: float, right: float, high: float, colour: int) -> None:
        """Fill a rectangle, m, with hard edges."""
        (begin, end), (first, last) = self._cut(left, right, self.columns), self._cut(low, high, self.rows)
        for row in range(first, last):
            self.pixels[row * self.columns + begin : row * self.columns + end] = [colour] * (end - begin)

    def stripe(self, stripe: Stripe) -> None:
        """Paint a stripe with smooth edges and round ends and corners."""
        half = stripe.width * self.scale / 2
        points = [(x * self.scale - 0.5, y * self.scale - 0.5) for x, y in stripe.points]
        covered: dict[int, float] = {}  # how much of each pixel the stripe covers
        for (ax, ay), (bx, by) in pairwise(points):
            dx, dy = bx - ax, by - ay
            square = dx * dx + dy * dy
            reach = half + 0.5
            for row in range(max(0, math.ceil(min(ay, by) - reach)), min(self.rows, int(max(ay, by) + reach) + 1)):
                # Of a slanted stretch only the columns near it: where its middle crosses the rows beside this one.
                begin, end = min(ax, bx), max(ax, bx)
                if dy:
                    cuts = [ax + dx * (row + side * reach - ay) / dy for side in (-1, 1)]
                    begin, end = max(begin, min(cuts)), min(end, max(cuts))
                for column in range(max(0, math.ceil(begin - reach)), min(self.columns, int(end + reach) + 1)):
                    along = ((column - ax) * dx + (row - ay) * dy) / square if square else 0.0
                    along = min(1.0, max(0.0, along))
                    away = math.hypot(column - ax - along * dx, row - ay - along * dy)
                    share = min(1.0, half + 0.5 - away)
                    at = row * self.columns + column
                    if share > covered.get(at, 0.0):
                        covered[at] = share
        colour = packed(stripe.colour)
        for at, share in covered.items():
            self.pixels[at] = _mixed(self.pixels[at], colour, share)

    def checkers(self, checkers: Checkers, across: int, along: int) -> None:
        """Paint squares over the whole floor, the first one dark."""
        side = checkers.square
        colours = packed(checkers.dark), packed(checkers.light)
        for row in range(along):
            first, last = self._cut(row * side, (row + 1) * side, self.rows)
            line: list[int] = []
            for column in range(across):
                begin, end = self._cut(column * side, (column + 1) * side, self.columns)
                line += [colours[(row + column) % 2]] * (end - begin)
            for each in range(first, last):
                self.pixels[each * self.columns : each * self.columns + len(line)] = line

    def print(self, paint: Print) -> None:
        """Paint a picture file; where it is transparent, what was there stays."""
        from PIL import Image  # floors without picture files need no Pillow

        size = max(1, round(paint.width * self.scale)), max(1, round(paint.depth * self.scale))
        if size[0] * size[1] > MAX_PRINT:
            raise ArgumentError(
                f"the picture {paint.file} would cover {paint.width} x {paint.depth} m; that is too much"
            )
        try:
            with opened(Path(paint.file)) as source:
                flat = source.convert("RGBA").resize(size).transpose(Image.Transpose.FLIP_TOP_BOTTOM)
        except ArgumentError as error:
            raise ArgumentError(f"the picture {paint.file} cannot be read: {error.message}", hint=error.hint) from error
        left, low = round(paint.x * self.scale), round(paint.y * self.scale)
        begin, end = max(0, left), min(self.columns, left + size[0])
        for row in range(max(0, low), min(self.rows, low + size[1])) if begin < end else ():
            bands = flat.crop((begin - left, row - low, end - left, row - low + 1)).tobytes()
            here = slice(row * self.columns + begin, row * self.columns + end)
            self.pixels[here] = [
                red << 16 | green << 8 | blue
                if opacity == 255
                else _mixed(below, red << 16 | green << 8 | blue, opacity / 255)
                for below, red, green, blue, opacity in zip(
                    self.pixels[here], bands[::4], bands[1::4], bands[2::4], bands[3::4], strict=True
                )
            ]

    def _cut(self, begin: float, end: float, size: int) -> tuple[int, int]:
        """Return the first pixel and the one after the last, from *begin* to *end*, m, within the floor."""
        return min(size, max(0, round(begin * self.scale))), min(size, max(0, round(end * self.scale)))


def _mixed(below: int, colour: int, share: float) -> int:
    """Return a pixel of which *colour* covers a share; a hole is there or not."""
    if share >= 1.0:
        return colour
    if share <= 0.0 or (below >= HOLE_MARK and share < 0.5):
        return below
    found = 0
    for shift in (16, 8, 0):
        low = below >> shift & 0xFF
        found |= round(low + share * ((colour >> shift & 0xFF) - low)) << shift
    return found


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
        with warnings.catch_warnings(action="ignore"):  # of its size, which is checked here
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
