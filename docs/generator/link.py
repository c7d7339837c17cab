"""The table of states on the page about the link."""

from __future__ import annotations

from elib.protocol.connection import TRANSITIONS, Step
from generator.markdown import table


def transitions() -> str:
    """Return the table: one row a state, what it means, and which step leads where."""
    rows = []
    for state, steps in TRANSITIONS.items():
        leads = [f"{_shown(step)} to `{target.name}`" for step, target in steps.items()]
        rows.append((f"`{state.name}`", state.value, ", ".join(leads) or "nowhere"))
    return table(("State", "Meaning", "Leads"), rows) + f"\n\nEvery state also takes {_shown(Step.CLOSE)}."


def _shown(step: Step) -> str:
    return step.name.lower().replace("_", " ")
