"""What is painted on the floor, as a picture for the drawings and the page."""

from __future__ import annotations

import struct
import zlib

from elib.simulator.physics import Colour
from elib.simulator.physics.fittings import FLOOR_COLOUR
from elib.simulator.physics.floor import HOLE_MARK, Floor, packed

PIT = Colour(22, 24, 30)
"""Of a hole."""
MAX_PIXELS = 1600
"""Pixels of the longer side: more could not be seen on a screen."""


def floor_png(floor: Floor, bare: Colour | None = None) -> bytes:
    """Return the picture of a painted floor as a PNG file, north up, which needs no Pillow.

    Args:
        floor: One with a picture.
        bare: What bare linoleum looks like; None leaves it transparent.
    """
    step = -(-max(floor.columns, floor.rows) // MAX_PIXELS)
    rows = [floor.pixels[row * floor.columns : (row + 1) * floor.columns : step] for row in range(0, floor.rows, step)]
    seen = {number: struct.pack(">I", number << 8 | 255) for number in set(floor.pixels) if number < HOLE_MARK}
    seen[packed(FLOOR_COLOUR)] = bytes((0, 0, 0, 0) if bare is None else (*bare, 255))
    pit = bytes((*PIT, 255))
    lines = b"".join(b"\0" + b"".join([seen.get(number, pit) for number in row]) for row in reversed(rows))
    head = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 6, 0, 0, 0)  # eight bits of red, green, blue, opacity
    parts = ((b"IHDR", head), (b"IDAT", zlib.compress(lines)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in parts
    )
