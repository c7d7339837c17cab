"""What a program may send: the messages of the door itself, and one made from each row of the catalogue of commands.

A message is a JSON object such as ``{"do": "set_speed", "id": 7, "left": 0.5, "right": 0.5}``.
"""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from inspect import Parameter
from typing import Annotated

from msgspec import Meta

from elib.doors.serve.client import DOOR_MESSAGES, Client, Robot
from elib.link.protocol.profiles import FIRMWARES, rule
from elib.link.protocol.quantities import Quantity
from elib.panel.server.conversation import Message, Result, decoder_of, message_of
from elib.robot.actions import CatalogueEntry, catalogue


def _command(entry: CatalogueEntry) -> type[Message]:
    """Return the class of the messages of one command; everybody may send that to stop."""

    def act(client: Client, robot: str, **arguments: object) -> Result:
        if entry.name == "stop":
            return client.stop(robot)
        return client.command(robot, entry, [arguments[each] for each, _, _ in entry.parameters])

    fields = [Parameter("robot", Parameter.KEYWORD_ONLY, annotation=Robot, default="")]
    fields += (
        Parameter(
            name,
            Parameter.KEYWORD_ONLY,
            annotation=_argument(quantity),
            default=default if default is Parameter.empty else _plain_default(default),
        )
        for name, quantity, default in entry.parameters
    )
    return message_of(act, entry.name, fields, entry.doc)


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


decode = decoder_of(MESSAGES.values(), _hint)
