"""Come together without knowing where anybody is: self-organised aggregation without computation.

Each robot looks straight ahead with its camera and asks one question: is there another robot? The law that answers it
has two lines and no memory. Gauci, Chen, Li, Dodd and Gross found it, proved that two robots always meet by it, and
gathered forty e-pucks ("Self-organized aggregation without computation", Int. J. Robotics Research 33(8), 2014).
"""

from __future__ import annotations

from typing import Annotated

from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.behaviours._run.loop import SETUP_TIMEOUT
from elib.behaviours.redness import how_red
from elib.protocol.quantities import CameraMode, LedAction
from elib.protocol.values import Wheels
from elib.robot.aio import Epuck
from elib.swarms.swarm import Swarm

Pace = Annotated[float, Quantity("pace", "rev/s", 0.1, 1.0, scale=1000)]

BACK = 0.7
"""Speed of the inner wheel when nobody is in sight, as a part of the outer one's: both backwards, round a circle of
15 cm. Gauci's controller is (-0.7, -1.0), found by trying all; sight turns it into (1.0, -1.0)."""
COLUMNS, ROWS = 12, 48
"""Pixels of the picture: 9 degrees wide, which bridges the gap between two LEDs of a neighbour down to 20 cm, and high
enough to see them above the horizon down to 6 cm. It takes 0.1 s over the wire."""
SIGHT = 0.003
"""Share of red pixels that is a robot: two of them, one LED at 1 m."""
ALL_LEDS = 8
PERIOD = 0.25
"""s between two pictures where the link is quick: at the usual pace a robot turns 55 degrees meanwhile."""


def aggregate(sees_another: bool, *, pace: float = 0.5) -> Wheels:
    """Return what brings a robot to the others: round them backwards in circles, and on the spot at their sight.

    Args:
        sees_another: Whether another robot is straight ahead.
        pace: Speed of the quicker wheel, rev/s.
    """
    return Wheels(pace, -pace) if sees_another else Wheels(-BACK * pace, -pace)


@behaviour(world="crowd?robots=10", reconnects=True)
async def gather(robots: Swarm, run: RunContext, *, pace: Pace = 0.5) -> None:
    """Come together, a swarm: each robot shows its LEDs, and looks for those of the others straight ahead.

    Args:
        robots: The robots.
        run: Where it performs.
        pace: Speed of the quicker wheel.
    """

    async def one(robot: Epuck) -> None:
        async def set_up(eyes: Epuck) -> bool:
            await eyes.set_camera(COLUMNS, ROWS, 8, CameraMode.COLOUR)  # it puts the lamps out on the e-puck1
            await eyes.set_led(ALL_LEDS, LedAction.ON)
            return True

        async def step(eyes: Epuck) -> None:
            picture = await eyes.image()
            wheels = aggregate(how_red(picture.pixels).fraction > SIGHT, pace=pace)
            await eyes.set_speed(wheels.left, wheels.right)

        await react(robot, set_up, min_timeout=SETUP_TIMEOUT)
        await react(robot, step, period=PERIOD)

    run.state("gathering")
    await robots.all.run(one)
