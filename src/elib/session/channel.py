"""What a robot needs of its session, or of what makes sessions for it."""

from __future__ import annotations

from typing import Protocol, TypeVar

from elib.errors import ElibError
from elib.protocol.context import Context, Profile
from elib.protocol.table import Request
from elib.protocol.values import Version
from elib.session.calls import Call
from elib.session.trace import TraceHook, Transcript
from elib.transport.base import Transport

T = TypeVar("T")


class Meter(Protocol):
    """Counts what happens, without the cost of a trace hook."""

    def ended(self, call: Call[object], error: BaseException | None, now: float) -> None:
        """Take note that *call* ended at *now*, s on the loop's clock."""
        ...

    def never_sent(self) -> None:
        """Take note that a call's deadline passed while there was no link."""
        ...

    def resynced(self) -> None:
        """Take note that the line was out of sync and is in sync again."""
        ...

    def greeted(self) -> None:
        """Take note that the robot greeted unasked."""
        ...


class Channel(Protocol):
    """A session, or a reconnector that makes a new one whenever the last is lost.

    Attributes:
        hooks: Trace hooks, called as ``hook(time, event)`` in the event loop.
        meter: Counts every outcome, if set.
        final_command: What is sent blindly when the robot falls silent while the line still takes bytes.
    """

    final_command: bytes
    hooks: list[TraceHook]
    meter: Meter | None

    @property
    def transport(self) -> Transport:
        """What carries the bytes now."""
        ...

    @property
    def context(self) -> Context:
        """What the connection knows."""
        ...

    @property
    def profile(self) -> Profile:
        """The firmware spoken to."""
        ...

    @property
    def version(self) -> Version:
        """The robot's answer to who it is."""
        ...

    @property
    def opening(self) -> Transcript:
        """What was written and received when the link was opened last, before calls were taken."""
        ...

    @property
    def error(self) -> ElibError | None:
        """Why it ended for good, or None."""
        ...

    @property
    def waiting(self) -> int:
        """Calls in the queue, not sent yet."""
        ...

    @property
    def unanswered(self) -> int:
        """Calls in the queue and under way."""
        ...

    async def execute(self, request: Request[T], timeout: float) -> T:
        """Send *request* in its turn and return its answer."""
        ...

    async def execute_last(self, request: Request[T], timeout: float) -> T:
        """Send *request* as the very last; what waits ends, and nothing is taken any more."""
        ...

    @property
    def stopping_time(self) -> float:
        """How long the robot may need to confirm a stop now, s."""
        ...

    async def close(self) -> None:
        """End it and free the port."""
        ...

    def interject(self, data: bytes) -> None:
        """Send *data* past the queue, without waiting; its answer is dropped."""
        ...

    async def blurt(self, data: bytes, wait: float) -> None:
        """Send *data* past the queue: a last word."""
        ...
