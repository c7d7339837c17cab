"""Recordings read back: to the last chunk that is whole, wherever the file ends."""

from __future__ import annotations

import base64
import json
import os
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, cast

from elib.errors import ArgumentError
from elib.pose import Pose
from elib.recording.mcapfile import check_mcap
from elib.recording.recorder import part_of
from elib.recording.topics import ABOUT, BYTES, FORMAT, MEASURED, ODOMETRY, WORLD_FILE

LARGEST_RECORD = 1 << 28
"""Bytes. What claims to be longer is damage: chunks have 1 MiB, and a picture 38 KB."""
MAGIC = b"\x89MCAP0\r\n"


@dataclass(frozen=True, slots=True)
class Entry:
    """One message of a recording.

    Attributes:
        time: s on the robot's clock.
        topic: Such as ``/calls`` or ``/readings/proximity``.
        data: As its schema says.
    """

    time: float
    topic: str
    data: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Sent:
    """Bytes that went over the line.

    Attributes:
        time: s on the robot's clock.
        to_robot: To the robot, not from it.
        data: The bytes.
    """

    time: float
    to_robot: bool
    data: bytes


@dataclass(slots=True)
class Health:
    """In what state a file was found.

    Attributes:
        is_complete: It was closed in order, index and all.
        damaged: Chunks and messages that could not be read.
        messages: That could be read.
        ends_at: Bytes of the file that could be read.
    """

    is_complete: bool = False
    damaged: int = 0
    messages: int = 0
    ends_at: int = 0


