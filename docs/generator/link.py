"""The table of states on the page about the link."""

from __future__ import annotations

from elib.protocol.connection import TRANSITIONS, Trigger
from generator.markdown import table


def transitions() -> str:
    """Return the table: one row a state, what it means, and which trigger leads where."""
    rows = []
    for state, triggers in TRANSITIONS.items():
        leads = [f"{_shown(trigger)} to `{target.name}`" for trigger, target in triggers.items()]
        rows.append((f"`{state.name}`", state.value, ", ".join(leads) or "nowhere"))
    return table(("State", "Meaning", "Leads"), rows) + f"\n\nEvery state also takes {_shown(Trigger.CLOSE)}."


def _shown(trigger: Trigger) -> str:
    return trigger.name.lower().replace("_", " ")
