"""Find out where a robot is on a map: follow walls until only one place is left."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace
from typing import TYPE_CHECKING

from elib.base.body import WHEEL_CIRCUMFERENCE
from elib.base.errors import NoWay
from elib.base.pose import Pose, apart
from elib.base.rules import Number
from elib.behaviours.avoid import STANDING
from elib.behaviours.explore import TURN_RATE
from elib.behaviours.wall_following import follow, sees_wall
from elib.robot.aio import Epuck

if TYPE_CHECKING:
    from elib.maps.grid import Grid

CRUISE = 0.6
"""rev/s along walls, 7.7 cm/s: of 24 robots 23 were found in 60 s, at 0.4 rev/s 21, and no more touched a wall."""
SPEED = CRUISE * WHEEL_CIRCUMFERENCE
"""m/s."""
AROUND, OFF = math.tau + 0.5, 0.2
"""rad to the right after which the robot was round something, and m that it then drives on without following it."""
LIMIT = Number(1.0, 3600.0)
"""s."""


async def find_place(robot: Epuck, map: Grid, *, limit: float = 120.0) -> Pose:  # noqa: A002  # as go_to has it
    """Find out where the robot is on a map. It follows walls until only one place is left, and then stands.

    ``robot.pose()`` and ``robot.go_to(x, y, map=map)`` count from that place on. The first time, the robot turns round
    once, so that each infrared sensor learns what it reads where nothing is near.

    Args:
        robot: The robot.
        map: The map. The robot may be anywhere on it.
        limit: How long it may take, s of the robot's time, from 1 to 3600.

    Returns:
        The place on the map, with its uncertainty. Where one corner looks like another it may be wrong
        (docs/guides/maps.md says how often); ``go_to`` notices that on its way, and ends in ``NoWay``.

    Raises:
        NoWay: The place was not found in that time. ``robot.pose()`` is what it would have been without the search.

    Example:
        >>> async def main(robot: elib.Epuck) -> None:
        ...     maze = elib.Grid.of_world("maze")
        ...     pose = await find_place(robot, maze)
        ...     print(f"to {pose.uncertainty:.2f} m")
        ...     await robot.go_to(0.1, 0.1, map=maze)
    """
    from elib.maps.grid import check_grid  # here: they need NumPy
    from elib.robot.ways import Guide

    check_grid(map)
    LIMIT.require(limit, "limit")
    async with robot.motion.under_way(robot, "find_place"):
        guide = await asyncio.to_thread(Guide, robot, map, SPEED, TURN_RATE, is_lost=True)
        end = robot.time + limit
        if robot.context.open_air is None:
            await guide.look_round()
        wheels, was_at_wall, turned = STANDING, False, 0.0
        before, left_at = robot.motion.odometry.pose, None
        while not guide.estimate.is_sure:
            if robot.time > end:
                raise NoWay(
                    f"the robot's place on the map was not found in {limit:g} s",
                    hint="is it on the map? Put it where walls look like nowhere else, or give it more time",
                )
            await guide.look()
            near, here = guide.near, robot.motion.odometry.pose
            turned += math.remainder(here.heading - before.heading, math.tau)
            before = here
            if was_at_wall and turned < -AROUND:  # round one thing, which tells nothing more, or is not on the map
                was_at_wall, left_at = False, here
            if left_at is not None and apart(here, left_at) < OFF:
                near = replace(near, diagonal_right=0, right=0)  # it drives past what is there
            if not was_at_wall:
                turned, was_at_wall = 0.0, sees_wall(near)
            wheels = follow(near, wheels, cruise=CRUISE, is_lost=not was_at_wall)
            await guide.roll(wheels)
        guide.hand_over()
        await robot.motion.roll(robot, 0.0, 0.0, SPEED)  # not further: it returns when the wheels stand
    return robot.motion.odometry.pose
