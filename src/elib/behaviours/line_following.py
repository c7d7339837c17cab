"""Follow a dark line on a pale floor with the ground sensors, and find it again when it is lost."""

from __future__ import annotations

import math
from typing import Annotated

from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.behaviours.avoid import STANDING, avoid
from elib.body import AXLE, METRES_PER_STEP, STEPS_PER_REVOLUTION
from elib.errors import Unsupported
from elib.protocol.values import Ground, Wheels
from elib.robot.aio import Epuck

Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 0.6, scale=1000)]

DARK = 0.6
"""Part of what the bare floor reads below which a sensor is over the line: four deviations below it, where the noise of
a reading is a tenth of it (Webots; robot-model, 2.5)."""
LEARNING = 0.05
"""Weight of a new reading in what counts as bare floor."""
STEERING = 0.5
"""Turn where the line is under an outer sensor, 9 mm aside: a circle of 5 cm, tighter than any bend worth driving."""
SPIN = 0.25
"""Wheel speed of a turn on the spot, rev/s: 1.2 rad/s."""
SWEEP = math.radians(110)
"""How far the robot looks to either side for a line that was lost before it turns right round."""
LEGS = SWEEP, -SWEEP, math.tau - SWEEP
"""Where the look around for a lost line turns back, from where the robot looked when it lost it, rad."""
LEAP = 0.008
"""m that a sensor may move from one look to the next, half a line: a slower link makes a slower robot."""
ARM = 0.03
"""m from the robot's middle to the ground sensors (robot-model, 2.5)."""
RIM = STEPS_PER_REVOLUTION * METRES_PER_STEP
"""m that a wheel rolls in one turn."""
PERIOD = 0.1
"""s between two looks where the link is quick: two commands take 0.09 s over Bluetooth (robot-model, 2.12)."""
SHORTEST = 0.1
"""s after which an answer is given up on a quick link: the robot drives blind meanwhile, and is soon off the line."""
MODULE = 20
"""Counts that a floor sends back at least. Without the module all sensors read 0 or -1."""


def offset(ground: Ground, paper: float) -> float | None:
    """Return how far to the left of the middle sensor the line lies, in spacings of the sensors; None if none sees it.

    Args:
        ground: What the ground sensors see, left, centre, right.
        paper: What they read over bare floor, counts.
    """
    left, centre, right = (max(0.0, 1 - count / paper) if count < DARK * paper else 0.0 for count in ground[:3])
    dark = left + centre + right
    return (left - right) / dark if dark else None


def bare_floor(ground: Ground, paper: float) -> float:
    """Return what the sensors read over bare floor, counts, given what it was taken for before; at first 0."""
    if not paper:
        return float(max(ground[:3]))
    bare = [count for count in ground[:3] if count >= DARK * paper]
    return paper + LEARNING * (sum(bare) / len(bare) - paper) if bare else paper


def follow(line: float, *, cruise: float = 0.5) -> Wheels:
    """Return the speeds that lead back over the line; the further aside it is, the slower and the sharper.

    Args:
        line: Where it is, -1 under the right sensor to 1 under the left one.
        cruise: Mean speed of the wheels on a straight line, rev/s.
    """
    mean = cruise * (1 - abs(line) / 2)
    return Wheels(mean * (1 - STEERING * line), mean * (1 + STEERING * line))


def sweep(turned: float, leg: int) -> int:
    """Return on which leg of the look around for a lost line the robot is, from 0; after the last one it is not near.

    The robot turns on the spot: first to the side where it saw the line last, then as far to the other, then on right
    round. The way on lies ahead, so one that turned right round at once would often take the way it came.

    Args:
        turned: From where the robot looked when it lost the line, positive to the side where that was last, rad.
        leg: The leg before.
    """
    while leg < len(LEGS) and (turned - LEGS[leg]) * leg_direction(leg) >= 0:
        leg += 1
    return leg


def leg_direction(leg: int) -> int:
    """Return to which side a leg turns: 1 to where the line was last, -1 away from there."""
    return -1 if leg % 2 else 1


class Follower:
    """What the robot remembers of the floor, the line and its look around.

    Args:
        robot: The robot.
        run: Where it performs.
        cruise: Mean speed of the wheels on a straight line, rev/s.
    """

    def __init__(self, robot: Epuck, run: RunContext, cruise: float) -> None:
        self._robot = robot
        self._run = run
        self._cruise = cruise
        self._looked = robot.time
        self._paper = 0.0
        self._wheels = STANDING
        self._side = 1.0  # where the line was last, 1 to the left
        self._leg = len(LEGS)  # of the look around; at first there is nothing to go back to
        self._turned, self._heading = 0.0, math.nan

    async def step(self, eyes: Epuck) -> None:
        """Look down, and follow the line or look for it; in a hurry, since the line is but 15 mm wide."""
        ground = await eyes.ground()
        gap = max(PERIOD, self._robot.time - self._looked)
        self._looked = self._robot.time
        if not self._paper and max(ground[:3]) < MODULE:
            raise Unsupported(
                f"the ground sensors read {', '.join(map(str, ground[:3]))}: there are none",
                hint="put the module on, or try it on sim://line; BTcom is built without them",
            )
        self._paper = bare_floor(ground, self._paper)
        line = offset(ground, self._paper)
        pace = min(self._cruise, LEAP / gap / RIM)
        if line is not None:
            self._run.state("following")
            self._side = math.copysign(1.0, line or self._side)
            self._leg, self._turned, self._heading = 0, 0.0, math.nan
            self._wheels = follow(line, cruise=pace)
        elif self._leg < len(LEGS):
            self._wheels = await self._sweep(eyes, gap)
        else:
            self._run.state("searching")
            self._wheels = avoid(await eyes.proximity(), self._wheels, cruise=pace)
        await eyes.set_speed(self._wheels.left, self._wheels.right)

    async def _sweep(self, eyes: Epuck, gap: float) -> Wheels:
        """Return the speeds that look around for the line, *gap* seconds after the last look."""
        if self._run.current_state == "following" and gap > 2 * max(PERIOD, self._robot.statistics.median):
            self._side = -self._side  # it steered to that side for too long, without a look, and is past the line
        self._run.state("sweeping")
        before, self._heading = self._heading, (await eyes.pose()).heading
        if not math.isnan(before):
            self._turned += self._side * math.remainder(self._heading - before, math.tau)
        self._leg = sweep(self._turned, self._leg)
        turn = self._side * leg_direction(self._leg) * min(SPIN, LEAP / gap / ARM * AXLE / 2 / RIM)
        return Wheels(-turn, turn)


@behaviour(world="line", reconnects=True)
async def follow_the_line(robot: Epuck, run: RunContext, *, cruise: Cruise = 0.5) -> None:
    """Follow a dark line with the ground sensors; where there is none, look for one.

    Args:
        robot: The robot to drive; it needs the ground sensor module.
        run: Where it performs.
        cruise: Mean speed of the wheels on a straight line.

    Raises:
        Unsupported: The robot has no ground sensors, or its firmware was built without them.
    """
    await react(robot, Follower(robot, run, cruise).step, period=PERIOD, min_timeout=SHORTEST)
