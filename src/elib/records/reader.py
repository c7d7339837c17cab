"""Reads recordings, and counts what they hold; a file that was cut off is read up to its last whole chunk."""

from __future__ import annotations

import base64
import os
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, cast

import msgspec
from msgspec.json import Decoder

from elib.base.errors import ArgumentError
from elib.base.plaintext import html_table
from elib.base.pose import Pose
from elib.records.mcapfile import check_mcap, part_of
from elib.records.mcapreader import Health, records_of
from elib.records.tables import FIXED, Row, Table, Tabulator, arrays, names_of, topics_of
from elib.records.topics import (
    ABOUT,
    BYTES,
    FORMAT,
    MEASURED,
    NOTES,
    ODOMETRY,
    WORLD_FILE,
    Data,
    Finite,
    Integer,
    Time,
    decoder_of,
)

MAX_MESSAGE = 1 << 22
"""Bytes. A picture has 52 KB, and a world of ten thousand robots 600 KB."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One message of a recording."""

    time: float  # s on the robot's clock
    topic: str  # name of the topic, such as `/calls` or `/readings/proximity`
    data: Mapping[str, Any]  # the fields of the message, as the topic's schema has them

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
    """Bytes that were sent over the line."""

    time: float  # s on the robot's clock
    to_robot: bool  # whether they were sent to the robot; otherwise the robot sent them
    data: bytes  # the bytes


FACTS: tuple[tuple[str, Any, str], ...] = (
    ("began", Finite, "when it began"),
    ("seed", Annotated[int, msgspec.Meta(ge=0)] | None, "which seed its world has"),
    ("robots", Annotated[int, msgspec.Meta(ge=1)] | None, "how many robots its world has"),
    ("robot_index", Integer | None, "which robot of its world it was"),
    ("calls_before", Integer | None, "how many calls were before it"),
    ("robot", str, "which robot it was"),
    ("firmware", str, "which firmware the robot ran"),
)
"""Facts that a recording must have, or may have: their names, what they are, and in words."""


class Recording:
    """A recording of one file or several parts. Each method reads the files from disk.

    Args:
        path: Path of the file, or of the first part to read. If the first parts were not kept, the name of the first
            part leads to the others.

    Raises:
        ArgumentError: The file does not exist, or is not a recording of elib.
        Unsupported: The package mcap is not installed.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        check_mcap()
        from mcap.records import Attachment, Metadata

        self.paths = _parts(Path(path))
        # facts about the recording, as text by name: `robot`, `url`, `firmware`, `began` and so on
        self.about: dict[str, str] = {}
        self.scene = ""  # the simulated world as TOML; empty if there is none
        for record in records_of(self.paths[0], Health(), only_header=True):
            match record:
                case Metadata() if record.name == ABOUT:
                    self.about = dict(record.metadata)
                case Attachment() if record.name == WORLD_FILE:
                    self.scene = record.data.decode("utf-8", "replace")
        if not self.about:
            raise ArgumentError(f"{os.fspath(path)!r} is not a recording of elib: it does not say what was recorded")
        if self.about.get("format") != FORMAT:
            raise ArgumentError(
                f"{os.fspath(path)!r} has format {self.about.get('format')!r}; this version of elib reads {FORMAT}",
                hint="install a newer elib",
            )
        for name, kind, what in FACTS:
            try:
                msgspec.convert(self.about.get(name), kind, strict=False)
            except msgspec.ValidationError:
                raise ArgumentError(f"{os.fspath(path)!r} is damaged: it does not say {what}") from None
        self.began = float(self.about["began"])  # when the recording began, s on the robot's clock

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
        health = Health() if health is None else health
        cut_off = 0
        for path in self.paths:
            health.is_complete = False
            yield from self.entries_of(path, *topics, health=health)
            cut_off += not health.is_complete
        health.is_complete = not cut_off

    def entries_of(self, path: Path, *topics: str, health: Health) -> Iterator[Entry]:
        """Yield the messages of one part; see :meth:`entries`."""
        from mcap.records import Channel, Message

        wanted: dict[int, tuple[str, Decoder[Any]]] = {}
        for record in records_of(path, health):
            if isinstance(record, Channel):
                folders = tuple(topic for topic in topics if topic.endswith("/"))
                if not topics or record.topic in topics or record.topic.startswith(folders):
                    wanted[record.id] = record.topic, decoder_of(record.topic)
            elif isinstance(record, Message) and record.channel_id in wanted:
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
        entries = self.entries(*topics_of(names or (*FIXED, "")))
        for name, rows in tabulator.batches((entry.topic, entry.data) for entry in entries):
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
    """One file of a recording."""

    path: Path
    size: int
    health: Health  # state of the file


@dataclass(slots=True)
class Summary:
    """A recording in numbers."""

    about: dict[str, str]  # facts about the recording, as text by name
    parts: list[FileSummary]  # the files of the recording
    messages: Counter[str] = field(default_factory=Counter)  # number of messages by topic
    # time of the first message, s on the robot's clock; the opening of the link may be before the beginning
    first: float = 0.0
    last: float = 0.0  # time of the last message, s on the robot's clock
    notes: list[Entry] = field(default_factory=list)  # the notes, in order

    @property
    def duration(self) -> float:
        """Robot time from the beginning to the last message, s."""
        return max(0.0, self.last - float(self.about["began"]))

    @property
    def is_complete(self) -> bool:
        """Whether every part was closed properly and is not damaged."""
        return all(part.health.is_whole for part in self.parts)

    def rate(self, topic: str) -> float:
        """Return the messages of a topic per second of robot time; 0 if no time passed."""
        return self.messages[topic] / self.duration if self.duration else 0.0


def summary_of(recording: Recording) -> Summary:
    """Read a whole recording and count what it holds."""
    summary = Summary(dict(recording.about), [], first=recording.began, last=recording.began)
    for path in recording.paths:
        health = Health()
        for entry in recording.entries_of(path, health=health):
            summary.messages[entry.topic] += 1
            summary.first, summary.last = min(summary.first, entry.time), max(summary.last, entry.time)
            if entry.topic == NOTES.name:
                summary.notes.append(entry)
        summary.parts.append(FileSummary(path, path.stat().st_size, health))
    return summary


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
    if len(content) > MAX_MESSAGE:
        return None
    try:
        data = decoder.decode(content)
        if isinstance(data, Data):
            data = msgspec.to_builtins(data)
        else:
            data["time"] = msgspec.convert(data["time"], Time)
    except (ValueError, KeyError, RecursionError):  # a bad byte is not an error of msgspec
        return None
    return cast("dict[str, Any]", data)
