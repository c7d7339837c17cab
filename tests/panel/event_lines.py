"""Lines of a robot's event log, as tests look for them."""

from __future__ import annotations

from collections.abc import Iterable

from elib.panel.events import Line


def lines_of(lines: Iterable[Line], kinds: Iterable[str], text: str = "") -> list[Line]:
    """Return the lines of some kinds that hold a text, in any case."""
    wanted = set(kinds)
    return [line for line in lines if line.kind in wanted and text.lower() in line.text.lower()]
