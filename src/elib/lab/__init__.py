"""Labs: tasks with goals, which a program is checked against in worlds that it cannot reach.

A lab is a folder with a file ``lab.toml`` (:mod:`elib.lab.labfile`). :func:`run_variant` runs a program over a
lock-step link (:mod:`elib.lab.marker`), and the goals judge what the robots did (:mod:`elib.lab.goals`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from elib.lab.goal import Goal as Goal
    from elib.lab.labfile import Lab as Lab
    from elib.lab.labfile import Variant as Variant
    from elib.lab.labfile import find_lab as find_lab
    from elib.lab.labfile import load_lab as load_lab
    from elib.lab.running import GoalResult as GoalResult
    from elib.lab.running import Running as Running
    from elib.lab.running import VariantResult as VariantResult
    from elib.lab.running import program_command as program_command
    from elib.lab.running import run_variant as run_variant

_HOMES = {
    "Goal": "goal",
    "Lab": "labfile",
    "Variant": "labfile",
    "find_lab": "labfile",
    "load_lab": "labfile",
    "GoalResult": "running",
    "Running": "running",
    "VariantResult": "running",
    "program_command": "running",
    "run_variant": "running",
}
"""The module of each name. The program's own process imports this package as well, and must start fast."""

__all__ = list(_HOMES)


if not TYPE_CHECKING:  # to a type checker, every name would then be there

    def __getattr__(name: str) -> object:
        if name not in _HOMES:
            raise AttributeError(f"module 'elib.lab' has no attribute {name!r}")
        import importlib

        return getattr(importlib.import_module(f"elib.lab.{_HOMES[name]}"), name)
