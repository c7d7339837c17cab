"""Checks of the messages of a recording against the schema of their topic: the reader yields only what passes."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias, cast

from elib.records.topics import READING, READINGS, TOPICS, Schema

Check: TypeAlias = Callable[[object], bool]

LARGEST_NUMBER = 1e15
"""No time, length or count of a recording comes near this number, and a float holds whole numbers up to it."""

_BY_NAME = {topic.name: topic.schema for topic in TOPICS}


def check_of(topic: str) -> Check:
    """Return a function that checks the data of a message against the schema of its topic.

    All fields of the schema must be there, except time stamps of the file's own clock. A message of a topic that elib
    does not know needs only a time.
    """
    schema = READING.get(topic) or _BY_NAME.get(topic)
    whole = _object(schema if schema is not None else READING[""])
    return (lambda data: whole(data) and _is_plain(data)) if topic.startswith(READINGS.name) else whole


def _object(schema: Schema) -> Check:
    properties = cast("Mapping[str, Schema]", schema["properties"])
    checks = [(name, _check(each)) for name, each in properties.items() if name != "timestamp"]

    def check(data: object) -> bool:
        return isinstance(data, dict) and all(name in data and fits(data[name]) for name, fits in checks)

    return check


def _check(schema: Schema) -> Check:
    kinds = schema["type"]
    if isinstance(kinds, list):
        several = [_check({**schema, "type": kind}) for kind in kinds]
        return lambda value: any(fits(value) for fits in several)
    match kinds:
        case "object":
            return _object(schema)
        case "array":
            items = _check(cast("Schema", schema["items"]))
            length = schema.get("maxItems")
            return lambda value: isinstance(value, list) and length in (None, len(value)) and all(map(items, value))
        case "string" if schema.get("contentEncoding") == "base64":
            return _is_base64
        case "string":
            return _is_text
        case "number":
            return _is_number
        case "integer":
            return lambda value: type(value) is int and _is_number(value)
        case "boolean":
            return lambda value: isinstance(value, bool)
        case _:
            return lambda value: value is None


def _is_number(value: object) -> bool:
    # The number is compared before it becomes a float: whole numbers in JSON may have any length.
    return type(value) in (int, float) and -LARGEST_NUMBER <= cast("float", value) <= LARGEST_NUMBER


def _is_text(value: object) -> bool:
    if not isinstance(value, str):
        return False
    if not value.isascii():
        try:
            value.encode()
        except UnicodeEncodeError:  # half of a surrogate pair: JSON can hold it, files and terminals cannot
            return False
    return True


def _is_base64(value: object) -> bool:
    try:
        return isinstance(value, str) and base64.b64decode(value) is not None
    except (binascii.Error, ValueError):
        return False


def _is_plain(value: Any) -> bool:
    """Return whether a reading holds only numbers, texts, truth values and lists of these."""
    match value:
        case dict():
            return all(map(_is_text, value)) and all(map(_is_plain, value.values()))
        case list():
            return all(map(_is_plain, value))
        case str():
            return _is_text(value)
        case None | bool():
            return True
        case _:
            return _is_number(value)
