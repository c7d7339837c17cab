"""Methods that need more than one row of the table: written once, reached through all four styles."""

from __future__ import annotations

import asyncio
from typing import Any, Protocol, TypeVar

from elib.protocol.context import Context
from elib.protocol.raw import text_request
from elib.protocol.styles import action
from elib.protocol.table import Request
from elib.protocol.values import Sensors
from elib.robot.moving import Motions
from elib.robot.polling import sensor_polls
from elib.session import check_timeout

T = TypeVar("T")


class Actor(Protocol):
    """What an action needs of the async robot."""

    @property
    def context(self) -> Context:
        """What the connection knows."""
        ...

    async def execute(self, request: Request[T], default: float) -> T:
        """Send one request."""
        ...


class Actions(Motions):
    """Every command, and what is put together from several."""

    @action
    async def text(self: Actor, command: str) -> str:
        """Send any text command and return the lines of its answer, as they came.

        A command that has no answer ends in a ReplyTimeout.
        """
        request = text_request(self.context, command)
        return await self.execute(request, request.timeout)

    @action
    async def sensors(self: Actor) -> Sensors:
        """Read everything the robot has: one request on the wire where the firmware bears it."""
        context = self.context
        found: dict[str, Any] = {}
        for poll in sensor_polls(context):
            answer = await self.execute(poll.request, poll.request.timeout)
            found |= poll.readings(answer)
        return Sensors(**found, **context.stamp)

    @action
    async def sleep(self: Actor, seconds: float) -> None:
        """Wait in the robot's time, simulated or real.

        Raises:
            ArgumentError: *seconds* is no finite number from 0 on.
        """
        await asyncio.sleep(check_timeout(seconds, "the time to sleep"))
