"""The tables of what a recording holds, from the topics themselves and from a recording."""

from __future__ import annotations

import tempfile
from pathlib import Path

import elib
from elib.recording import load
from elib.recording.topics import TOPICS, Schema
from generator.markdown import table

TOLD = {
    "format": "version of these topics",
    "elib": "version of elib that wrote it",
    "python": "version of Python",
    "platform": "the system it ran on",
    "robot": "name of the robot",
    "url": "what was opened",
    "origin": "`robot`, `simulator` or `replay`",
    "firmware": "the firmware spoken to",
    "version": "the robot's own answer",
    "hardware": "its hardware version, where it tells one",
    "began": "when the recording began, s on the robot's clock",
    "calls_before": "calls that the program had made before",
    "program": "its command line",
    "part": "number of this file, from 1",
    "part_began": "when this file began, s on the robot's clock",
    "wall": "the same in UTC",
    "world": "the simulated world",
    "seed": "its seed",
    "robots": "robots in it",
    "robot_index": "which one this was, from 0",
}


def topics() -> str:
    """Return the table of topics, with the fields of their messages."""
    rows = []
    for topic in TOPICS:
        name = f"`{topic.name}NAME`" if topic.schema is None else f"`{topic.name}`"
        kind = f"`{topic.schema_name}Name`" if topic.schema is None else f"`{topic.schema_name}`"
        rows.append((name, kind, topic.about, _fields(topic.schema)))
    return table(("Topic", "Schema", "What it holds", "Fields"), rows)


def about() -> str:
    """Return the table of what a recording says of itself, by a recording.

    Raises:
        RuntimeError: A recording says something that has no explanation here.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        with elib.connect("sim://?speed=max") as robot, robot.record(path):
            robot.selector()
        found = load(path).about
    unknown = found.keys() - TOLD.keys()
    if unknown:
        raise RuntimeError(f"TOLD does not explain {sorted(unknown)}")
    return table(("Key", "What it says"), ((f"`{key}`", text) for key, text in TOLD.items() if key in found))


def _fields(schema: Schema | None) -> str:
    if schema is None:
        return "`time`, those of the reading, `origin`"
    properties = schema["properties"]
    assert isinstance(properties, dict)
    return ", ".join(f"`{name}`" for name in properties)
