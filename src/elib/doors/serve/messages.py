"""What a program may send: one function a message, with its fields, and what is done.

A message is a JSON object such as ``{"do": "set_speed", "id": 7, "left": 0.5, "right": 0.5}``. The messages of the door
itself are the functions below; one for each command of the robot is made from the catalogue of commands.
"""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from inspect import Parameter
from typing import Annotated, Union

from msgspec import Meta
from msgspec.json import Decoder

from elib.doors.serve.answers import Driven, Watched, Welcome
from elib.doors.serve.client import Client
from elib.link.protocol.profiles import FIRMWARES, rule
from elib.link.protocol.quantities import Quantity
from elib.panel.server.conversation import Decoded, Message, Result, Table, decoded, message_of
from elib.robot.actions import CatalogueEntry, catalogue
from elib.robot.snapshot import WATCHABLE

SLOWEST, FASTEST = 0.1, 50.0
"""Range of the rate of a watch, Hz: over Bluetooth, no robot answers more than some 40 questions a second."""

Robot = Annotated[str, Meta(max_length=12, description="Key of the robot; not needed where there is only one.")]


Name = Annotated[str, Meta(max_length=20, extra_json_schema={"enum": list(WATCHABLE)})]


class AboutRobot(Message):
    """Is about one robot.

    Attributes:
        robot: Key of the robot; not needed where there is only one.
    """

    robot: Robot = ""


DOOR_MESSAGES = Table()
"""The messages that are not commands of the robot, by their names."""


@DOOR_MESSAGES.request(is_greeting=True)
def hello(
    client: Client,
    name: Annotated[str, Meta(max_length=80, description="Name of the program, for the event log.")] = "",
    token: Annotated[
        str, Meta(max_length=200, description="The token that the door printed, if it asks for one.")
    ] = "",
) -> Welcome:
    """Say who connects, and ask which robots there are. It comes first where a token is needed."""
    return client.greet(name, token)


@DOOR_MESSAGES.request(base=AboutRobot)
def drive(
    client: Client,
    robot: str,
    *,
    force: Annotated[bool, Meta(description="Whether to take over from another driver, who is stopped first.")] = False,
) -> None:
    """Take the wheel: from now on this program may move the robot, and no other.

    While the robot may move, the program has to send a message at least every 0.3 s. The first command that moves a
    robot which no client drives takes the wheel, too.
    """
    client.take(robot, by_force=force)


@DOOR_MESSAGES.request(base=AboutRobot)
def leave(client: Client, robot: str) -> None:
    """Give the wheel back: the robot stops."""
    client.leave(robot)


@DOOR_MESSAGES.request()
def beat(client: Client) -> Driven:
    """Say that the program is still there. The result names the robots that it drives."""
    return Driven(client.driven())


@DOOR_MESSAGES.request(base=AboutRobot)
def watch(
    client: Client,
    robot: str,
    readings: Annotated[
        tuple[Name, ...],
        Meta(max_length=len(WATCHABLE), description="Names of the readings; all sensors of the firmware if empty."),
    ] = (),
    rate: Annotated[float, Meta(ge=SLOWEST, le=FASTEST, description="Messages a second, Hz.")] = 20.0,
) -> Watched:
    """Ask for readings again and again: a ``readings`` message comes so many times a second, or as fast as the link is.

    Several watches of one robot differ in their readings; the same readings again only change the rate.
    """
    return client.watch(robot, readings, rate)


@DOOR_MESSAGES.request(base=AboutRobot)
def unwatch(
    client: Client,
    robot: str,
    readings: Annotated[
        tuple[Name, ...],
        Meta(max_length=len(WATCHABLE), description="Names of the readings as in watch; every watch if empty."),
    ] = (),
) -> None:
    """End a watch of these readings, or all watches of the robot."""
    client.unwatch(robot, readings)


@DOOR_MESSAGES.request()
def events(client: Client, *, on: Annotated[bool, Meta(description="Whether events are wanted.")] = True) -> None:
    """Ask for what happens on the robots and their links, as ``event`` messages, or end that."""
    client.tell_events(on=on)


def _command(entry: CatalogueEntry) -> type[Message]:
    """Return the class of the messages of one command; everybody may send that to stop."""

    def act(client: Client, robot: str, **arguments: object) -> Result:
        if entry.name == "stop":
            return client.stop(robot)
        return client.command(robot, entry, [arguments[each] for each, _, _ in entry.parameters])

    fields = (
        Parameter(
            name,
            Parameter.KEYWORD_ONLY,
            annotation=_argument(quantity),
            default=default if default is Parameter.empty else _plain_default(default),
        )
        for name, quantity, default in entry.parameters
    )
    return message_of(act, entry.name, fields, entry.doc, AboutRobot, entry=entry)


def _argument(quantity: Quantity | None) -> object:
    """Return the type of an argument. Its range differs between firmwares: the command checks it, with words."""
    if quantity is None:
        return Annotated[str, Meta(max_length=200)]
    shown = Meta(description=rule(quantity), extra_json_schema=_range(quantity))
    if quantity.names is not None:
        return Annotated[str | int | bool, shown]
    return Annotated[float, shown] if quantity.scale else Annotated[int, shown]


def _range(quantity: Quantity) -> dict[str, object]:
    """Return the widest range that a firmware has, as JSON Schema says it."""
    if quantity.names is not None:
        numbers = sorted({int(each) for each in quantity.names})
        names = [name.lower() for name in quantity.names.__members__]
        truth: list[object] = [False, True] if {0, 1} <= set(numbers) and len(numbers) < 4 else []
        return {"enum": [*names, *numbers, *truth]}
    limits = [profile.limited(quantity) for profile in FIRMWARES.values()]
    found: dict[str, object] = {"minimum": min(x.low for x in limits), "maximum": max(x.high for x in limits)}
    choices = quantity.choices
    if isinstance(choices, range):
        found["multipleOf"] = choices.step
    elif choices is not None:
        found["enum"] = list(choices)
    if quantity.unit:
        found["x-unit"] = quantity.unit
    return found


def _plain_default(default: object) -> object:
    name = getattr(default, "name", None)
    return default if name is None else str(name).lower()


COMMANDS: Mapping[str, type[Message]] = {name: _command(entry) for name, entry in catalogue().items()}
"""The messages of the robot's commands, by name."""

MESSAGES: Mapping[str, type[Message]] = {**DOOR_MESSAGES, **COMMANDS}
"""All of them, by their names."""

NAMES = tuple(MESSAGES)
"""What ``do`` may be."""

MOTIONS = ("go", "turn", "go_to")
"""What programs ask for that is not a command of the robot: elib drives it step by step, in Python."""

_DECODER: Decoder[Message] = Decoder(Union[tuple(MESSAGES.values())])  # noqa: UP007  # a tuple of types has no |


def _hint(do: object) -> str:
    if not isinstance(do, str) or not do:
        return 'a message is one JSON object, such as {"do": "hello", "id": 1}'
    if do in COMMANDS:
        return f"the arguments are {catalogue()[do].usage}"
    if do in MESSAGES:
        return "elib serve --schema prints the fields of every message"
    if do in MOTIONS:
        return "a whole motion is a loop of set_speed and encoders in your program"
    near = get_close_matches(do[:40], NAMES, 1)
    return f"did you mean {near[0]!r}?" if near else "elib serve --schema prints every message"


def decode(text: str) -> Decoded:
    """Return the number of a message, and what a program said; of a wrong message, what is wrong with it."""
    return decoded(_DECODER, text, _hint)
