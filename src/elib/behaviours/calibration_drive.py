"""Drive what ``elib fit`` needs to measure a robot: record it, with its true poses.

Legs measure the wheels together, turns on the spot the axle, arcs each wheel, and slow approaches to a wall the
infrared sensors: near it the robot turns once, so that every sensor passes the wall. It stands still between all of
these, where counters and poses agree however slow the link is.
"""

from __future__ import annotations

import asyncio
import contextlib
from typing import Annotated

from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.errors import RemoteProtocolError, ReplyTimeout
from elib.robot.aio import Epuck

Duration = Annotated[float, Quantity("duration", "s", 20.0, 3600.0, scale=1000)]

PERIOD = 0.05
"""s between two looks at counters and sensors, on links quicker than that."""
REST = 0.7
"""s that the robot stands between two movements: some round trips over Bluetooth."""
LEG, LEG_SPEED = 4.0, 0.5
"""s, rev/s: a leg of 26 cm."""
SPIN, SPIN_SPEED = 9.0, 0.3
"""s, rev/s: two turns on the spot."""
ARC, ARC_FAST, ARC_SLOW = 6.0, 0.5, 0.25
"""s, rev/s: 29 cm and about a turn's half, on a circle of 8 cm."""
FAR, CLOSE = 60, 900
"""Counts of a front sensor above what it reads in the open, at which the robot slows down, and stands: about 6 cm and
1.5 cm from a white wall, by the published curves (robot-model.md, 2.3)."""
FAST, SLOW = 0.4, 0.1
"""rev/s towards the wall."""
LONGEST_APPROACH, LONGEST_CREEP = 9.0, 8.0
"""s that the wall is looked for, and crept up to: without one the robot turns back after 47 cm."""
LONGEST_WALL = 36.0
"""s that all of it takes, as a rule."""
FRONT = (0, 7)


@behaviour(world="square")
async def calibration_drive(robot: Epuck, run: RunContext, *, duration: Duration = 120.0) -> None:
    """Drive legs, turns, arcs and up to a wall, to be recorded for elib fit.

    It needs a free square metre, the robot in its middle, and a white wall about 45 cm ahead. Without the wall the
    infrared sensors cannot be fitted.

    Args:
        robot: The robot to drive.
        run: Where it performs.
        duration: How long it goes on; what would take longer is left out.
    """
    drive = Drive(robot)
    await drive.look()
    in_the_open = drive.front
    movements = (
        ("turns", 2 * (SPIN + REST), drive.spin),
        ("wall", LONGEST_WALL, lambda: drive.approach(in_the_open)),
        ("leg", 2 * (LEG + REST), drive.leg),
        ("arcs", 4 * (ARC + REST), drive.arcs),
    )
    shortest = min(seconds for _, seconds, _ in movements)
    while run.time + shortest <= duration:
        for name, seconds, move in movements:
            if run.time + seconds <= duration:
                run.state(name)
                await move()


class Drive:
    """The movements, and what is looked at meanwhile.

    Attributes:
        front: Greatest count of the two front sensors at the last look.
    """

    def __init__(self, robot: Epuck) -> None:
        self._robot = robot
        self.front = 0

    async def look(self) -> None:
        """Read counters and sensors; an answer may be lost, or garbled."""
        with contextlib.suppress(ReplyTimeout, RemoteProtocolError):
            await self._robot.encoders()
            near = await self._robot.proximity()
            self.front = max(near[sensor] for sensor in FRONT)

    async def turn_wheels(self, left: float, right: float, seconds: float, until: float | None = None) -> float:
        """Turn the wheels, rev/s, for some time or until a front sensor reads *until*, counts; return the time, s."""
        robot = self._robot

        async def tell(eyes: Epuck) -> bool:
            await eyes.set_speed(left, right)
            return True

        await react(robot, tell)  # again where the answer is lost, since nobody knows whether the wheels heard
        began = robot.time
        while robot.time - began < seconds and (until is None or self.front < until):
            looked = robot.time
            await self.look()
            await asyncio.sleep(max(0.0, PERIOD - (robot.time - looked)))
        return robot.time - began

    async def rest(self) -> None:
        """Stand for a moment."""
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
        """Drive an arc to either side, each there and back."""
        for left, right in ((ARC_SLOW, ARC_FAST), (ARC_FAST, ARC_SLOW)):
            for sign in (1, -1):
                await self.turn_wheels(sign * left, sign * right, ARC)
                await self.rest()

    async def approach(self, in_the_open: int) -> None:
        """Drive up to the wall ahead, turn once before it, and drive back.

        Args:
            in_the_open: What the front sensors read where nothing is near, counts.
        """
        fast = await self.turn_wheels(FAST, FAST, LONGEST_APPROACH, until=in_the_open + FAR)
        slow = await self.turn_wheels(SLOW, SLOW, LONGEST_CREEP, until=in_the_open + CLOSE)
        await self.rest()
        if self.front >= in_the_open + CLOSE:
            await self.turn_wheels(-SPIN_SPEED, SPIN_SPEED, SPIN / 2)
            await self.turn_wheels(SPIN_SPEED, -SPIN_SPEED, SPIN / 2)
            await self.rest()
        await self.turn_wheels(-SLOW, -SLOW, slow)
        await self.turn_wheels(-FAST, -FAST, fast)
        await self.rest()
