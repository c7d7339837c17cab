"""A flock: robots that keep a distance from each other and drive the same way, by range and bearing.

Reynolds' three rules, with what a robot hears of its neighbours: go away from those that are too near, towards those
that are far, and in the direction in which they drive ("Flocks, herds and schools", SIGGRAPH 1987). Distance and
bearing come with each message; the direction of the others is what the message says: where its sender has magnetic
north, by its magnetometer, so that no robot needs to know where it is.

Only robots of the simulator hear each other, and only the e-puck2 has a magnetometer: other robots keep their distance
from each other, and do not drive the same way.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

from elib.base.body import SENSOR_DIRECTIONS
from elib.behaviours import OpenAir, Quantity, RunContext, behaviour, react
from elib.behaviours.dispersion import disperse
from elib.link.protocol.values import MagneticField, Neighbour
from elib.robot.aio import Epuck
from elib.robot.swarms.swarm import Swarm

Pace = Annotated[float, Quantity("pace", "rev/s", 0.1, 1.0, scale=1000)]
Spacing = Annotated[float, Quantity("spacing", "m", 0.1, 0.5, scale=1000)]

ALIGNMENT, COHESION, OBSTACLES = 1.0, 0.6, 1.5
"""Weights of the three wishes. A robot that hears no one drives straight on, with weight 1."""
BYTE = math.tau / 256
"""rad. Step of a direction in a message of one byte, 1.4 degrees: less than the noise of a bearing."""
NEAR = 50.0
"""Counts of an infrared sensor at which what it sees weighs as much as the direction of the flock: at 6 cm."""
NOISE = 20
"""Counts that are ignored, a few more than the noise."""
PERIOD = 0.1
"""s between two steps if the link is quick: a robot sends ten messages a second."""


def north_of(field: MagneticField) -> float:
    """Return the direction of magnetic north, rad, 0 ahead, positive to the left; a virtual robot has no iron."""
    return math.atan2(field.y, field.x)


def packed(north: float) -> bytes:
    """Return the message that says where its sender has north."""
    return bytes([round(north / BYTE) % 256])


def flock(
    north: float, neighbours: Sequence[Neighbour], near: Sequence[float], *, spacing: float = 0.2
) -> tuple[float, float]:
    """Return where to go: forward and to the left, 1 for each weight of 1.

    Args:
        north: The robot's own direction of north, rad.
        neighbours: What it hears; a message of another length than one byte says nothing of its sender's direction.
        near: Readings of its eight infrared sensors, counts.
        spacing: Distance that neighbours should keep, between their middles, m.
    """
    ahead, leftward = 1.0, 0.0
    for each in neighbours:
        # From -1 side by side over 0 at the right distance to at most 1.
        pull = COHESION * min((each.distance - spacing) / spacing, 1.0)
        ahead += pull * math.cos(each.bearing)
        leftward += pull * math.sin(each.bearing)
        if len(each.message) == 1:
            # Where the other one looks, as this robot sees it.
            course = north - each.message[0] * BYTE
            ahead += ALIGNMENT * math.cos(course)
            leftward += ALIGNMENT * math.sin(course)
    scale = 1.0 / (1 + len(neighbours))
    ahead, leftward = ahead * scale, leftward * scale
    for count, angle in zip(near, SENSOR_DIRECTIONS, strict=True):
        if count > NOISE:
            push = OBSTACLES * math.sqrt(count / NEAR)
            ahead -= push * math.cos(angle)
            leftward -= push * math.sin(angle)
    return ahead, leftward


@behaviour(world="crowd?robots=8&firmware=epuck2", reconnects=True, group="swarm")
async def flocking(robots: Swarm, run: RunContext, *, pace: Pace = 0.4, spacing: Spacing = 0.2) -> None:
    """Drive as a flock: each robot keeps a distance from the others that it hears, and drives where they drive.

    Args:
        robots: The robots, of the simulator; only e-puck2s know their direction.
        run: The run.
        pace: Speed of the wheels.
        spacing: Distance that neighbours should keep.
    """

    async def one(robot: Epuck) -> None:
        has_compass = "magnetometer" not in robot.context.profile.absent
        open_air = OpenAir()

        async def step(view: Epuck) -> None:
            north = 0.0
            if has_compass:
                north = north_of(await view.magnetometer())
                await view.send_message(packed(north))
            heard = await view.neighbours()
            ahead, leftward = flock(north, heard, open_air(await view.proximity()), spacing=spacing)
            wheels = disperse(math.atan2(leftward, ahead), pace=pace)
            await view.set_speed(wheels.left, wheels.right)

        await react(robot, step, period=PERIOD)

    run.state("flocking")
    await robots.all.run(one)
