"""Values as JSON has them: readings, pictures, and the other results of commands."""

from __future__ import annotations

import base64
import functools
import io
import math
from collections.abc import Mapping
from typing import Any

from elib.base.errors import ElibError
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.values import READING_TYPES, Reading, Role, Sensors, describe

Json = Any
ROLES = (Role.NUMBER, Role.CONVERTED, Role.PHYSICAL)
"""Fields of a reading that a program is told; constants are not needed where the converted numbers are there."""


def plain(value: object) -> Json:
    """Return the result of a command as objects, lists, numbers and texts."""
    match value:
        case float():
            return value if math.isfinite(value) else None
        case None | bool() | int() | str():
            return value
        case Sensors():
            found = {name: plain(getattr(value, name)) for name in READING_TYPES}
            return found | {"time": _moment(value.time)}
        case Reading():
            return reading(value)
        case Image():
            return picture(value)
        case list() | tuple():
            return [plain(each) for each in value]
    return value.tolist()  # type: ignore[attr-defined]  # an array of NumPy, which is not imported for this


def reading(value: Reading) -> dict[str, Json]:
    """Return a reading as an object of its fields, with its time."""
    found: dict[str, Json] = {name: plain(getattr(value, name)) for name in _names(type(value))}  # type: ignore[arg-type]  # classes have hashes
    found["time"] = _moment(value.time)
    return found


def picture(image: Image) -> dict[str, Json]:
    """Return a picture as an object, with its pixels as a PNG file.

    Raises:
        Unsupported: The picture is in YUV, which elib does not decode.
    """
    return {
        "width": image.width,
        "height": image.height,
        "mode": CameraMode(image.mode).name.lower(),
        "png": _png(image),
        "time": _moment(image.time),
    }


def all_plain(readings: Mapping[str, Reading | Image]) -> dict[str, Json]:
    """Return readings by name; null for a picture that cannot be decoded."""
    found: dict[str, Json] = {}
    for name, each in readings.items():
        try:
            found[name] = picture(each) if isinstance(each, Image) else reading(each)
        except ElibError:
            found[name] = None
    return found


@functools.cache
def _names(kind: type[Reading]) -> tuple[str, ...]:
    return tuple(info.name for info in describe(kind, *ROLES))


@functools.lru_cache(8)
def _png(image: Image) -> str:
    import PIL.Image

    stream = io.BytesIO()
    PIL.Image.fromarray(image.pixels).save(stream, "PNG")
    return base64.b64encode(stream.getvalue()).decode("ascii")


def _moment(seconds: float) -> float | None:
    return round(seconds, 6) if math.isfinite(seconds) else None
