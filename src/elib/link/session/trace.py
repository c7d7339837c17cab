"""The events of a link that trace hooks get, as frozen values."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, get_args

from elib.base.errors import ElibError
from elib.link.protocol.image import Image
from elib.link.protocol.table import Request
from elib.link.protocol.values import Sensors, Steps


@dataclass(frozen=True, slots=True)
class Called:
    """A call entered the queue."""

    request: Request[object]


@dataclass(frozen=True, slots=True)
class Ended:
    """A call ended: with a value, or with an error."""

    request: Request[object]  # what was asked
    value: object  # the answer; None for a bare acknowledgement and where there is an error
    error: BaseException | None  # why there is no answer, or None
    called: float  # when the call was made, s on the loop's clock, as the event ``Called`` said
    waited: float  # time from the call to its end, s
    round_trip: float  # time from sending to the end, s; nan if it was never sent
    is_replaced: bool = False  # whether a newer call was sent in its place, and it shares that one's outcome
    overtook_at: float = math.nan  # when it was first sent, past what was under way, s; nan if it was not


@dataclass(frozen=True, slots=True)
class Wrote:
    """Bytes were written to the line."""

    data: bytes


@dataclass(frozen=True, slots=True)
class Received:
    """Bytes were received."""

    data: bytes


Transcript = tuple[tuple[float, Wrote | Received], ...]
"""The bytes on the line before a session began, each piece with its time, s on the loop's clock."""


@dataclass(frozen=True, slots=True)
class Resynced:
    """The line was out of sync and is in sync again."""

    duration: float  # how long the resync took, s
    dropped: int  # bytes received while the line was out of sync, without the answer to the probe


@dataclass(frozen=True, slots=True)
class Pushed:
    """A robot that streams sent readings or a picture without being asked for them."""

    value: Sensors | Image  # all its readings, or the picture


@dataclass(frozen=True, slots=True)
class Greeted:
    """The robot sent its greeting unasked: it was switched on, or it restarted."""


@dataclass(frozen=True, slots=True)
class Ending:
    """The session ended, for this reason."""

    error: ElibError


@dataclass(frozen=True, slots=True)
class ResetNoticed:
    """The robot restarted unasked; what was set is being restored."""

    sign: str  # what showed it: `greeting` or `encoders`


@dataclass(frozen=True, slots=True)
class Disconnected:
    """The link of a reconnecting robot is down; it is being opened again."""

    error: ElibError


@dataclass(frozen=True, slots=True)
class Reconnected:
    """The link of a reconnecting robot is up again, and what was set is restored."""

    gap: float  # time without a link, s
    attempts: int  # how often opening it was tried


@dataclass(frozen=True, slots=True)
class SessionOpened:
    """A session was opened: the robot was asked for its version."""

    opening: Transcript  # the bytes that were exchanged to recognise the robot
    counters: Steps | None = None  # the step counters that were read last meanwhile; None if the robot did not answer


@dataclass(frozen=True, slots=True)
class Noted:
    """A line that a person or a program wrote beside what the link did."""

    text: str  # the line
    kind: str = "note"  # `note`, `state`, `link`, `robot` or `recorder`
    level: int = 2  # 2 information, 3 warning, 4 error


@dataclass(frozen=True, slots=True)
class MachineBegan:
    """A machine of states began to drive the robot."""

    program: str  # the text of the program that holds its states


TraceEvent = (
    Called
    | Ended
    | Wrote
    | Received
    | Resynced
    | Pushed
    | Greeted
    | Ending
    | ResetNoticed
    | Disconnected
    | Reconnected
    | SessionOpened
    | Noted
    | MachineBegan
)
TraceHook = Callable[[float, TraceEvent], None]
"""Called as ``hook(time, event)`` in the event loop; the time is in s on its clock."""


class Hooks(dict[type, tuple[TraceHook, ...]]):
    """The trace hooks of a channel, by the kind of event that they are called with.

    An event is made only if a hook wants its kind, so a hook should name those that it needs.

    Args:
        last: A hook that is called after all others.
        kinds: The kinds of events that it needs.
    """

    def __init__(self, last: TraceHook | None = None, *kinds: type) -> None:
        super().__init__(dict.fromkeys(get_args(TraceEvent), ()))
        self._last = last
        if last is not None:
            self.append(last, *kinds)

    def append(self, hook: TraceHook, *kinds: type) -> None:
        """Call *hook* from now on with events of these kinds, or of all of them.

        Hooks must be quick. One that raises is removed, and its error is reported to the event loop.
        """
        for kind in kinds or self:
            self[kind] = tuple(sorted((*self[kind], hook), key=lambda each: each == self._last))

    def remove(self, hook: TraceHook) -> None:
        """Call *hook* no longer. Safe to repeat."""
        for kind, hooks in self.items():
            self[kind] = tuple(each for each in hooks if each != hook)

    def emit(self, time: float, kind: type[TraceEvent], *values: Any) -> None:
        """Call the hooks that want an event of a *kind*, made from its values, at *time*, s on the loop's clock."""
        if self[kind]:
            self.call(time, kind(*values))

    def call(self, time: float, event: TraceEvent) -> None:
        """Call the hooks that want *event*, which happened at *time*, s on the loop's clock."""
        for hook in self[type(event)]:
            try:
                hook(time, event)
            except Exception as error:
                self.remove(hook)
                message = f"a trace hook of elib raised; removed: {hook!r}"
                asyncio.get_running_loop().call_exception_handler({"message": message, "exception": error})
