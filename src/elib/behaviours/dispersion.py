"""Spread out: each robot drives away from whatever its infrared sensors see, until they see nothing any more."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.body import SENSOR_DIRECTIONS
from elib.protocol.values import Wheels
from elib.robot.aio import Epuck
from elib.swarms.swarm import Swarm

Pace = Annotated[float, Quantity("pace", "rev/s", 0.1, 1.0, scale=1000)]

NOISE = 10.5
"""Counts of a smoothed reading that mean nothing. Enki's noise of 10, cut off below 0, has a mean of 4 and a deviation
of 6, of which the smoothing leaves 2: three deviations above the mean. What is noise all the same moves a robot by a
centimetre now and then."""
SMOOTHING = 0.2
"""Weight of the newest reading: two robots then see each other from 17 cm between their middles on, not from 14."""
STRAIGHT = math.radians(60)
"""What leads further aside than this is turned to on the spot; to the rest the robot bends while it drives."""
LOOKING = 0.07
"""Wheel speed of a robot that sees nobody, rev/s: it turns slowly on the spot, for between its sensors there are gaps
of 60 degrees in which somebody may stand."""
LEAVING = 0.5
"""s that a robot drives on after the last sight, to leave by more than it sees. Robots that go on for much longer come
into the sight of others, and the swarm takes long to settle."""
PERIOD = 0.2
"""s between two looks where the link is quick: at the usual pace a robot drives 8 mm meanwhile."""


def escape(near: Sequence[float]) -> float | None:
    """Return the direction that leads away from all that is near, rad, positive to the left; None where nothing is.

    Each sensor pushes the more the nearer it sees something: by the root of its count, which goes with one over the
    distance (robot-model, 2.3).

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
    """Return the speeds that lead off in a direction, rad, positive to the left."""
    if abs(direction) > STRAIGHT:
        turn = math.copysign(pace, direction)
        return Wheels(-turn, turn)
    share = direction / STRAIGHT
    return Wheels(pace * min(1.0, 1 - share), pace * min(1.0, 1 + share))


@behaviour(world="crowd?robots=10", reconnects=True)
async def scatter(robots: Swarm, run: RunContext, *, pace: Pace = 0.3) -> None:
    """Spread out, a swarm: drive away from whoever is near, and rest where nobody is.

    Args:
        robots: The robots.
        run: Where it performs.
        pace: Speed of the wheels on the way.
    """

    async def one(robot: Epuck) -> None:
        smooth: list[float] = [0.0] * len(SENSOR_DIRECTIONS)
        leaves_until = -math.inf

        async def step(eyes: Epuck) -> None:
            nonlocal leaves_until
            near = await eyes.proximity()
            smooth[:] = [before + SMOOTHING * (now - before) for before, now in zip(smooth, near, strict=True)]
            direction = escape(smooth)
            if direction is not None:
                leaves_until = robot.time + LEAVING
                wheels = disperse(direction, pace=pace)
            elif robot.time < leaves_until:
                wheels = Wheels(pace, pace)
            else:
                wheels = Wheels(-LOOKING, LOOKING)
            await eyes.set_speed(wheels.left, wheels.right)

        await react(robot, step, period=PERIOD)

    run.state("scattering")
    await robots.all.run(one)
