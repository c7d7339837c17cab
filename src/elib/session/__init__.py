"""The session: calls on one link, in order and with deadlines; and the events of the link that hooks get."""

from elib.protocol.quantities import check_timeout as check_timeout
from elib.session.calls import Call as Call
from elib.session.channel import Channel as Channel
from elib.session.channel import ForwardingChannel as ForwardingChannel
from elib.session.channel import Robot as Robot
from elib.session.core import GRACE as GRACE
from elib.session.core import Session as Session
from elib.session.resync import LONGEST_SILENCE_WAIT as LONGEST_SILENCE_WAIT
from elib.session.resync import PICTURE_SILENCE as PICTURE_SILENCE
from elib.session.statistics import LinkCounter as LinkCounter
from elib.session.statistics import LinkStats as LinkStats
from elib.session.trace import Called as Called
from elib.session.trace import Disconnected as Disconnected
from elib.session.trace import Ended as Ended
from elib.session.trace import Ending as Ending
from elib.session.trace import Greeted as Greeted
from elib.session.trace import Received as Received
from elib.session.trace import Reconnected as Reconnected
from elib.session.trace import ResetNoticed as ResetNoticed
from elib.session.trace import Resynced as Resynced
from elib.session.trace import SessionOpened as SessionOpened
from elib.session.trace import TraceEvent as TraceEvent
from elib.session.trace import TraceHook as TraceHook
from elib.session.trace import Transcript as Transcript
from elib.session.trace import Wrote as Wrote
from elib.session.trace import call_hooks as call_hooks
