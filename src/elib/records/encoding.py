"""Readings and pictures as the data of messages, and the numbers in them."""

from __future__ import annotations

import enum
from collections.abc import Collection, Iterator, Mapping

from elib.base.pictures import base64_of
from elib.link.protocol.image import Image
from elib.link.protocol.values import Reading, Role, describe
from elib.records.topics import PictureData

MAX_FIELDS = 16
"""Numbers of a list in a reading; a longer list holds samples of sound."""


def fields_of(value: Reading) -> dict[str, object]:
    """Return the fields of a reading, with its time and origin, and in SI units where the firmware sends raw counts."""
    names = (*(info.name for info in describe(type(value)) if info.name != "origin"), "origin")
    found = {name: getattr(value, name) for name in names}
    return {name: each.name if isinstance(each, enum.Enum) else each for name, each in found.items()}


def skipped_fields() -> frozenset[str]:
    """Return the fields of a reading's message that are not numbers from the robot.

    They are its time, its origin, what converts numbers, and the same numbers in another unit.
    """
    return frozenset({"timestamp", *_skipped(Reading)})


def _skipped(kind: type[Reading]) -> Iterator[str]:
    yield from (info.name for info in describe(kind) if info.role is not Role.NUMBER)
    for each in kind.__subclasses__():
        yield from _skipped(each)


def numbers_in(data: Mapping[str, object], skipped: Collection[str] | None = None) -> dict[str, float]:
    """Return the numbers that the robot sent in a reading's message, by their fields; of a list each by its place.

    Args:
        data: The message.
        skipped: The result of :func:`skipped_fields`. A program with many messages calls that once.
    """
    skipped = skipped_fields() if skipped is None else skipped
    found: dict[str, float] = {}
    for name, value in data.items():
        if name in skipped:
            continue
        if isinstance(value, int | float):
            found[name] = float(value)
        elif isinstance(value, list) and len(value) <= MAX_FIELDS:
            found.update({f"{name}[{k}]": float(each) for k, each in enumerate(value) if isinstance(each, int | float)})
    return found


def picture_data(picture: Image) -> PictureData:
    """Return the data of ``/pictures``."""
    pixels = picture.pixels
    channels = pixels.shape[2] if pixels.ndim == 3 else 1
    return PictureData(
        time=picture.time,
        frame_id="camera",
        width=picture.width,
        height=picture.height,
        encoding="rgb8" if channels == 3 else "mono8",
        step=picture.width * channels,
        data=base64_of(pixels.tobytes()),
    )
