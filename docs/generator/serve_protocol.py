"""The page of the protocol of elib serve, from its JSON Schema and a session with a real door."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
from typing import Any

from websockets.asyncio.client import ClientConnection, connect

from elib.doors.robots import connected
from elib.doors.serve.answers import PROTOCOL, TOLD
from elib.doors.serve.client import DOOR_MESSAGES, MAX_WATCHES
from elib.doors.serve.door import MAX_PROGRAMS, PATH, ProgramDoor
from elib.doors.serve.door import MESSAGES as RATE
from elib.doors.serve.messages import COMMANDS
from elib.doors.serve.schema import reading_kinds, schema
from elib.panel.drivelock import DEAD_MAN
from elib.panel.server.conversation import ANSWERS, MAX_MESSAGE, MAX_WAITING, Message
from elib.panel.server.http import READING_TIME
from elib.panel.server.listening import PORT, listen
from generator.markdown import inline, joined, table

Schema = dict[str, Any]

INTRODUCTION = f"""# Protocol of elib serve

`elib serve URL...` lets programs in any language drive and watch robots: `ws://127.0.0.1:{PORT}{PATH}` takes
WebSocket connections, and each text message is one JSON object. This page is version {PROTOCOL} of the protocol; the
path has its number. `elib serve --schema` prints the same as JSON Schema, for programs that generate code.

## Rules

- A message has `do`, the name of what is wanted, and `id`, any number from 1 on. Every request with a number gets
  exactly one `answer` with the same number, in bounded time. Without a number, only a failure is told, by `error`.
- `robot` names a robot by its key: "1", "2" and so on, as the answer to `hello` lists them. It can be left out when
  there is only one robot.
- Unknown or wrong fields are refused. Units are those of elib: rev/s, m, rad, s.
- One program or page drives a robot at a time; all others may watch it. The first command that moves a robot which
  no client drives takes the wheel, `drive` with `force` takes it over, and `leave` gives it back.
- While its robot may move, the driver has to send a message at least every {DEAD_MAN:g} s, best a `beat` every 0.1 s.
  Otherwise the robot stops. A connection that ends stops its robot at once.
- Everybody may send `stop`. When somebody else has stopped the robot, also a person on the page, the driver's commands
  are refused until it sends `drive` again.
- A driver whose robot was stopped under it is told so by an `error` with the key of the robot.
- A program that does not read gets no newer readings until it has read, and then the newest; it is disconnected when
  it leaves messages unread for {READING_TIME:g} s.
- Limits: {MAX_MESSAGE:,} bytes a message, {RATE:g} messages a second, {MAX_WAITING} requests that wait for answers,
  {ANSWERS:g} answers a second (later ones wait), {MAX_WATCHES} watches a program, {MAX_PROGRAMS} programs. One that
  sends more or larger messages is disconnected.
- A browser page of another site is refused unless `--allow-origin` names its site. Other computers reach the door only
  with `--host`; then the first message must be a `hello` with the printed token, within 5 s.

## An example session

