"""One world as a picture, whatever kind of file is asked for."""

from __future__ import annotations

from os import PathLike, fspath
from pathlib import Path
from typing import Unpack

from elib.base.errors import ArgumentError
from elib.base.files import write_file
from elib.simulator.drawing.png import png_of
from elib.simulator.drawing.svg import draw_svg
from elib.simulator.drawing.top import Look
from elib.simulator.physics import Snapshot


def draw(snapshot: Snapshot, path: str | PathLike[str] | None = None, **look: Unpack[Look]) -> str | None:
    """Draw *snapshot* from above: robots with their lamps, rays and trails, and all that is around them.

    Args:
        snapshot: The world; take it with ``beams=True`` to see the infrared sensors.
        path: Of a file that ends in ``.svg`` or ``.png``; an existing one is replaced. None for no file.
        look: How it is drawn.

    Returns:
        The SVG document if there is no path.

    Raises:
        ArgumentError: *size* is out of its range, *path* ends otherwise, or the file cannot be written.
        ElibError: The disk is full.
    """
    if path is None:
        return draw_svg(snapshot, **look)
    match Path(path).suffix.lower():
        case ".svg":
            write_file(path, draw_svg(snapshot, **look).encode())
        case ".png":
            write_file(path, png_of(snapshot, **look))
        case _:
            raise ArgumentError(
                f"a drawing cannot become {fspath(path)!r}; its name must end in .svg or .png",
                hint="without a name the SVG text is returned",
            )
    return None
