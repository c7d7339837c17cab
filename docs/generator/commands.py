"""The page of commands, made from the command table and the profiles."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable

from elib.base.errors import Unsupported
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context, Profile
from elib.link.protocol.profiles import PROFILES, rule
from elib.link.protocol.styles import Action
from elib.link.protocol.table import Spec
from elib.robot.actions import Actions, Messenger, Motions
from generator.markdown import bullets, docstring, inline, joined, table

INTRODUCTION = """# Commands

Every command is a method of the robot, under the same name in all [four API styles](../concepts/api-styles.md).
Arguments are checked before anything is sent: a wrong one raises `ArgumentError`, and a command that the robot's
firmware does not have raises `Unsupported`. Each call waits at most as long as its entry says, counted from the call;
`within(seconds)` changes that for one call.

*On the wire* shows the letter of the text command or the opcode of the binary one. A binary frame ends with `00`, and
the text question `C` follows it as a guard ([why](../decisions/0002-a-text-question-behind-every-binary-frame.md)).

The examples are typed at Python's prompt. Before each stands

```pycon
>>> import math
>>> import elib
>>> robot = elib.connect("sim://?speed=max")
```

with `sim://?firmware=epuck2&speed=max` for what only an e-puck2 has. `help(robot.set_led)` shows the same entry.
"""
ACTIONS = tuple(name for kind in (Motions, Actions) for name, row in vars(kind).items() if isinstance(row, Action))
"""What needs several commands: the motions, then the others."""


def page() -> str:
    """Return the page."""
    parts = [INTRODUCTION, overview(), *(entry(spec) for spec in SPECS.values())]
    parts.append(
        "## Made of several commands\n\nThese are methods of the robot like the others; a motion and"
        " `sensors` may send more than one request. `neighbours` and `send_message` send none: only robots of the"
        " simulator have them."
    )
    parts += [action(name) for name in ACTIONS]
    parts.append(firmwares())
    return joined(parts)


def overview() -> str:
    """Return the table of the commands that each firmware has."""
    rows = [
        (f"[`{spec.name}`](#{spec.name})", returns(spec.signature), *where(spec.name))
        for spec in sorted(SPECS.values(), key=lambda spec: spec.name)
    ]
    rows += [(f"[`{name}`](#{name})", returns(getattr(Actions, name).__signature__), *where(name)) for name in ACTIONS]
    return "## Which command exists where\n\n" + table(("Command", "Returns", *PROFILES), rows)


def where(name: str) -> list[str]:
    """Return a cell for each firmware: whether it has the command."""
    if hasattr(Messenger, name):
        return ["simulated" for _ in PROFILES]
    return ["-" if name in profile.absent else "yes" for profile in PROFILES.values()]


def entry(spec: Spec[object]) -> str:
    """Return the entry of a command."""
    parts = [f"## {spec.name}", f"```text\n{spec.name}{shown(spec.signature)}\n```", docstring(spec.doc)]
    if spec.parameters:
        parts.append(
            table(("Argument", "Unit and range"), ((f"`{each.name}`", rule(each.quantity)) for each in spec.parameters))
        )
    if spec.example:
        parts.append(f"```pycon\n{spec.example}\n```")
    facts = []
    if spec.signature.return_annotation != "None":
        facts.append(f"Returns {returns(spec.signature)}.")
    facts.append(f"Waits up to {spec.timeout:g} s.")
    if spec.urgent:
        facts.append("Goes first among the calls that wait.")
    if spec.replaces:
        facts.append(f"Takes the place of unsent {' and '.join(f'`{name}`' for name in sorted(spec.replaces))} calls.")
    facts.append("On the wire: " + "; ".join(wire(spec)) + ".")
    busy = [
        f"{profile.service[spec.name]:g} s ({name})"
        for name, profile in PROFILES.items()
        if spec.name in profile.service
    ]
    if busy:
        facts.append("The robot is busy meanwhile and reads nothing, up to " + ", ".join(busy) + ".")
    facts += absent(spec.name)
    return "\n\n".join([*parts, bullets(facts)])


def action(name: str) -> str:
    """Return the entry of a method made of several commands."""
    row = getattr(Actions, name)
    facts = absent(name)
    if row.__signature__.return_annotation != "None":
        facts.insert(0, f"Returns {returns(row.__signature__)}.")
    parts = [f"## {name}", f"```text\n{name}{shown(row.__signature__)}\n```", docstring(row.__doc__)]
    return "\n\n".join([*parts, bullets(facts)])


def absent(name: str) -> list[str]:
    """Return a sentence for each reason why a firmware does not have it."""
    reasons: dict[str, list[str]] = {}
    for profile in PROFILES.values():
        if name in profile.absent:
            reasons.setdefault(profile.absent[name], []).append(profile.name)
    return [f"Not on {', '.join(names)}: {inline(reason)}." for reason, names in reasons.items()]


def wire(spec: Spec[object]) -> list[str]:
    """Return the forms on the wire, with the firmwares where they differ."""
    forms: dict[str, list[str]] = {}
    for profile in PROFILES.values():
        try:
            code = spec.form(Context(profile)).code
        except Unsupported:
            continue
        forms.setdefault(f"text `{spec.letter}`" if code is None else f"binary `{code:02X}`", []).append(profile.name)
    if len(forms) == 1:
        return list(forms)
    return [f"{form} ({', '.join(names)})" for form, names in forms.items()]


def shown(signature: inspect.Signature) -> str:
    """Return a signature without annotations, enumerations by their names."""
    return "(" + ", ".join(_shown(item) for item in signature.parameters.values()) + ")"


def _shown(item: inspect.Parameter) -> str:
    if item.default is item.empty:
        return item.name
    return f"{item.name}={getattr(item.default, 'name', item.default)}"


def returns(signature: inspect.Signature) -> str:
    """Return the type of a result, with a link if the page of values has it."""
    text = str(signature.return_annotation)
    name = text.removeprefix("v.")
    if text == "None":
        return "-"
    if name == "NDArray[int16]":
        return "a NumPy array"
    return f"`{name}`" if not re.fullmatch(r"[A-Z]\w+", name) else f"[`{name}`](values.md#{name.lower()})"


def firmwares() -> str:
    """Return the table of what differs between firmwares."""
    return (
        "## Firmwares\n\n"
        "The answer to `V` decides which of these profiles is used; `firmware=` of `connect` and `open` overrides"
        " it.\n\n" + table(("", *PROFILES), _facts(list(PROFILES.values())))
    )


def _facts(profiles: list[Profile]) -> Iterable[list[str]]:
    yield ["answer to `V` contains", *(f"`{each.version}`" for each in profiles)]
    yield ["most bytes of a picture", *(str(each.picture_bytes) for each in profiles)]
    yield ["zooms", *("any that fits" if each.zooms is None else ", ".join(map(str, each.zooms)) for each in profiles)]
    yield ["camera `Mounting`", *(each.mounting.name for each in profiles)]
    yield ["bytes that may wait unread", *(str(each.receive_ring) for each in profiles)]
    yield ["acceleration at 0 g, counts", *(f"{each.acceleration_zero:g}" for each in profiles)]
    yield ["counts for 1 g", *(f"{each.counts_per_g:g}" for each in profiles)]