`>` is what the program sends, `<` what it is told. The answers are those of a virtual robot; numbers that
differ between two runs are replaced, and long texts are cut.
"""
SESSION: tuple[tuple[Schema, int], ...] = (
    ({"do": "hello", "id": 1, "name": "my program"}, 1),
    ({"do": "set_speed", "id": 2, "left": 0.5, "right": 0.5}, 1),
    ({"do": "beat"}, 0),
    ({"do": "encoders", "id": 3}, 1),
    ({"do": "set_speed", "id": 4, "left": 5, "right": 0.5}, 1),
    ({"do": "watch", "id": 5, "readings": ["proximity"], "rate": 1}, 2),
    ({"do": "unwatch", "id": 6}, 1),
    ({"do": "distance", "id": 7}, 1),
    ({"do": "set_camera", "id": 8, "width": 8, "height": 8, "mode": "grey"}, 1),
    ({"do": "image", "id": 9}, 1),
    ({"do": "stop", "id": 10}, 1),
)
"""What is sent, and how many messages follow."""
MAX_SHOWN = 330
"""Characters of a message of the session that are shown."""


def page() -> str:
    """Return the page."""
    parts = schema()["$defs"]
    found = [INTRODUCTION, session(), "## Messages of the door"]
    found += [message(kind, parts) for kind in DOOR_MESSAGES.values()]
    found.append(
        "## Commands of the robot\n\nThey are the [commands](commands.md) of elib under the same names, where their"
        " ranges on each firmware are explained. A firmware that does not have one answers with `Unsupported`."
    )
    found.append(commands(parts))
    found.append("## What a program is told")
    for kind in TOLD:
        part = parts[kind.__name__]
        found.append(record(part, f"{part['properties']['type']['enum'][0]}: "))
    found.append("## Readings\n\nAll have `time`, s on the clock of the door, too.")
    found.append(readings(parts))
    found += [record(parts[name]) for name in ("Trouble", "Picture", "Welcome", "RobotInfo")]
    return joined(found)


def session() -> str:
    """Return the example session with the answers of a virtual robot."""
    with contextlib.ExitStack() as stack, open(os.devnull, "w", encoding="utf-8") as nothing:
        stack.enter_context(contextlib.redirect_stderr(nothing))
        return "```text\n" + "\n".join(asyncio.run(_converse())) + "\n```"


async def _converse() -> list[str]:
    address = listen(port=0)
    lines = []
    with contextlib.closing(address.socket):
        async with connected(["sim://?seed=1"], page=address, door=ProgramDoor()):
            url = f"ws://127.0.0.1:{address.port}{PATH}"
            async with connect(url, compression=None, proxy=None) as socket:
                for sent, answers in SESSION:
                    await socket.send(json.dumps(sent))
                    lines.append(f"> {json.dumps(sent)}")
                    lines += [f"< {_stable(await _told(socket))}" for _ in range(answers)]
    return lines


async def _told(socket: ClientConnection) -> str:
    """Return the next message but for errors: on a busy computer the robot may be stopped because of a late message."""
    while '"type":"error"' in (text := str(await socket.recv())):
        pass
    return text


def _stable(text: str) -> str:
    """Return a message without what differs between two runs."""
    text = re.sub(r'"time":[0-9.]+', '"time":12.5', text)
    text = re.sub(r'"(left|right)":[0-9]+,"right":[0-9]+', '"left":4,"right":4', text)
    text = re.sub(r'("(?:front|rear|diagonal)_\w+"|"left"|"right"):[0-9]+(?=[,}])', r"\1:12", text)
    text = re.sub(r'"png":"[^"]{24}[^"]*"', '"png":"iVBORw0KGgoAAAANSUhEUgAA…"', text)
    return text if len(text) <= MAX_SHOWN else text[:MAX_SHOWN] + "…"


def message(kind: type[Message], parts: dict[str, Schema]) -> str:
    """Return the entry of a message of the door."""
    part = parts[kind.__name__]
    return "\n\n".join(
        [
            f"### {kind.__struct_config__.tag}",
            *(inline(text) for text in part["description"].split("\n\n")),
            fields(part, without=("do", "id")),
            f"Result: {shown(part['x-result'])}.",
        ]
    )


def fields(part: Schema, without: tuple[str, ...] = ()) -> str:
    """Return the table of the fields of a message."""
    required = part.get("required", [])
    rows = [
        (
            f"`{name}`",
            shown(each),
            "needed" if name in required else f"`{json.dumps(each.get('default'))}`",
            inline(each.get("description", "")),
        )
        for name, each in part["properties"].items()
        if name not in without
    ]
    return table(("Field", "Type", "Default", "Meaning"), rows) if rows else "It has no fields of its own."


def commands(parts: dict[str, Schema]) -> str:
    """Return the table of the commands."""
    rows = []
    for name, kind in COMMANDS.items():
        part = parts[kind.__name__]
        own = {field: part["properties"][field] for field in kind.__struct_fields__ if field not in ("id", "robot")}
        arguments = "; ".join(_argument(field, each) for field, each in own.items())
        rows.append((f"[`{name}`](commands.md#{name})", arguments or "-", shown(part["x-result"])))
    return table(("do", "Fields", "Result"), rows)


def _argument(name: str, part: Schema) -> str:
    default = f" = `{json.dumps(part['default'])}`" if "default" in part else ""
    rule = inline(part.get("description", "a text"))
    return f"`{name}`{default}: {rule.lower() if 'enum' in part else rule}"


def readings(parts: dict[str, Schema]) -> str:
    """Return the table of the readings."""
    rows = []
    for kind in reading_kinds():
        part = parts[f"{kind.__name__}Reading"]
        own = [f"`{name}` {shown(each)}" for name, each in part["properties"].items() if name != "time"]
        rows.append((part["title"], "; ".join(own)))
    return table(("Reading", "Fields"), rows)


def record(part: Schema, kind: str = "") -> str:
    """Return the entry of an object, all of whose fields are always there; *kind* is that of a message."""
    rows = [(f"`{n}`", shown(each), inline(each.get("description", ""))) for n, each in part["properties"].items()]
    fields = table(("Field", "Type", "Meaning"), rows)
    return joined([f"### {kind}{part['title']}", inline(part["description"]), fields])


def shown(part: Schema) -> str:
    """Return a type in words, with its unit."""
    if "$ref" in part:
        name = part["$ref"].rpartition("/")[2]
        return f"[{name}](#{'readings' if name.endswith('Reading') else name.lower()})"
    if "const" in part or "enum" in part:
        values = part["enum"] if "enum" in part else [part["const"]]
        return ", ".join(f"`{json.dumps(value)}`" for value in values)
    if "oneOf" in part or "anyOf" in part:
        return " or ".join(shown(each) for each in part.get("oneOf") or part["anyOf"])
    kind = part.get("type", "any value")
    text = " or ".join(kind) if isinstance(kind, list) else str(kind)
    if text == "array":
        text = f"array of {shown(part['items'])}" if "items" in part else text
    if text == "object" and "properties" in part:
        text = "object of " + "; ".join(f"`{name}` {shown(each)}" for name, each in part["properties"].items())
    unit = part.get("x-unit")
    return f"{text}, {unit}" if unit else text
