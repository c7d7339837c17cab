"""Recordings for tests: how one is made, and what the package mcap itself reads in one."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from mcap.reader import make_reader

import elib
from elib.records.recorder import Recorder
from elib.robot.runner import run_on

T = TypeVar("T")
SIM = "sim://square?speed=max&seed=5"

KINDS = {
    "object": dict,
    "array": list,
    "string": str,
    "boolean": bool,
    "integer": int,
    "number": (int, float),
    "null": type(None),
}


@dataclass(frozen=True)
class Read:
    """A message as anybody's reader finds it."""

    topic: str
    log_time: int
    sequence: int
    data: dict[str, Any]
    schema: dict[str, Any]
    schema_name: str


def read(path: Path) -> list[Read]:
    """Return the messages of a file, read by its index."""
    with path.open("rb") as stream:
        return [
            Read(
                channel.topic,
                message.log_time,
                message.sequence,
                json.loads(message.data),
                json.loads(schema.data),
                schema.name,
            )
            for schema, channel, message in make_reader(stream, validate_crcs=True).iter_messages(log_time_order=False)
            if schema is not None
        ]


def topics(path: Path) -> set[str]:
    return {each.topic for each in read(path)}


def of_topic(path: Path, topic: str) -> list[dict[str, Any]]:
    return [each.data for each in read(path) if each.topic == topic]


def complaints(data: object, schema: Mapping[str, Any], place: str = "") -> list[str]:
    """Return what in *data* is not as its JSON schema says: types, fields that are missing or not described."""
    kinds = schema.get("type", list(KINDS))
    kinds = kinds if isinstance(kinds, list) else [kinds]
    if isinstance(data, bool):
        fits = "boolean" in kinds
    else:
        fits = isinstance(data, tuple(part for kind in kinds for part in _types(kind)))
    if not fits:
        return [f"{place or 'message'} is {data!r}, not {kinds}"]
    found: list[str] = []
    if isinstance(data, dict) and "properties" in schema:
        properties = schema["properties"]
        found += [f"{place}/{name} is missing" for name in properties.keys() - data.keys()]
        found += [f"{place}/{name} is not described" for name in data.keys() - properties.keys()]
        for name in data.keys() & properties.keys():
            found += complaints(data[name], properties[name], f"{place}/{name}")
    if isinstance(data, list) and "items" in schema:
        for each in data:
            found += complaints(each, schema["items"], f"{place}[]")
    return found


def _types(kind: str) -> tuple[type, ...]:
    types = KINDS[kind]
    return types if isinstance(types, tuple) else (types,)


def recorded(path: Path, main: Callable[[elib.Epuck, Recorder], Awaitable[T]], url: str = SIM, **settings: Any) -> T:
    """Run a program on a robot that is being recorded from its first command on."""

    async def program(robot: elib.Epuck) -> T:
        with robot.record(path, **settings) as recorder:
            return await main(robot, recorder)

    return run_on(url, program)
