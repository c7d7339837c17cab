"""Methods that need more than one row of the table: written once, reached through all four styles."""

from __future__ import annotations

import asyncio
from typing import Protocol, TypeVar, get_args

from elib.errors import Unsupported
from elib.protocol.actuators import actuators_frame
from elib.protocol.context import Context
from elib.protocol.everything import combine, sensor_requests
from elib.protocol.quantities import Switch
from elib.protocol.raw import text_request, text_timeout
from elib.protocol.replies import Nothing, guarded
from elib.protocol.styles import action
from elib.protocol.table import Request
from elib.protocol.values import Sensors
from elib.robot.moving import Motions
from elib.session import check_timeout

T = TypeVar("T")

SWITCH = get_args(Switch)[1]
"""What counts as on and off."""


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
        return await self.execute(text_request(self.context, command), text_timeout(self.context, command))

    @action
    async def sensors(self: Actor) -> Sensors:
        """Read everything the robot has: one request on the wire where the firmware bears it."""
        found: dict[str, object] = {}
        for request in sensor_requests(self.context):
            readings = await self.execute(request, 1.0)
            found.update(readings)
        return combine(found, self.context)

    @action
    async def set_obstacle_avoidance(self: Actor, on: bool) -> None:
        """Switch the firmware's own obstacle avoidance on or off.

        While it is on it corrects the speeds that set_speed() asks for. The wire has one packet for all actuators, so
        the speeds and the lamps as this program last set them go out with it.
        """
        context = self.context
        reason = context.profile.absent.get("set_obstacle_avoidance")
        if reason is not None:
            raise Unsupported(f"set_obstacle_avoidance() does not exist on {context.profile.name}: {reason}")
        avoid = bool(SWITCH.check("on", on, 0, 1))

        def make() -> bytes:
            return actuators_frame(context, avoid=avoid, speed=context.last_set.speed)

        request = Request(
            f"set_obstacle_avoidance({on!r})", "set_obstacle_avoidance", make(), guarded(Nothing()), make=make
        )
        await self.execute(request, 1.0)
        context.last_set.avoidance = avoid

    @action
    async def sleep(self: Actor, seconds: float) -> None:
        """Wait in the robot's time, simulated or real.

        Raises:
            ArgumentError: *seconds* is no finite number from 0 on.
        """
        await asyncio.sleep(check_timeout(seconds, "the time to sleep"))
