"""The table about who drives a robot of the panel."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

from elib.panel.drivelock import LOCK_STATES, WHEEL_STATES, Event
from generator.markdown import table


def states() -> str:
    """Return two tables: what each state means, and what each event does to both of them."""
    meanings = [(f"`{state.name}`", state.value) for states in (LOCK_STATES, WHEEL_STATES) for state in states]
    rows = [
        (event.name.lower().replace("_", " "), event.value, *(_leads(states, event) for states in STATES))
        for event in Event
    ]
    head = ("Event", "When", "Who drives", "The wheels")
    return f"{table(('State', 'Meaning'), meanings)}\n\n{table(head, rows)}"


STATES: tuple[Mapping[Enum, Mapping[Event, Enum]], ...] = (LOCK_STATES, WHEEL_STATES)  # type: ignore[assignment]


def _leads(states: Mapping[Enum, Mapping[Event, Enum]], event: Event) -> str:
    """Return where an event leads from each state that it changes."""
    found: dict[str, list[str]] = {}
    for state, leads in states.items():
        if leads.get(event, state) is not state:
            found.setdefault(leads[event].name, []).append(state.name)
    return ", ".join(f"{' or '.join(f'`{name}`' for name in names)} to `{target}`" for target, names in found.items())
