"""The page of telemetry: watching a robot, the snapshots it gives, and the events of its link."""

from __future__ import annotations

import elib
from elib.robot.events import BlockingEvents, Events, RobotEvent
from elib.robot.snapshot import WATCHABLE
from generator.markdown import docstring, field_table, inline, joined, section
from generator.robot import function, members, robot

INTRODUCTION = """# Telemetry

What a robot tells while it works. The [guide](../guides/telemetry.md) shows how it is used.
"""
EVENTS = (elib.LinkDown, elib.LinkBack, elib.UnexpectedReset, elib.LateAnswer)
SHOWN = ("- `recent", "- `dropped", "- `within")
"""Of the members of ``robot.events`` those for who reads it; the others are for who writes it."""


def page() -> str:
    """Return the page."""
    parts = [INTRODUCTION, watching(), robot(elib.Watch), robot(elib.BlockingWatch), snapshot(), events()]
    return joined(parts)


def watching() -> str:
    """Return the entry of ``robot.watch``."""
    entry = function(elib.Epuck.watch).replace("## elib.watch", "## robot.watch")
    names = ", ".join(f"`{name}`" for name in WATCHABLE)
    return f"{entry}\n\nThe names are {names}. [Which command exists where](commands.md) says which firmware has what."


def snapshot() -> str:
    """Return the entry of snapshots."""
    about, _, _ = docstring(elib.Snapshot.__doc__).partition("**Attributes**")
    fields = field_table(section(elib.Snapshot.__doc__, "Attributes"))
    return "\n\n".join(["## elib.Snapshot", about.strip(), fields, "\n".join(members(elib.Snapshot))])


def events() -> str:
    """Return the entries of ``robot.events`` and of each kind of event."""
    parts = [
        f"## robot.events\n\n{docstring(Events.__doc__)}",
        "\n".join(line for line in members(Events) if line.startswith(SHOWN)),
        f"On a blocking robot: {inline((BlockingEvents.__doc__ or '').replace('What happened', 'what happened', 1))}",
        f"### elib.RobotEvent\n\n{docstring(RobotEvent.__doc__)}",
    ]
    parts += [f"### elib.{kind.__name__}\n\n{docstring(kind.__doc__)}" for kind in EVENTS]
    return "\n\n".join(parts)
