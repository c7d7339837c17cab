"""A drive to be recorded, with true poses, for ``elib fit``, which measures the robot by it.

Straight legs measure both wheels together, turns on the spot the axle, arcs each wheel by itself, and slow approaches
to a wall the infrared sensors: near the wall the robot turns once, so that every sensor passes it. Between all of these
it stands still, so that counters and poses agree even if the link is slow.
"""

from __future__ import annotations

import asyncio
import contextlib
from typing import Annotated

from elib.base.errors import RemoteProtocolError, ReplyTimeout
from elib.behaviours import OpenAir, Quantity, RunContext, behaviour, react
from elib.robot.aio import Epuck

Duration = Annotated[float, Quantity("duration", "s", 20.0, 3600.0, scale=1000)]

PERIOD = 0.05
"""s between two readings of counters and sensors, if the link is quick enough."""
REST = 0.7
"""s that the robot stands between two movements: several round trips over Bluetooth."""
LEG, LEG_SPEED = 4.0, 0.5
"""s, rev/s: a leg of 26 cm."""
SPIN, SPIN_SPEED = 9.0, 0.3
"""s, rev/s: two turns on the spot."""
ARC, ARC_FAST, ARC_SLOW = 6.0, 0.5, 0.25
"""s, rev/s: 29 cm, about half a turn on a circle with a radius of 8 cm."""
FAR, CLOSE = 40, 1000
"""Counts of a front sensor, above its reading in the open, at which the robot slows down and at which it stops: about 6
cm and 0.9 cm before a white wall (e-puck.md, 3). A sensor is then 13 mm from it, so that little of the curve is left to
guess; with 0.06 s of latency each way, the robot stops another 3 mm nearer."""
FAST, SLOW = 0.4, 0.1
"""rev/s towards the wall."""
MAX_APPROACH, MAX_SLOW_APPROACH = 9.0, 8.0
"""s that the robot drives until it sees the wall, and then to it. Without a wall it turns back after 47 cm."""
MAX_WALL = 36.0
"""s that the whole approach usually takes."""
FRONT = (0, 7)


@behaviour(world="square", group="tools")
async def calibration_drive(robot: Epuck, run: RunContext, *, duration: Duration = 120.0) -> None:
    """Drive legs, turns, arcs and up to a wall, to be recorded for elib fit.

    Put the robot in the middle of a free square metre, with a white wall about 45 cm ahead. Without the wall the
    infrared sensors cannot be fitted.

    Args:
        robot: The robot to drive.
        run: The run.
        duration: How long the drive may take; movements that would take longer are left out.
    """
    drive = CalibrationDrive(robot)
    await drive.read()
    movements = (
        ("turns", 2 * (SPIN + REST), drive.spin),
        ("wall", MAX_WALL, drive.approach),
        ("leg", 2 * (LEG + REST), drive.leg),
        ("arcs", 4 * (ARC + REST), drive.arcs),
    )
    shortest = min(seconds for _, seconds, _ in movements)
    while run.time + shortest <= duration:
        for name, seconds, move in movements:
            if run.time + seconds <= duration:
                run.state(name)
                await move()


class CalibrationDrive:
    """The movements, and the readings during them.

    Attributes:
        front: The greater count of the two front sensors at the last reading, without what they read in the open.
    """

    def __init__(self, robot: Epuck) -> None:
        self._robot = robot
        self._open_air = OpenAir()
        self.front = 0

    async def read(self) -> None:
        """Read counters and sensors; an answer may be lost or garbled."""
        with contextlib.suppress(ReplyTimeout, RemoteProtocolError):
            await self._robot.encoders()
            near = self._open_air(await self._robot.proximity())
            self.front = max(near[sensor] for sensor in FRONT)

    async def turn_wheels(self, left: float, right: float, seconds: float, until: float | None = None) -> float:
        """Turn the wheels, rev/s, for *seconds* or until a front sensor reads *until*, counts; return the time, s."""
        robot = self._robot

        async def tell(view: Epuck) -> bool:
            await view.set_speed(left, right)
            return True

        await react(robot, tell)  # repeated after a lost answer, because the command may be lost too
        began = robot.time
        while robot.time - began < seconds and (until is None or self.front < until):
            began_reading = robot.time
            await self.read()
            await asyncio.sleep(max(0.0, PERIOD - (robot.time - began_reading)))
        return robot.time - began

    async def rest(self) -> None:
        """Stand for :data:`REST`."""
        await self.turn_wheels(0, 0, REST)

    async def leg(self) -> None:
        """Drive ahead and back."""
        for speed in (LEG_SPEED, -LEG_SPEED):
            await self.turn_wheels(speed, speed, LEG)
            await self.rest()

    async def spin(self) -> None:
        """Turn on the spot, to the left and to the right."""
        for speed in (SPIN_SPEED, -SPIN_SPEED):
            await self.turn_wheels(-speed, speed, SPIN)
            await self.rest()

    async def arcs(self) -> None:
        """Drive an arc to the left and one to the right, each there and back."""
        for left, right in ((ARC_SLOW, ARC_FAST), (ARC_FAST, ARC_SLOW)):
            for sign in (1, -1):
                await self.turn_wheels(sign * left, sign * right, ARC)
                await self.rest()

    async def approach(self) -> None:
        """Drive up to the wall ahead, turn once in front of it, and drive back."""
        fast = await self.turn_wheels(FAST, FAST, MAX_APPROACH, until=FAR)
        slow = await self.turn_wheels(SLOW, SLOW, MAX_SLOW_APPROACH, until=CLOSE)
        await self.rest()
        if self.front >= CLOSE:
            await self.turn_wheels(-SPIN_SPEED, SPIN_SPEED, SPIN / 2)
            await self.turn_wheels(SPIN_SPEED, -SPIN_SPEED, SPIN / 2)
            await self.rest()
        await self.turn_wheels(-SLOW, -SLOW, slow)
        await self.turn_wheels(-FAST, -FAST, fast)
        await self.rest()
