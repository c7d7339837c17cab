"""Follow a dark line on a bright floor with the ground sensors, and find it again when it is lost."""

from __future__ import annotations

import math
from typing import Annotated

from elib.base.body import AXLE, WHEEL_CIRCUMFERENCE
from elib.base.errors import Unsupported
from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.behaviours.avoid import STANDING, avoid
from elib.link.protocol.values import Ground, Wheels
from elib.robot.aio import Epuck

Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 0.6, scale=1000)]

DARK = 0.6
"""Part of the floor's reading below which a sensor is over the line. It is four deviations below, because the noise of
a reading is a tenth of it (Webots; e-puck.md, 5)."""
LEARNING = 0.05
"""Weight of a new reading in the running mean of the bare floor."""
STEERING = 0.5
"""Turn if the line is under an outer sensor, 9 mm aside: a circle of 5 cm, tighter than the bends of usual tracks."""
SPIN = 0.25
"""Wheel speed of a turn on the spot, rev/s: 1.2 rad/s."""
SWEEP = math.radians(110)
"""Angle to each side, rad, in which the robot searches for a lost line before it turns all the way round."""
LEGS = SWEEP, -SWEEP, math.tau - SWEEP
"""Angles at which the search for a lost line turns back, rad from the heading at which it was lost."""
MAX_STEP = 0.008
"""m that a sensor may move from one reading to the next, half the width of a line: a slow link makes a slow robot."""
ARM = 0.03
"""m from the robot's centre to the ground sensors (e-puck.md, 5)."""
PERIOD = 0.1
"""s between two steps if the link is quick: two commands take 0.09 s over Bluetooth (wire-protocol.md, 5.13)."""
MIN_TIMEOUT = 0.1
"""s after which an answer is given up on a quick link: meanwhile the robot drives without seeing the line."""
FLOOR = 20
"""Counts that any floor gives at least. Without the sensor module all sensors read 0 or -1."""


def offset(ground: Ground, floor: float) -> float | None:
    """Return how far to the left of the centre sensor the line is, in spacings of the sensors; None if none sees it.

    Args:
        ground: Readings of the ground sensors, left, centre, right.
        floor: Their reading over the bare floor, counts.
    """
    left, centre, right = (max(0.0, 1 - count / floor) if count < DARK * floor else 0.0 for count in ground[:3])
    dark = left + centre + right
    return (left - right) / dark if dark else None


def bare_floor(ground: Ground, floor: float) -> float:
    """Return the updated reading over the bare floor, counts; *floor* is the one before, 0 at first."""
    if not floor:
        return float(max(ground[:3]))
    bare = [count for count in ground[:3] if count >= DARK * floor]
    return floor + LEARNING * (sum(bare) / len(bare) - floor) if bare else floor


def follow(line: float, *, cruise: float = 0.5) -> Wheels:
    """Return the speeds that lead back over the line; the further aside it is, the slower and sharper the turn.

    Args:
        line: Position of the line, from -1 under the right sensor to 1 under the left one.
        cruise: Mean speed of the wheels on a straight line, rev/s.
    """
    mean = cruise * (1 - abs(line) / 2)
    return Wheels(mean * (1 - STEERING * line), mean * (1 + STEERING * line))


def sweep(turned: float, leg: int) -> int:
    """Return the leg of the search for a lost line, counted from 0; after the last leg no line is near.

    The robot turns on the spot: first to the side where it last saw the line, then as far to the other side, then all
    the way round. The line goes on ahead: a robot that turned round at once would often follow it back.

    Args:
        turned: Angle from the heading at which the line was lost, positive to the side where it was last seen, rad.
        leg: The leg before.
    """
    while leg < len(LEGS) and (turned - LEGS[leg]) * leg_direction(leg) >= 0:
        leg += 1
    return leg


def leg_direction(leg: int) -> int:
    """Return the direction in which a leg turns: 1 to the side where the line was last seen, -1 to the other."""
    return -1 if leg % 2 else 1


class Follower:
    """The robot's memory of the floor, the line and its search.

    Args:
        robot: The robot.
        run: The run.
        cruise: Mean speed of the wheels on a straight line, rev/s.
    """

    def __init__(self, robot: Epuck, run: RunContext, cruise: float) -> None:
        self._robot = robot
        self._run = run
        self._cruise = cruise
        self._read_at = robot.time
        self._floor = 0.0
        self._wheels = STANDING
        self._side = 1.0  # where the line was last seen, 1 to the left
        self._leg = len(LEGS)  # of the search; at first there is no lost line
        self._turned, self._heading = 0.0, math.nan

    async def step(self, view: Epuck) -> None:
        """Read the ground sensors, and follow the line or search for it."""
        ground = await view.ground()
        gap = max(PERIOD, self._robot.time - self._read_at)
        self._read_at = self._robot.time
        if not self._floor and max(ground[:3]) < FLOOR:
            raise Unsupported(
                f"the ground sensors read {', '.join(map(str, ground[:3]))}: the robot does not have them",
                hint="attach the sensor module, or use sim://line; BTcom is built without ground sensors",
            )
        self._floor = bare_floor(ground, self._floor)
        line = offset(ground, self._floor)
        pace = min(self._cruise, MAX_STEP / gap / WHEEL_CIRCUMFERENCE)
        if line is not None:
            self._run.state("following")
            self._side = math.copysign(1.0, line or self._side)
            self._leg, self._turned, self._heading = 0, 0.0, math.nan
            self._wheels = follow(line, cruise=pace)
        elif self._leg < len(LEGS):
            self._wheels = await self._sweep(view, gap)
        else:
            self._run.state("searching")
            self._wheels = avoid(await view.proximity(), self._wheels, cruise=pace)
        await view.set_speed(self._wheels.left, self._wheels.right)

    async def _sweep(self, view: Epuck, gap: float) -> Wheels:
        """Return the speeds of the search for the line, *gap* seconds after the last reading."""
        if self._run.current_state == "following" and gap > 2 * max(PERIOD, self._robot.statistics.median):
            self._side = -self._side  # it steered to that side for too long without a reading, and has crossed the line
        self._run.state("sweeping")
        before, self._heading = self._heading, (await view.pose()).heading
        if not math.isnan(before):
            self._turned += self._side * math.remainder(self._heading - before, math.tau)
        self._leg = sweep(self._turned, self._leg)
        turn = self._side * leg_direction(self._leg) * min(SPIN, MAX_STEP / gap / ARM * AXLE / 2 / WHEEL_CIRCUMFERENCE)
        return Wheels(-turn, turn)


@behaviour(world="line", reconnects=True, group="vehicles")
async def follow_line(robot: Epuck, run: RunContext, *, cruise: Cruise = 0.5) -> None:
    """Follow a dark line with the ground sensors; if there is none, search for one.

    Args:
        robot: The robot to drive; it needs the ground sensor module.
        run: The run.
        cruise: Mean speed of the wheels on a straight line.

    Raises:
        Unsupported: The robot has no ground sensors, or its firmware was built without them.
    """
    await react(robot, Follower(robot, run, cruise).step, period=PERIOD, min_timeout=MIN_TIMEOUT)
