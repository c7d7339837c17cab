"""The tables about the link: its states, and where the selector must stand for it."""

from __future__ import annotations

from elib.link.protocol.connection import TRANSITIONS, Trigger
from elib.link.protocol.profiles import BTCOM_AMONG_OTHERS, PROFILES
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


def selector() -> str:
    """Return where the selector of each robot must stand, as a table."""
    rows = []
    for name, profile in PROFILES.items():
        rows += [(f"`{name}`", link, str(position)) for position, link in profile.talks_at.items()]
        if not profile.talks_at:
            rows.append((f"`{name}` alone on an e-puck1", "Bluetooth", "any position"))
    rows.append(("BTcom among the programs of an e-puck1 as delivered", "Bluetooth", BTCOM_AMONG_OTHERS))
    return table(("Firmware", "Link", "Selector"), rows)
