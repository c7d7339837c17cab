"""The files of a recording that is being written: one file, or parts that follow each other."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path

from elib.recording.mcapfile import McapFile
from elib.recording.messages import WARNING, Event, Noted, Translator

AT_ONCE = 8
"""Events that are written between two pauses for other threads, some 50 us: an answer waits no longer than that."""


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

    def write(self, batch: list[tuple[float, Event]], dropped: int, yield_gil: Callable[[], None]) -> None:
        """Write and flush a batch of events; call *yield_gil* between some of them."""
        if dropped:
            text = f"{dropped} events were lost: they came faster than they could be written"
            batch.append((batch[-1][0], Noted(text, "recorder", WARNING)))
        messages = self._translator.messages
        for number, (time, event) in enumerate(batch):
            if self._part_seconds is not None and time - self._began >= self._part_seconds:
                self._turn(time)
            for message in messages(time, event):
                self._file.write(message)
            if number % AT_ONCE == 0:
                yield_gil()
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
