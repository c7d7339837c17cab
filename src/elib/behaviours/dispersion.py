"""A swarm that spreads out: each robot drives away from what its infrared sensors see, until they see nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

from elib.base.body import SENSOR_DIRECTIONS
from elib.behaviours import OpenAir, Quantity, RunContext, behaviour, react
from elib.link.protocol.values import Wheels
from elib.robot.aio import Epuck
from elib.robot.swarms.swarm import Swarm

Pace = Annotated[float, Quantity("pace", "rev/s", 0.1, 1.0, scale=1000)]

NOISE = 8.0
"""Counts of a smoothed reading that are ignored. The noise of 3 has a deviation of 1 after smoothing, and what a sensor
reads in the open seems 3 counts less than it is. Noise above this limit moves a robot by a centimetre from time to
time."""
SMOOTHING = 0.2
"""Weight of the newest reading. Smoothed, two robots see each other at 15 cm between their centres."""
STRAIGHT = math.radians(60)
"""To a direction further aside than this the robot turns on the spot; to others it turns while it drives."""
SCANNING = 0.07
"""Wheel speed of a robot that sees nothing, rev/s. It turns slowly on the spot, because another robot may stand in a
gap of 60 degrees between its sensors."""
LEAVING = 0.5
"""s that a robot drives on after it last saw something, to get further away than it sees. If it drove on much longer,
it would come near others, and the swarm would take long to settle."""
PERIOD = 0.2
"""s between two steps if the link is quick: at the default pace a robot drives 8 mm meanwhile."""


def escape(near: Sequence[float]) -> float | None:
    """Return the direction that leads away from all that is near, rad, positive to the left; None if nothing is near.

    Each sensor repels by the square root of its count, which is proportional to one over the distance (e-puck.md,
    3).

    Args:
        near: Readings of the eight infrared sensors, smoothed or not, counts.
    """
    pushes = [math.sqrt(count) if count > NOISE else 0.0 for count in near]
    if not any(pushes):
        return None
    ahead = -sum(push * math.cos(angle) for push, angle in zip(pushes, SENSOR_DIRECTIONS, strict=True))
    leftward = -sum(push * math.sin(angle) for push, angle in zip(pushes, SENSOR_DIRECTIONS, strict=True))
    return math.atan2(leftward, ahead)


def disperse(direction: float, *, pace: float = 0.3) -> Wheels:
    """Return the speeds that lead in a direction, rad, positive to the left."""
    if abs(direction) > STRAIGHT:
        turn = math.copysign(pace, direction)
        return Wheels(-turn, turn)
    share = direction / STRAIGHT
    return Wheels(pace * min(1.0, 1 - share), pace * min(1.0, 1 + share))


@behaviour(world="crowd?robots=10", reconnects=True, group="swarm")
async def scatter(robots: Swarm, run: RunContext, *, pace: Pace = 0.3) -> None:
    """Spread out, as a swarm: each robot drives away from others, and stays where no other is near.

    Args:
        robots: The robots.
        run: The run.
        pace: Speed of the wheels while driving.
    """

    async def one(robot: Epuck) -> None:
        smooth: list[float] = [0.0] * len(SENSOR_DIRECTIONS)
        leaves_until, open_air = -math.inf, OpenAir()

        async def step(view: Epuck) -> None:
            nonlocal leaves_until
            near = open_air(await view.proximity())
            smooth[:] = [before + SMOOTHING * (now - before) for before, now in zip(smooth, near, strict=True)]
            direction = escape(smooth)
            if direction is not None:
                leaves_until = robot.time + LEAVING
                wheels = disperse(direction, pace=pace)
            elif robot.time < leaves_until:
                wheels = Wheels(pace, pace)
            else:
                wheels = Wheels(-SCANNING, SCANNING)
            await view.set_speed(wheels.left, wheels.right)

        await react(robot, step, period=PERIOD)

    run.state("scattering")
    await robots.all.run(one)
