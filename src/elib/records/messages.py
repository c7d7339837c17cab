"""Translates the events of a link into the messages of a recording."""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import msgspec

from elib.base.errors import LinkClosed, Unsupported
from elib.base.pictures import base64_of
from elib.base.pose import Pose
from elib.link import session
from elib.link.protocol.image import Image
from elib.link.protocol.values import Distance, Proximity, Reading, Sensors
from elib.link.session.statistics import LinkStats
from elib.records import topics
from elib.records.encoding import fields_of, picture_data
from elib.records.ranges import ROBOT, distance_points, infrared_points

_JSON = msgspec.json.Encoder()
INFORMATION, WARNING, ERROR = 2, 3, 4
"""Levels of ``foxglove.Log``."""


@dataclass(frozen=True, slots=True)
class Located:
    """A pose of the robot."""

    pose: Pose  # the pose, with its time
    is_measured: bool  # whether it was measured from outside; otherwise it comes from the step counters
    moves_frame: bool = False  # whether the robot's own frame, in which its ranges are, goes with this pose


@dataclass(frozen=True, slots=True)
class Observed:
    """The state of a simulated world."""

    state: Mapping[str, Any]  # the fields of WorldData, without its time
    # the world as TOML if boxes or walls were added, moved or removed since the last one; otherwise empty
    scene: str = ""


Event = session.TraceEvent | Located | LinkStats | Observed
"""Everything that is recorded."""


class Message(NamedTuple):
    """One message."""

    time: float  # s on the robot's clock
    topic: topics.Topic
    data: topics.Data | Mapping[str, object]  # its data; of a reading its fields
    reading: str = ""  # name of the reading after `/readings/`; empty for other topics


def channel_of(message: Message) -> tuple[str, str, topics.Schema]:
    """Return the name of the topic, of its schema, and the schema, with which a message is announced."""
    topic, reading = message.topic, message.reading
    schema = topic.schema
    if schema is None:
        schema = schema_of(cast("Mapping[str, object]", message.data), reading)
    return topic.name + reading, topic.schema_name + "".join(word.capitalize() for word in reading.split("_")), schema


