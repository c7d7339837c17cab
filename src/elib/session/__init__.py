"""The session: who waits for what on one link, and what can be watched of it."""

from elib.protocol.quantities import check_timeout
from elib.session.calls import Call
from elib.session.channel import Channel, Meter
from elib.session.core import GRACE, Session
from elib.session.resync import LONGEST_SILENCE_WAIT, PICTURE_SILENCE
from elib.session.trace import (
    Called,
    Disconnected,
    Ended,
    Ending,
    Greeted,
    Received,
    Reconnected,
    ResetNoticed,
    Resynced,
    SessionOpened,
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
    "Disconnected",
    "Ended",
    "Ending",
    "Greeted",
    "Meter",
    "Received",
    "Reconnected",
    "ResetNoticed",
    "Resynced",
    "Session",
    "SessionOpened",
    "TraceEvent",
    "TraceHook",
    "Transcript",
    "Wrote",
    "check_timeout",
]
