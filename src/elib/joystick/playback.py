"""A recording in the panel: what the robot said, at the pace at which it said it. Nothing can be told to it."""

from __future__ import annotations

import asyncio
import base64
import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

from elib.pose import Pose
from elib.protocol import values as v
from elib.protocol.commands import SPECS
from elib.protocol.context import Context
from elib.protocol.image import Image
from elib.protocol.profiles import profile_named
from elib.protocol.quantities import CameraMode
from elib.recording.reader import Entry, Recording
from elib.recording.timeline import KINDS
from elib.recording.topics import CALLS, MEASURED, NOTES, ODOMETRY, OUTCOMES, PICTURES, READINGS
from elib.robot.snapshot import IMAGE
from elib.timebase import require_speed
from elib.transport.url import Url, speed_of

ORIGIN = "replay"


class Playback:
    """A recording, from its beginning to its end.

    Args:
        url: ``replay://FILE``.

    Attributes:
        recording: The recording.
        context: The firmware it was, and its lamps and camera as they had been set.
        on_reading: Called with the name and the value of each reading and picture, on the clock of the event loop.
        on_pose: Called with each place the robot was at.
        on_line: Called with kind, text and whether it was bad, for each line of the event log.

    Raises:
        ArgumentError: There is no such file, or it is no recording.
        SimulationError: The running event loop cannot run at the speed asked for.
        Unsupported: The package mcap is not installed.
    """

    def __init__(self, url: Url) -> None:
        require_speed(speed_of(url))
        self.recording = Recording(Path(url.target))
        self.context = Context(profile_named(self.recording.about.get("firmware", "")))
        self.on_reading: Callable[[str, v.Reading | Image], object] = lambda name, value: None
        self.on_pose: Callable[[Pose], object] = lambda pose: None
        self.on_line: Callable[[str, str, bool], object] = lambda kind, text, is_bad: None
        self._calls: dict[int, tuple[str, tuple[int, ...]]] = {}
        self._is_measured = False

    async def play(self) -> None:
        """Let everything happen when it happened."""
        loop = asyncio.get_running_loop()
        shift = loop.time() - self.recording.began
        topics = (READINGS, PICTURES, MEASURED, ODOMETRY, CALLS, OUTCOMES, NOTES)
        for entry in self.recording.entries(*(topic.name for topic in topics)):
            try:
                await asyncio.sleep(max(0.0, entry.time + shift - loop.time()))
                self._take(entry, entry.time + shift)
            except (KeyError, TypeError, ValueError, IndexError):  # a message that elib did not write
                continue

    def _take(self, entry: Entry, now: float) -> None:
        data, name = entry.data, entry.topic.removeprefix(READINGS.name)
        if name in v.READING_TYPES:
            self.on_reading(name, _reading(v.READING_TYPES[name], entry, now))
        elif entry.topic == PICTURES.name:
            self.on_reading(IMAGE, _picture(entry, now))
        elif entry.topic in (MEASURED.name, ODOMETRY.name):
            self._is_measured |= entry.topic == MEASURED.name
            if self._is_measured == (entry.topic == MEASURED.name):
                self.on_pose(dataclasses.replace(entry.pose, time=now))
        elif entry.topic == CALLS.name:
            self._calls[data["call"]] = str(data["text"]), tuple(map(int, data["arguments"]))
        elif entry.topic == OUTCOMES.name:
            self._ended(entry)
        elif entry.topic == NOTES.name:
            kind = str(data["name"])
            self.on_line(kind if kind in KINDS else "note", str(data["message"]), data["level"] > 2)

    def _ended(self, entry: Entry) -> None:
        """Note what a call has set; one that only read, or turned the wheels, is not worth a line."""
        data = entry.data
        text, arguments = self._calls.pop(data["call"], (f"{data['command']}()", ()))
        spec = SPECS.get(data["command"])
        if data["ok"]:
            if spec is not None and spec.remember is not None:
                spec.remember(arguments, self.context)
            if spec is None or spec.is_reading or spec.name == "set_speed":
                return
        self.on_line(
            "call", f"{text}: {'ok' if data['ok'] else str(data['error']).partition(chr(10))[0]}", not data["ok"]
        )


def _reading(kind: type[v.Reading], entry: Entry, now: float) -> v.Reading:
    """Return a reading by the fields of its message.

    Raises:
        KeyError: A field is missing.
        TypeError: One is no number.
    """
    names = [field.name for field in dataclasses.fields(kind) if field.name not in ("time", "origin")]
    fields = {name: _numbers(entry.data[name]) for name in names}
    return kind(**fields, time=now, origin=ORIGIN)


def _numbers(value: object) -> Any:
    if isinstance(value, list):
        return tuple(map(_numbers, value))
    if value is None or isinstance(value, int | float):
        return value
    raise TypeError("no number")


def _picture(entry: Entry, now: float) -> Image:
    width, height, pixels = int(entry.data["width"]), int(entry.data["height"]), base64.b64decode(entry.data["data"])
    is_grey = entry.data["encoding"] == "mono8"
    if len(pixels) != width * height * (1 if is_grey else 3):
        raise ValueError("a picture of another size than it says")
    if not is_grey:
        # Back to the 16 bits of the camera, from which they were stretched to 24.
        reds, greens, blues = pixels[0::3], pixels[1::3], pixels[2::3]
        words = (
            red >> 3 << 11 | green >> 2 << 5 | blue >> 3 for red, green, blue in zip(reds, greens, blues, strict=True)
        )
        pixels = b"".join(word.to_bytes(2, "big") for word in words)
    return Image(CameraMode.GREY if is_grey else CameraMode.COLOUR, width, height, pixels, time=now, origin=ORIGIN)


__all__ = ["Playback"]