def json_of(message: Message, nanoseconds: int) -> bytes:
    """Return the JSON of a message, with the time stamp of the file's own clock where the schema has one."""
    data = message.data
    if isinstance(data, topics.FoxgloveData):
        data.timestamp = topics.Stamp(nanoseconds // 10**9, nanoseconds % 10**9)
    try:
        return _JSON.encode(data)
    except UnicodeEncodeError:  # half of a surrogate pair, as Python has it in a name that is not text
        return _JSON.encode(_text_only(msgspec.to_builtins(data)))


def _text_only(value: Any) -> Any:
    """Return the same data with escapes for what no UTF-8 can hold."""
    match value:
        case str():
            return value.encode(errors="backslashreplace").decode()
        case dict():
            return {key: _text_only(each) for key, each in value.items()}
        case list():
            return [_text_only(each) for each in value]
        case _:
            return value


def schema_of(data: Mapping[str, object], title: str) -> topics.Schema:
    """Return the JSON schema of a reading; each of its fields may be null."""
    kinds = {bool: "boolean", int: "integer", float: "number", str: "string", list: "array"}
    properties: topics.Schema = {
        # A field with an int may hold a float in the next message: the schema says number for both.
        name: {"type": [{"integer": "number"}.get(kind, kind), "null"]}
        if (kind := kinds.get(type(value))) is not None
        else {}
        for name, value in data.items()
    }
    return {"type": "object", "title": title, "properties": properties}


class Translator:
    """Turns events into messages, and numbers the calls."""

    def __init__(self) -> None:
        self._count = 0
        # The numbers of the calls without an outcome, by what was called and when.
        self._open: dict[tuple[str, float], deque[int]] = {}
        self._makers: dict[type, Callable[..., Iterable[Message]]] = {
            session.Called: self._called,
            session.Ended: self._ended,
            session.Wrote: lambda time, event: (_transfer(time, event.data, to_robot=True),),
            session.Received: lambda time, event: (_transfer(time, event.data, to_robot=False),),
            session.Pushed: lambda time, event: reading_messages(time, "image", event.value),
            session.SessionOpened: self._opened,
            session.MachineBegan: lambda time, event: (
                Message(time, topics.PROGRAM, topics.ProgramData(time=time, program=event.program)),
            ),
            session.Noted: lambda time, event: (_note(time, event.text, event.kind, level=event.level),),
            Located: self._located,
            LinkStats: self._checked,
            Observed: self._observed,
        }

    def messages(self, time: float, event: Event) -> Iterable[Message]:
        """Return the messages that are written for an event."""
        return self._makers.get(type(event), self._happened)(time, event)

    def _called(self, time: float, event: session.Called) -> Iterable[Message]:
        request = event.request
        self._count += 1
        self._open.setdefault((request.text, time), deque()).append(self._count)
        data = topics.CallData(
            time=time,
            call=self._count,
            command=request.name,
            text=request.text,
            arguments=list(map(int, request.numbers)),
        )
        return (Message(time, topics.CALLS, data),)

    def _ended(self, time: float, event: session.Ended) -> Iterable[Message]:
        request = event.request
        error = event.error
        data = topics.OutcomeData(
            time=time,
            call=self._number_of(event),
            command=request.name,
            ok=error is None,
            error="" if error is None else f"{type(error).__name__}: {error}".removesuffix(": "),
            waited=event.waited,
            round_trip=None if math.isnan(event.round_trip) else event.round_trip,
        )
        found = [Message(time, topics.OUTCOMES, data)]
        if event.value is not None:
            found += reading_messages(time, request.name, event.value)
        return found

    def _number_of(self, event: session.Ended) -> int:
        """Return the number of a call that ended; 0 if the call was made before the recording began."""
        call = event.request.text, event.called
        if call not in self._open:
            return 0
        number = self._open[call].popleft()
        if not self._open[call]:
            del self._open[call]
        return number

    def _opened(self, time: float, event: session.SessionOpened) -> Iterable[Message]:
        for when, each in event.opening:
            yield _transfer(when, each.data, to_robot=isinstance(each, session.Wrote))

    def _observed(self, time: float, event: Observed) -> Iterable[Message]:
        if event.scene:
            yield Message(time, topics.SCENE, topics.SceneData(time=time, scene=event.scene))
        yield Message(time, topics.WORLD, topics.WorldData(time=time, **event.state))

    def _located(self, time: float, event: Located) -> Iterable[Message]:
        pose = event.pose
        half = pose.heading / 2
        position = topics.Vector3(pose.x, pose.y, 0.0)
        orientation = topics.Quaternion(0.0, 0.0, math.sin(half), math.cos(half))
        frame = "world" if event.is_measured else "start"
        data = topics.PoseData(
            time=pose.time, frame_id=frame, pose=topics.Placement(position, orientation), heading=pose.heading
        )
        yield Message(time, topics.MEASURED if event.is_measured else topics.ODOMETRY, data)
        if event.moves_frame:
            moved = topics.TransformData(
                time=time, parent_frame_id=frame, child_frame_id=ROBOT, translation=position, rotation=orientation
            )
            yield Message(time, topics.TRANSFORM, moved)

    def _checked(self, time: float, event: LinkStats) -> Iterable[Message]:
        data = dataclasses.asdict(event)
        del data["age"]  # the time of /outcomes says it better
        return (Message(time, topics.LINK, topics.LinkData(time=time, **data)),)

    def _happened(self, time: float, event: session.TraceEvent) -> Iterable[Message]:
        match event:
            case session.Resynced(duration=duration, dropped=dropped):
                yield _note(
                    time,
                    f"the line was out of sync for {duration:.3f} s; {dropped} bytes were dropped",
                    "link",
                    "resynced",
                )
            case session.Greeted():
                yield _note(time, "the robot greeted unasked: it has restarted", "robot", "greeted", WARNING)
            case session.ResetNoticed(sign=sign):
                yield _note(time, f"the robot has restarted; its {sign} showed it", "robot", "reset", WARNING)
            case session.Disconnected(error=error):
                yield _note(time, f"the link is down: {error.message}", "link", "down", WARNING)
            case session.Reconnected(gap=gap, attempts=attempts):
                yield _note(time, f"the link is back after {gap:.3f} s and {attempts} attempts", "link", "back")
            case session.Ending(error=error):
                happened = "closed" if isinstance(error, LinkClosed) else "lost"
                yield _note(time, f"the session ended: {error.message}", "link", happened)
            case _:
                return


def readings_in(name: str, value: object) -> Iterator[tuple[str, Reading | Image]]:
    """Yield each reading in an answer with its name; one answer may hold the readings of several commands."""
    if isinstance(value, Sensors):
        for field in dataclasses.fields(value):
            each = getattr(value, field.name)
            if isinstance(each, Reading):
                yield field.name, each
    elif isinstance(value, dict):
        for key, each in value.items():
            yield from readings_in(str(key), each)
    elif isinstance(value, Reading | Image):
        yield name, value


def reading_messages(time: float, name: str, value: object) -> list[Message]:
    """Return the messages of each reading in an answer, or in a packet that came without being asked for."""
    found: list[Message] = []
    for each, reading in readings_in(name, value):
        found += _picture(time, reading) if isinstance(reading, Image) else _reading(time, each, reading)
    return found


def _transfer(time: float, data: bytes, *, to_robot: bool) -> Message:
    return Message(time, topics.BYTES, topics.BytesData(time=time, to_robot=to_robot, data=base64_of(data)))


def _reading(time: float, name: str, value: Reading) -> Iterable[Message]:
    if not math.isfinite(value.time):
        value = dataclasses.replace(value, time=time)
    yield Message(value.time, topics.READINGS, fields_of(value), name)
    if isinstance(value, Proximity):
        yield Message(value.time, topics.INFRARED, infrared_points(value.time, value.numbers))
    elif isinstance(value, Distance):
        yield Message(value.time, topics.AHEAD, distance_points(value.time, value.metres))


def _picture(time: float, picture: Image) -> Iterable[Message]:
    if not math.isfinite(picture.time):
        picture = dataclasses.replace(picture, time=time)
    try:
        return (Message(picture.time, topics.PICTURES, picture_data(picture)),)
    except (Unsupported, ValueError):
        return ()  # its bytes are in the recording


def _note(time: float, text: str, kind: str, happened: str = "", level: int = INFORMATION) -> Message:
    return Message(time, topics.NOTES, topics.NoteData(time=time, level=level, message=text, name=kind, event=happened))
