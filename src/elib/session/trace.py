"""What trace hooks see: everything that happens on a link, as frozen values."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass

from elib.errors import ElibError
from elib.protocol.table import Request


@dataclass(frozen=True, slots=True)
class Called:
    """A call entered the queue."""

    request: Request[object]


@dataclass(frozen=True, slots=True)
class Ended:
    """A call ended: with a value, or with an error.

    Attributes:
        request: What was asked.
        value: The answer; None for a bare acknowledgement and where there is an error.
        error: Why there is no answer, or None.
        waited: s from the call to its end.
        round_trip: s from sending to the end; nan if it was never sent.
    """

    request: Request[object]
    value: object
    error: BaseException | None
    waited: float
    round_trip: float


@dataclass(frozen=True, slots=True)
class Wrote:
    """Bytes left for the robot."""

    data: bytes


@dataclass(frozen=True, slots=True)
class Received:
    """Bytes came from the robot."""

    data: bytes


Transcript = tuple[tuple[float, Wrote | Received], ...]
"""What went over the line before a session began."""


@dataclass(frozen=True, slots=True)
class Resynced:
    """The line was out of sync and is in sync again.

    Attributes:
        duration: s that it took.
        dropped: Bytes that came since it was out of sync and answered nothing anybody waited for.
    """

    duration: float
    dropped: int


@dataclass(frozen=True, slots=True)
class Greeted:
    """The robot greeted unasked: it was switched on, or it reset itself."""


@dataclass(frozen=True, slots=True)
class Ending:
    """The session ended, for this reason."""

    error: ElibError


@dataclass(frozen=True, slots=True)
class ResetNoticed:
    """The robot restarted without having been asked; what was set is being restored.

    Attributes:
        sign: ``greeting`` or ``encoders``: how it showed.
    """

    sign: str


@dataclass(frozen=True, slots=True)
class Disconnected:
    """A reconnecting robot's link is gone; it is being opened again."""

    error: ElibError


@dataclass(frozen=True, slots=True)
class Reconnected:
    """A reconnecting robot's link is back, and what was set is restored.

    Attributes:
        gap: s without a link.
        attempts: Times it was tried.
    """

    gap: float
    attempts: int


@dataclass(frozen=True, slots=True)
class SessionOpened:
    """A reconnecting robot has another session; the robot was asked who it is.

    Attributes:
        opening: What was written and received for that, each with its time, s on the clock of the event loop.
    """

    opening: Transcript


TraceEvent = (
    Called
    | Ended
    | Wrote
    | Received
    | Resynced
    | Greeted
    | Ending
    | ResetNoticed
    | Disconnected
    | Reconnected
    | SessionOpened
)
TraceHook = Callable[[float, TraceEvent], None]
"""Called as ``hook(time, event)`` in the event loop, time in s on its clock."""


def call_hooks(hooks: list[TraceHook], time: float, event: TraceEvent) -> None:
    """Call every hook; remove one that raises, and report it to the running event loop."""
    for hook in tuple(hooks):
        try:
            hook(time, event)
        except Exception as error:
            hooks.remove(hook)
            message = f"a trace hook of elib raised; removed: {hook!r}"
            asyncio.get_running_loop().call_exception_handler({"message": message, "exception": error})
