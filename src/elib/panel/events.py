"""The event log of one robot: what happened, in lines that a person reads and filters."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from itertools import islice
from typing import Annotated

from msgspec import Meta, Struct

from elib.link.session import Disconnected, Ended, Greeted, Noted, Reconnected, ResetNoticed, Resynced, TraceEvent

KINDS = {
    "call": "Commands",
    "link": "Connection",
    "robot": "Robot",
    "state": "Behaviours",
    "note": "Notes",
    "panel": "This page",
    "recorder": "Recording",
    "agent": "Agent",
}
"""The kinds of lines, with their titles."""
KEPT = 500
"""Lines of the event log."""
MAX_TEXT = 2000
"""Characters of a line."""
CHATTER = 1.0
"""s in which one line stands for all speeds that were set: a stick sets ten a second."""


class Line(Struct, frozen=True, rename={"is_bad": "bad"}):
    """A line of the event log: its number, s on the panel's clock, a kind to filter by, and what happened."""

    number: int
    time: float
    kind: Annotated[str, Meta(extra_json_schema={"enum": list(KINDS)})]
    text: str
    is_bad: bool = False


class EventLog:
    """The newest lines."""

    def __init__(self) -> None:
        self.lines: deque[Line] = deque(maxlen=KEPT)  # the newest ones, oldest first
        self.count = 0  # how many there ever were
        self._loop = asyncio.get_running_loop()
        self._spoken = -math.inf

    def note(self, text: str, kind: str = "note", *, is_bad: bool = False) -> None:
        """Add a line."""
        text = text if len(text) <= MAX_TEXT else text[:MAX_TEXT] + " …"
        self.lines.append(Line(self.count, round(self._loop.time(), 6), kind, text, is_bad))
        self.count += 1

    def since(self, number: int) -> list[Line]:
        """Return the lines from a number on, as far as they are kept."""
        newest = islice(reversed(self.lines), max(0, self.count - number))  # mostly none; doors ask ten times a second
        return [*newest][::-1]

    def see(self, time: float, event: TraceEvent) -> None:
        """Add a line for what happened on the link, where it is worth one."""
        match event:
            case Ended(request=request, error=error) if not isinstance(error, asyncio.CancelledError):
                is_reading = request.spec is None or request.spec.is_reading
                if error is None and (is_reading or self._is_chatter(time, request.name)):
                    return
                text = "ok" if error is None else str(error).partition("\n")[0]
                self.note(f"{request.text}: {text}", "call", is_bad=error is not None)
            case Disconnected(error=error):
                self.note(f"the link is down: {error.message}", "link", is_bad=True)
            case Reconnected(gap=gap):
                self.note(f"the link is back after {gap:.1f} s", "link")
            case ResetNoticed() | Greeted():
                self.note("the robot has restarted", "robot", is_bad=True)
            case Noted(text=text, kind=kind):
                self.note(text, kind)
            case Resynced(dropped=dropped):
                self.note(f"the line was out of sync; {dropped} bytes were dropped", "link")
            case _:
                pass

    def _is_chatter(self, time: float, name: str) -> bool:
        """Return whether a command needs no line: a speed soon after another."""
        if name != "set_speed":
            return False
        if time - self._spoken < CHATTER:
            return True
        self._spoken = time
        return False
