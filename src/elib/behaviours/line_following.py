"""Follow a dark line on a bright floor with the ground sensors, and find it again when it is lost.

What a sensor reads over black differs from robot to robot, 79 to 750 counts, and from sensor to sensor. So the robot
first looks to both sides, and learns what each sensor reads over the line and beside it.
"""

from __future__ import annotations

import math
from typing import Annotated

from elib.base.body import AXLE, WHEEL_CIRCUMFERENCE
from elib.base.errors import Unsupported
from elib.behaviours import OpenAir, Quantity, RunContext, behaviour, react
from elib.behaviours.avoid import STANDING, avoid
from elib.link.protocol.values import Ground, Wheels
from elib.robot.aio import Epuck

Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 0.6, scale=1000)]

DARK = 0.5
"""How dark it is under a sensor that is over the line, at least: 0 is the bare floor, 1 the line."""
CONTRAST = 60
"""Counts between line and floor, at least: less is noise. With the worst of 90 real sensors, 750 counts over black, the
line on the grey floor of a lab gives 150."""
LEARNING = 0.3
"""Weight of a new reading in what a sensor reads over the line, or over the floor: a reading that is wrong is soon
forgotten, and three readings are enough to know a line."""
LOOK = math.radians(60)
"""Angle to each side in which the robot learns the line at first: each sensor crosses a line that it stands along, even
if it looks 20 degrees aside."""
CALIBRATION = LOOK, -LOOK, 0.0
"""Angles at which that look turns back, rad from the first heading."""
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
TIGHTEST = 0.05
"""m: radius with which the spiral begins that searches for a lost line. Turned round, the robot has seen 0.04 m."""
SPACING = 0.06
"""m between two turns of that spiral."""
ARM = 0.03
"""m from the robot's centre to the ground sensors (e-puck.md, 5)."""
PERIOD = 0.1
"""s between two steps if the link is quick: two commands take 0.09 s over Bluetooth (wire-protocol.md, 5.13)."""
MIN_TIMEOUT = 0.1
"""s after which an answer is given up on a quick link: meanwhile the robot drives without seeing the line."""
FLOOR = 20
"""Counts that any floor gives at least; less is a hole, or the air under a lifted robot. Without the sensor module all
sensors read 0 or -1."""
FULL_SCALE = 1023
"""Counts of a sensor at most: ten bits."""


class Levels:
    """What each ground sensor reads over the line and over the floor: left, centre, right."""

    def __init__(self) -> None:
        self.line = [math.inf] * 3
        self.floor = [0.0] * 3

    def learn(self, ground: Ground) -> None:
        """Learn from a reading: at first the lowest and the highest count, then each count as the nearer of both."""
        for s, count in enumerate(ground[:3]):
            line, floor = self.line[s], self.floor[s]
            if not FLOOR <= count <= FULL_SCALE:
                continue
            if floor - line < CONTRAST:
                self.line[s], self.floor[s] = min(line, count), max(floor, count)
            elif 2 * count < line + floor:
                self.line[s] += LEARNING * (count - line)
            else:
                self.floor[s] += LEARNING * (count - floor)

    def offset(self, ground: Ground) -> float | None:
        """Return how far to the left of the centre sensor the line is, in spacings of the sensors.

        None if no sensor sees it.
        """
        left, centre, right = (
            self._darkness(count, line, floor)
            for count, line, floor in zip(ground[:3], self.line, self.floor, strict=True)
        )
        dark = left + centre + right
        return (left - right) / dark if dark else None

    @staticmethod
    def _darkness(count: int, line: float, floor: float) -> float:
        if floor - line < CONTRAST:
            return 0.0
        dark = min((floor - count) / (floor - line), 1.0)
        return dark if dark > DARK else 0.0


def follow(line: float, *, cruise: float = 0.5) -> Wheels:
    """Return the speeds that lead back over the line; the further aside it is, the slower and sharper the turn.

    Args:
        line: Position of the line, from -1 under the right sensor to 1 under the left one.
        cruise: Mean speed of the wheels on a straight line, rev/s.
    """
    mean = cruise * (1 - abs(line) / 2)
    return Wheels(mean * (1 - STEERING * line), mean * (1 + STEERING * line))


def sweep(turned: float, leg: int, legs: tuple[float, ...] = LEGS) -> int:
    """Return the leg of the search for a lost line, counted from 0; after the last leg no line is near.

    The robot turns on the spot: first to the side where it last saw the line, then as far to the other side, then all
    the way round. The line goes on ahead: a robot that turned round at once would often follow it back.

    Args:
        turned: Angle from the heading at which the line was lost, positive to the side where it was last seen, rad.
        leg: The leg before.
        legs: Angles at which the search turns back, rad.
    """
    while leg < len(legs) and (turned - legs[leg]) * leg_direction(leg) >= 0:
        leg += 1
    return leg


