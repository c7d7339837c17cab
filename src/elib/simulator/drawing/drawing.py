"""One world as a picture, whatever kind of file is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike, fspath
from pathlib import Path

from elib.base.errors import ArgumentError
from elib.base.files import write_file
from elib.base.zone import Zone
from elib.simulator.drawing.png import draw_png
from elib.simulator.drawing.svg import draw_svg
from elib.simulator.drawing.top import Trail
from elib.simulator.physics import Snapshot


def draw(
    snapshot: Snapshot,
    path: str | PathLike[str] | None = None,
    *,
    trails: Sequence[Trail] = (),
    caption: str | None = None,
    size: int = 900,
    zones: Sequence[Zone] = (),
) -> str | None:
    """Draw *snapshot* from above: robots with their lamps, rays and trails, and all that is around them.

    Args:
        snapshot: The world; take it with ``beams=True`` to see the infrared sensors.
        path: Of a file that ends in ``.svg`` or ``.png``; an existing one is replaced. None for no file.
        trails: Where each robot was, oldest first, in the order of the robots; pale is old.
        caption: Line below the picture; None makes one from the snapshot, "" leaves it empty.
        size: Pixels of the arena's longer side, 200..8000.
        zones: Parts of the floor to be marked.

    Returns:
        The SVG document if there is no path.

    Raises:
        ArgumentError: *size* is out of its range, *path* ends otherwise, or the file cannot be written.
        ElibError: The disk is full.
    """
    if path is None:
        return draw_svg(snapshot, trails=trails, caption=caption, size=size, zones=zones)
    match Path(path).suffix.lower():
        case ".svg":
            document = draw_svg(snapshot, trails=trails, caption=caption, size=size, zones=zones)
            write_file(path, document.encode())
        case ".png":
            draw_png(snapshot, path, trails=trails, caption=caption, size=size, zones=zones)
        case _:
            raise ArgumentError(
                f"a drawing cannot become {fspath(path)!r}; its name must end in .svg or .png",
                hint="without a name the SVG text is returned",
            )
    return None
