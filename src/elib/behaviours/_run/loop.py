"""The control loop of a reactive behaviour: read the sensors, act, and stand still after a lost answer."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable

from elib.base.errors import CommandRejected, LinkLost, NotAnEpuck, RemoteProtocolError, ReplyTimeout
from elib.behaviours._run.context import RunContext
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck

PERIOD = 0.05
"""s between two steps, if the link is quick enough: the sensors are updated 64 times a second, and over Bluetooth two
commands take 0.09 s (wire-protocol.md, 5.13)."""
TRANSIENT = (ReplyTimeout, RemoteProtocolError, LinkLost)
"""Errors after which the next call may succeed: a lost or garbled answer, a link that is being reopened."""
ROUND_TRIPS = 3.0
"""Round trips after which an answer is given up, on a link that is slower than the shortest timeout."""
MAX_DOUBLINGS = 5
"""How many times the timeout may double."""
MIN_TIMEOUT, MAX_TIMEOUT = 0.3, 3.0
"""s after which an answer is given up. In the shortest time a robot at full speed drives 4 cm, as far as its infrared
sensors see. The longest time is for links so slow that no answer would come within the shortest."""
SETUP_TIMEOUT = 1.0
"""Shortest timeout, s, of slow commands to a standing robot: camera settings take 0.2 s (wire-protocol.md, 5.13)."""


def is_final(error: Exception, robot: Epuck) -> bool:
    """Return whether *error*, one of :data:`TRANSIENT`, will come again with every call."""
    if isinstance(error, LinkLost):
        return not robot.is_reconnecting or robot.session.error is not None
    return isinstance(error, CommandRejected | NotAnEpuck)


class AdaptiveTimeout:
    """How long to wait for an answer: a few round trips, doubled for each answer that was lost in a row.

    A slow link makes a slow robot, not one that gives up, and a lost answer leaves it blind for a short time only.

    Args:
        min_timeout: Timeout on a quick link, s.
        trip: Time of a round trip, s; nan before one was measured.

    Attributes:
        trip: Time of a round trip, s; 0 before one was measured.
    """

    def __init__(self, min_timeout: float = MIN_TIMEOUT, trip: float = math.nan) -> None:
        self._min_timeout = min_timeout
        self.answered(trip)

    @property
    def seconds(self) -> float:
        """Timeout of the next call, s."""
        return min(MAX_TIMEOUT, max(self._min_timeout, ROUND_TRIPS * self.trip) * 2.0**self._missed)

    def answered(self, trip: float) -> None:
        """Note that all answers came, and the time of a round trip: *trip* seconds, or nan."""
        self.trip, self._missed = 0.0 if math.isnan(trip) else trip, 0

    def missed(self) -> None:
        """Note that an answer did not come."""
        self._missed = min(self._missed + 1, MAX_DOUBLINGS)


async def react(
    robot: Epuck,
    step: Callable[[Epuck], Awaitable[object]],
    *,
    period: float = PERIOD,
    min_timeout: float = MIN_TIMEOUT,
) -> None:
    """Call *step* again and again until cancelled. After a lost answer the robot stands still before the next step.

    A step that sets the robot up ends with ``return True``: it is repeated only until all its answers have come.

    Args:
        robot: The robot.
        step: ``async def step(view)``: read the sensors and act. *view* is the robot with a short timeout, an
            :class:`AdaptiveTimeout`; motions and pictures keep their own. The loop ends when the step returns a true
            value.
        period: Time from one step to the next, s, if the link is quick enough.
        min_timeout: Timeout on a quick link, s.

    Raises:
        LinkLost: The link was lost, and the robot does not reconnect, or did not succeed.

    Example:
        >>> async def main(robot):
        ...     async def step(view):
        ...         await view.set_speed(0.3, 0.3)
        ...         return max(await view.proximity()) > 500  # a true value ends the loop
        ...
        ...     await elib.react(robot, step)
        >>> elib.run(main, robot="sim://square?speed=max")
    """
    timeout = AdaptiveTimeout(min_timeout, robot.statistics.median)
    due = robot.time
    while True:
        try:
            if await step(robot.within(timeout.seconds, quick_only=True)):
                return
            timeout.answered(robot.statistics.median)
        except TRANSIENT as error:
            if is_final(error, robot):
                raise
            timeout.missed()
            try:
                await robot.within(timeout.seconds).set_speed(0.0, 0.0)
            except TRANSIENT as another:
                if is_final(another, robot):
                    raise
        now = robot.time
        due = max(due + period, now)
        await robot.sleep(due - now)


def react_blocking(
    robot: BlockingEpuck,
    run: RunContext,
    step: Callable[[BlockingEpuck], object],
    *,
    period: float = PERIOD,
    min_timeout: float = MIN_TIMEOUT,
) -> None:
    """Do the same as :func:`react` in the blocking style, until *run* is over.

    Args:
        robot: The robot.
        run: The run.
        step: ``def step(view)``; it may use ``view.begin``.
        period: Time from one step to the next, s, if the link is quick enough.
        min_timeout: Timeout on a quick link, s.

    Raises:
        LinkLost: The link was lost, and the robot does not reconnect, or did not succeed.
    """
    timeout = AdaptiveTimeout(min_timeout, robot.statistics.median)
    due = robot.time
    while not run.is_over:
        try:
            if step(robot.within(timeout.seconds, quick_only=True)):
                return
            timeout.answered(robot.statistics.median)
        except TRANSIENT as error:
            if is_final(error, robot.robot):
                raise
            timeout.missed()
            try:
                robot.within(timeout.seconds).set_speed(0.0, 0.0)
            except TRANSIENT as another:
                if is_final(another, robot.robot):
                    raise
        now = robot.time
        due = max(due + period, now)
        robot.sleep(due - now)
