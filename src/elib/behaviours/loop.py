"""The loop of reactive behaviours: look, act, and never drive blind."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable

from elib.behaviours.stage import Stage
from elib.errors import CommandRejected, LinkLost, NotAnEpuck, RemoteProtocolError, ReplyTimeout
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck

PERIOD = 0.05
"""s between two looks, where the link is quick enough: the sensors have news 64 times a second, and over Bluetooth two
commands take 0.09 s anyhow (robot-model, 2.12)."""
PASSING = (ReplyTimeout, RemoteProtocolError, LinkLost)
"""What may be over with the next call: an answer that is lost or garbled, a link that comes back."""
TRIPS = 2.5
"""Round trips that an answer may take before it is given up, on a link slower than the short patience."""
SHORT, LONG = 0.3, 3.0
"""s after which an answer is given up. The short one: at full speed the robot has then gone 4 cm, as far as it sees.
The long one holds on a link so slow that the short one would never do."""


def is_final(error: Exception, robot: Epuck) -> bool:
    """Return whether *error*, one of :data:`PASSING`, will come again and again."""
    if isinstance(error, LinkLost):
        return not robot.is_reconnecting or robot.session.error is not None
    return isinstance(error, CommandRejected | NotAnEpuck)


class Patience:
    """How long an answer is waited for: short at first, twice as long after each that does not come.

    So a slow link makes a slow robot and not one that gives up; when answers come it shrinks again.

    Attributes:
        seconds: For the next call.
    """

    def __init__(self) -> None:
        self.seconds = SHORT

    def answered(self, trip: float) -> None:
        """Note that all came; *trip* is what round trips take, s, or nan."""
        shortest = SHORT if math.isnan(trip) else min(max(SHORT, TRIPS * trip), LONG)
        self.seconds = max(shortest, self.seconds * 0.9)

    def missed(self) -> None:
        """Note that an answer did not come."""
        self.seconds = min(2 * self.seconds, LONG)


async def react(robot: Epuck, step: Callable[[Epuck], Awaitable[object]], *, period: float = PERIOD) -> None:
    """Take *step* again and again until cancelled; after a lost answer the robot stands still and looks again.

    Args:
        robot: The robot.
        step: ``async def step(eyes)``: one look and what follows from it, on a robot whose calls wait as long as the
            :class:`Patience` says. It ends when that returns something true.
        period: From one step to the next, s, where the link is quick enough.

    Raises:
        LinkLost: The link is gone, and the robot is none that reconnects, or it did not come back.
    """
    patience = Patience()
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
    robot: BlockingEpuck, stage: Stage, step: Callable[[BlockingEpuck], object], *, period: float = PERIOD
) -> None:
    """Do the same as :func:`react` on the blocking face and those that hang on it, until *stage* is over.

    Args:
        robot: The robot.
        stage: Where it performs.
        step: ``def step(eyes)``; it may use ``eyes.begin``.
        period: As of :func:`react`.

    Raises:
        LinkLost: As of :func:`react`.
    """
    patience = Patience()
    due = robot.time
    while not stage.is_over:
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
