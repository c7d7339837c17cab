"""The topics of a recording, and a class for the data of each: it becomes JSON, checks what is read, and is the schema.

Times in messages are seconds on the robot's clock. The clock of the file itself (``log_time``) runs with them from the
moment, in UTC, at which recording began.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Final

import msgspec
from msgspec import UNSET, Meta, Struct, UnsetType

FORMAT: Final = "1"
"""Version of topics and schemas; each recording says which version it has."""
ABOUT: Final = "elib"
"""Name of the metadata record with the facts about a recording."""
WORLD_FILE: Final = "world.toml"
"""Name of the attachment with the simulated world."""
MAX_NUMBER: Final = 1e15
"""No time, length or count of a recording comes near this number, and a float holds whole numbers up to it."""

Schema = dict[str, Any]

Finite = Annotated[float, Meta(ge=-MAX_NUMBER, le=MAX_NUMBER)]
Integer = Annotated[int, Meta(ge=-int(MAX_NUMBER), le=int(MAX_NUMBER))]
Time = Annotated[Finite, Meta(description="s on the robot's clock")]
Base64 = Annotated[
    str,
    Meta(
        pattern="^(?:[A-Za-z0-9+/]{4})*(?:[A-Za-z0-9+/]{2}==|[A-Za-z0-9+/]{3}=)?$",
        extra_json_schema={"contentEncoding": "base64"},
    ),
]
PlanePosition = Annotated[list[Finite], Meta(min_length=2, max_length=2)]
PlanePose = Annotated[list[Finite], Meta(min_length=3, max_length=3)]


class Stamp(Struct):
    """A moment of the file's own clock."""

    sec: int
    nsec: int


class Data(Struct, kw_only=True):
    """The data of a message."""

    time: Time


class FoxgloveData(Data, kw_only=True):
    """Data that Foxglove's panels understand by the name of its schema."""

    timestamp: Stamp | UnsetType = UNSET  # when the message was written, on the file's own clock


class BytesData(Data, kw_only=True):
    """Bytes that were written or received."""

    to_robot: bool
    data: Annotated[Base64, Meta(description="the bytes")]


class CallData(Data, kw_only=True):
    """A request of the program."""

    call: Annotated[Integer, Meta(description="its number, from 1")]
    command: Annotated[str, Meta(description="name of the command")]
    text: Annotated[str, Meta(description="the call as a person wrote it")]
    arguments: Annotated[Sequence[Integer], Meta(description="as whole numbers of the wire")]


class OutcomeData(Data, kw_only=True):
    """The end of a request."""

    call: Annotated[Integer, Meta(description="number of the call")]
    command: Annotated[str, Meta(description="name of the command")]
    ok: bool
    error: Annotated[str, Meta(description="what went wrong; empty if nothing")]
    waited: Annotated[Finite, Meta(description="s from the call to its end")]
    round_trip: Annotated[Finite | None, Meta(description="s from sending to the end; null if never sent")]


class EncodersData(Data, kw_only=True):
    """A reading of the step counters."""

    left: Integer
    right: Integer
    origin: str | UnsetType = UNSET


class PictureData(FoxgloveData, kw_only=True):
    """A picture."""

    frame_id: Annotated[str, Meta(description="camera")]
    width: Integer
    height: Integer
    encoding: Annotated[str, Meta(description="mono8 or rgb8")]
    step: Annotated[Integer, Meta(description="bytes of a row")]
    data: Annotated[Base64, Meta(description="the pixels, row by row")]


class Vector3(Struct):
    """A place, m."""

    x: Finite
    y: Finite
    z: Finite


class Quaternion(Struct):
    """A direction."""

    x: Finite
    y: Finite
    z: Finite
    w: Finite


class Placement(Struct):
    """A place and a direction."""

    position: Vector3
    orientation: Quaternion


class PoseData(FoxgloveData, kw_only=True):
    """A pose of the robot."""

    frame_id: Annotated[str, Meta(description="what it is measured from")]
    pose: Placement
    heading: Annotated[Finite, Meta(description="rad from the x axis, positive to the left")]


