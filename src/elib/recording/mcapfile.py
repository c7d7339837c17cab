"""An MCAP file (https://mcap.dev) while it is written: if it is cut off, it is readable up to its last whole chunk."""

from __future__ import annotations

import importlib.util
import json
import os
import platform
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib.metadata import version

from elib.errors import ArgumentError, Unsupported, install
from elib.recording.encoding import encoded, fields_of
from elib.recording.mcapwriter import McapWriter
from elib.recording.messages import Message
from elib.recording.topics import ABOUT, WORLD_FILE, Schema


def check_mcap() -> None:
    """Check that recordings can be read and written here.

    Raises:
        Unsupported: The package mcap is not installed.
    """
    if importlib.util.find_spec("mcap") is None:
        raise Unsupported("recordings need the package mcap, which is not installed", hint=install("record"))


def versions() -> dict[str, str]:
    """Return the versions of the programs that write a recording."""
    return {
        "elib": version("elib-epuck"),
        "python": platform.python_version(),
        "platform": platform.platform(terse=True),
    }


class McapFile:
    """A recording file that grows. If the program dies, only what was not flushed is lost.

    Args:
        path: Path of a file that does not exist yet.
        about: Facts about the recording, as text by name.
        began: Robot time at which the file begins, s: the file's own clock shows *wall* then.
        wall: The date and time of that moment.
        scene: The simulated world as TOML, if there is one.

    Raises:
        ArgumentError: A file of this name exists.
        OSError: The file cannot be opened.
    """

    def __init__(
        self, path: str | os.PathLike[str], about: Mapping[str, str], began: float, wall: datetime, scene: str = ""
    ) -> None:
        check_mcap()
        try:
            # Without a buffer, written bytes are with the operating system at once, and a chunk is one write.
            self._stream = open(path, "xb", buffering=0)  # noqa: SIM115  # closed in finish()
        except FileExistsError:
            raise exists(path) from None
        self._epoch = nanoseconds_of(wall) - round(began * 1e9)
        self._channels: dict[tuple[str, str], int] = {}
        self._is_broken = False
        try:
            self._writer = McapWriter(self._stream, f"elib {version('elib-epuck')}")
            self._writer.add_metadata(ABOUT, about)
            if scene:
                self._writer.add_attachment(nanoseconds_of(wall), WORLD_FILE, "application/toml", scene.encode())
        except BaseException:
            self._stream.close()
            raise

    @property
    def size(self) -> int:
        """Number of bytes that were flushed."""
        return self._writer.size

    @property
    def pending(self) -> int:
        """Number of bytes that wait for the next flush, before compression."""
        return self._writer.pending

    @property
    def count(self) -> int:
        """Number of messages so far."""
        return self._writer.count

    def write(self, message: Message) -> None:
        """Add a message to the chunk that is being filled."""
        time, topic, data, reading, _ = message
        channel = self._channels.get((topic.name, reading)) or self._register(message)
        nanoseconds = self._epoch + round(time * 1e9)
        if nanoseconds < 0:  # a robot's clock may show any time, but the file's clock begins in 1970
            nanoseconds = 0
        if not isinstance(data, bytes):
            if "timestamp" in _properties(topic.schema):
                data = {"timestamp": {"sec": nanoseconds // 10**9, "nsec": nanoseconds % 10**9}, **data}
            data = encoded(data)
        self._writer.add_message(channel, nanoseconds, data)

    def flush(self) -> None:
        """End the chunk and write it: from now on it is in the file even if the program dies."""
        try:
            self._writer.flush()
        except BaseException:
            self._is_broken = True
            raise

    def finish(self) -> None:
        """Write the index and close the file. It is safe to call this again."""
        if self._stream.closed:
            return
        try:
            if not self._is_broken:  # readers cannot use an index after half a chunk
                self._writer.finish()
        finally:
            self._stream.close()

    def _register(self, message: Message) -> int:
        topic, reading, value = message.topic, message.reading, message.value
        schema = topic.schema
        if schema is None:
            schema = schema_of({} if value is None else fields_of(value), reading)
        name = topic.schema_name + "".join(word.capitalize() for word in reading.split("_"))
        channel = self._writer.register(topic.name + reading, name, json.dumps(schema).encode())
        self._channels[topic.name, reading] = channel
        return channel


def schema_of(data: Mapping[str, object], title: str) -> Schema:
    """Return the JSON schema of a reading; each of its fields may be null."""
    kinds = {bool: "boolean", int: "integer", float: "number", str: "string", list: "array"}
    properties: Schema = {
        # A field with an int may hold a float in the next message: the schema says number for both.
        name: {"type": [{"integer": "number"}.get(kind, kind), "null"]}
        if (kind := kinds.get(type(value))) is not None
        else {}
        for name, value in data.items()
    }
    return {"type": "object", "title": title, "properties": properties}


def exists(path: str | os.PathLike[str]) -> ArgumentError:
    """Return the error for a recording whose file exists."""
    return ArgumentError(f"{os.fspath(path)!r} exists; a recording never replaces a file", hint="choose another name")


def nanoseconds_of(moment: datetime) -> int:
    """Return a moment in nanoseconds since 1970."""
    passed = moment - datetime(1970, 1, 1, tzinfo=UTC)
    return (passed.days * 86_400 + passed.seconds) * 10**9 + passed.microseconds * 1000


def _properties(schema: Schema | None) -> Mapping[str, object]:
    found = {} if schema is None else schema.get("properties")
    return found if isinstance(found, dict) else {}
