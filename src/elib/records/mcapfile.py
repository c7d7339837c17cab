"""The files of a recording while they are written: one MCAP file (https://mcap.dev), or parts that follow each other.

A file that is cut off is readable up to its last whole chunk.
"""

from __future__ import annotations

import importlib.util
import json
import os
import platform
from collections import deque
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from importlib.metadata import version
from pathlib import Path

from elib.base.errors import ArgumentError, Unsupported
from elib.base.extras import install
from elib.link.session import Noted
from elib.records.mcapwriter import McapWriter
from elib.records.messages import WARNING, Event, Message, Translator, channel_of, json_of
from elib.records.topics import ABOUT, WORLD_FILE


def check_mcap() -> None:
    """Check that recordings can be read and written here."""
    if importlib.util.find_spec("mcap") is None:
        raise Unsupported("recordings need the package mcap, which is not installed", hint=install("record"))


def versions() -> dict[str, str]:
    """Return the versions of the programs that write a recording."""
    return {
        "elib": version("elib-epuck"),
        "python": platform.python_version(),
        "platform": platform.platform(terse=True),
    }


class McapFile(McapWriter):
    """A recording file that grows. If the program dies, only what was not flushed is lost.

    Args:
        path: Path of a file that does not exist yet.
        about: Facts about the recording, as text by name.
        began: Robot time at which the file begins, s: the file's own clock shows *wall* then.
        wall: The date and time of that moment.
        scene: The simulated world as TOML, if there is one.
    """

    def __init__(
        self, path: str | os.PathLike[str], about: Mapping[str, str], began: float, wall: datetime, scene: str = ""
    ) -> None:
        check_mcap()
        try:
            # Without a buffer, written bytes are with the operating system at once, and a chunk is one write.
            stream = open(path, "xb", buffering=0)  # noqa: SIM115  # closed in finish()
        except FileExistsError:
            raise exists(path) from None
        self._epoch = nanoseconds_of(wall) - round(began * 1e9)
        self._numbers: dict[tuple[str, str], int] = {}
        self._is_broken = False
        try:
            super().__init__(stream, f"elib {version('elib-epuck')}")
            self.add_metadata(ABOUT, about)
            if scene:
                self.add_attachment(nanoseconds_of(wall), WORLD_FILE, "application/toml", scene.encode())
        except BaseException:
            stream.close()
            raise

    def write(self, message: Message) -> None:
        """Add a message to the chunk that is being filled."""
        channel = self._numbers.get((message.topic.name, message.reading)) or self._register(message)
        nanoseconds = self._epoch + round(message.time * 1e9)
        if nanoseconds < 0:  # a robot's clock may show any time, but the file's clock begins in 1970
            nanoseconds = 0
        self.add_message(channel, nanoseconds, json_of(message, nanoseconds))

    def flush(self) -> None:
        """End the chunk and write it: from now on it is in the file even if the program dies."""
        try:
            super().flush()
        except BaseException:
            self._is_broken = True
            raise

    def finish(self) -> None:
        """Write the index and close the file. It is safe to call this again."""
        if self._stream.closed:
            return
        try:
            if not self._is_broken:  # readers cannot use an index after half a chunk
                super().finish()
        finally:
            self._stream.close()

    def _register(self, message: Message) -> int:
        topic, schema_name, schema = channel_of(message)
        channel = self.register(topic, schema_name, json.dumps(schema).encode())
        self._numbers[message.topic.name, message.reading] = channel
        return channel


class Parts:
    """Writes one file, or one part after the other. It is used in the thread of the recorder."""

    def __init__(
        self,
        path: Path,
        about: Mapping[str, str],
        began: float,
        scene: str,
        part_bytes: int | None,
        part_seconds: float | None,
        keep: int | None,
    ) -> None:
        self._path, self._about, self._scene = path, about, scene
        self._part_bytes, self._part_seconds, self._keep = part_bytes, part_seconds, keep
        self._translator = Translator()
        self._wall = datetime.now(UTC)
        self._first = self._began = began
        self._number = 0
        self._kept: deque[Path] = deque()
        self._before = (0, 0)
        self._file = self._next(began)

    @property
    def messages(self) -> int:
        """Number of messages in all parts."""
        return self._before[0] + self._file.count

    @property
    def size(self) -> int:
        """Size of all parts, bytes."""
        return self._before[1] + self._file.size

    def write(self, batch: list[tuple[float, Event]], dropped: int) -> None:
        """Write and flush a batch of events."""
        if dropped:
            text = f"{dropped} events were lost: they came faster than they could be written"
            batch.append((batch[-1][0], Noted(text, "recorder", WARNING)))
        messages = self._translator.messages
        for time, event in batch:
            if self._part_seconds is not None and time - self._began >= self._part_seconds:
                self._turn(time)
            for message in messages(time, event):
                self._file.write(message)
            if self._part_bytes is not None and self._file.pending >= self._part_bytes:
                self._flush(time)
        self._flush(batch[-1][0])

    def finish(self) -> None:
        """Close the newest part."""
        self._file.finish()

    def _flush(self, time: float) -> None:
        self._file.flush()
        if self._part_bytes is not None and self._file.size >= self._part_bytes:
            self._turn(time)

    def _turn(self, time: float) -> None:
        self._file.finish()
        before, file = (self.messages, self.size), self._next(time)
        self._before, self._file = before, file

    def _next(self, began: float) -> McapFile:
        self._number += 1
        self._began = began
        path = self._path if self._number == 1 else part_of(self._path, self._number)
        wall = self._wall + timedelta(seconds=began - self._first)
        about = {**self._about, "part": str(self._number), "part_began": repr(began), "wall": wall.isoformat()}
        file = McapFile(path, about, began, wall, self._scene)
        self._kept.append(path)
        if self._keep is not None and len(self._kept) > self._keep:
            self._kept.popleft().unlink(missing_ok=True)
        return file


def part_of(path: Path, number: int) -> Path:
    """Return the name of a later part of a recording."""
    return path.with_name(f"{path.stem}.part{number}{path.suffix}")


def exists(path: str | os.PathLike[str]) -> ArgumentError:
    """Return the error for a recording whose file exists."""
    return ArgumentError(f"{os.fspath(path)!r} exists; a recording never replaces a file", hint="choose another name")


def nanoseconds_of(moment: datetime) -> int:
    """Return a moment in nanoseconds since 1970."""
    passed = moment - datetime(1970, 1, 1, tzinfo=UTC)
    return (passed.days * 86_400 + passed.seconds) * 10**9 + passed.microseconds * 1000
