"""What the door sends to programs: one class a message."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from elib.doors.serve.values import Json

Id = Annotated[int, Meta(description="Number of the request.")]
Robot = Annotated[str, Meta(description="Key of the robot.")]
Text = Annotated[str, Meta(description="What happened.")]


class Told(Struct, tag_field="type"):
    """Something that a program is told."""


class Answer(Told, tag="answer", kw_only=True):
    """The answer to a request that was carried out."""

    id: Id
    ok: Annotated[bool, Meta(extra_json_schema={"const": True})] = True
    result: Annotated[Json, Meta(description="What the request gives, or null.", extra_json_schema={})] = None


class Trouble(Struct, kw_only=True):
    """Why a request was not carried out."""

    kind: Annotated[str, Meta(description="Name of the error in elib, such as ReplyTimeout.")]
    message: Text
    hint: Annotated[str, Meta(description="What to try; empty if there is nothing to say.")]


class Failure(Told, tag="answer", kw_only=True):
    """The answer to a request that failed."""

    id: Id
    ok: Annotated[bool, Meta(extra_json_schema={"const": False})] = False
    error: Trouble


class Error(Told, tag="error", kw_only=True):
    """The failure of a request without a number, or something that went wrong without a request.

    A program is told so when a robot that it drives was stopped under it, and when a watch has ended by itself.
    """

    robot: Annotated[str, Meta(description="Key of the robot that it is about; empty for none.")] = ""
    error: Trouble


class Readings(Told, tag="readings", kw_only=True):
    """Readings that the program watches. A program that does not read in time misses old ones, never the newest."""

    robot: Robot
    time: Annotated[
        float, Meta(description="When they were complete, s on the door's clock.", extra_json_schema={"x-unit": "s"})
    ]
    readings: Annotated[
        dict[str, Json], Meta(description="The readings by name, each as the command of that name returns it.")
    ]
    missed: Annotated[int, Meta(description="How many messages of this watch the program has missed so far.")]


class Event(Told, tag="event", kw_only=True):
    """Something that happened on a robot or on its link: a line of the event log."""

    robot: Robot
    time: Annotated[
        float, Meta(description="When it happened, s on the door's clock.", extra_json_schema={"x-unit": "s"})
    ]
    kind: Annotated[str, Meta(description="What it is about: call, link, robot, panel or note.")]
    text: Text
    is_bad: Annotated[bool, Meta(description="Whether something went wrong.")]
    missed: Annotated[int, Meta(description="How many lines before this one the program has missed.")]


TOLD: tuple[type[Told], ...] = (Answer, Failure, Error, Readings, Event)
"""All of them."""