def leg_direction(leg: int) -> int:
    """Return the direction in which a leg turns: 1 to the side where the line was last seen, -1 to the other."""
    return -1 if leg % 2 else 1


def spiral(wheels: Wheels, driven: float) -> Wheels:
    """Return the speeds of a spiral outwards, so that a line that is near is found first.

    Args:
        wheels: The speeds of a robot that drives straight on, rev/s.
        driven: How far the robot has searched, m; math.inf ends the spiral.
    """
    bend = AXLE / 2 / math.sqrt(TIGHTEST**2 + SPACING * driven / math.pi)
    return Wheels(wheels.left * (1 - bend), wheels.right * (1 + bend))


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
        self._levels = Levels()
        self._wheels, self._open_air = STANDING, OpenAir()
        self._side = 1.0  # where the line was last seen, 1 to the left
        self._is_calibrating = True
        self._legs: tuple[float, ...] = CALIBRATION
        self._restart()

    async def step(self, view: Epuck) -> None:
        """Read the ground sensors, and follow the line or search for it."""
        ground = await view.ground()
        gap = max(PERIOD, self._robot.time - self._read_at)
        self._read_at = self._robot.time
        if not any(self._levels.floor) and max(ground[:3]) < FLOOR:
            raise Unsupported(
                f"the ground sensors read {', '.join(map(str, ground[:3]))}: the robot does not have them",
                hint="attach the sensor module, or use sim://line; BTcom is built without ground sensors",
            )
        self._levels.learn(ground)
        if self._is_calibrating and self._leg == len(self._legs):
            self._is_calibrating, self._legs = False, LEGS
            self._restart()
        line = None if self._is_calibrating else self._levels.offset(ground)
        pace = min(self._cruise, MAX_STEP / gap / WHEEL_CIRCUMFERENCE)
        if line is not None:
            self._run.state("following")
            self._side = math.copysign(1.0, line or self._side)
            self._restart()
            self._wheels = follow(line, cruise=pace)
        elif self._leg < len(self._legs):
            self._wheels = await self._sweep(view, gap)
        else:
            self._run.state("searching")
            free = avoid(self._open_air(await view.proximity()), self._wheels, cruise=pace)
            if free != (pace, pace):
                self._searched = math.inf  # the spiral would lead along the wall
            self._wheels = spiral(free, self._searched)
            self._searched += pace * WHEEL_CIRCUMFERENCE * gap
        await view.set_speed(self._wheels.left, self._wheels.right)

    def _restart(self) -> None:
        """Let the next turn begin at the heading that the robot then has."""
        self._leg, self._turned, self._heading = 0, 0.0, math.nan
        self._searched = 0.0  # m driven in search of the line

    async def _sweep(self, view: Epuck, gap: float) -> Wheels:
        """Return the speeds of a turn to learn or to find the line, *gap* seconds after the last reading."""
        if self._run.current_state == "following" and gap > 2 * max(PERIOD, self._robot.statistics.median):
            self._side = -self._side  # it steered to that side for too long without a reading, and has crossed the line
        self._run.state("calibrating" if self._is_calibrating else "sweeping")
        before, self._heading = self._heading, (await view.pose()).heading
        if not math.isnan(before):
            self._turned += self._side * math.remainder(self._heading - before, math.tau)
        self._leg = sweep(self._turned, self._leg, self._legs)
        turn = self._side * leg_direction(self._leg) * min(SPIN, MAX_STEP / gap / ARM * AXLE / 2 / WHEEL_CIRCUMFERENCE)
        return Wheels(-turn, turn)


@behaviour(world="line", reconnects=True, group="vehicles")
async def follow_line(robot: Epuck, run: RunContext, *, cruise: Cruise = 0.5) -> None:
    """Follow a dark line with the ground sensors; if there is none, search for one.

    First it looks to both sides: begin on the line, so that each sensor learns what line and floor give.

    Args:
        robot: The robot to drive; it needs the ground sensor module.
        run: The run.
        cruise: Mean speed of the wheels on a straight line.

    Raises:
        Unsupported: The robot has no ground sensors, or its firmware was built without them.
    """
    await react(robot, Follower(robot, run, cruise).step, period=PERIOD, min_timeout=MIN_TIMEOUT)