class TransformData(FoxgloveData, kw_only=True):
    """Where a frame is in another."""

    parent_frame_id: Annotated[str, Meta(description="world or start")]
    child_frame_id: Annotated[str, Meta(description="robot")]
    translation: Vector3
    rotation: Quaternion


class PackedField(Struct):
    """One number of a packed point."""

    name: Annotated[str, Meta(description="x, y, z or range, m")]
    offset: Integer
    type: Annotated[Integer, Meta(description="7: a number of 32 bits with a fraction")]


class PointsData(FoxgloveData, kw_only=True):
    """Points around the robot."""

    frame_id: Annotated[str, Meta(description="robot")]
    pose: Placement
    point_stride: Annotated[Integer, Meta(description="bytes of a point")]
    fields: Sequence[PackedField]
    data: Annotated[Base64, Meta(description="the points")]


class LinkData(Data, kw_only=True):
    """The health of the link."""

    count: Annotated[Integer, Meta(description="answers received")]
    lost: Annotated[Integer, Meta(description="calls that were sent and not answered in time")]
    refused: Annotated[Integer, Meta(description="calls that ended in another error after they were sent")]
    unsent: Annotated[Integer, Meta(description="calls whose deadline passed before they could be sent")]
    median: Annotated[Finite | None, Meta(description="median round trip of the newest answers, s")]
    p99: Annotated[Finite | None, Meta(description="the round trip that 99 % of them do not exceed, s")]
    resyncs: Annotated[Integer, Meta(description="times the line had to be brought into sync")]
    resets: Annotated[Integer, Meta(description="greetings that the robot sent unasked")]
    waiting: Annotated[Integer, Meta(description="calls that wait for their turn")]
    unanswered: Annotated[Integer, Meta(description="calls without an outcome yet")]


class WorldData(Data, kw_only=True):
    """Where everything is that can move in a simulated world."""

    tick: Integer
    robots: Annotated[Sequence[PlanePose], Meta(description="x (m), y (m), heading (rad) of each")]
    boxes: Annotated[Sequence[PlanePose], Meta(description="x (m), y (m), heading (rad) of each")]
    cylinders: Annotated[Sequence[PlanePosition], Meta(description="x (m), y (m) of each")]


class SceneData(Data, kw_only=True):
    """A simulated world."""

    scene: Annotated[str, Meta(description="a world file")]


class ProgramData(Data, kw_only=True):
    """A program whose states drive the robot from now on."""

    program: Annotated[str, Meta(description="the text of the program, in Python")]


class NoteData(FoxgloveData, kw_only=True):
    """A line about something that happened."""

    level: Annotated[Integer, Meta(description="2 information, 3 warning, 4 error")]
    message: Annotated[str, Meta(description="a line")]
    name: Annotated[str, Meta(description="note, state, link, robot or recorder")]
    event: Annotated[
        str, Meta(description="of link and robot: resynced, greeted, reset, down, back, closed or lost; else empty")
    ]


Scalar = Finite | Integer | str | bool | None
ReadingFields = dict[str, Scalar | list[Scalar | list[Scalar]] | dict[str, Scalar]]
"""A reading of any fields, as JSON has it."""


@dataclass(frozen=True, slots=True)
class Topic:
    """One kind of message."""

    name: str
    schema_name: str  # name of the schema; Foxglove's panels understand messages whose schema has one of its names
    about: str  # what the topic holds, for the documentation
    form: type[Data] | None  # class of its messages; None for readings, whose fields follow from their class

    @property
    def schema(self) -> Schema | None:
        """The JSON schema; None if it follows from the reading."""
        return None if self.form is None else _schema_of(self.form)


