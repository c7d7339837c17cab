"""The session: who waits for what on one link, and what can be watched of it."""

from elib.session.calls import Call, check_timeout
from elib.session.core import GRACE, LONGEST_SILENCE_WAIT, PICTURE_SILENCE, Meter, Session
from elib.session.trace import Called, Ended, Ending, Fenced, Greeted, Received, TraceEvent, TraceHook, Wrote

__all__ = [
    "GRACE",
    "LONGEST_SILENCE_WAIT",
    "PICTURE_SILENCE",
    "Call",
    "Called",
    "Ended",
    "Ending",
    "Fenced",
    "Greeted",
    "Meter",
    "Received",
    "Session",
    "TraceEvent",
    "TraceHook",
    "Wrote",
    "check_timeout",
]
