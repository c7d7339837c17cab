"""Reads recordings, and counts what they hold; a file that was cut off is read up to its last whole chunk."""

from __future__ import annotations

import base64
import math
import os
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, cast

import msgspec
from msgspec.json import Decoder

from elib.base.errors import ArgumentError
from elib.base.files import open_file, reason_of
from elib.base.plaintext import html_table
from elib.base.pose import Pose
from elib.records.mcapfile import check_mcap, part_of
from elib.records.mcapwriter import CHANNEL, MAGIC, MESSAGE, MOST_PACKED, SCHEMA
from elib.records.tables import FIXED, Row, Table, Tabulator, arrays, names_of, topics_of
from elib.records.topics import (
    ABOUT,
    BYTES,
    FORMAT,
    LARGEST_NUMBER,
    MEASURED,
    NOTES,
    ODOMETRY,
    WORLD_FILE,
    Data,
    Time,
    decoder_of,
)

LARGEST_CHUNK = 1 << 24
"""Bytes of an unpacked chunk. A larger one is damaged: chunks of elib have 1 MiB, those of other tools 4 MiB."""
LARGEST_RECORD = LARGEST_CHUNK + (1 << 16)
"""Bytes of any other record. A longer one is damaged, too."""
LARGEST_MESSAGE = 1 << 22
"""Bytes. A picture has 52 KB, and a world of ten thousand robots 600 KB."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One message of a recording.

    Attributes:
        time: s on the robot's clock.
        topic: Name of the topic, such as ``/calls`` or ``/readings/proximity``.
        data: The fields of the message, as the topic's schema has them.
    """

    time: float
    topic: str
    data: Mapping[str, Any]

    @property
    def pose(self) -> Pose:
        """The pose that a message of ``/pose/odometry`` or ``/pose/measured`` holds."""
        place = self.data["pose"]["position"]
        return Pose(place["x"], place["y"], self.data["heading"], time=self.time)

    @property
    def transfer(self) -> Transfer:
        """The bytes that a message of ``/bytes`` holds."""
        return Transfer(self.time, bool(self.data["to_robot"]), base64.b64decode(self.data["data"]))


@dataclass(frozen=True, slots=True)
class Transfer:
    """Bytes that were sent over the line.

    Attributes:
        time: s on the robot's clock.
        to_robot: Whether they were sent to the robot; otherwise the robot sent them.
        data: The bytes.
    """

    time: float
    to_robot: bool
    data: bytes


@dataclass(slots=True)
class Health:
    """The state of a file.

    Attributes:
        is_complete: Whether the file was closed properly, with its index.
        damaged: Number of chunks and messages that could not be read.
        messages: Number of messages that could be read.
        ends_at: Number of bytes of the file that could be read.
    """

    is_complete: bool = False
    damaged: int = 0
    messages: int = 0
    ends_at: int = 0


