"""The page of errors: the tree, and for each class its cause, its cure and the messages it comes with."""

from __future__ import annotations

import ast
import inspect
import re
from pathlib import Path

import elib
from elib.base import errors
from generator.markdown import block, docstring, joined, table

INTRODUCTION = """# Errors

Every error of elib is an `ElibError`. Its text says what happened and to which request, and ends with a hint where
there is one; both are there as `.message` and `.hint`.

```text
{tree}
```

An error that resembles one of Python's own is one too, so `except TimeoutError` and `except ConnectionError` work.
"""
CURES = {
    "ElibError": "Catch this one to catch them all.",
    "ArgumentError": "Correct the call. It raises at once, before a byte is sent, so nothing has changed.",
    "Unsupported": "Ask for something else, or use another firmware; [Commands](commands.md) says which has what.",
    "SwarmError": "Look at `robot` for who failed first and at `errors` for why; with `.collect` the others go on.",
    "ReplyTimeout": "Ask again. The link has repaired itself by then, or the next call says that it is lost. See the"
    " [guide to timeouts](../guides/timeouts.md).",
    "CallCancelled": "Begin the call again if its value is still of use: the link is open.",
    "ProtocolError": "Catch one of its subclasses.",
    "LocalProtocolError": "Only who drives `elib.link.protocol` by hand meets it: finish the request under way first.",
    "RemoteProtocolError": "Ask again; the session brings the line back into step first. If it comes often, the line is"
    " noisy, or the robot runs another firmware than elib takes it for.",
    "CommandRejected": "Ask `version()` which firmware answers. With `firmware=` given, leave it out.",
    "NotAnEpuck": "Try another port; check that the standard firmware is on the robot.",
    "LinkError": "Look at the port itself: it is not a serial port, or the system refuses it and says why.",
    "LinkNotFound": "Ask `elib find` for the name. Is the robot switched on, paired and in range?",
    "LinkBusy": "Close the other program; the message names it where the system tells.",
    "LinkDenied": "Get the right to open the port; the hint says how.",
    "LinkClosed": "Make a new robot object. One that was closed, or never opened, stays so.",
    "LinkLost": "See to the robot (battery, range), then open a new connection, or let `elib.reconnecting` do it. Calls"
    " on this one repeat the reason. See [Link faults](../guides/link-faults.md).",
    "RobotSilent": "Switch the robot on, charge it, and turn its selector to a program that talks; `elib doctor URL`"
    " looks at everything in between.",
    "ReplayDiffers": "Run the program that was recorded, as it was; `replay://FILE?fork=SECONDS` goes on from any"
    " moment in the simulator. See [Replay](../guides/replay.md).",
    "MotionError": "Catch one of its subclasses.",
    "MotionBusy": "Await the motion that is under way, or cancel it; `stop()` ends it too.",
    "NoWay": "Is the pose that of the map, and is what it shows still there? Then another goal, or a new map.",
    "MotionInterrupted": "Let one part of the program drive at a time: the other call has the wheels now.",
    "SimulationError": "Let `elib.connect()` or `elib.run()` choose the event loop; real ports need real time.",
    "SimulationStalled": "Put a timeout around what may never come. The message names the tasks and where they wait.",
}
"""What to do about each, for a person."""


def page() -> str:
    """Return the page.

    Raises:
        KeyError: An error has no cure yet.
    """
    said = messages()
    kinds = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, errors.ElibError)]
    parts = [INTRODUCTION.format(tree=block(errors.__doc__))]
    for kind in kinds:
        bases = " and ".join(f"`{base.__name__}`" for base in kind.__bases__)
        about = f"{docstring(kind.__doc__)}\n\nBased on {bases}.\n\n**What to do.** {CURES[kind.__name__]}"
        parts.append(f"## {kind.__name__}\n\n{about}")
        if rows := said.get(kind.__name__):
            parts.append(table(("Message", "Hint"), rows))
    return joined(parts)


def messages() -> dict[str, list[tuple[str, str]]]:
    """Return message and hint of every place that makes an error, by class; argument errors are too many."""
    found: dict[str, list[tuple[str, str]]] = {}
    for path in sorted(Path(inspect.getfile(elib)).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.args):
                continue
            kind = node.func.id
            is_rule = kind == "ArgumentError" or (kind == "SimulationError" and "physics" in path.parts)
            if is_rule or not hasattr(errors, kind):
                continue  # a line for every rule of arguments and world files would hide the rest
            message = template(node.args[0])
            hint = next((template(item.value) for item in node.keywords if item.arg == "hint"), "")
            says_something = re.search("[a-z]", re.sub(r"\*[^*]*\*", "", message)) or hint
            if says_something and (message, hint) not in found.setdefault(kind, []):
                found[kind].append((message, hint))
    return found


def template(node: ast.expr) -> str:
    """Return a message as it stands in the code, what is put in by its name in italics."""
    match node:
        case ast.Call(func=ast.Name(id="install"), args=[ast.Constant(value=str(extra))]):
            return f"install the extra {extra}: *the command for it*"
        case ast.Constant(value=str(text)):
            return text.strip().replace("<", "&lt;").replace("\n", " ")
        case ast.JoinedStr(values=parts):
            return "".join(template(part) if isinstance(part, ast.FormattedValue) else _literal(part) for part in parts)
        case ast.FormattedValue(value=value):
            return f"*{_name(value)}*"
        case ast.BinOp(left=left, right=right):
            return template(left) + template(right)
    return ""


def _literal(node: ast.expr) -> str:
    return str(node.value).replace("<", "&lt;").replace("\n", " ") if isinstance(node, ast.Constant) else ""


def _name(node: ast.expr) -> str:
    for each in ast.walk(node):
        match each:
            case ast.Attribute(attr=name) | ast.Name(id=name):
                return name.replace("_", " ").strip().lower()
    return "value"
