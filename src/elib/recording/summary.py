"""Summary of a recording: what it holds, how much, and whether it is complete."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from elib.recording.reader import Entry, Health, Recording
from elib.recording.topics import NOTES


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
