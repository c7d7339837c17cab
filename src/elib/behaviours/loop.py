"""The loop of reactive behaviours: look, act, and never drive blind."""

from __future__ import annotations

import contextlib
from collections.abc import Awaitable, Callable

from elib.errors import LinkLost, ReplyTimeout
from elib.robot.aio import Epuck

PERIOD = 0.05
"""s between two looks, where the link is quick enough: the sensors have news 64 times a second, and over Bluetooth two
commands take 0.09 s anyhow (robot-model, 2.12)."""
SHORT, LONG = 0.3, 3.0
"""s after which an answer is given up. The short one: at full speed the robot has then gone 4 cm, as far as it sees.
The long one holds on a link so slow that the short one would never do."""


async def react(robot: Epuck, step: Callable[[Epuck], Awaitable[object]], *, period: float = PERIOD) -> None:
    """Take *step* again and again until cancelled; after a lost answer the robot stands still and looks again.

    The patience with each answer begins short and doubles with every one that does not come, so that a slow link
    makes a slow robot and not one that gives up; it shrinks again when answers come.

    Args:
        robot: The robot.
        step: ``async def step(eyes)``: one look and what follows from it, on a robot whose calls wait that long.
        period: From one step to the next, s, where the link is quick enough.

    Raises:
        LinkLost: The link is gone, and the robot is none that reconnects, or it did not come back.
    """
    patience = SHORT
    due = robot.time
    while True:
        eyes = robot.within(patience)
        try:
            await step(eyes)
            patience = max(SHORT, patience * 0.9)
        except (ReplyTimeout, LinkLost) as error:
            if isinstance(error, LinkLost) and not robot.is_reconnecting:
                raise
            patience = min(2 * patience, LONG)
            with contextlib.suppress(ReplyTimeout):
                await robot.within(patience).set_speed(0.0, 0.0)
        now = robot.time
        due = max(due + period, now)
        await robot.sleep(due - now)
