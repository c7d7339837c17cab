"""What the door sends to programs: one class a message, and values as JSON has them."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Annotated

from msgspec import Meta, Struct

from elib.base.errors import ElibError
from elib.base.pictures import as_png, base64_of
from elib.link.protocol.image import Image, enlarged
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.values import READING_TYPES, Reading, Role, Sensors, describe
from elib.link.protocol.words import to_json
from elib.panel.server.conversation import Answer, Error, Failure, Json, Text, Told
from elib.panel.slot import Phase

PROTOCOL = 1
"""Version of the protocol; the path of the door's address has the same number."""
Robot = Annotated[str, Meta(description="Key of the robot.")]


class RobotInfo(Struct):
    """A robot of the door."""

    robot: Annotated[str, Meta(description="Its key, as messages name it.")]
    name: str
    url: str
    firmware: Annotated[str, Meta(description="Empty while it is not connected.")]
    state: Annotated[str, Meta(extra_json_schema={"enum": [each.name.lower() for each in Phase]})]
    driver: Annotated[
        str,
        Meta(
            description="Who drives it; empty while no client does.",
            extra_json_schema={"enum": ["", "you", "another"]},
        ),
    ]


class Welcome(Struct):
    """What a program is told first."""

    protocol: Annotated[int, Meta(extra_json_schema={"const": PROTOCOL})]
    elib: Annotated[str, Meta(description="Version of elib.")]
    robots: list[RobotInfo]


class Driven(Struct):
    """The answer to a beat."""

    drives: Annotated[list[str], Meta(description="Keys of the robots it drives.")]


class Watched(Struct):
    """The answer to a watch."""

    readings: Annotated[tuple[str, ...], Meta(description="What is watched, in order.")]
    rate: Annotated[float, Meta(extra_json_schema={"x-unit": "Hz"})]


class Readings(Told, tag="readings", kw_only=True):
    """Readings that the program watches. A program that does not read in time misses old ones, never the newest."""

    robot: Robot
    time: Annotated[
        float, Meta(description="When they were complete, s on the door's clock.", extra_json_schema={"x-unit": "s"})
    ]
    readings: Annotated[
        dict[str, Json], Meta(description="The readings by name, each as the command of that name returns it.")
    ]
    missed: Annotated[int, Meta(description="How many messages of this watch the program has missed so far.")]


class Event(Told, tag="event", kw_only=True):
    """Something that happened on a robot or on its link: a line of the event log."""

    robot: Robot
    time: Annotated[
        float, Meta(description="When it happened, s on the door's clock.", extra_json_schema={"x-unit": "s"})
    ]
    kind: Annotated[str, Meta(description="What it is about: call, link, robot, panel or note.")]
    text: Text
    is_bad: Annotated[bool, Meta(description="Whether something went wrong.")]
    missed: Annotated[int, Meta(description="How many lines before this one the program has missed.")]


TOLD: tuple[type[Told], ...] = (Answer, Failure, Error, Readings, Event)
"""All of them."""

ROLES = (Role.NUMBER, Role.CONVERTED, Role.PHYSICAL)
"""Fields of a reading that a program is told; constants are not needed where the converted numbers are there."""


def plain(value: object) -> Json:
    """Return the result of a command as objects, lists, numbers and texts; a picture has its pixels as a PNG file."""
    match value:
        case Reading():
            found = {name: plain(getattr(value, name)) for name in _names(type(value))}  # type: ignore[arg-type]  # classes have hashes
            return found | {"time": _moment(value.time)}
        case Image():
            return {
                "width": value.width,
                "height": value.height,
                "mode": CameraMode(value.mode).name.lower(),
                "png": _png(value),
                "time": _moment(value.time),
            }
        case list() | tuple():
            return [plain(each) for each in value]
    return to_json(value)


def all_plain(readings: Mapping[str, Reading | Image]) -> dict[str, Json]:
    """Return readings by name; null for a picture that cannot be decoded."""
    found: dict[str, Json] = {}
    for name, each in readings.items():
        try:
            found[name] = plain(each)
        except ElibError:
            found[name] = None
    return found


@functools.cache
def _names(kind: type[Reading]) -> tuple[str, ...]:
    if kind is Sensors:
        return tuple(READING_TYPES)
    return tuple(info.name for info in describe(kind, *ROLES))


@functools.lru_cache(8)
def _png(image: Image) -> str:
    return base64_of(as_png(enlarged(image, 1)))


def _moment(seconds: float) -> float | None:
    return round(seconds, 6) if math.isfinite(seconds) else None
