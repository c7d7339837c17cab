"""The loop of reactive behaviours: look, act, and never drive blind. What sets a robot up is repeated by it, too."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable

from elib.behaviours._run.context import RunContext
from elib.errors import CommandRejected, LinkLost, NotAnEpuck, RemoteProtocolError, ReplyTimeout
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck

PERIOD = 0.05
"""s between two looks, where the link is quick enough: the sensors have news 64 times a second, and over Bluetooth two
commands take 0.09 s anyhow (robot-model, 2.12)."""
PASSING = (ReplyTimeout, RemoteProtocolError, LinkLost)
"""What may be over with the next call: an answer that is lost or garbled, a link that comes back."""
TRIPS = 3.0
"""Round trips that an answer may take before it is given up, on a link slower than the short patience."""
DOUBLINGS = 5
"""Most times that the patience doubles."""
SHORT, LONG = 0.3, 3.0
"""s after which an answer is given up. The short one: at full speed the robot has then gone 4 cm, as far as it sees.
The long one holds on a link so slow that the short one would never do."""
SETTING_UP = 1.0
"""s for what takes long on a standing robot: the camera's settings take 0.2 s (robot-model, 2.12)."""


def is_final(error: Exception, robot: Epuck) -> bool:
    """Return whether *error*, one of :data:`PASSING`, will come again and again."""
    if isinstance(error, LinkLost):
        return not robot.is_reconnecting or robot.session.error is not None
    return isinstance(error, CommandRejected | NotAnEpuck)


class AdaptiveTimeout:
    """How long an answer is waited for: a few round trips, and twice as long for each that is missed in a row.

    So a slow link makes a slow robot and not one that gives up, and a lost answer leaves it blind for a moment only.

    Args:
        shortest: On a quick link, s.
        trip: What a round trip has taken so far, s; nan before one was measured.

    Attributes:
        trip: What a round trip takes, s; 0 before one was measured.
    """

    def __init__(self, shortest: float = SHORT, trip: float = math.nan) -> None:
        self._shortest = shortest
        self.answered(trip)

    @property
    def seconds(self) -> float:
        """For the next call, s."""
        return min(LONG, max(self._shortest, TRIPS * self.trip) * 2.0**self._missed)

    def answered(self, trip: float) -> None:
        """Note that all answers came; a round trip takes *trip* seconds, or nan."""
        self.trip, self._missed = 0.0 if math.isnan(trip) else trip, 0

    def missed(self) -> None:
        """Note that an answer did not come."""
        self._missed = min(self._missed + 1, DOUBLINGS)


async def react(
    robot: Epuck, step: Callable[[Epuck], Awaitable[object]], *, period: float = PERIOD, shortest: float = SHORT
) -> None:
    """Take *step* again and again until cancelled; after a lost answer the robot stands still and looks again.

    A set-up is one step that ends with ``return True``: it is repeated only until all its answers have come.

    Args:
        robot: The robot.
        step: ``async def step(eyes)``: one look and what follows from it, on a robot whose calls wait as long as the
            :class:`AdaptiveTimeout` says. It ends when that returns something true.
        period: From one step to the next, s, where the link is quick enough.
        shortest: What an answer is waited for on a quick link, s.

    Raises:
        LinkLost: The link is gone, and the robot is none that reconnects, or it did not come back.
    """
    patience = AdaptiveTimeout(shortest, robot.statistics.median)
    due = robot.time
    while True:
        try:
            if await step(robot.within(patience.seconds)):
                return
            patience.answered(robot.statistics.median)
        except PASSING as error:
            if is_final(error, robot):
                raise
            patience.missed()
            try:
                await robot.within(patience.seconds).set_speed(0.0, 0.0)
            except PASSING as another:
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
    shortest: float = SHORT,
) -> None:
    """Do the same as :func:`react` in the blocking style and those that hang on it, until *run* is over.

    Args:
        robot: The robot.
        run: Where it performs.
        step: ``def step(eyes)``; it may use ``eyes.begin``.
        period: As of :func:`react`.
        shortest: As of :func:`react`.

    Raises:
        LinkLost: As of :func:`react`.
    """
    patience = AdaptiveTimeout(shortest, robot.statistics.median)
    due = robot.time
    while not run.is_over:
        try:
            if step(robot.within(patience.seconds)):
                return
            patience.answered(robot.statistics.median)
        except PASSING as error:
            if is_final(error, robot.robot):
                raise
            patience.missed()
            try:
                robot.within(patience.seconds).set_speed(0.0, 0.0)
            except PASSING as another:
                if is_final(another, robot.robot):
                    raise
        now = robot.time
        due = max(due + period, now)
        robot.sleep(due - now)
