"""The top view as a PNG file."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Unpack

from elib.base.pictures import as_png
from elib.simulator.drawing.floor import floor_png
from elib.simulator.drawing.shapes import Area, Circle, Drawing, Picture, Point, Stroke, Text
from elib.simulator.drawing.top import Look, top_view
from elib.simulator.physics import Snapshot

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

OVERSAMPLING = 3  # Drawn this much larger, then scaled down: Pillow draws hard edges. Above 3 nothing is gained.


def png_of(snapshot: Snapshot, **look: Unpack[Look]) -> bytes:
    """Return the PNG file that shows *snapshot* from above."""
    return as_png(render(top_view(snapshot, **look)), is_small=True)


def render(drawing: Drawing) -> Image:
    """Return *drawing* as an image, with smooth edges."""
    from PIL import Image, ImageDraw  # Only pictures need Pillow; a robot starts faster without.

    scale = OVERSAMPLING
    canvas = Image.new("RGB", (drawing.width * scale, drawing.height * scale), tuple(drawing.background))
    pen = ImageDraw.Draw(canvas)
    for shape in drawing.shapes:
        if isinstance(shape, Picture):
            _paste(canvas, shape, scale)
        else:
            _draw(pen, shape, scale)
    return canvas.resize((drawing.width, drawing.height), Image.Resampling.BOX)


def _paste(canvas: Image, picture: Picture, scale: int) -> None:
    from PIL import Image

    (x, y), (width, height) = picture.place, picture.size
    size = max(1, round(width * scale)), max(1, round(height * scale))
    with Image.open(io.BytesIO(floor_png(picture.floor, picture.bare))) as floor:
        canvas.paste(floor.convert("RGB").resize(size), (round(x * scale), round(y * scale)))


def _draw(pen: ImageDraw, shape: Area | Circle | Stroke | Text, scale: int) -> None:
    match shape:
        case Area():
            points = _enlarged(shape.points, scale)
            pen.polygon(points, fill=tuple(shape.fill))
            if shape.outline is not None:
                _stroke(pen, [*points, points[0]], tuple(shape.outline), shape.width * scale)
        case Circle():
            (x, y), radius = _enlarged((shape.centre,), scale)[0], shape.radius * scale
            if shape.fill is None:
                if shape.outline is not None:
                    _ring(pen, x, y, radius, tuple(shape.outline), shape.width * scale)
                return
            if shape.outline is not None:
                _disc(pen, x, y, radius + shape.width * scale / 2, tuple(shape.outline))
                radius -= shape.width * scale / 2
            _disc(pen, x, y, radius, tuple(shape.fill))
        case Stroke():
            _stroke(pen, _enlarged(shape.points, scale), tuple(shape.colour), shape.width * scale)
        case Text():
            from PIL import ImageFont

            anchor = {"start": "ls", "middle": "ms", "end": "rs"}[shape.anchor]
            font = ImageFont.load_default(size=shape.size * scale)
            x, y = shape.place
            pen.text((x * scale, y * scale), shape.text, fill=tuple(shape.colour), font=font, anchor=anchor)


def _enlarged(points: tuple[Point, ...], scale: int) -> list[Point]:
    return [(x * scale, y * scale) for x, y in points]


def _disc(pen: ImageDraw, x: float, y: float, radius: float, colour: tuple[int, ...]) -> None:
    pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=colour)


def _ring(pen: ImageDraw, x: float, y: float, radius: float, colour: tuple[int, ...], width: float) -> None:
    outer = radius + width / 2
    pen.ellipse((x - outer, y - outer, x + outer, y + outer), outline=colour, width=max(1, round(width)))


def _stroke(pen: ImageDraw, points: list[Point], colour: tuple[int, ...], width: float) -> None:
    pen.line(points, fill=colour, width=max(1, round(width)), joint="curve")
    if width >= 3:  # Pillow leaves the ends square.
        for x, y in (points[0], points[-1]):
            _disc(pen, x, y, width / 2 - 0.5, colour)
