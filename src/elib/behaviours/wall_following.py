"""Follow a wall with a hand on it: at a set distance, round corners that come towards the robot and that go away."""

from __future__ import annotations

import enum
import math
from typing import Annotated

from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.body import AXLE, METRES_PER_STEP, STEPS_PER_REVOLUTION
from elib.protocol.values import Proximity, Wheels
from elib.robot.aio import Epuck


class Side(enum.IntEnum):
    """On which side of the robot the wall is."""

    LEFT = 0
    RIGHT = 1


Hand = Annotated[Side, Quantity("side", "", 0, 1, names=Side)]
Clearance = Annotated[float, Quantity("distance", "m", 0.02, 0.035, scale=1e6)]
Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 0.5, scale=1000)]

STANDING = Wheels(0.0, 0.0)
BODY = 0.037
"""m. Radius of the robot."""
UNIT = 0.5
"""m: an infrared sensor reads (UNIT / d)^2 over a white wall (GCtronic's driver; within 10 % of Enki's curve from 2 to
5 cm; robot-model, 2.3)."""
SIGHT = 0.075
"""m. What reads as further away is not seen: 44 counts, more than four deviations of the noise (Enki's model)."""
SLANT = 1.9
"""What the diagonal sensor's distance is along a wall, over the robot's from it: 1 / cos 44 degrees, and more because
the sensor sits further in (robot-model, 2.2)."""
PULL = 20.0
"""Turn for each metre that the diagonal sensor's distance is wrong by. The sensor looks 5 cm ahead, so a robot that
comes nearer turns away before it is too near, and none swings to and fro."""
SHARPEST = 0.9
"""Most that one wheel is faster, and the other slower, than the mean."""
FURTHER = 0.004
"""m. The side sensor sits so far inside the body."""
AHEAD = 0.035
"""m. Something in front that is nearer is the other wall of an inner corner: the robot turns on the spot."""
CLEAR = 0.055
"""m. The turn ends when nothing in front is nearer. More than AHEAD, or the robot would dither."""
ASIDE = 1.5
"""A diagonal sensor's distance counts this much longer than the front ones': it looks 46 degrees aside."""
SPIN = 0.3
"""Wheel speed of a turn on the spot, rev/s: 1.5 rad/s, 8 degrees between two looks."""
PERIOD = 0.1
"""s between two looks where the link is quick: two commands take 0.09 s over Bluetooth (robot-model, 2.12)."""
LEAP = 0.01
"""m that the robot may drive from one look to the next: a slower link makes a slower robot."""


def wall_distance(count: int) -> float:
    """Return how far away a white wall is that an infrared sensor reads as *count*, m, at most :data:`SIGHT`."""
    return min(SIGHT, UNIT / math.sqrt(count)) if count > 0 else SIGHT


def mirrored(near: Proximity) -> Proximity:
    """Return what the sensors would read if left and right were exchanged."""
    return Proximity(*reversed(near))


def sees_wall(near: Proximity) -> bool:
    """Return whether there is a wall on the right hand."""
    return min(map(wall_distance, (near.diagonal_right, near.right))) < SIGHT


def follow(
    near: Proximity, before: Wheels = STANDING, *, distance: float = 0.03, cruise: float = 0.4, is_lost: bool = False
) -> Wheels:
    """Return the speeds that keep a wall on the right hand.

    With something in front the robot turns left on the spot, and goes on until the way is free. Along the wall it holds
    the distance by its diagonal sensor. Where the wall ends it drives round the end, in the circle that leads there.

    Args:
        near: What the infrared sensors see; for a wall on the left, :func:`mirrored`.
        before: The speeds this law returned last.
        distance: Between body and wall, m.
        cruise: Mean speed of the wheels along the wall, rev/s.
        is_lost: There is no wall to go round: drive straight on.
    """
    front = min(wall_distance(near.front_left), wall_distance(near.front_right))
    ahead = min(front, ASIDE * wall_distance(near.diagonal_left))
    is_turning = before.left < 0 < before.right
    if ahead < (CLEAR if is_turning else AHEAD):
        spin = min(SPIN, cruise)
        return Wheels(-spin, spin)
    diagonal, beside = wall_distance(near.diagonal_right), wall_distance(near.right)
    if diagonal < SIGHT:
        turn = PULL * (diagonal - SLANT * distance)
    elif beside < SIGHT:
        turn = max(0.0, PULL * (beside - FURTHER - distance))
    else:
        turn = 0.0 if is_lost else AXLE / 2 / (distance + BODY)
    turn = max(-SHARPEST, min(SHARPEST, turn))
    return Wheels(cruise * (1 + turn), cruise * (1 - turn))


@behaviour(world="maze", reconnects=True)
async def keep_a_hand_on_the_wall(
    robot: Epuck, run: RunContext, *, side: Hand = Side.RIGHT, distance: Clearance = 0.03, cruise: Cruise = 0.4
) -> None:
    """Follow a wall with a hand on it, through any room or maze.

    Without a wall it drives straight on until it finds one. What it keeps distance from should be white, or as bright:
    a darker wall is taken for one that is further away.

    Args:
        robot: The robot to drive.
        run: Where it performs.
        side: On which side the wall is.
        distance: Between body and wall.
        cruise: Mean speed of the wheels along the wall.
    """
    wheels = STANDING
    way, longest = math.inf, math.tau * (distance + BODY)  # driven since a wall was last seen, m
    looked = robot.time

    async def step(eyes: Epuck) -> None:
        nonlocal wheels, way, looked
        before, wheels = wheels, STANDING  # after a lost answer it stands
        near = await eyes.proximity()
        gap, looked = max(PERIOD, robot.time - looked), robot.time
        if side is Side.LEFT:
            near, before = mirrored(near), Wheels(before.right, before.left)
        rim = STEPS_PER_REVOLUTION * METRES_PER_STEP
        way = 0.0 if sees_wall(near) else way + gap * rim * sum(before) / 2
        wheels = follow(near, before, distance=distance, cruise=min(cruise, LEAP / gap / rim), is_lost=way > longest)
        is_turning = wheels.left < 0
        run.state("turning" if is_turning else "searching" if way > longest else "following")
        if side is Side.LEFT:
            wheels = Wheels(wheels.right, wheels.left)
        await eyes.set_speed(wheels.left, wheels.right)

    await react(robot, step, period=PERIOD)
