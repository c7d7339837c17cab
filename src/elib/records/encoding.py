"""Messages of a recording as JSON: frequent ones are formatted by hand, the others by the module json."""

from __future__ import annotations

import enum
import json
import math
from binascii import b2a_base64
from collections.abc import Collection, Iterator, Mapping
from json.encoder import encode_basestring_ascii as quoted
from operator import attrgetter

from elib.link.protocol.image import Image
from elib.link.protocol.table import Request
from elib.link.protocol.values import Reading, Role, describe
from elib.link.session import Ended

_JSON = json.JSONEncoder(allow_nan=False, separators=(",", ":"), ensure_ascii=True)
MOST_FIELDS = 16
"""Numbers of a list in a reading; a longer list holds samples of sound."""
_PLAIN = {int, float}
"""Types whose ``repr`` is JSON if the number is finite."""


def encoded(data: Mapping[str, object]) -> bytes:
    """Return a message as JSON; a number that is not finite becomes null."""
    try:
        return _JSON.encode(data).encode()
    except ValueError:
        return _JSON.encode(_finite(data)).encode()


def bytes_message(time: float, data: bytes, *, to_robot: bool) -> bytes:
    """Return the message of ``/bytes``."""
    direction = b"true" if to_robot else b"false"
    return b'{"time":%a,"to_robot":%b,"data":"%b"}' % (time, direction, b2a_base64(data, newline=False))


def call_message(time: float, number: int, request: Request[object]) -> bytes:
    """Return the message of ``/calls``."""
    text = (
        f'{{"time":{time!r},"call":{number},"command":{quoted(request.name)},'
        f'"text":{quoted(request.text)},"arguments":[{",".join(map(str, map(int, request.numbers)))}]}}'
    )
    return text.encode()


def outcome_message(time: float, number: int, event: Ended) -> bytes:
    """Return the message of ``/outcomes``."""
    error = event.error
    said = "" if error is None else f"{type(error).__name__}: {error}".removesuffix(": ")
    trip = "null" if math.isnan(event.round_trip) else repr(event.round_trip)
    text = (
        f'{{"time":{time!r},"call":{number},"command":{quoted(event.request.name)},'
        f'"ok":{"true" if error is None else "false"},"error":{quoted(said)},'
        f'"waited":{event.waited!r},"round_trip":{trip}}}'
    )
    return text.encode()


class ReadingForm:
    """Turns readings of one class into messages.

    Args:
        kind: The class.
    """

    def __init__(self, kind: type[Reading]) -> None:
        self._names = [info.name for info in describe(kind) if info.name != "origin"]
        self._values = attrgetter(*self._names)
        self._is_plain = len(self._names) > 1 and not describe(kind, Role.PHYSICAL)
        fields = ",".join(f'"{name}":%r' for name in self._names)
        self._pattern = f'{{{fields},"origin":%s}}'

    def message(self, value: Reading) -> bytes:
        """Return the message of one reading."""
        if self._is_plain:
            values: tuple[float, ...] = self._values(value)
            # Only for these types is the result of repr() JSON; all others take the slow path.
            if {*map(type, values)} <= _PLAIN and math.isfinite(sum(values)):
                return (self._pattern % (*values, quoted(value.origin))).encode()
        return encoded(fields_of(value))


_FORMS: dict[type[Reading], ReadingForm] = {}


def reading_message(value: Reading) -> bytes:
    """Return the message of a reading."""
    kind = type(value)
    form = _FORMS.get(kind)
    if form is None:
        form = _FORMS[kind] = ReadingForm(kind)
    return form.message(value)


def fields_of(value: Reading) -> dict[str, object]:
    """Return the fields of a reading, with its time and origin, and in SI units where the firmware sends raw counts."""
    names = [info.name for info in describe(type(value)) if info.name != "origin"]
    return {**{name: _jsonable(getattr(value, name)) for name in names}, "origin": value.origin}


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
        elif isinstance(value, list) and len(value) <= MOST_FIELDS:
            found.update({f"{name}[{k}]": float(each) for k, each in enumerate(value) if isinstance(each, int | float)})
    return found


def picture_fields(picture: Image) -> dict[str, object]:
    """Return the message of ``/pictures``, without its time stamp.

    Raises:
        Unsupported: elib cannot decode this pixel format.
    """
    pixels = picture.pixels
    channels = pixels.shape[2] if pixels.ndim == 3 else 1
    return {
        "frame_id": "camera",
        "width": picture.width,
        "height": picture.height,
        "encoding": "rgb8" if channels == 3 else "mono8",
        "step": picture.width * channels,
        "data": b2a_base64(pixels.tobytes(), newline=False).decode("ascii"),
        "time": picture.time,
    }


def _jsonable(value: object) -> object:
    if isinstance(value, enum.Enum):
        return value.name
    return list(value) if isinstance(value, tuple) else value


def _finite(value: object) -> object:
    match value:
        case dict():
            return {key: _finite(each) for key, each in value.items()}
        case list() | tuple():
            return [_finite(each) for each in value]
        case float() if not math.isfinite(value):
            return None
        case _:
            return value
