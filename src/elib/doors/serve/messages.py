"""What a program may send: one class a message, with its fields, and what is done.

A message is a JSON object such as ``{"do": "set_speed", "id": 7, "left": 0.5, "right": 0.5}``. The messages of the door
itself are the classes below; a class for each command of the robot is made from the catalogue of commands.
"""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import TYPE_CHECKING, Annotated, ClassVar, Union, cast

import msgspec
from msgspec import Meta
from msgspec.json import Decoder

from elib.link.protocol.profiles import FIRMWARES, rule
from elib.link.protocol.quantities import Quantity
from elib.panel.server.conversation import Decoded, Message, Result, decoded
from elib.robot.actions import CatalogueEntry, catalogue
from elib.robot.snapshot import WATCHABLE

if TYPE_CHECKING:
    from elib.doors.serve.client import Client

SLOWEST, FASTEST = 0.1, 50.0
"""Range of the rate of a watch, Hz: over Bluetooth, no robot answers more than some 40 questions a second."""

Key = Annotated[str, Meta(max_length=12)]
Robot = Annotated[str, Meta(max_length=12, description="Key of the robot; not needed where there is only one.")]


class Hello(Message, tag="hello"):
    """Say who connects, and ask which robots there are. It comes first where a token is needed."""

    is_greeting = True

    name: Annotated[str, Meta(max_length=80, description="Name of the program, for the event log.")] = ""
    token: Annotated[str, Meta(max_length=200, description="The token that the door printed, if it asks for one.")] = ""

    def carry_out(self, client: Client) -> Result:
        return client.greet(self.name, self.token)


class AboutRobot(Message):
    """Is about one robot.

    Attributes:
        robot: Key of the robot; not needed where there is only one.
    """

    robot: Robot = ""


class Drive(AboutRobot, tag="drive"):
    """Take the wheel: from now on this program may move the robot, and no other.

    While the robot may move, the program has to send a message at least every 0.3 s. The first command that moves a
    robot which no client drives takes the wheel, too.
    """

    force: Annotated[bool, Meta(description="Whether to take over from another driver, who is stopped first.")] = False

    def carry_out(self, client: Client) -> None:
        client.take(self.robot, by_force=self.force)


class Leave(AboutRobot, tag="leave"):
    """Give the wheel back: the robot stops."""

    def carry_out(self, client: Client) -> None:
        client.leave(self.robot)


class Beat(Message, tag="beat"):
    """Say that the program is still there. The result names the robots that it drives."""

    def carry_out(self, client: Client) -> Result:
        return {"drives": client.driven()}


class Watch(AboutRobot, tag="watch"):
    """Ask for readings again and again: a ``readings`` message comes so many times a second, or as fast as the link is.

    Several watches of one robot differ in their readings; the same readings again only change the rate.
    """

    readings: Annotated[
        list[Annotated[str, Meta(max_length=20, extra_json_schema={"enum": list(WATCHABLE)})]],
        Meta(max_length=len(WATCHABLE), description="Names of the readings; all sensors of the firmware if empty."),
    ] = []
    rate: Annotated[float, Meta(ge=SLOWEST, le=FASTEST, description="Messages a second, Hz.")] = 20.0

    def carry_out(self, client: Client) -> Result:
        return client.watch(self.robot, self.readings, self.rate)


class Unwatch(AboutRobot, tag="unwatch"):
    """End a watch of these readings, or all watches of the robot."""

    readings: Annotated[
        list[Annotated[str, Meta(max_length=20, extra_json_schema={"enum": list(WATCHABLE)})]],
        Meta(max_length=len(WATCHABLE), description="Names of the readings as in watch; every watch if empty."),
    ] = []

    def carry_out(self, client: Client) -> None:
        client.unwatch(self.robot, self.readings)


class Events(Message, tag="events"):
    """Ask for what happens on the robots and their links, as ``event`` messages, or end that."""

    on: Annotated[bool, Meta(description="Whether events are wanted.")] = True

    def carry_out(self, client: Client) -> None:
        client.tell_events(on=self.on)


class Command(AboutRobot):
    """One command of the robot."""

    entry: ClassVar[CatalogueEntry]

    def carry_out(self, client: Client) -> Result:
        arguments = [getattr(self, name) for name, _, _ in self.entry.parameters]
        return client.command(self.robot, self.entry, arguments)


class StopCommand(Command):
    """The command that stops a robot; everybody may send it."""

    def carry_out(self, client: Client) -> Result:
        return client.stop(self.robot)


DOOR_MESSAGES: tuple[type[Message], ...] = (Hello, Drive, Leave, Beat, Watch, Unwatch, Events)
"""The messages that are not commands of the robot."""


def _command(entry: CatalogueEntry) -> type[Command]:
    """Return the class of the messages of one command."""
    fields: list[tuple[str, object] | tuple[str, object, object]] = []
    for name, quantity, default in entry.parameters:
        kind = _argument(quantity)
        fields.append((name, kind) if default is entry.signature.empty else (name, kind, _plain_default(default)))
    title = "".join(part.capitalize() for part in entry.name.split("_"))
    found = msgspec.defstruct(
        title,
        fields,
        bases=(StopCommand if entry.name == "stop" else Command,),
        namespace={"entry": entry, "__doc__": entry.doc},
        module=__name__,
        tag=entry.name,
        kw_only=True,
    )
    return cast("type[Command]", found)


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


COMMANDS: Mapping[str, type[Command]] = {name: _command(entry) for name, entry in catalogue().items()}
"""The messages of the robot's commands, by name."""

MESSAGES: tuple[type[Message], ...] = (*DOOR_MESSAGES, *COMMANDS.values())
"""All of them."""

NAMES: tuple[str, ...] = tuple(str(kind.__struct_config__.tag) for kind in MESSAGES)
"""What ``do`` may be."""

MOTIONS = ("go", "turn", "go_to")
"""What programs ask for that is not a command of the robot: elib drives it step by step, in Python."""

_DECODER: Decoder[Message] = Decoder(Union[MESSAGES])  # noqa: UP007  # a tuple of types has no |


def _hint(do: object) -> str:
    if not isinstance(do, str) or not do:
        return 'a message is one JSON object, such as {"do": "hello", "id": 1}'
    if do in COMMANDS:
        return f"the arguments are {COMMANDS[do].entry.usage}"
    if do in NAMES:
        return "elib serve --schema prints the fields of every message"
    if do in MOTIONS:
        return "a whole motion is a loop of set_speed and encoders in your program"
    near = get_close_matches(do[:40], NAMES, 1)
    return f"did you mean {near[0]!r}?" if near else "elib serve --schema prints every message"


def decode(text: str) -> Decoded:
    """Return the number of a message, and what a program said; of a wrong message, what is wrong with it."""
    return decoded(_DECODER, text, _hint)
