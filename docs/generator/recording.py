"""The tables of the topics and the metadata of a recording."""

from __future__ import annotations

import tempfile
from pathlib import Path

import elib
from elib.records.reader import read_recording
from elib.records.topics import TOPICS, Schema
from generator.markdown import table

EXPLAINED = {
    "format": "version of these topics",
    "elib": "version of elib that wrote it",
    "python": "version of Python",
    "platform": "the system it ran on",
    "robot": "name of the robot",
    "url": "URL that was opened",
    "origin": "`robot`, `simulator` or `replay`",
    "firmware": "the firmware of the robot",
    "version": "the robot's answer to `version()`",
    "hardware": "hardware version, if the robot has one",
    "began": "when the recording began, s on the robot's clock",
    "calls_before": "number of calls that the program made before",
    "program": "command line of the program",
    "part": "number of this file, from 1",
    "part_began": "when this file began, s on the robot's clock",
    "wall": "the same moment in UTC",
    "world": "the simulated world",
    "seed": "seed of the world",
    "robots": "number of robots in the world",
    "robot_index": "number of this robot, from 0",
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
    """Return the table of the metadata of a recording, made from a new recording.

    Raises:
        RuntimeError: The recording has a key that is not explained here.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        with elib.connect("sim://?speed=max") as robot, robot.record(path):
            robot.selector()
        found = read_recording(path).about
    unknown = found.keys() - EXPLAINED.keys()
    if unknown:
        raise RuntimeError(f"EXPLAINED does not explain {sorted(unknown)}")
    return table(("Key", "What it says"), ((f"`{key}`", text) for key, text in EXPLAINED.items() if key in found))


def _fields(schema: Schema | None) -> str:
    if schema is None:
        return "`time`, the fields of the reading, `origin`"
    properties = schema["properties"]
    assert isinstance(properties, dict)
    return ", ".join(f"`{name}`" for name in properties)
