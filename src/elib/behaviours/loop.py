"""The loop of reactive behaviours: look, act, and never drive blind."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable

from elib.errors import CommandRejected, LinkLost, NotAnEpuck, RemoteProtocolError, ReplyTimeout
from elib.robot.aio import Epuck

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


async def react(robot: Epuck, step: Callable[[Epuck], Awaitable[object]], *, period: float = PERIOD) -> None:
    """Take *step* again and again until cancelled; after a lost answer the robot stands still and looks again.

    The patience with each answer begins short and doubles with every one that does not come, so that a slow link
    makes a slow robot and not one that gives up; it shrinks again when answers come.

    Args:
        robot: The robot.
        step: ``async def step(eyes)``: one look and what follows from it, on a robot whose calls wait that long. It
            ends when that returns something true.
        period: From one step to the next, s, where the link is quick enough.

    Raises:
        LinkLost: The link is gone, and the robot is none that reconnects, or it did not come back.
    """
    patience = SHORT
    due = robot.time
    while True:
        eyes = robot.within(patience)
        try:
            if await step(eyes):
                return
            trip = robot.statistics.median
            shortest = SHORT if math.isnan(trip) else min(max(SHORT, TRIPS * trip), LONG)
            patience = max(shortest, patience * 0.9)
        except PASSING as error:
            if is_final(error, robot):
                raise
            patience = min(2 * patience, LONG)
            try:
                await robot.within(patience).set_speed(0.0, 0.0)
            except PASSING as another:
                if is_final(another, robot):
                    raise
        now = robot.time
        due = max(due + period, now)
        await robot.sleep(due - now)
