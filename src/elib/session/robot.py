"""The interface of an open robot, as recordings, the poller, motions and actions use it."""

from __future__ import annotations

from typing import Protocol, TypeVar

from elib.pose import Pose
from elib.protocol.context import Context
from elib.protocol.table import Request
from elib.session.channel import Channel

T = TypeVar("T")


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
    def time_given(self) -> float:
        """The time that :meth:`elib.Epuck.within` gave to this action, s; infinite without one."""

    @property
    def time_left(self) -> float:
        """The part of :attr:`time_given` that is left, s."""

    async def execute(self, request: Request[T], default: float) -> T:
        """Send *request* and return its answer, within *default* seconds unless :attr:`time_given` says otherwise."""
