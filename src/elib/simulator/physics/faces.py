"""What walls and boxes show to cameras: tags, or pictures of a file, as cells of one colour each."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Final, TypeAlias

from elib.base.errors import ArgumentError
from elib.base.tags import FACES, face_cells
from elib.simulator.physics.floor import opened

Cells: TypeAlias = tuple[tuple[int, ...], ...]
"""Rows of packed colours, the uppermost one first."""

MAX_CELLS: Final = 64
"""Cells along the longer side of a picture. That of a robot has 40 x 40 pixels as a rule."""
PAPER: Final = 0xEBEBEB
"""White paper as a camera shows it; black ink is 0x191919."""
INK: Final = 0x191919

Faces: TypeAlias = dict[str, int]
"""What the surfaces of one world show, and the number by which their records know it; 0 is nothing."""


def cells_of(face: str) -> Cells:
    """Return the cells of what a surface shows; none of nothing. A picture is scaled down to 64 along its longer side.

    Raises:
        ArgumentError: The file of a picture cannot be read.
    """
    if face in FACES:
        return _tag(face)
    path = Path(face)
    return _picture(path, path.stat().st_mtime_ns if path.is_file() else 0)


@lru_cache
def _tag(face: str) -> Cells:
    return tuple(tuple(PAPER if is_white else INK for is_white in row) for row in face_cells(face))


@lru_cache
def _picture(path: Path, written: int) -> Cells:
    """Read a picture once for all worlds that show it; *written* is when its file was."""
    from PIL import Image  # worlds without pictures need no Pillow

    try:
        with opened(path) as source:
            shown = Image.new("RGBA", source.size, "white")
            shown.alpha_composite(source.convert("RGBA"))
            shown.thumbnail((MAX_CELLS, MAX_CELLS), Image.Resampling.BOX)
    except ArgumentError as error:
        raise ArgumentError(f"the picture {path} cannot be read: {error.message}", hint=error.hint) from error
    pixels = shown.convert("RGB").tobytes()
    colours = [int.from_bytes(pixels[k : k + 3]) for k in range(0, len(pixels), 3)]
    return tuple(tuple(colours[k : k + shown.width]) for k in range(0, len(colours), shown.width))
