"""The event loop of a blocking robot, as a test looks at it from a thread of the program."""

from __future__ import annotations

import asyncio

import elib
from shared import PATIENCE


def let_turn(robot: elib.BlockingEpuck, turns: int = 20) -> None:
    """Let the robot's loop make turns, in each of which simulated time would move if it may, and wait for them."""
    for _ in range(turns):
        asyncio.run_coroutine_threadsafe(asyncio.sleep(0), robot._portal.loop).result(PATIENCE)
