"""The topics of one robot: what a recording of it would hold, as it happens."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections.abc import Mapping

import msgspec
from foxglove import Channel, Context, Schema

from elib.base.pose import Pose
from elib.link.protocol.image import Image
from elib.link.protocol.values import Reading
from elib.link.session import Noted
from elib.panel.playback import Playback
from elib.panel.slot import Slot
from elib.records import messages
from elib.records.reader import Entry
from elib.records.recorder import Tap
from elib.records.topics import MEASURED, ODOMETRY, PICTURES, READINGS, TOPICS, TRANSFORM, Data
from elib.robot.aio import Epuck

WORLD_FRAME = "world"
"""The frame that robots share."""
FRAMES = ("frame_id", "parent_frame_id", "child_frame_id")
OF_THE_LINK = frozenset({"link", "robot", "call"})
"""Kinds of lines of the event log that the messages of a link already tell."""
_BY_NAME = {topic.name: topic for topic in TOPICS}


class Topics:
    """Publishes what happens to one robot, in the panel's event loop."""

    def __init__(self, slot: Slot, prefix: str, context: Context) -> None:
        self._slot, self._prefix, self._context = slot, prefix, context
        self._epoch = time.time_ns() - round(asyncio.get_running_loop().time() * 1e9)
        self._channels: dict[tuple[str, str], Channel] = {}
        for topic in TOPICS:
            if topic.schema is not None:
                self._register((topic.name, ""), topic.name, topic.schema_name, topic.schema)
        self._translator = messages.Translator()
        self._robot: Epuck | None = None
        self._tap: Tap | None = None
        self._playback: Playback | None = None
        self._has_measured = False
        self._lines = 0

    @property
    def shows_pictures(self) -> bool:
        """Whether a client looks at the camera."""
        return self._channels[PICTURES.name, ""].has_sinks()

    def follow(self) -> None:
        """Publish from now on what the robot does that is connected now, or the recording that is played now."""
        slot = self._slot
        robot = slot.robot if slot.is_connected else None
        if robot is not self._robot:
            self.leave()
            self._robot = robot
            if robot is not None:
                self._translator = messages.Translator()
                self._tap = Tap(robot, self._hear, robot.time, self.leave)
        playback = slot.playback if slot.is_playing else None
        if playback is not self._playback:
            self._playback = playback
            if playback is not None:
                self._play(playback)
        self._tell_lines()

    def leave(self) -> None:
        """Follow the robot no more. Safe to repeat."""
        if self._tap is not None:
            self._tap.leave()
            self._tap = None

    def _hear(self, item: tuple[float, messages.Event]) -> None:
        if not isinstance(item[1], Noted):  # the event log has that line, too
            self._put(item)

    def _put(self, item: tuple[float, messages.Event]) -> None:
        for message in self._translator.messages(*item):
            self._publish(message)

    def _publish(self, message: messages.Message) -> None:
        key = (message.topic.name, message.reading)
        channel = self._channels.get(key)
        if channel is None:
            channel = self._register(key, *messages.channel_of(message))
        if not channel.has_sinks():
            return
        moment = self._epoch + round(message.time * 1e9)
        if self._prefix and isinstance(message.data, Data):
            message = message._replace(data=self._renamed(message.data))
        channel.log(messages.json_of(message, moment), log_time=moment)

    def _renamed(self, data: Data) -> Data:
        """Return data whose frames are this robot's own, beside those of the others."""
        frames = {name: getattr(data, name, WORLD_FRAME) for name in FRAMES}
        own = {name: f"{self._prefix[1:]}/{frame}" for name, frame in frames.items() if frame != WORLD_FRAME}
        return msgspec.structs.replace(data, **own)

    def _register(self, key: tuple[str, str], topic: str, schema_name: str, schema: Mapping[str, object]) -> Channel:
        described = Schema(name=schema_name, encoding="jsonschema", data=json.dumps(schema).encode())
        channel = Channel(self._prefix + topic, schema=described, message_encoding="json", context=self._context)
        self._channels[key] = channel
        return channel

    def _tell_lines(self) -> None:
        """Publish the new lines of the event log that no message of the link has told."""
        new, self._lines = self._slot.log.since(self._lines), self._slot.log.count
        for line in new:
            if self._tap is None or line.kind not in OF_THE_LINK:
                self._put(
                    (line.time, Noted(line.text, line.kind, messages.ERROR if line.is_bad else messages.INFORMATION))
                )

    # -- recordings --

    def _play(self, playback: Playback) -> None:
        """Publish a recording from its beginning, at the time at which everything happened."""
        before = playback.on_reading

        def read(name: str, value: Reading | Image) -> None:
            before(name, value)
            for message in messages.reading_messages(value.time, name, value):
                self._publish(message)

        playback.on_reading, playback.on_entry = read, self._replay
        self._has_measured = False
        playback.seek(0.0)

    def _replay(self, entry: Entry, now: float) -> None:
        topic = _BY_NAME.get(entry.topic)
        if topic is None or topic is PICTURES or entry.topic.startswith(READINGS.name):
            return
        with contextlib.suppress(KeyError, TypeError, ValueError):  # a message elib did not write
            if topic in (MEASURED, ODOMETRY):
                self._has_measured |= topic is MEASURED
                place = entry.pose
                located = messages.Located(
                    Pose(place.x, place.y, place.heading, time=now),
                    is_measured=topic is MEASURED,
                    moves_frame=self._has_measured == (topic is MEASURED),
                )
                self._put((now, located))
            elif topic.form is not None and topic is not TRANSFORM:
                self._publish(messages.Message(now, topic, msgspec.convert({**entry.data, "time": now}, topic.form)))
