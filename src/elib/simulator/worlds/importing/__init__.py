"""Worlds of other simulators as worlds of elib: what is flat is taken, and what is not is named with its line.

Begin with ``plan.py``: each reader beside it fills a :class:`~elib.simulator.worlds.importing.plan.Plan`.
"""

from __future__ import annotations

from pathlib import Path

from elib.base.errors import ArgumentError
from elib.base.rules import MAX_TEXT
from elib.simulator.worlds.importing import argos, playground, stage, webots
from elib.simulator.worlds.importing.plan import Plan

READERS = {
    ".wbt": webots.read,
    ".playground": playground.read,
    ".argos": argos.read,
    ".world": stage.read,
}
"""The reader of each ending: of Webots, Aseba Playground, ARGoS and Stage."""


def read_world(path: Path) -> Plan:
    """Return what the world file of another simulator says.

    Raises:
        ArgumentError: It has another ending, or cannot be read.
        SimulationError: It breaks a rule of its format; the message names the file and the line.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise ArgumentError(
            f"{path} is no world of a simulator that elib can read", hint=f"such files end in {', '.join(READERS)}"
        )
    plan = Plan(path)
    reader(plan, plan.text_of(path))
    plan.about = "".join(filter(str.isprintable, " ".join(plan.about.split())))[:MAX_TEXT]
    return plan


__all__ = ["READERS", "read_world"]
