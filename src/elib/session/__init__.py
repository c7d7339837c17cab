"""The session: who waits for what on one link, and what can be watched of it."""

from elib.protocol.quantities import check_timeout
from elib.session.calls import Call
from elib.session.channel import Channel, Meter
from elib.session.core import GRACE, Session
from elib.session.resync import LONGEST_SILENCE_WAIT, PICTURE_SILENCE
from elib.session.trace import (
    Called,
    Ended,
    Ending,
    Greeted,
    LinkBack,
    LinkDown,
    Opened,
    Received,
    ResetNoticed,
    Resynced,
    TraceEvent,
    TraceHook,
    Transcript,
    Wrote,
)

__all__ = [
    "GRACE",
    "LONGEST_SILENCE_WAIT",
    "PICTURE_SILENCE",
    "Call",
    "Called",
    "Channel",
    "Ended",
    "Ending",
    "Greeted",
    "LinkBack",
    "LinkDown",
    "Meter",
    "Opened",
    "Received",
    "ResetNoticed",
    "Resynced",
    "Session",
    "TraceEvent",
    "TraceHook",
    "Transcript",
    "Wrote",
    "check_timeout",
]
