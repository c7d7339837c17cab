"""``elib tags``: a sheet of AprilTags to print, at true size."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.files import write_file
from elib.base.rules import Choice, Number
from elib.base.tags import FAMILIES, cells
from elib.cli.arguments import option
from elib.simulator.drawing.svg import element

PAPER, MARGIN = (210, 297), 10
"""A4, and what printers leave blank of it, mm."""
LABEL = 4
"""Height of what stands below each tag, mm."""


def tags(
    numbers: Annotated[list[int], Cli(help="The numbers of the tags.")],
    *,
    file: Annotated[Path, option("-o FILE", "The SVG file to write.")] = Path("tags.svg"),
    size: Annotated[float, Number(5, 180, "mm"), option("--size MM", "Side of the black square.")] = 60.0,
    family: Annotated[str, Choice(tuple(FAMILIES)), option("--family NAME", "16h5 or 36h11.")] = "16h5",
) -> None:
    """Write a sheet of AprilTags to print, as an SVG file of A4.

    Print it without scaling, and measure a black square: its side is the size that picture.tags() is told. The white
    rim around a tag, as wide as one of its cells, belongs to it.

    For example:
        elib tags 0 1 2 3
        elib tags 7 --family 36h11 --size 100 -o seven.svg
    """
    cell = size / len(cells(family, 0))
    across, down = (size + 2 * cell + 1, size + 2 * cell + LABEL + 1)
    columns, rows = (int((paper - 2 * MARGIN) // step) for paper, step in zip(PAPER, (across, down), strict=True))
    if len(numbers) > columns * rows:
        raise ArgumentError(
            f"a sheet has room for {columns * rows} tags of {size:g} mm, not for {len(numbers)}",
            hint="write several sheets, or smaller tags",
        )
    drawn = []
    for place, number in enumerate(numbers):
        left, top = MARGIN + place % columns * across, MARGIN + place // columns * down
        outer = size + 2 * cell
        frame = {"fill": "none", "stroke": "#ccc", "stroke_width": 0.1}
        drawn.append(element("rect", x=f"{left:.3f}", y=f"{top:.3f}", width=outer, height=outer + LABEL, **frame))
        black = element("rect", x=f"{left + cell:.3f}", y=f"{top + cell:.3f}", width=size, height=size)
        drawn.append(black)
        white = "".join(
            f"M{left + (k + 1) * cell:.3f} {top + (i + 1) * cell:.3f}h{cell:.3f}v{cell:.3f}h-{cell:.3f}z"
            for i, row in enumerate(cells(family, number))
            for k, is_white in enumerate(row)
            if is_white
        )
        drawn.append(element("path", d=white, fill="#fff"))
        label = f"{family} {number}, {size:g} mm"
        drawn.append(element("text", label, x=f"{left + cell:.3f}", y=f"{top + outer + 2:.3f}", font_size=3))
    width, height = PAPER
    box = {"width": f"{width}mm", "height": f"{height}mm", "viewBox": f"0 0 {width} {height}"}
    sheet = element("svg", "\n".join(drawn), xmlns="http://www.w3.org/2000/svg", **box)
    write_file(file, (sheet + "\n").encode())
    print(f"{len(numbers)} tags are in {file}: print it at 100 %, on A4")
