"""The protocol as JSON Schema, made from the classes of the messages, the catalogue of commands and the readings."""

from __future__ import annotations

import inspect
import types
from typing import Any, cast, get_args, get_type_hints

import msgspec

from elib.base.plaintext import summary
from elib.doors.serve.answers import PROTOCOL, ROLES, TOLD, Welcome
from elib.doors.serve.client import DOOR_MESSAGES
from elib.doors.serve.messages import MESSAGES
from elib.link.protocol import values as v
from elib.link.protocol.values import READING_TYPES, FieldInfo, Reading, Sensors, describe
from elib.panel.server.conversation import Message
from elib.robot.actions import catalogue

Schema = dict[str, Any]
DRAFT = "https://json-schema.org/draft/2020-12/schema"
REF = "#/$defs/{name}"
TIME: Schema = {"type": ["number", "null"], "description": "When it came, s on the clock of the door.", "x-unit": "s"}
JSON_TYPES = {int: "integer", float: "number", bool: "boolean", str: "string", type(None): "null"}
PICTURE: Schema = {
    "title": "Picture",
    "description": "An upright picture of the camera.",
    "type": "object",
    "properties": {
        "width": {"type": "integer", "x-unit": "pixels"},
        "height": {"type": "integer", "x-unit": "pixels"},
        "mode": {"enum": ["grey", "colour"]},
        "png": {"type": "string", "contentEncoding": "base64", "contentMediaType": "image/png"},
        "time": TIME,
    },
    "required": ["width", "height", "mode", "png", "time"],
}


def schema() -> Schema:
    """Return the JSON Schema of the protocol: what a program may send, and what it is told."""
    own, parts = msgspec.json.schema_components(tuple(MESSAGES.values()), ref_template=REF)
    told, more = msgspec.json.schema_components((*TOLD, Welcome), ref_template=REF)
    found: dict[str, Schema] = {name: cast("Schema", part) for name, part in (parts | more).items()}
    for kind in MESSAGES.values():
        found[kind.__name__]["x-result"] = result_of(kind)
        found[kind.__name__]["description"] = inspect.getdoc(kind) or ""
        found[kind.__name__]["additionalProperties"] = False
    for each in TOLD:
        message = found[each.__name__]
        message["required"] = list(message["properties"])  # a message is always sent whole
        for part in message["properties"].values():
            part.pop("default", None)
    found["Picture"] = PICTURE
    found |= {_title(kind): reading_schema(kind) for kind in reading_kinds()}
    found["ClientMessage"] = {"description": "What a program sends.", "oneOf": list(own)}
    found["ServerMessage"] = {"description": "What a program is told.", "oneOf": list(told[:-1])}
    return {
        "$schema": DRAFT,
        "title": f"elib serve, protocol {PROTOCOL}",
        "description": "Each text message of the WebSocket is one JSON object. x-result is what the answer has.",
        "x-protocol": PROTOCOL,
        "$ref": REF.format(name="ClientMessage"),
        "$defs": dict(sorted(found.items())),
    }


def result_of(kind: type[Message]) -> Schema:
    """Return the schema of the result of a request."""
    name = str(kind.__struct_config__.tag)
    if name in DOOR_MESSAGES:
        (found,), parts = msgspec.json.schema_components((kind.answers,), ref_template=REF)
        if kind.answers is Welcome:
            return found
        whole = parts.get(getattr(kind.answers, "__name__", ""), found)
        return {key: value for key, value in whole.items() if key not in ("title", "description")}
    text = str(catalogue()[name].signature.return_annotation).removeprefix("v.")
    simple = {"None": "null", "str": "string", "int": "integer"}
    if text in simple:
        return {"type": simple[text]}
    if text == "list[int]":
        return {"type": "array", "items": {"type": "integer"}}
    if text.startswith("NDArray"):
        return {"type": "array", "items": {"type": "array", "items": {"type": "integer"}}}
    if text == "Image":
        return {"$ref": REF.format(name="Picture")}
    return {"$ref": REF.format(name=_title(getattr(v, text)))}


def reading_kinds() -> tuple[type[Reading], ...]:
    """Return the classes of all readings that a program gets."""
    return (*READING_TYPES.values(), Sensors, v.CameraSettings, v.Pitch, v.Version)


def reading_schema(kind: type[Reading]) -> Schema:
    """Return the schema of a reading, with the units of its fields."""
    properties: dict[str, Schema]
    if kind is Sensors:
        properties = {
            name: {"oneOf": [{"$ref": REF.format(name=_title(each))}, {"type": "null"}]}
            for name, each in READING_TYPES.items()
        }
    else:
        hints = get_type_hints(kind)
        properties = {info.name: _field(info, hints.get(info.name)) for info in describe(kind, *ROLES)}
    properties["time"] = TIME
    return {
        "title": _title(kind),
        "description": summary(kind),
        "type": "object",
        "properties": properties,
        "required": list(properties),
    }


def _field(info: FieldInfo, hint: object) -> Schema:
    kinds = [each for each in (get_args(hint) if isinstance(hint, types.UnionType) else (hint,)) if each in JSON_TYPES]
    found: Schema = {}
    if info.names:
        found = {"type": "array", "items": {"type": "integer" if int in get_args(hint) else "number"}}
        found["description"] = f"In order: {', '.join(info.names)}."
    elif kinds:
        names = [JSON_TYPES[each] for each in kinds]
        found = {"type": names[0] if len(names) == 1 else names}
    if info.unit:
        found["x-unit"] = info.unit
    return found


def _title(kind: type[Reading]) -> str:
    """Return the name of a reading's schema; some are called like the commands that read them."""
    return f"{kind.__name__}Reading"
