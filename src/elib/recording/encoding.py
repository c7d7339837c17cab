"""Messages as JSON. What comes thousands of times a second is put together by hand, the rest by the json module."""

from __future__ import annotations

import dataclasses
import enum
import json
import math
from binascii import b2a_base64
from collections.abc import Iterator, Mapping
from json.encoder import encode_basestring_ascii as quoted
from operator import attrgetter

from elib.protocol.image import Image
from elib.protocol.table import Request
from elib.protocol.values import Acceleration, AngularVelocity, Reading
from elib.session import Ended

_JSON = json.JSONEncoder(allow_nan=False, separators=(",", ":"), ensure_ascii=True)
_PLAIN = {int, float}
"""Types whose ``repr`` is JSON, if the number is finite."""


_CONVERTED: dict[type[Reading], str] = {Acceleration: "g", AngularVelocity: "rad_per_s"}
"""Properties that are written beside the raw numbers: the same in SI units."""


def _apart(kind: type[Reading]) -> Iterator[str]:
    yield from (field.name for field in dataclasses.fields(kind) if field.metadata.get("apart"))
    for each in kind.__subclasses__():
        yield from _apart(each)


APART = frozenset({"timestamp", *_CONVERTED.values(), *_apart(Reading)})
"""Fields of a reading's message that are no raw numbers of it: time, constants, and the same in another unit."""


def encoded(data: Mapping[str, object]) -> bytes:
    """Return a message as JSON; what is no finite number becomes null."""
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
    """How readings of one type become messages.

    Args:
        kind: The type.
    """

    def __init__(self, kind: type[Reading]) -> None:
        self._names = [field.name for field in dataclasses.fields(kind) if field.name != "origin"]
        self._values = attrgetter(*self._names)
        self._is_plain = len(self._names) > 1 and kind not in _CONVERTED
        fields = ",".join(f'"{name}":%r' for name in self._names)
        self._pattern = f'{{{fields},"origin":%s}}'

    def message(self, value: Reading) -> bytes:
        """Return the message of one reading."""
        if self._is_plain:
            values: tuple[float, ...] = self._values(value)
            # Only then is what repr() says JSON: anything else goes the long way.
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
    """Return a reading by its fields, with time and origin, and in SI units where the firmware sends raw counts."""
    data = {
        field.name: _jsonable(getattr(value, field.name))
        for field in dataclasses.fields(value)
        if field.name != "origin"
    }
    if (converted := _CONVERTED.get(type(value))) is not None:
        data[converted] = list(getattr(value, converted))
    return {**data, "origin": value.origin}


def picture_fields(picture: Image) -> dict[str, object]:
    """Return the message of ``/pictures``, without its stamp.

    Raises:
        Unsupported: Nobody can decode it.
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


__all__ = [
    "APART",
    "bytes_message",
    "call_message",
    "encoded",
    "fields_of",
    "outcome_message",
    "picture_fields",
    "reading_message",
]