class Recording:
    """A recording of one file or several parts. Each method reads the files from disk.

    Args:
        path: Path of the file, or of the first part to read. If the first parts were not kept, the name of the first
            part leads to the others.

    Attributes:
        paths: Paths of the parts, in order.
        about: Facts about the recording, as text by name: ``robot``, ``url``, ``firmware``, ``began`` and so on.
        scene: The simulated world as TOML; empty if there is none.
        began: When the recording began, s on the robot's clock.

    Raises:
        ArgumentError: The file does not exist, or is not a recording of elib.
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
            raise ArgumentError(f"{os.fspath(path)!r} is not a recording of elib: it does not say what was recorded")
        if self.about.get("format") != FORMAT:
            raise ArgumentError(
                f"{os.fspath(path)!r} has format {self.about.get('format')!r}; this version of elib reads {FORMAT}",
                hint="install a newer elib",
            )
        for key, (number, what) in NUMBERS.items():
            try:
                value = number(self.about.get(key, "0" if key != "began" else ""))
            except ValueError:
                value = math.nan
            if not abs(value) < (MOST_SEEDS if key == "seed" else LARGEST_NUMBER):
                raise ArgumentError(f"{os.fspath(path)!r} is damaged: it does not say {what}")
        for key, what in WORDS.items():
            if key not in self.about:
                raise ArgumentError(f"{os.fspath(path)!r} is damaged: it does not say {what}")
        self.began = float(self.about["began"])

    @property
    def name(self) -> str:
        """Name of the first file."""
        return self.paths[0].name

    def entries(self, *topics: str, health: Health | None = None) -> Iterator[Entry]:
        """Yield the messages in the order in which they were written.

        Args:
            topics: Topics to yield; all topics if none are given. ``/readings/`` stands for all readings.
            health: If given, the state of the files is noted here.
        """
        for path in self.paths:
            yield from self.entries_of(path, *topics, health=health)

    def entries_of(self, path: Path, *topics: str, health: Health | None = None) -> Iterator[Entry]:
        """Yield the messages of one part; see :meth:`entries`."""
        health = Health() if health is None else health
        wanted: dict[int, tuple[str, Decoder[Any]]] = {}
        for record in records_of(path, health):
            kind = type(record).__name__
            if kind == "Channel":
                if not topics or any(_is_meant(record.topic, topic) for topic in topics):
                    wanted[record.id] = record.topic, decoder_of(record.topic)
            elif kind == "Message" and record.channel_id in wanted:
                topic, decoder = wanted[record.channel_id]
                data = _data_of(record.data, decoder)
                if data is None:
                    health.damaged += 1
                else:
                    yield Entry(data["time"], topic, data)

    def exchange(self) -> list[Transfer]:
        """Return every byte that went over the line, in order."""
        return [entry.transfer for entry in self.entries(BYTES.name)]

    def tables(self, *names: str) -> dict[str, Table]:
        """Return tables of what was recorded: each is an array for each column, as ``pandas.DataFrame`` takes it.

        Args:
            names: ``proximity`` or another reading, ``calls``, ``notes``, ``odometry``, ``measured`` or ``world``; all
                tables that have rows if none are given.
        """
        tabulator = Tabulator(self.about)
        batches: dict[str, list[list[Row]]] = {}
        for name, rows in tabulator.batches(self.entries(*topics_of(names or (*FIXED, "")))):
            batches.setdefault(name, []).append(rows)
        return {name: arrays(tabulator.columns[name], batches[name]) for name in names or batches if name in batches}

    def __getitem__(self, name: str) -> Table:
        """Return one table; see :meth:`tables`.

        Raises:
            ArgumentError: The recording does not have such a reading.
        """
        found = self.tables(name)
        if name in found:
            return found[name]
        if name in FIXED:
            return arrays(FIXED[name], [])
        raise ArgumentError(f"{self.name} has no table {name!r}", hint=f"it has {', '.join(self.table_names())}")

    def table_names(self) -> list[str]:
        """Return the names of the tables that have rows."""
        return names_of(summary_of(self).messages)

    def path(self, *, measured: bool) -> list[Pose]:
        """Return the poses of the robot: those measured from outside, or those by its step counters."""
        return [entry.pose for entry in self.entries(MEASURED.name if measured else ODOMETRY.name)]

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} of {self.about['robot']}>"

    def _repr_html_(self) -> str:
        """Show what the recording holds in a notebook."""
        summary = summary_of(self)
        rows: list[tuple[str, str]] = []
        rows += [(name, self.about[name]) for name in ("robot", "url", "firmware", "world") if name in self.about]
        rows.append(("duration", f"{summary.duration:.1f} s of robot time"))
        if not summary.is_complete:
            rows.append(("state", "not complete"))
        counts = ", ".join(f"{topic.removeprefix('/')} {count}" for topic, count in sorted(summary.messages.items()))
        rows += [("messages", counts), ("tables", ", ".join(names_of(summary.messages)))]
        return html_table(rows, f"recording {self.name}")


def read_recording(path: str | os.PathLike[str]) -> Recording:
    """Open a recording; see :class:`Recording`."""
    return Recording(path)


@dataclass(frozen=True, slots=True)
class FileSummary:
    """One file of a recording.

    Attributes:
        path: Path of the file.
        size: Size of the file, bytes.
        health: State of the file.
    """

    path: Path
    size: int
    health: Health


@dataclass(slots=True)
class Summary:
    """A recording in numbers.

    Attributes:
        about: Facts about the recording, as text by name.
        parts: The files of the recording.
        messages: Number of messages by topic.
        first: Time of the first message, s on the robot's clock; the opening of the link may be before the beginning.
        last: Time of the last message, s on the robot's clock.
        notes: The notes, in order.
    """

    about: dict[str, str]
    parts: list[FileSummary]
    messages: Counter[str] = field(default_factory=Counter)
    first: float = 0.0
    last: float = 0.0
    notes: list[Entry] = field(default_factory=list)

    @property
    def duration(self) -> float:
        """Robot time from the beginning to the last message, s."""
        return max(0.0, self.last - float(self.about["began"]))

    @property
    def is_complete(self) -> bool:
        """Whether every part was closed properly and is not damaged."""
        return all(part.health.is_complete and not part.health.damaged for part in self.parts)

    def rate(self, topic: str) -> float:
        """Return the messages of a topic per second of robot time; 0 if no time passed."""
        return self.messages[topic] / self.duration if self.duration else 0.0


def summary_of(recording: Recording) -> Summary:
    """Read a whole recording and count what it holds."""
    summary = Summary(dict(recording.about), [])
    times: list[float] = [recording.began]
    for path in recording.paths:
        health = Health()
        for entry in recording.entries_of(path, health=health):
            summary.messages[entry.topic] += 1
            times = [min(times[0], entry.time), max(times[-1], entry.time)]
            if entry.topic == NOTES.name:
                summary.notes.append(entry)
        summary.parts.append(FileSummary(path, path.stat().st_size, health))
    summary.first, summary.last = times[0], times[-1]
    return summary


NUMBERS: Mapping[str, tuple[Callable[[str], float], str]] = {
    "began": (float, "when it began"),
    "seed": (int, "which seed its world has"),
    "robot_index": (int, "which robot of its world it was"),
    "calls_before": (int, "how many calls were before it"),
}
WORDS: Mapping[str, str] = {"robot": "which robot it was", "firmware": "which firmware the robot ran"}
"""Facts that a recording must have: numbers and words, each with what it says."""
MOST_SEEDS = 1 << 64


def records_of(path: Path, health: Health, *, only_header: bool = False) -> Iterator[Any]:
    """Yield the records of an MCAP file, also those inside chunks, as far as they are whole.

    Args:
        path: Path of the file.
        health: The state of the file is noted here.
        only_header: Stop at the first chunk.

    Raises:
        ArgumentError: The file cannot be read, or is not an MCAP file.
    """
    from mcap.exceptions import McapError
    from mcap.stream_reader import StreamReader

    try:
        stream = open_file(path)
    except (OSError, ValueError) as error:
        raise ArgumentError(f"{os.fspath(path)!r} cannot be read: {reason_of(error)}") from None
    with stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise ArgumentError(
                f"{os.fspath(path)!r} is not an MCAP file", hint="robot.record(FILE) and elib record FILE write them"
            )
        stream.seek(0)
        size = os.fstat(stream.fileno()).st_size
        reader = StreamReader(cast("Any", _Bounded(stream, size)), emit_chunks=True, record_size_limit=LARGEST_RECORD)
        try:
            for record in reader.records:
                kind = type(record).__name__
                if kind != "Chunk":
                    yield record
                elif only_header:
                    return
                else:
                    try:
                        for part in _parts_in(_unpacked(cast("Any", record))):
                            health.messages += type(part).__name__ == "Message"
                            yield part
                    except _Damaged:
                        health.damaged += stream.tell() < size  # the last chunk is cut off, not damaged
                        continue
                health.ends_at = stream.tell()
            health.is_complete, health.ends_at = True, stream.tell()
        except (McapError, EOFError, struct.error, ValueError, UnicodeDecodeError):
            return  # the file is cut off here; all whole records were yielded


class _Damaged(Exception):
    """A chunk cannot be read."""


class _Bounded:
    """A file that never returns more than it has: a damaged length must not make the reader fill the memory."""

    def __init__(self, stream: BinaryIO, size: int) -> None:
        self._stream, self._size = stream, size

    def read(self, length: int) -> bytes:
        """Return *length* bytes, or what is left; never more than a record may have."""
        return self._stream.read(max(0, min(length, LARGEST_RECORD, self._size - self._stream.tell())))


def _unpacked(chunk: Any) -> bytes:
    """Return the unpacked records of a chunk.

    Raises:
        _Damaged: The data do not match the chunk's header, or would unpack to far more: a few bytes can claim to be
            gigabytes.
    """
    size = chunk.uncompressed_size
    if size > LARGEST_CHUNK or (chunk.compression and size > MOST_PACKED * len(chunk.data)):
        raise _Damaged
    try:
        data = _DECOMPRESSORS[chunk.compression](chunk.data, size)
    except Exception:  # damaged data can raise anything in a decompressor
        raise _Damaged from None
    # A chunk without a checksum has 0 there; it is refused.
    if len(data) != size or zlib.crc32(data) != chunk.uncompressed_crc or not chunk.uncompressed_crc:
        raise _Damaged
    return data


def _unpack_zstd(data: bytes, size: int) -> bytes:
    import zstandard

    if zstandard.frame_content_size(data) > size:  # zstandard would allocate that much
        raise _Damaged
    return zstandard.ZstdDecompressor(max_window_size=LARGEST_CHUNK).decompress(data, max_output_size=size)


def _unpack_lz4(data: bytes, size: int) -> bytes:
    import lz4.frame

    found: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    return found


_DECOMPRESSORS: Mapping[str, Callable[[bytes, int], bytes]] = {
    "": lambda data, size: data,
    "zstd": _unpack_zstd,
    "lz4": _unpack_lz4,
}


def _parts_in(data: bytes) -> Iterator[Any]:
    """Yield the schemas, channels and messages of a chunk one by one: there may be half a million.

    Raises:
        _Damaged: A record is not whole.
    """
    from mcap.records import Channel, Message, Schema

    place = 0
    try:
        while place < len(data):
            kind, length = _HEAD.unpack_from(data, place)
            begin, place = place + _HEAD.size, place + _HEAD.size + length
            if place > len(data):
                raise _Damaged
            if kind == MESSAGE:
                channel, sequence, logged, published = _MESSAGE.unpack_from(data, begin)
                yield Message(channel, logged, data[begin + _MESSAGE.size : place], published, sequence)
            elif kind == CHANNEL:
                number, schema = struct.unpack_from("<HH", data, begin)
                topic, then = _text_at(data, begin + 4)
                encoding, _ = _text_at(data, then)
                yield Channel(number, topic, encoding, {}, schema)
            elif kind == SCHEMA:
                (number,) = struct.unpack_from("<H", data, begin)
                name, then = _text_at(data, begin + 2)
                encoding, then = _text_at(data, then)
                (length,) = struct.unpack_from("<I", data, then)
                yield Schema(number, data[then + 4 : then + 4 + length], encoding, name)
    except (struct.error, UnicodeDecodeError):
        raise _Damaged from None


def _text_at(data: bytes, place: int) -> tuple[str, int]:
    """Return a text inside a record, and the position after it."""
    (length,) = struct.unpack_from("<I", data, place)
    end = place + 4 + length
    return data[place + 4 : end].decode(), end


_HEAD, _MESSAGE = struct.Struct("<BQ"), struct.Struct("<HIQQ")


def _parts(path: Path) -> list[Path]:
    """Return the paths of all parts of the recording that begins with *path*."""
    if not path.name:
        raise ArgumentError(f"{os.fspath(path)!r} is a folder, not a recording", hint="name a file that ends in .mcap")
    stem, _, number = path.stem.rpartition(".part")
    first = path.with_name(stem + path.suffix) if stem and number.isdecimal() else path
    if first is path and not path.exists():
        # Perhaps the first parts were not kept.
        names = (each.stem.rpartition(".part")[2] for each in path.parent.glob(f"*.part*{path.suffix}"))
        there = (int(name) for name in names if name.isdecimal() and part_of(path, int(name)).exists())
        path = part_of(first, start) if (start := min(there, default=0)) else path
    found = [path]
    begin = int(path.stem.rpartition(".part")[2]) if path != first else 1
    while (part := part_of(first, begin + len(found))).exists():
        found.append(part)
    return found


def _data_of(content: bytes, decoder: Decoder[Any]) -> dict[str, Any] | None:
    """Return the data of a message; None if it is damaged."""
    if len(content) > LARGEST_MESSAGE:
        return None
    try:
        data = decoder.decode(content)
        if isinstance(data, Data):
            data = msgspec.to_builtins(data)
        else:
            data["time"] = msgspec.convert(data["time"], Time)
    except (msgspec.MsgspecError, KeyError, RecursionError):
        return None
    return cast("dict[str, Any]", data)


def _is_meant(topic: str, wanted: str) -> bool:
    return topic == wanted or (wanted.endswith("/") and topic.startswith(wanted))
