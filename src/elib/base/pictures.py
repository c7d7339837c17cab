"""Pictures as PNG, and bytes as text."""

from __future__ import annotations

import io
from binascii import b2a_base64
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL.Image import Image


def base64_of(data: bytes) -> str:
    """Return bytes as text."""
    return b2a_base64(data, newline=False).decode("ascii")


def as_png(picture: Image, *, is_small: bool = False) -> bytes:
    """Return a picture as a PNG file; one that is to be small takes longer to make."""
    out = io.BytesIO()
    picture.save(out, "PNG", optimize=is_small)
    return out.getvalue()


def as_address(png: bytes) -> str:
    """Return a PNG file as an address that holds it, for a document that needs no second file."""
    return f"data:image/png;base64,{base64_of(png)}"
