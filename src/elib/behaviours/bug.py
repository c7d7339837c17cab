"""Come to a place without a map: straight on, and along the wall of what is in the way (the algorithm Bug 2)."""

from __future__ import annotations

import math

from elib.base.body import AXLE, WHEEL_CIRCUMFERENCE
from elib.base.pose import Pose, apart, bearing
from elib.behaviours import OpenAir, RunContext, behaviour, react
from elib.behaviours.avoid import STANDING
from elib.behaviours.wall_following import AHEAD, MAX_STEP, PERIOD, SPIN, Cruise, follow, wall_distance
from elib.link.protocol.values import Proximity, Wheels
from elib.robot.actions import Coordinate
from elib.robot.aio import Epuck

THERE = 0.015
"""m from the place within which the robot has come to it."""
LINE = 0.015
"""m from the straight line to the place within which the robot leaves a wall."""
NEARER = 0.03
"""m that it must then be nearer to the place than where it met the wall."""
GAIN = 1.2
"""Turn for each rad that the place lies beside the heading, as a part of the mean speed."""
ASIDE = 0.6
"""rad beside the heading from which the robot turns on the spot."""
AROUND = 0.5
"""m along a wall after which it may be back where it met it: there is no way then."""


class Way:
    """The way of one robot to a place, m. Each step takes a pose and readings, and returns wheel speeds.

    Attributes:
        state: ``straight``, ``along`` a wall, ``there``, or ``enclosed`` if it went round what is in the way.
    """

    def __init__(self, x: float, y: float) -> None:
        self._goal = x, y
        self._start: Pose | None = None
        self._met = self._before = Pose(0.0, 0.0)
        self._driven = 0.0
        self._wheels = STANDING
        self.state = "straight"

    def __call__(self, pose: Pose, near: Proximity, cruise: float) -> Wheels:
        """Return the speeds for the next step."""
        self._start = self._start or pose
        self._driven += apart(pose, self._before)
        self._before = pose
        left = self._left(pose)
        if left < THERE:
            self.state = "there"
        elif self.state == "along":
            if self._aside(pose, self._start) < LINE and left < self._left(self._met) - NEARER:
                self.state = "straight"
            elif self._driven > AROUND and apart(pose, self._met) < LINE:
                self.state = "enclosed"
        elif min(map(wall_distance, (near.front_left, near.front_right))) < AHEAD:
            self.state, self._met, self._driven = "along", pose, 0.0
        if self.state == "along":
            self._wheels = follow(near, self._wheels, cruise=cruise)
        elif self.state == "straight":
            beside = bearing(pose, *self._goal)
            spin = math.copysign(min(SPIN, cruise), beside)
            turn = max(-1.0, min(1.0, GAIN * beside))
            self._wheels = (
                Wheels(-spin, spin) if abs(beside) > ASIDE else Wheels(cruise * (1 - turn), cruise * (1 + turn))
            )
        else:
            self._wheels = STANDING
        return self._wheels

    def _left(self, pose: Pose) -> float:
        return math.dist((pose.x, pose.y), self._goal)

    def _aside(self, pose: Pose, start: Pose) -> float:
        """Return how far a pose is from the line to the goal, m."""
        x, y = self._goal[0] - start.x, self._goal[1] - start.y
        return abs(x * (pose.y - start.y) - y * (pose.x - start.x)) / max(math.hypot(x, y), THERE)


@behaviour(reconnects=True, group="vehicles")
async def bug(robot: Epuck, run: RunContext, *, x: Coordinate = 0.7, y: Coordinate = 0.0, cruise: Cruise = 0.4) -> None:
    """Come to a place without a map: straight on, and along the wall of what is in the way.

    First it turns round once, so that each sensor learns what it reads where nothing is near. The place is one of
    odometry, which real wheels lead aside: after two metres, by up to 50 cm.

    Args:
        robot: The robot to drive.
        run: The run.
        x: The place, ahead of where the robot starts.
        y: The place, to the left of where it starts.
        cruise: Mean speed of the wheels.
    """
    way, open_air, turned = Way(x, y), OpenAir(), 0.0
    read_at = robot.time

    async def step(view: Epuck) -> bool:
        nonlocal turned, read_at
        near, pose = open_air(await view.proximity()), await view.pose()
        gap, read_at = max(PERIOD, robot.time - read_at), robot.time
        pace = min(cruise, MAX_STEP / gap / WHEEL_CIRCUMFERENCE)
        if turned < math.tau:
            turned += gap * 2 * SPIN * WHEEL_CIRCUMFERENCE / AXLE
            run.state("calibrating")
            await view.set_speed(-SPIN, SPIN)
            return False
        wheels = way(pose, near, pace)
        run.state(way.state)
        await view.set_speed(*wheels)
        return way.state in ("there", "enclosed")

    await react(robot, step, period=PERIOD)
    if way.state == "enclosed":
        run.say("It went round what is in the way: there is no way to that place.")
