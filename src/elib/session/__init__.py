"""The session: calls on one link, in order and with deadlines; and the events of the link that hooks get."""

from elib.protocol.quantities import check_timeout
from elib.session.calls import Call
from elib.session.channel import Channel, ForwardingChannel, Robot
from elib.session.core import GRACE, Session
from elib.session.resync import LONGEST_SILENCE_WAIT, PICTURE_SILENCE
from elib.session.statistics import LinkCounter, LinkStats
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
    call_hooks,
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
    "ForwardingChannel",
    "Greeted",
    "LinkCounter",
    "LinkStats",
    "Received",
    "Reconnected",
    "ResetNoticed",
    "Resynced",
    "Robot",
    "Session",
    "SessionOpened",
    "TraceEvent",
    "TraceHook",
    "Transcript",
    "Wrote",
    "call_hooks",
    "check_timeout",
]
