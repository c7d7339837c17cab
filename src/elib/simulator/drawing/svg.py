"""The top view as SVG text: scales without loss and goes straight into a web page or a notebook."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape
from io import BytesIO

from elib.base.zone import Zone
from elib.simulator.drawing.shapes import Circle, Picture, Point, Polygon, Shape, Stroke, Text
from elib.simulator.drawing.top import Trail, top_view
from elib.simulator.physics import Colour, Snapshot


def draw_svg(
    snapshot: Snapshot,
    *,
    trails: Sequence[Trail] = (),
    caption: str | None = None,
    size: int = 900,
    zones: Sequence[Zone] = (),
) -> str:
    """Return *snapshot* seen from above as an SVG document.

    Args:
        snapshot: The world; take it with ``beams=True`` to see the infrared sensors.
        trails: Where each robot was, oldest first, in the order of the robots; pale is old.
        caption: Line below the picture; None makes one from the snapshot, "" leaves it empty.
        size: Pixels of the arena's longer side, 200..8000.
        zones: Parts of the floor to be marked.

    Raises:
        ArgumentError: *size* is out of its range.
    """
    drawing = top_view(snapshot, trails, caption, size, zones)
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{drawing.width}" height="{drawing.height}"'
            f' viewBox="0 0 {drawing.width} {drawing.height}" font-family="sans-serif"'
            ' stroke-linecap="round" stroke-linejoin="round">',
            f'<rect width="100%" height="100%" fill="{drawing.background}"/>',
            *(_element(shape) for shape in drawing.shapes),
            "</svg>\n",
        ]
    )


def _element(shape: Shape) -> str:
    match shape:
        case Polygon():
            ink = _ink(shape.fill, shape.outline, shape.width)
            return f'<polygon points="{_points(shape.points)}"{ink}/>'
        case Circle():
            x, y = shape.centre
            ink = _ink(shape.fill, shape.outline, shape.width)
            return f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{shape.radius:.2f}"{ink}/>'
        case Stroke():
            ink = _ink(None, shape.colour, shape.width)
            return f'<polyline points="{_points(shape.points)}"{ink}/>'
        case Text():
            x, y = shape.place
            return (
                f'<text x="{x:.2f}" y="{y:.2f}" font-size="{shape.size:.1f}" fill="{shape.colour}"'
                f' text-anchor="{shape.anchor}">{escape(shape.text)}</text>'
            )
        case Picture():
            (x, y), (width, height) = shape.place, shape.size
            return (
                f'<image x="{x:.2f}" y="{y:.2f}" width="{width:.2f}" height="{height:.2f}"'
                f' preserveAspectRatio="none" href="{_inline(shape)}"/>'
            )


def _inline(picture: Picture) -> str:
    """Return the picture within the document: it needs no second file."""
    from elib.simulator.drawing.floor import floor_picture

    out = BytesIO()
    floor_picture(picture.floor, picture.bare).save(out, "PNG", optimize=True)
    return f"data:image/png;base64,{b64encode(out.getvalue()).decode()}"


def _points(points: tuple[Point, ...]) -> str:
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in points)


def _ink(fill: Colour | None, outline: Colour | None, width: float) -> str:
    stroke = f' stroke="{outline}" stroke-width="{width:.2f}"' if outline is not None else ""
    return f' fill="{fill if fill is not None else "none"}"{stroke}'