class Recording:
    """A recording, of one file or several parts; read anew from disk whenever it is asked for something.

    Args:
        path: Of its file, or of the part to begin with; where the first ones were not kept, the first name will do.

    Attributes:
        paths: Its parts, in order.
        about: What was recorded, as text by name: ``robot``, ``url``, ``firmware``, ``began`` and so on.
        scene: The simulated world as TOML; empty if there is none.
        began: When it began, s on the robot's clock.

    Raises:
        ArgumentError: There is no such file, or it is no recording of elib.
        Unsupported: The package mcap is not installed.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        check_mcap()
        self.paths = _parts(Path(path))
        self.about: dict[str, str] = {}
        self.scene = ""
        for record in records_of(self.paths[0], Health(), only_header=True):
            kind = type(record).__name__
            if kind == "Metadata" and record.name == ABOUT:
                self.about = dict(record.metadata)
            elif kind == "Attachment" and record.name == WORLD_FILE:
                self.scene = record.data.decode("utf-8", "replace")
        if not self.about:
            raise ArgumentError(f"{os.fspath(path)!r} is no recording of elib: nothing in it says what was recorded")
        if self.about.get("format") != FORMAT:
            raise ArgumentError(
                f"{os.fspath(path)!r} has format {self.about.get('format')!r}; this version of elib reads {FORMAT}",
                hint="install a newer elib",
            )
        try:
            self.began = float(self.about["began"])
        except (KeyError, ValueError):
            raise ArgumentError(f"{os.fspath(path)!r} is damaged: it does not say when it began") from None

    @property
    def name(self) -> str:
        """Of its first file."""
        return self.paths[0].name

    def entries(self, *topics: str, health: Health | None = None) -> Iterator[Entry]:
        """Yield its messages in the order in which they were written.

        Args:
            topics: Those that are wanted, all if none are named; ``/readings/`` means all below it.
            health: Told what was found, if given.
        """
        for path in self.paths:
            yield from self.entries_of(path, *topics, health=health)

    def entries_of(self, path: Path, *topics: str, health: Health | None = None) -> Iterator[Entry]:
        """Yield the messages of one part; see :meth:`entries`."""
        health = Health() if health is None else health
        wanted: dict[int, str] = {}
        for record in records_of(path, health):
            kind = type(record).__name__
            if kind == "Channel":
                if not topics or any(_is_meant(record.topic, topic) for topic in topics):
                    wanted[record.id] = record.topic
            elif kind == "Message" and record.channel_id in wanted:
                try:
                    data = json.loads(record.data)
                    entry = Entry(float(data["time"]), wanted[record.channel_id], data)
                except (ValueError, KeyError, TypeError):
                    health.damaged += 1
                    continue
                yield entry

    def exchange(self) -> list[Sent]:
        """Return every byte that went over the line, in order."""
        return [sent_in(entry) for entry in self.entries(BYTES.name)]

    def path(self, *, measured: bool) -> list[Pose]:
        """Return where the robot was: as measured from outside, or by its step counters."""
        name = MEASURED.name if measured else ODOMETRY.name
        return [
            Pose(position["x"], position["y"], each.data["heading"], time=each.time)
            for each in self.entries(name)
            for position in (each.data["pose"]["position"],)
        ]


def sent_in(entry: Entry) -> Sent:
    """Return what a message of ``/bytes`` holds."""
    return Sent(entry.time, bool(entry.data["to_robot"]), base64.b64decode(entry.data["data"]))


def load(path: str | os.PathLike[str]) -> Recording:
    """Open a recording; see :class:`Recording`."""
    return Recording(path)


def records_of(path: Path, health: Health, *, only_header: bool = False) -> Iterator[Any]:
    """Yield the records of an MCAP file, those of chunks too, as far as they are whole.

    Args:
        path: Of the file.
        health: Told what was found.
        only_header: Stop at the first chunk.

    Raises:
        ArgumentError: It cannot be read, or is no MCAP file.
    """
    from mcap.exceptions import McapError
    from mcap.stream_reader import StreamReader, breakup_chunk

    try:
        stream = path.open("rb")
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise ArgumentError(f"{os.fspath(path)!r} cannot be read: {reason}") from None
    with stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise ArgumentError(
                f"{os.fspath(path)!r} is no MCAP file", hint="robot.record(FILE) and elib record FILE write them"
            )
        stream.seek(0)
        size = path.stat().st_size
        reader = StreamReader(cast("Any", _Bounded(stream, size)), emit_chunks=True, record_size_limit=LARGEST_RECORD)
        try:
            for record in reader.records:
                kind = type(record).__name__
                if kind != "Chunk":
                    yield record
                elif only_header:
                    return
                else:
                    chunk = cast("Any", record)
                    try:
                        if not chunk.uncompressed_crc:  # to the package it means that there is nothing to check
                            raise McapError("a chunk without a checksum")
                        parts = breakup_chunk(chunk, validate_crc=True)
                    except Exception:  # whatever a damaged chunk makes of its decompressor
                        health.damaged += stream.tell() < size  # the last one is cut, not damaged
                        continue
                    health.messages += sum(type(part).__name__ == "Message" for part in parts)
                    yield from parts
                health.ends_at = stream.tell()
            health.is_complete, health.ends_at = True, stream.tell()
        except (McapError, EOFError, struct.error, ValueError, UnicodeDecodeError):
            return  # it ends here: what is whole was yielded


class _Bounded:
    """A file of which nobody can ask for more than it has: a damaged length must not fill the memory."""

    def __init__(self, stream: BinaryIO, size: int) -> None:
        self._stream, self._size = stream, size

    def read(self, length: int) -> bytes:
        """Return so many bytes, or what is left."""
        return self._stream.read(min(length, self._size - self._stream.tell()))


def _parts(path: Path) -> list[Path]:
    """Return all parts of the recording that begins with *path*."""
    stem, _, number = path.stem.rpartition(".part")
    first = path.with_name(stem + path.suffix) if stem and number.isdecimal() else path
    if first is path and not path.exists():
        # Its first parts were not kept, perhaps.
        names = (each.stem.rpartition(".part")[2] for each in path.parent.glob(f"*.part*{path.suffix}"))
        there = (int(name) for name in names if name.isdecimal() and part_of(path, int(name)).exists())
        path = part_of(first, start) if (start := min(there, default=0)) else path
    found = [path]
    begin = int(path.stem.rpartition(".part")[2]) if path != first else 1
    while (part := part_of(first, begin + len(found))).exists():
        found.append(part)
    return found


def _is_meant(topic: str, wanted: str) -> bool:
    return topic == wanted or (wanted.endswith("/") and topic.startswith(wanted))


__all__ = ["Entry", "Health", "Recording", "Sent", "load", "records_of"]
