"""The mistakes that a teacher keeps with a lab: programs whose first line says which goal fails, and why."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from elib.base.rules import nearest
from elib.lab.goal import MISSED, GoalResult
from elib.lab.labfile import Lab

FOLDER = Path("teacher", "mistakes")
"""In the folder of a lab."""

CLAIM = re.compile(r"# fails: (\S+): (\S.*)")
"""The first line of a mistake: the goal that fails, and the reason for a person."""


def is_mistake(lab: Lab, program: Path) -> bool:
    """Return whether a program, or a folder with its files, is among the mistakes of the lab."""
    return program.resolve().parent == lab.folder / FOLDER


def _claimed(text: str) -> str:
    """Return which goal the first line of a mistake says to fail; an empty string if it does not say one."""
    claim = CLAIM.fullmatch(text.partition("\n")[0].rstrip())
    return claim[1] if claim else ""


def wrong_claim(lab: Lab, text: str, runs: Sequence[Sequence[GoalResult]]) -> str:
    """Return why a mistake fails in no variant as its first line says; an empty string if it does in one."""
    if not runs:
        return "it could not be run"
    name = _claimed(text)
    if not name:
        return "its first line does not say what fails: # fails: GOAL: reason"
    names = [goal.name for goal in lab.goals]
    if name not in names:
        return f"it should fail {name}, but there is no such goal: {nearest(name, names)}"
    failed = [each for goals in runs for each in goals if not each.holds]
    if any(each.goal.name == name and not each.text.startswith(MISSED) for each in failed):
        return ""
    fail = {each.goal.name for each in failed}
    also = ", ".join(each for each in names if each in fail - {name})
    others = f"{also} fails" if also else "all goals hold"
    if name in fail:
        return f"it should fail {name}, but {name} fails only where another goal fails: {others}"
    return f"it should fail {name}, but {name} holds: {others}"


def also_failed(lab: Lab, text: str, runs: Sequence[Sequence[GoalResult]]) -> str:
    """Return, as the end of a sentence, which goals a mistake fails that its first line does not name."""
    named = _claimed(text)
    fail = {each.goal.name for goals in runs for each in goals if not (each.holds or each.text.startswith(MISSED))}
    others = [goal.name for goal in lab.goals if goal.name in fail and goal.name != named]
    return f", and also {' and '.join(others)}" if others else ""
