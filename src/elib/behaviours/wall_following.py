"""Follow a wall on one side, at a set distance, round inner and outer corners."""

from __future__ import annotations

import enum
import math
from typing import Annotated

from elib.base.body import AXLE, RADIUS, WHEEL_CIRCUMFERENCE
from elib.base.infrared import LIGHT
from elib.behaviours import OpenAir, Quantity, RunContext, behaviour, react
from elib.behaviours.avoid import STANDING
from elib.link.protocol.values import Proximity, Wheels
from elib.robot.aio import Epuck


class Side(enum.IntEnum):
    """The side of the robot on which the wall is."""

    LEFT = 0
    RIGHT = 1


Hand = Annotated[Side, Quantity("side", "", 0, 1, names=Side)]
Clearance = Annotated[float, Quantity("distance", "m", 0.02, 0.035, scale=1e6)]
Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 0.5, scale=1000)]

UNIT = math.sqrt(LIGHT)
"""m. At a distance d from a white wall, an infrared sensor reads (UNIT / d)^2 (e-puck.md, 3)."""
SIGHT = 0.075
"""m. Readings of a larger distance are ignored: 32 counts, ten deviations of the noise. Sensors see open air unlike
each other."""
SLANT, OUTSET = 1.46, 0.013
"""The diagonal sensor reads a wall alongside as SLANT times the robot's distance from it and OUTSET, m: it looks at 44
degrees, from further inside, and its side rays go far. Fitted in the simulator, 1.5 to 4 cm from a white wall."""
GAIN = 24.0
"""Turn for each metre of error of the diagonal sensor's distance. The sensor looks 5 cm ahead, so a robot that comes
nearer turns away before it is too near, and does not oscillate."""
MAX_TURN = 0.9
"""Largest turn: one wheel is faster, and the other slower, than the mean by this part of it."""
INSIDE = 0.002
"""m from the edge of the body to the side sensor."""
AHEAD = 0.035
"""m. If something in front is nearer, it is the other wall of an inner corner: the robot turns on the spot."""
CLEAR = 0.055
"""m. The turn ends when nothing in front is nearer. More than AHEAD, to avoid oscillation."""
ASIDE = 1.5
"""Factor for the distance of a diagonal sensor beside those in front: it looks 46 degrees aside."""
SPIN = 0.3
"""Wheel speed of a turn on the spot, rev/s: 1.5 rad/s, 8 degrees between two readings."""
PERIOD = 0.1
"""s between two steps if the link is quick: two commands take 0.09 s over Bluetooth (wire-protocol.md, 5.13)."""
MAX_STEP = 0.01
"""m that the robot may drive from one reading to the next: a slow link makes a slow robot."""


def wall_distance(count: int) -> float:
    """Return the distance of a white wall whose reading is *count*, m, at most :data:`SIGHT`."""
    return min(SIGHT, UNIT / math.sqrt(count)) if count > 0 else SIGHT


def mirrored(near: Proximity) -> Proximity:
    """Return the readings with left and right exchanged."""
    return Proximity(*reversed(near))


def sees_wall(near: Proximity) -> bool:
    """Return whether there is a wall on the right."""
    return min(map(wall_distance, (near.diagonal_right, near.right))) < SIGHT


def follow(
    near: Proximity, before: Wheels = STANDING, *, distance: float = 0.03, cruise: float = 0.4, is_lost: bool = False
) -> Wheels:
    """Return the speeds that keep a wall on the right.

    If something is in front, the robot turns left on the spot until the way is free. Along the wall it keeps the
    distance by its diagonal sensor. At the end of the wall it drives in a circle round the end.

    Args:
        near: Readings of the infrared sensors, without what they read in the open; for a wall on the left,
            :func:`mirrored`.
        before: The speeds that this controller returned last.
        distance: Distance between body and wall, m.
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
    excess = beside - INSIDE - distance
    circle = AXLE / 2 / (distance + RADIUS)
    if diagonal < SIGHT:
        # Of something round it sees less than of a wall: only the side sensor then sees that it is too near.
        turn = GAIN * (diagonal - SLANT * distance - OUTSET + min(0.0, excess))
    elif beside < SIGHT:  # the end of a wall is narrow, so it seems farther than it is
        turn = max(0.0, min(GAIN * excess, circle))
    else:
        turn = 0.0 if is_lost else circle
    turn = max(-MAX_TURN, min(MAX_TURN, turn))
    return Wheels(cruise * (1 + turn), cruise * (1 - turn))


@behaviour(world="maze", reconnects=True, group="vehicles")
async def follow_wall(
    robot: Epuck, run: RunContext, *, side: Hand = Side.RIGHT, distance: Clearance = 0.03, cruise: Cruise = 0.4
) -> None:
    """Follow a wall on one side, through any room or maze.

    First it turns round once, so that each sensor learns what it reads where nothing is near. Without a wall the robot
    drives straight on until it finds one. Walls should be white, or as bright: a darker wall seems further away.

    Args:
        robot: The robot to drive.
        run: The run.
        side: Side on which the wall is.
        distance: Distance between body and wall.
        cruise: Mean speed of the wheels along the wall.
    """
    wheels, open_air = STANDING, OpenAir()
    way, longest = math.inf, math.tau * (distance + RADIUS)  # driven since a wall was last seen, m
    turned = 0.0  # since it began, rad
    read_at = robot.time

    async def step(view: Epuck) -> None:
        nonlocal wheels, way, turned, read_at
        before, wheels = wheels, STANDING  # after a lost answer the robot stands
        near = open_air(await view.proximity())
        gap, read_at = max(PERIOD, robot.time - read_at), robot.time
        pace = min(cruise, MAX_STEP / gap / WHEEL_CIRCUMFERENCE)
        if turned < math.tau:
            turned += gap * WHEEL_CIRCUMFERENCE * (before.right - before.left) / AXLE
            run.state("calibrating")
            wheels = Wheels(-min(SPIN, pace), min(SPIN, pace))
            await view.set_speed(wheels.left, wheels.right)
            return
        if side is Side.LEFT:
            near, before = mirrored(near), Wheels(before.right, before.left)
        way = 0.0 if sees_wall(near) else way + gap * WHEEL_CIRCUMFERENCE * sum(before) / 2
        wheels = follow(
            near,
            before,
            distance=distance,
            cruise=pace,
            is_lost=way > longest,
        )
        is_turning = wheels.left < 0
        run.state("turning" if is_turning else "searching" if way > longest else "following")
        if side is Side.LEFT:
            wheels = Wheels(wheels.right, wheels.left)
        await view.set_speed(wheels.left, wheels.right)

    await react(robot, step, period=PERIOD)
