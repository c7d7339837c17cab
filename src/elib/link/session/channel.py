"""The interfaces of a robot and of its channel, and the base of channels that stand in front of another one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Generic, Protocol, TypeVar

from elib.base.errors import ElibError
from elib.base.pose import Pose
from elib.link.protocol.context import Context
from elib.link.protocol.table import Request
from elib.link.protocol.values import Steps, Version
from elib.link.protocol.wifi_connection import Wanted
from elib.link.session.statistics import LinkStats
from elib.link.session.trace import Hooks, MachineBegan, Noted, Transcript
from elib.link.transport.base import Transport

T = TypeVar("T")


class Channel(Protocol):
    """A session, or a reconnector that makes a new session whenever the last one is lost."""

    hooks: Hooks  # trace hooks, called as `hook(time, event)` in the event loop

    @property
    def transport(self) -> Transport:
        """The transport that carries the bytes now."""

    @property
    def context(self) -> Context:
        """The connection's knowledge about its robot."""

    @property
    def version(self) -> Version:
        """The robot's answer to the question for its version."""

    @property
    def opening(self) -> Transcript:
        """The bytes that were written and received when the link was opened last, before calls were taken."""

    @property
    def counters(self) -> Steps | None:
        """The step counters as they were read when the link was opened last, if the robot answered."""

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
    def requests(self) -> Iterator[Request[object]]:
        """The requests of all calls that have no outcome yet, in the queue and under way."""

    @property
    def restoring(self) -> Request[object] | None:
        """The request that sets again now what was set before the link was lost or the robot restarted, if any."""

    async def execute(self, request: Request[T], timeout: float) -> T:
        """Send *request* in its turn and return its answer."""

    async def execute_last(self, request: Request[T], timeout: float) -> T:
        """Send *request* as the last one; calls that wait end with an error, and no more are taken."""

    def stream(self, *, sensors: Wanted | None, images: bool) -> None:
        """Have a robot that streams send what is watched, as ``Pushed`` events; others do nothing.

        Args:
            sensors: Called with the time of each packet, s on the loop's clock; returns if its readings are wanted.
                None if none are.
            images: Whether the robot must send pictures all the time.
        """

    def send_unqueued(self, data: bytes) -> bool:
        """Send *data* past the queue, without waiting; its answer is dropped. Return whether the line took it."""

    def forget_speed(self) -> None:
        """Do not restore the wheel speeds when the link is back: the motion that set them has ended."""

    def note(self, time: float, event: Noted | MachineBegan) -> None:
        """Tell the trace hooks of the link what a program did at *time*, s on the loop's clock."""

    async def close(self) -> None:
        """End the channel and free the port. Safe to repeat."""


class Forwarded(Generic[T]):
    """An attribute that a :class:`ForwardingChannel` reads from the channel behind it."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, channel: ForwardingChannel, owner: type) -> T:
        value: T = getattr(channel._session, self._name)  # noqa: SLF001  # this class serves only that one
        return value


class ForwardingChannel:
    """The base of a channel in front of a session, or of another channel: passes on what it does not change."""

    _session: Channel

    transport = Forwarded[Transport]()
    context = Forwarded[Context]()
    version = Forwarded[Version]()
    opening = Forwarded[Transcript]()
    counters = Forwarded["Steps | None"]()
    waiting = Forwarded[int]()
    unanswered = Forwarded[int]()
    requests = Forwarded[Iterator[Request[object]]]()
    restoring = Forwarded["Request[object] | None"]()
    stopping_time = Forwarded[float]()

    def stream(self, *, sensors: Wanted | None, images: bool) -> None:
        """Have a robot that streams send what is watched."""
        self._session.stream(sensors=sensors, images=images)

    def note(self, time: float, event: Noted | MachineBegan) -> None:
        """Tell the trace hooks of the link what a program did."""
        self._session.note(time, event)


class Robot(Protocol):
    """An open robot in an event loop; :class:`elib.Epuck` is one."""

    @property
    def name(self) -> str:
        """A name for people, used in logs."""

    @property
    def url(self) -> str:
        """The URL that was opened."""

    @property
    def time(self) -> float:
        """The robot's time: the clock of its event loop, s."""

    @property
    def session(self) -> Channel:
        """The channel that carries its calls."""

    @property
    def context(self) -> Context:
        """The connection's knowledge about its robot."""

    @property
    def is_reconnecting(self) -> bool:
        """Whether it reopens its link when that is lost."""

    @property
    def odometry_pose(self) -> Pose:
        """Where it is by the step counters that were read last."""

    @property
    def call_count(self) -> int:
        """Number of calls that have ended."""

    @property
    def statistics(self) -> LinkStats:
        """How the link has been so far."""

    @property
    def time_given(self) -> float:
        """The time that :meth:`elib.Epuck.within` gave to this action, s; infinite without one."""

    @property
    def time_left(self) -> float:
        """The part of :attr:`time_given` that is left, s."""

    async def execute(self, request: Request[T], default: float) -> T:
        """Send *request* and return its answer, within *default* seconds unless :attr:`time_given` says otherwise."""
