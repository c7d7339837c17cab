"""Methods that need more than one row of the table: written once, reached through all four faces."""

from __future__ import annotations

import asyncio
from typing import Protocol, TypeVar

from elib.errors import Unsupported
from elib.protocol.commands import Commands
from elib.protocol.context import Context
from elib.protocol.everything import combine, sensor_requests
from elib.protocol.lamps import BODY, FRONT
from elib.protocol.quantities import STEPS_PER_REVOLUTION
from elib.protocol.raw import text_request
from elib.protocol.replies import GUARD, Nothing, guarded
from elib.protocol.table import Request, action, opcode
from elib.protocol.values import Sensors, Wheels

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

    async def speed(self) -> Wheels:
        """Read the speeds last asked for."""
        ...


class Actions(Commands):
    """Every command, and what is put together from several."""

    @action
    async def text(self: Actor, command: str) -> str:
        """Send any text command and return the lines of its answer, as they came.

        A command that has no answer ends in a ReplyTimeout.
        """
        return await self.execute(text_request(self.context, command), 1.0)

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
        the speeds last asked for and the lamps as this program last set them go out with it.
        """
        context = self.context
        reason = context.profile.absent.get("set_obstacle_avoidance")
        if reason is not None:
            raise Unsupported(f"set_obstacle_avoidance() does not exist on {context.profile.name}: {reason}")
        speed = await self.speed()
        lamps, rgb = context.last_set.lamps, context.last_set.rgb
        bits = sum(lamps[lamp] << bit for bit, lamp in enumerate((0, 2, 4, 6, BODY, FRONT)))
        wheels = b"".join(round(wheel * STEPS_PER_REVOLUTION).to_bytes(2, "little", signed=True) for wheel in speed)
        packet = bytes((opcode(0x09), 2 if on else 0, *wheels, bits, *rgb, 0, 0)) + GUARD
        await self.execute(
            Request(f"set_obstacle_avoidance({on!r})", "set_obstacle_avoidance", packet, guarded(Nothing())), 1.0
        )

    @action
    async def sleep(self: Actor, seconds: float) -> None:
        """Wait in the robot's time, simulated or real."""
        await asyncio.sleep(seconds)
