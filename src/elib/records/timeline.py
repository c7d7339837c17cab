"""A recording as lines for a person: one line for each call and each note."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from elib.base.pose import Pose
from elib.records.encoding import numbers_in, skipped_fields
from elib.records.reader import Entry, Recording
from elib.records.topics import CALLS, MEASURED, NOTES, ODOMETRY, OUTCOMES, PICTURES, READINGS

KINDS = ("call", "note", "state", "link", "robot", "recorder")
"""Kinds of moments; all except ``call`` are kinds of notes."""


@dataclass(frozen=True, slots=True)
class Moment:
    """Something that happened."""

    time: float  # s since the recording began
    kind: str  # one of KINDS
    text: str  # what happened, in one line
    is_bad: bool = False  # whether it went wrong
    readings: Mapping[str, tuple[float, ...]] = field(default_factory=dict)  # the numbers of the readings, by name
    speed: tuple[float, float] | None = None  # wheel speeds that the call set, rev/s; None if it set none
    pose: Pose | None = None  # last known pose of the robot, measured if possible


def timeline(recording: Recording, kinds: Sequence[str] = KINDS) -> Iterator[Moment]:
    """Yield what happened, in order of the ends of calls."""
    assembler = _Assembler(recording.began)
    topics = (CALLS, OUTCOMES, READINGS, PICTURES, MEASURED, ODOMETRY, NOTES)
    for entry in recording.entries(*(topic.name for topic in topics)):
        yield from (moment for moment in assembler.take(entry) if moment.kind in kinds)
    yield from (moment for moment in assembler.end() if moment.kind in kinds)


class _Assembler:
    """Puts the messages of a call together."""

    def __init__(self, began: float) -> None:
        self._began = began
        self._skipped = skipped_fields()
        self._calls: dict[int, tuple[float, str, tuple[int, ...]]] = {}
        self._outcome: Entry | None = None
        self._read: dict[str, tuple[float, ...]] = {}
        self._shown: list[str] = []
        self._pose: Pose | None = None
        self._is_measured = False

    def take(self, entry: Entry) -> Iterator[Moment]:
        """Take a message; yield the moments that it completes."""
        topic, data = entry.topic, entry.data
        if topic.startswith(READINGS.name):
            self._take_reading(topic.removeprefix(READINGS.name), data)
        elif topic == PICTURES.name:
            self._shown.append(f"{data['width']}x{data['height']} {data['encoding']}")
        elif topic == MEASURED.name or (topic == ODOMETRY.name and not self._is_measured):
            self._pose, self._is_measured = entry.pose, topic == MEASURED.name
        elif topic == CALLS.name:
            yield from self._finished()
            self._calls[data["call"]] = entry.time, data["text"], tuple(data["arguments"])
        elif topic == OUTCOMES.name:
            yield from self._finished()
            self._outcome = entry
        elif topic == NOTES.name:
            yield from self._finished()
            kind = data["name"] if data["name"] in KINDS else "note"
            yield Moment(entry.time - self._began, kind, data["message"], data["level"] > 2, pose=self._pose)

    def _take_reading(self, name: str, data: Mapping[str, Any]) -> None:
        """Add a reading to the call whose outcome came last."""
        self._read[name] = tuple(numbers_in(data, self._skipped).values())
        words = " ".join(_short(value) for key, value in data.items() if key not in self._skipped and value is not None)
        is_one_of_several = bool(self._shown) or (
            self._outcome is not None and self._outcome.data["command"] == "sensors"
        )
        self._shown.append(f"{name} {words}" if is_one_of_several else words)

    def end(self) -> Iterator[Moment]:
        """Yield what is left, also calls without an outcome."""
        yield from self._finished()
        for time, text, _ in self._calls.values():
            yield Moment(time - self._began, "call", f"{text}  no outcome was recorded", is_bad=True, pose=self._pose)

    def _finished(self) -> Iterator[Moment]:
        """Yield the call whose outcome came last, with its readings."""
        outcome, self._outcome = self._outcome, None
        shown, self._shown = self._shown, []
        read, self._read = self._read, {}
        if outcome is None:
            return
        data = outcome.data
        _, text, arguments = self._calls.pop(data["call"], (0.0, f"{data['command']}()", ()))
        speed = None
        if data["ok"] and data["command"] == "set_speed" and len(arguments) == 2:  # otherwise the call is damaged
            speed = arguments[0] / 1000, arguments[1] / 1000
        elif data["ok"] and data["command"] in ("stop", "reset"):
            speed = 0.0, 0.0
        said = f"ok, {1000 * data['waited']:.1f} ms" if data["ok"] else str(data["error"]).partition("\n")[0]
        values = f": {', '.join(shown)}" if shown else ""
        yield Moment(
            outcome.time - self._began, "call", f"{text}  {said}{values}", not data["ok"], read, speed, self._pose
        )


def _short(value: object) -> str:
    if isinstance(value, list):
        return " ".join(map(_short, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)
