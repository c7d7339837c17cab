"""SVG: scales without loss and goes straight into a web page or a notebook."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import Unpack

from elib.base.pictures import as_address
from elib.simulator.drawing.floor import floor_png
from elib.simulator.drawing.shapes import Area, Circle, Picture, Point, Shape, Stroke, Text
from elib.simulator.drawing.top import Look, top_view
from elib.simulator.physics import Colour, Snapshot


def draw_svg(snapshot: Snapshot, **look: Unpack[Look]) -> str:
    """Return *snapshot* seen from above as an SVG document.

    Raises:
        ArgumentError: The size is out of its range.
    """
    drawing = top_view(snapshot, **look)
    background = element("rect", width="100%", height="100%", fill=drawing.background)
    shapes = [background, *map(_written, drawing.shapes)]
    return document(drawing.width, drawing.height, shapes, font_family="sans-serif") + "\n"


def document(width: int, height: int, elements: Iterable[str], *, top: int = 0, **attributes: object) -> str:
    """Return an SVG document, an element on each line, from y = *top* on; attributes are those of :func:`element`."""
    return element(
        "svg",
        "\n".join(["", *elements, ""]),
        xmlns="http://www.w3.org/2000/svg",
        width=width,
        height=height,
        viewBox=f"0 {top} {width} {height}",
        **attributes,
        stroke_linecap="round",
        stroke_linejoin="round",
    )


def element(name: str, content: str | None = None, /, **attributes: object) -> str:
    """Return an element with what is in it; ``font_size=12`` is its attribute ``font-size``, None leaves one out."""
    written = (
        f' {key.rstrip("_").replace("_", "-")}="{value}"' for key, value in attributes.items() if value is not None
    )
    return f"<{name}{''.join(written)}" + ("/>" if content is None else f">{content}</{name}>")


def _written(shape: Shape) -> str:
    match shape:
        case Area():
            return element("polygon", points=_points(shape.points), **_ink(shape.fill, shape.outline, shape.width))
        case Circle(centre=(x, y)):
            place = {"cx": f"{x:.2f}", "cy": f"{y:.2f}", "r": f"{shape.radius:.2f}"}
            return element("circle", **place, **_ink(shape.fill, shape.outline, shape.width))
        case Stroke():
            return element("polyline", points=_points(shape.points), **_ink(None, shape.colour, shape.width))
        case Text(place=(x, y)):
            look = {"font_size": f"{shape.size:.1f}", "fill": shape.colour, "text_anchor": shape.anchor}
            return element("text", escape(shape.text), x=f"{x:.2f}", y=f"{y:.2f}", **look)
        case Picture(place=(x, y), size=(width, height)):
            place = {"x": f"{x:.2f}", "y": f"{y:.2f}", "width": f"{width:.2f}", "height": f"{height:.2f}"}
            return element("image", **place, preserveAspectRatio="none", href=_inline(shape))


def _inline(picture: Picture) -> str:
    """Return the picture within the document: it needs no second file."""
    return as_address(floor_png(picture.floor, picture.bare))


def _points(points: tuple[Point, ...]) -> str:
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in points)


def _ink(fill: Colour | None, outline: Colour | None, width: float) -> dict[str, object]:
    stroke = {} if outline is None else {"stroke": outline, "stroke_width": f"{width:.2f}"}
    return {"fill": fill or "none", **stroke}