BYTES: Final = Topic("/bytes", "elib.Bytes", "every byte in both directions, as it was written or received", BytesData)
CALLS: Final = Topic("/calls", "elib.Call", "each request, when the program made it", CallData)
OUTCOMES: Final = Topic("/outcomes", "elib.Outcome", "how each request ended", OutcomeData)
READINGS: Final = Topic("/readings/", "elib.", "each reading by its fields, whichever command asked for it", None)
PICTURES: Final = Topic("/pictures", "foxglove.RawImage", "each picture, upright: mono8 or rgb8", PictureData)
ODOMETRY: Final = Topic(
    "/pose/odometry", "foxglove.PoseInFrame", "pose of the robot by its step counters, from where it began", PoseData
)
MEASURED: Final = Topic(
    "/pose/measured",
    "foxglove.PoseInFrame",
    "true pose of the robot: from the simulated world, or measured from outside",
    PoseData,
)
TRANSFORM: Final = Topic(
    "/tf",
    "foxglove.FrameTransform",
    "where the robot's own frame is: in the simulated world, or by odometry from where the robot began",
    TransformData,
)
INFRARED: Final = Topic(
    "/ranges/infrared",
    "foxglove.PointCloud",
    "what the infrared sensors see, by the usual curve of a white wall; a sensor that sees nothing has no point",
    PointsData,
)
AHEAD: Final = Topic(
    "/ranges/distance", "foxglove.PointCloud", "what the time-of-flight sensor sees straight ahead", PointsData
)
LINK: Final = Topic(
    "/link",
    "elib.Link",
    "the health of the link since it was opened, once a second while answers come",
    LinkData,
)
WORLD: Final = Topic(
    "/world",
    "elib.World",
    "poses of everything that can move in a simulated world, ten times a second",
    WorldData,
)
SCENE: Final = Topic(
    "/scene",
    "elib.Scene",
    "the simulated world, after a hand has added, moved or removed a box or a wall",
    SceneData,
)
PROGRAM: Final = Topic(
    "/program", "elib.Program", "the program of a machine of states, when it begins to drive the robot", ProgramData
)
NOTES: Final = Topic(
    "/notes",
    "foxglove.Log",
    "other events: notes, states of a behaviour, link down and back, restarts of the robot",
    NoteData,
)

TOPICS: Final = (
    BYTES,
    CALLS,
    OUTCOMES,
    READINGS,
    PICTURES,
    ODOMETRY,
    MEASURED,
    TRANSFORM,
    INFRARED,
    AHEAD,
    LINK,
    WORLD,
    SCENE,
    PROGRAM,
    NOTES,
)
_FORMS: Mapping[str, type[Data]] = {
    **{topic.name: topic.form for topic in TOPICS if topic.form is not None},
    f"{READINGS.name}encoders": EncodersData,  # programs use its fields by name
}


def decoder_of(topic: str) -> msgspec.json.Decoder[Any]:
    """Return what reads the messages of a topic, a :class:`Data` or a :data:`ReadingFields`, and refuses all others.

    A message of a topic that elib does not know needs only a time.
    """
    return _decoder(_FORMS.get(topic) or (ReadingFields if topic.startswith(READINGS.name) else dict[str, Any]))


@cache
def _decoder(form: Any) -> msgspec.json.Decoder[Any]:
    return msgspec.json.Decoder(form)


@cache
def _schema_of(form: type[Data]) -> Schema:
    """Return the JSON schema of a class of messages, without references: not every tool follows them."""
    (schema,), named = msgspec.json.schema_components([form])
    whole: Schema = _whole(schema, named)
    return whole


def _whole(schema: Any, named: Mapping[str, Schema]) -> Any:
    """Return a schema with what it refers to in its place, and without the ranges that only a reader needs."""
    match schema:
        case {"$ref": str(name)}:
            return _whole(named[name.rpartition("/")[2]], named)
        case {"anyOf": [{"type": str(kind)}, {"type": "null"}], **more}:
            return {"type": [kind, "null"], **more}
        case dict():
            left_out = ("required", "minimum", "maximum", "pattern")
            return {key: _whole(value, named) for key, value in schema.items() if key not in left_out}
        case list():
            return [_whole(each, named) for each in schema]
        case _:
            return schema
