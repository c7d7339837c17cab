"""Channels, which carry a robot's calls: their interface, and the base of those that stand in front of another one."""

from __future__ import annotations

from typing import Protocol, TypeVar

from elib.errors import ElibError
from elib.protocol.context import Context, Profile
from elib.protocol.table import Request
from elib.protocol.values import Version
from elib.session.trace import TraceHook, Transcript
from elib.transport.base import Transport

T = TypeVar("T")


class Channel(Protocol):
    """A session, or a reconnector that makes a new session whenever the last one is lost.

    Attributes:
        hooks: Trace hooks, called as ``hook(time, event)`` in the event loop. They must be quick. A hook that raises is
            removed and reported to the loop.
    """

    hooks: list[TraceHook]

    @property
    def transport(self) -> Transport:
        """The transport that carries the bytes now."""

    @property
    def context(self) -> Context:
        """The connection's knowledge about its robot."""

    @property
    def profile(self) -> Profile:
        """The profile of the robot's firmware."""

    @property
    def version(self) -> Version:
        """The robot's answer to the question for its version."""

    @property
    def opening(self) -> Transcript:
        """The bytes that were written and received when the link was opened last, before calls were taken."""

    @property
    def error(self) -> ElibError | None:
        """Why it ended for good, or None."""

    @property
    def waiting(self) -> int:
        """Number of calls in the queue, not sent yet."""

    @property
    def unanswered(self) -> int:
        """Number of calls in the queue and under way."""

    @property
    def stopping_time(self) -> float:
        """How long the robot may need to confirm a stop now, s."""

    @property
    def is_restoring(self) -> bool:
        """Whether what was set is being set again now, after the link was lost or the robot restarted."""

    async def execute(self, request: Request[T], timeout: float) -> T:
        """Send *request* in its turn and return its answer."""

    async def execute_last(self, request: Request[T], timeout: float) -> T:
        """Send *request* as the last one; calls that wait end with an error, and no more are taken."""

    def send_unqueued(self, data: bytes) -> bool:
        """Send *data* past the queue, without waiting; its answer is dropped. Return whether the line took it."""

    def forget_speed(self) -> None:
        """Do not restore the wheel speeds when the link is back: the motion that set them has ended."""

    async def close(self) -> None:
        """End the channel and free the port. Safe to repeat."""


class ForwardingChannel:
    """The base of a channel in front of a session, or of another channel: passes on what it does not change."""

    _session: Channel

    @property
    def transport(self) -> Transport:
        """The transport that carries the bytes now."""
        return self._session.transport

    @property
    def context(self) -> Context:
        """The connection's knowledge about its robot."""
        return self._session.context

    @property
    def profile(self) -> Profile:
        """The profile of the robot's firmware."""
        return self._session.profile

    @property
    def version(self) -> Version:
        """The robot's answer to the question for its version."""
        return self._session.version

    @property
    def opening(self) -> Transcript:
        """The bytes that were written and received when the link was opened last."""
        return self._session.opening

    @property
    def waiting(self) -> int:
        """Number of calls not sent yet, as far as they reached the session."""
        return self._session.waiting

    @property
    def unanswered(self) -> int:
        """Number of calls not answered yet, as far as they reached the session."""
        return self._session.unanswered

    @property
    def stopping_time(self) -> float:
        """How long the robot may need to confirm a stop now, s."""
        return self._session.stopping_time

    @property
    def is_restoring(self) -> bool:
        """Whether what was set is being set again now."""
        return self._session.is_restoring
