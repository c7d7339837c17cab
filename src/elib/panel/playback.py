"""A recording in the panel: what the robot said, at the time at which it said it. Nothing can be sent to it."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import msgspec

from elib.base.pose import Pose
from elib.base.timebase import require_speed
from elib.link.protocol import values as v
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context
from elib.link.protocol.image import Image
from elib.link.protocol.profiles import profile_named
from elib.link.protocol.quantities import CameraMode
from elib.link.session import MachineBegan, Noted
from elib.link.transport.url import Url, speed_of
from elib.records.reader import Entry, Recording
from elib.records.timeline import KINDS
from elib.records.topics import (
    CALLS,
    LINK,
    MEASURED,
    NOTES,
    ODOMETRY,
    OUTCOMES,
    PICTURES,
    PROGRAM,
    READINGS,
    SCENE,
    WORLD,
)
from elib.robot.snapshot import IMAGE

ORIGIN = "replay"
TOPICS = (READINGS, PICTURES, MEASURED, ODOMETRY, CALLS, OUTCOMES, LINK, WORLD, SCENE, PROGRAM, NOTES)
AT_ONCE = 500
"""Messages that are shown at once before other tasks may run."""


class Playback:
    """A recording, from its beginning to its end.

    Attributes:
        at: How far it has been played, s from its beginning.
        length: How long it is, s; 0 until that is known.
    """

    def __init__(self, url: Url) -> None:
        require_speed(speed_of(url))
        self.recording = Recording(Path(url.target))
        # the firmware of the robot, and its LEDs and camera as they were set
        self.context = Context(profile_named(self.recording.about.get("firmware", "")))
        # called with the name and the value of each reading and picture, on the clock of the event loop
        self.on_reading: Callable[[str, v.Reading | Image], object] = lambda name, value: None
        self.on_pose: Callable[[Pose], object] = lambda pose: None  # called with each pose of the robot
        # called with kind, text and whether it is bad, for each line of the event log
        self.on_line: Callable[[str, str, bool], object] = lambda kind, text, is_bad: None
        # called with each line and each machine of states that began, as a link tells of them
        self.on_program: Callable[[Noted | MachineBegan], object] = lambda event: None
        # called with each message as it was recorded, and its time on the clock of the event loop
        self.on_entry: Callable[[Entry, float], object] = lambda entry, now: None
        self._calls: dict[int, tuple[str, tuple[int, ...]]] = {}
        self._is_measured = False
        self.at = self.length = 0.0
        self.is_paused = False  # whether it is held
        self._woken, self._sought = asyncio.Event(), asyncio.Event()

    async def play(self) -> None:
        """Let everything happen when it happened, until its end; :meth:`seek` begins again from another moment."""
        self.length = await asyncio.to_thread(self._measure)
        while True:
            self._sought.clear()
            await self._play_from(self.at)
            if not self._sought.is_set():
                return

    def seek(self, seconds: float) -> None:
        """Go on from another moment, s from the beginning."""
        self.at = min(max(0.0, seconds), self.length)
        self._sought.set()
        self._woken.set()

    def pause(self, *, on: bool) -> None:
        """Hold the recording, or let it go on."""
        self.is_paused = on
        self._woken.set()

    async def _play_from(self, start: float) -> None:
        """Show at once what was before *start*, and everything after it at its time."""
        loop = asyncio.get_running_loop()
        shift = loop.time() - self.recording.began - start
        for number, entry in enumerate(self.recording.entries(*(topic.name for topic in TOPICS))):
            if self._sought.is_set():
                return
            seconds = entry.time - self.recording.began
            if seconds < start:
                if number % AT_ONCE == 0:
                    await asyncio.sleep(0)
            else:
                while self.is_paused or loop.time() < entry.time + shift:
                    began, was_paused = loop.time(), self.is_paused
                    await self._wait(math.inf if was_paused else entry.time + shift - began)
                    if self._sought.is_set():
                        return
                    if was_paused:
                        shift += loop.time() - began
                self.at = seconds
            with contextlib.suppress(KeyError, TypeError, ValueError, IndexError):  # a message elib did not write
                self._take(entry, min(entry.time + shift, loop.time()))

    async def _wait(self, seconds: float) -> None:
        """Wait so long, or until the recording is held, let go or told to go on elsewhere."""
        self._woken.clear()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(None if math.isinf(seconds) else seconds):
                await self._woken.wait()

    def _measure(self) -> float:
        times = [entry.time for entry in self.recording.entries(*(topic.name for topic in TOPICS))]
        return max(times, default=self.recording.began) - self.recording.began

    def _take(self, entry: Entry, now: float) -> None:
        self.on_entry(entry, now)
        data, name = entry.data, entry.topic.removeprefix(READINGS.name)
        if name in v.READING_TYPES:
            stamp = {"time": now, "origin": ORIGIN}
            self.on_reading(name, msgspec.convert({**data, **stamp}, v.READING_TYPES[name]))
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
        elif entry.topic == PROGRAM.name:
            self.on_program(MachineBegan(str(data["program"])))
        elif entry.topic == NOTES.name:
            kind = str(data["name"])
            self.on_program(Noted(str(data["message"]), kind))
            self.on_line(kind if kind in KINDS else "note", str(data["message"]), data["level"] > 2)

    def _ended(self, entry: Entry) -> None:
        """Record what a call has set; one that only read, or turned the wheels, gets no line."""
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
