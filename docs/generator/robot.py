"""The page of the robot objects: opening one, and what it has beside its commands."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Callable, Iterator

import elib
from elib.link.protocol.commands import SPECS
from elib.link.protocol.table import example_of
from elib.robot.actions import Actions
from generator.markdown import description, docstring, inline, joined

INTRODUCTION = """# Robots

How to find and open a robot, and what it offers beside its [commands](commands.md).
[API styles](../concepts/api-styles.md) compares the four ways to call; [Telemetry](telemetry.md) describes `watch` and
`events`. The examples are typed at Python's prompt, after `robot = elib.connect("sim://?speed=max")`.
"""
FUNCTIONS: tuple[Callable[..., object], ...] = (
    elib.connect,
    elib.open,
    elib.run,
    elib.robot_url,
    elib.robot_urls,
    elib.reconnecting,
    elib.find,
    elib.swarm,
    elib.wait,
    elib.really,
    elib.behaviour,
    elib.react,
    elib.play,
    elib.read_log,
    elib.read_recording,
)
INNER = ("context", "execute", "motion", "robot", "session", "time_left")
"""Members for those who build on elib, not for those who drive a robot with it."""
CLASSES = (
    elib.BlockingEpuck,
    elib.Epuck,
    elib.BeginEpuck,
    elib.Pending,
    elib.CallbackEpuck,
    elib.Reconnecting,
    elib.Found,
    elib.Swarm,
    elib.Outcomes,
    elib.RunContext,
)


def page() -> str:
    """Return the page."""
    parts = [INTRODUCTION, *(function(each) for each in FUNCTIONS), *(robot(each) for each in CLASSES)]
    parts.append(f"## __version__\n\n`elib.__version__` is the version of the library as text: `{elib.__version__}`.")
    return joined(parts)


def function(what: Callable[..., object], package: str = "elib") -> str:
    """Return the entry of a function, as it is imported from *package*."""
    called = f"{'await ' * inspect.iscoroutinefunction(what)}{what.__name__}{shown(what)}"
    return f"## {package}.{what.__name__}\n\n```text\n{called}\n```\n\n{docstring(what.__doc__)}"


def is_command(name: str) -> bool:
    """Return whether another page describes a member."""
    return name in SPECS or hasattr(Actions, name) or name in INNER


def robot(kind: type) -> str:
    """Return the entry of a robot's class."""
    return entry(kind, is_command)


def entry(kind: type, is_left_out: Callable[[str], bool], package: str = "elib") -> str:
    """Return the entry of a class, as it is imported from *package*."""
    return f"## {package}.{kind.__name__}\n\n{docstring(kind.__doc__)}\n\n" + "\n".join(members(kind, is_left_out))


def members(kind: type, is_left_out: Callable[[str], bool] = is_command) -> Iterator[str]:
    """Yield a line for every public member but those left out."""
    for name, member in inspect.getmembers_static(kind):
        if name.startswith("_") or is_left_out(name):
            continue
        if isinstance(member, classmethod):
            yield f"- `{name}{shown(getattr(kind, name))}`: {inline(description(member.__doc__))}"
        if isinstance(member, property):
            yield f"- `{name}`: {inline(description(member.__doc__))}"
        elif inspect.isfunction(member):
            yield f"- `{name}{shown(member)}`: {inline(description(member.__doc__))}"
        else:
            continue
        example = example_of(inspect.getdoc(member) or "")
        if example and kind is elib.BlockingEpuck:
            yield textwrap.indent(f"\n```pycon\n{example}\n```\n", "  ", lambda line: bool(line.strip()))


def shown(what: Callable[..., object]) -> str:
    """Return a signature in short: names and defaults."""
    parts = []
    is_keyword = False
    for item in inspect.signature(what).parameters.values():
        if item.name == "self":
            continue
        if item.kind is item.KEYWORD_ONLY and not is_keyword:
            is_keyword = True
            parts.append("*")
        star = "*" * (item.kind is item.VAR_POSITIONAL)
        is_keyword = is_keyword or bool(star)
        parts.append(star + item.name if item.default is item.empty else f"{item.name}={item.default!r}")
    return re.sub(r"\s+", " ", f"({', '.join(parts)})")
