"""The topics of a recording and their JSON schemas.

Times in messages are seconds on the robot's clock. The clock of the file itself (``log_time``) runs with them from the
moment, in UTC, at which recording began.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

FORMAT: Final = "1"
"""Version of topics and schemas; each recording says which version it has."""
ABOUT: Final = "elib"
"""Name of the metadata record with the facts about a recording."""
WORLD_FILE: Final = "world.toml"
"""Name of the attachment with the simulated world."""

Schema = dict[str, object]


def _object(title: str, **properties: Schema) -> Schema:
    return {"type": "object", "title": title, "properties": properties}


def _number(text: str) -> Schema:
    return {"type": "number", "description": text}


def _text(text: str, **more: object) -> Schema:
    return {"type": "string", "description": text, **more}


def _rows(width: int, text: str) -> Schema:
    row = {"type": "array", "items": {"type": "number"}, "minItems": width, "maxItems": width}
    return {"type": "array", "items": row, "description": text}


TIME: Final = _number("s on the robot's clock")
STAMP: Final = _object("stamp", sec={"type": "integer"}, nsec={"type": "integer"})
_BYTES: Final = {"contentEncoding": "base64"}


@dataclass(frozen=True, slots=True)
class Topic:
    """One kind of message.

    Attributes:
        name: Name of the topic; each reading has a topic of its own below ``/readings/``.
        schema_name: Name of the schema; Foxglove's panels understand messages whose schema has one of its names.
        about: What the topic holds, for the documentation.
        schema: JSON schema; None if it follows from the reading.
    """

    name: str
    schema_name: str
    about: str
    schema: Schema | None


BYTES: Final = Topic(
    "/bytes",
    "elib.Bytes",
    "every byte in both directions, as it was written or received",
    _object("bytes", time=TIME, to_robot={"type": "boolean"}, data=_text("the bytes", **_BYTES)),
)
CALLS: Final = Topic(
    "/calls",
    "elib.Call",
    "each request, when the program made it",
    _object(
        "call",
        time=TIME,
        call={"type": "integer", "description": "its number, from 1"},
        command=_text("name of the command"),
        text=_text("the call as a person wrote it"),
        arguments={"type": "array", "items": {"type": "integer"}, "description": "as whole numbers of the wire"},
    ),
)
OUTCOMES: Final = Topic(
    "/outcomes",
    "elib.Outcome",
    "how each request ended",
    _object(
        "outcome",
        time=TIME,
        call={"type": "integer", "description": "number of the call"},
        command=_text("name of the command"),
        ok={"type": "boolean"},
        error=_text("what went wrong; empty if nothing"),
        waited=_number("s from the call to its end"),
        round_trip={"type": ["number", "null"], "description": "s from sending to the end; null if never sent"},
    ),
)
READINGS: Final = Topic("/readings/", "elib.", "each reading by its fields, whichever command asked for it", None)
READING: Final = {
    "": _object("any", time=TIME),
    "/readings/encoders": _object("encoders", time=TIME, left={"type": "integer"}, right={"type": "integer"}),
}
"""The fields that every message must have, and the fields of readings that programs use by name."""
PICTURES: Final = Topic(
    "/pictures",
    "foxglove.RawImage",
    "each picture, upright: mono8 or rgb8",
    _object(
        "picture",
        timestamp=STAMP,
        frame_id=_text("camera"),
        width={"type": "integer"},
        height={"type": "integer"},
        encoding=_text("mono8 or rgb8"),
        step={"type": "integer", "description": "bytes of a row"},
        data=_text("the pixels, row by row", **_BYTES),
        time=TIME,
    ),
)
_VECTOR: Final = _object("vector", x={"type": "number"}, y={"type": "number"}, z={"type": "number"})
_QUATERNION: Final = _object(
    "quaternion", x={"type": "number"}, y={"type": "number"}, z={"type": "number"}, w={"type": "number"}
)
_POSE: Final = _object(
    "pose",
    timestamp=STAMP,
    frame_id=_text("what it is measured from"),
    pose=_object("pose", position=_VECTOR, orientation=_QUATERNION),
    time=TIME,
    heading=_number("rad from the x axis, positive to the left"),
)
ODOMETRY: Final = Topic(
    "/pose/odometry", "foxglove.PoseInFrame", "pose of the robot by its step counters, from where it began", _POSE
)
MEASURED: Final = Topic(
    "/pose/measured",
    "foxglove.PoseInFrame",
    "true pose of the robot: from the simulated world, or measured from outside",
    _POSE,
)
TRANSFORM: Final = Topic(
    "/tf",
    "foxglove.FrameTransform",
    "where the robot's own frame is: in the simulated world, or by odometry from where the robot began",
    _object(
        "transform",
        timestamp=STAMP,
        parent_frame_id=_text("world or start"),
        child_frame_id=_text("robot"),
        translation=_VECTOR,
        rotation=_QUATERNION,
        time=TIME,
    ),
)
_POINTS: Final = _object(
    "points",
    timestamp=STAMP,
    frame_id=_text("robot"),
    pose=_object("pose", position=_VECTOR, orientation=_QUATERNION),
    point_stride={"type": "integer", "description": "bytes of a point"},
    fields={
        "type": "array",
        "items": _object(
            "field",
            name=_text("x, y, z or range, m"),
            offset={"type": "integer"},
            type={"type": "integer", "description": "7: a number of 32 bits with a fraction"},
        ),
    },
    data=_text("the points", **_BYTES),
    time=TIME,
)
INFRARED: Final = Topic(
    "/ranges/infrared",
    "foxglove.PointCloud",
    "what the infrared sensors see, by the usual curve of a white wall; a sensor that sees nothing has no point",
    _POINTS,
)
AHEAD: Final = Topic(
    "/ranges/distance", "foxglove.PointCloud", "what the time-of-flight sensor sees straight ahead", _POINTS
)
LINK: Final = Topic(
    "/link",
    "elib.Link",
    "the health of the link since it was opened, once a second while answers come",
    _object(
        "link",
        time=TIME,
        count={"type": "integer", "description": "answers received"},
        lost={"type": "integer", "description": "calls that were sent and not answered in time"},
        refused={"type": "integer", "description": "calls that ended in another error after they were sent"},
        unsent={"type": "integer", "description": "calls whose deadline passed before they could be sent"},
        median={"type": ["number", "null"], "description": "median round trip of the newest answers, s"},
        p99={"type": ["number", "null"], "description": "the round trip that 99 % of them do not exceed, s"},
        resyncs={"type": "integer", "description": "times the line had to be brought into sync"},
        resets={"type": "integer", "description": "greetings that the robot sent unasked"},
        waiting={"type": "integer", "description": "calls that wait for their turn"},
        unanswered={"type": "integer", "description": "calls without an outcome yet"},
    ),
)
WORLD: Final = Topic(
    "/world",
    "elib.World",
    "poses of everything that can move in a simulated world, ten times a second",
    _object(
        "world",
        time=TIME,
        tick={"type": "integer"},
        robots=_rows(3, "x (m), y (m), heading (rad) of each"),
        boxes=_rows(3, "x (m), y (m), heading (rad) of each"),
        cylinders=_rows(2, "x (m), y (m) of each"),
    ),
)
SCENE: Final = Topic(
    "/scene",
    "elib.Scene",
    "the simulated world, after a hand has added, moved or removed a box or a wall",
    _object("scene", time=TIME, scene=_text("a world file")),
)
NOTES: Final = Topic(
    "/notes",
    "foxglove.Log",
    "other events: notes, states of a behaviour, link down and back, restarts of the robot",
    _object(
        "note",
        timestamp=STAMP,
        level={"type": "integer", "description": "2 information, 3 warning, 4 error"},
        message=_text("a line"),
        name=_text("note, state, link, robot or recorder"),
        event=_text("of link and robot: resynced, greeted, reset, down, back, closed or lost; else empty"),
        time=TIME,
    ),
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
    NOTES,
)
