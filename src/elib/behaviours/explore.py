"""Explore an unknown arena: drive to the nearest place from which something new is seen, and draw a map."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import math
from typing import TYPE_CHECKING, Annotated

from elib.base.body import WHEEL_CIRCUMFERENCE
from elib.base.errors import NoWay
from elib.base.pose import Pose, apart
from elib.behaviours import Quantity, RunContext, behaviour
from elib.behaviours.avoid import STANDING
from elib.behaviours.wall_following import follow, sees_wall, wall_distance
from elib.robot.aio import Epuck

if TYPE_CHECKING:
    from elib.maps.grid import Grid
    from elib.robot.ways import Guide

Pace = Annotated[float, Quantity("pace", "m/s", 0.02, 0.12, scale=1e6)]

TURN_RATE = 1.5
"""rad/s."""
MAX_LOOSE = 1.5
"""m without a wall after which it looks for what is unknown instead."""
AROUND, HOME = 0.6, 0.05
"""m that it has driven at least when it is back, and from where it began then: the way round a post is shorter."""
STRETCH, NEAR = 0.10, 0.055
"""m along a wall that tell its direction, and from it."""
STRAIGHT, SLANTED = 0.06, 0.35
"""rad: how exactly it does, and from where a wall does not stand at right angles to the others."""
MAX_CRUISE = 0.52
"""rev/s along walls: a wheel round the outside of a corner is nearly twice as fast."""
FILE = "explored.png"
"""Where the map is left, with explored.toml beside it."""


async def draw(robot: Epuck, grid: Grid, *, pace: float = 0.08) -> None:
    """Draw a map of all that the robot can come to, in the coordinates of its odometry; the robot then stands.

    Args:
        robot: The robot.
        grid: The map; what it knows already is not looked at again.
        pace: The fastest speed, m/s.
    """
    from elib.maps.ways import frontier, is_seen  # here: they need NumPy
    from elib.robot.ways import Guide

    given_up: list[tuple[float, float]] = []
    async with robot.motion.under_way(robot, "explore"):
        guide = await asyncio.to_thread(Guide, robot, grid, pace, TURN_RATE, draws=True)
        try:
            await guide.look_round()
            await _along_walls(guide, min(pace / WHEEL_CIRCUMFERENCE, MAX_CRUISE))
            while (
                goal := await asyncio.to_thread(
                    frontier, grid, (guide.estimate.pose.x, guide.estimate.pose.y), given_up
                )
            ) is not None:
                with contextlib.suppress(NoWay):
                    await guide.drive_to(goal, functools.partial(is_seen, grid, goal))
                if not is_seen(grid, goal):
                    given_up.append(goal)
        finally:
            robot.motion.odometry.pose = guide.estimate.pose


async def _along_walls(guide: Guide, cruise: float) -> None:
    """Follow the wall on the right until the robot is where it was, or has found none: most of a map in one go."""
    wheels, driven, loose = STANDING, 0.0, 0.0
    first: Pose | None = None
    before = guide.estimate.pose
    straight, is_straight = Straight(), False
    while loose < MAX_LOOSE and (first is None or driven < AROUND or apart(first, before) > HOME):
        await guide.look()
        here = guide.estimate.pose
        way, before = apart(here, before), here
        driven, loose = driven + way, 0.0 if sees_wall(guide.near) else loose + way
        if first is None and not loose:
            first, driven = here, 0.0
        heading = straight(here, wall_distance(guide.near.right))
        if heading is not None:
            if not is_straight:  # what was drawn before may be turned against it
                guide.known.odds[:] = 0
                await asyncio.to_thread(guide.localiser.renew)
            is_straight = True
            guide.localiser.turn_to(heading, STRAIGHT)
        wheels = follow(guide.near, wheels, cruise=cruise, is_lost=first is None)
        await guide.roll(wheels)


class Straight:
    """Tells the heading beside a wall, if all walls stand at right angles to the first one."""

    def __init__(self) -> None:
        self._looks: list[tuple[Pose, float]] = []
        self._first: float | None = None

    def __call__(self, pose: Pose, distance: float) -> float | None:
        """Return the heading at *pose*, rad; None if the last stretch was not straight along a wall.

        Args:
            pose: Where the robot thinks to be.
            distance: How far the wall beside it is, m.
        """
        self._looks.append((pose, distance))
        while apart(self._looks[0][0], pose) > STRETCH:
            del self._looks[0]
        beside = [seen for _, seen in self._looks]
        turned = [math.remainder(each.heading - pose.heading, math.tau) for each, _ in self._looks]
        way = apart(self._looks[0][0], pose)
        if way < 0.8 * STRETCH or max(beside) > NEAR or max(beside) - min(beside) > 0.006:
            return None
        if max(turned) - min(turned) > 0.2:
            return None
        # Along the wall it came nearer or went away by this angle; the headings on the way were about as much aside.
        aside = math.atan2(beside[-1] - beside[0], way)
        wall = pose.heading + sum(turned) / len(turned) - aside
        if self._first is None:
            self._first = wall
        off = math.remainder(wall - self._first, math.tau / 4)
        return None if abs(off) > SLANTED else pose.heading - off


@behaviour(world="maze", group="vehicles")
async def explore(robot: Epuck, run: RunContext, *, pace: Pace = 0.08) -> None:
    """Explore an unknown arena and leave a map of it, explored.png and explored.toml; earlier ones are replaced.

    First it follows the wall on the right, once round, then it drives to what is still unknown. Walls that stand at
    nearly right angles are drawn so: that keeps the map straight, though no robot's wheels are alike. In a wide room in
    which it sees no wall for long the map bends.

    Args:
        robot: The robot to drive.
        run: The run.
        pace: The fastest speed.
    """
    from elib.maps.grid import Grid

    grid = Grid()
    run.state("exploring")
    try:
        await draw(robot, grid, pace=pace)
    finally:
        if grid.odds.size:
            grid.save(FILE)
            run.say(f"{grid}: {FILE}")
