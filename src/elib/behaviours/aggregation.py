"""A swarm that comes together: self-organised aggregation without computation.

Each robot looks straight ahead with its camera and decides one thing: is there another robot? The controller has two
lines and no memory. Gauci, Chen, Li, Dodd and Gross found it, proved that two robots with it always meet, and gathered
forty e-pucks ("Self-organized aggregation without computation", Int. J. Robotics Research 33(8), 2014).
"""

from __future__ import annotations

from typing import Annotated

from elib.behaviours import Quantity, RunContext, behaviour, react
from elib.behaviours._run.loop import SETUP_TIMEOUT
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode, LedAction
from elib.link.protocol.values import Wheels
from elib.robot.aio import Epuck
from elib.robot.swarms.swarm import Swarm

Pace = Annotated[float, Quantity("pace", "rev/s", 0.1, 1.0, scale=1000)]

BACK = 0.7
"""Speed of the inner wheel as a part of the outer one's when no robot is in sight: both wheels turn backwards, and the
robot drives round a circle of 15 cm. Gauci's controller, found by trying all, is (-0.7, -1.0) without and (1.0, -1.0)
with a robot in sight."""
COLUMNS, ROWS = 12, 48
"""Pixels of the picture. It is 7 degrees wide, more than the gap between two LEDs of a robot 20 cm away or more, and
high enough to see them above the horizon from 6 cm on. It takes 0.1 s over the wire."""
SIGHT = 0.005
"""Fraction of red pixels that means a robot: three pixels. The LEDs of one 1 m away are seven."""
ALL_LEDS = 8
PERIOD = 0.25
"""s between two pictures if the link is quick: at the default pace a robot turns 55 degrees meanwhile."""


def sees_another(picture: Image) -> bool:
    """Return whether a picture shows the LEDs of a robot: an area, for what is red here and there is noise."""
    return bool(picture.blobs("red", smallest=SIGHT))


def aggregate(sees_another: bool, *, pace: float = 0.5) -> Wheels:
    """Return the speeds that lead to other robots: backwards in circles, or turning on the spot if one is in sight.

    Args:
        sees_another: Another robot is straight ahead.
        pace: Speed of the quicker wheel, rev/s.
    """
    return Wheels(pace, -pace) if sees_another else Wheels(-BACK * pace, -pace)


@behaviour(world="crowd?robots=10", reconnects=True, group="swarm")
async def gather(robots: Swarm, run: RunContext, *, pace: Pace = 0.5) -> None:
    """Come together, as a swarm: each robot turns on its LEDs, and looks straight ahead for those of the others.

    Args:
        robots: The robots.
        run: The run.
        pace: Speed of the quicker wheel.
    """

    async def one(robot: Epuck) -> None:
        async def set_up(view: Epuck) -> bool:
            await view.set_camera(COLUMNS, ROWS, 8, CameraMode.COLOUR)  # on the e-puck1 this turns the LEDs off
            await view.set_led(ALL_LEDS, LedAction.ON)
            return True

        async def step(view: Epuck) -> None:
            picture = await view.image()
            wheels = aggregate(sees_another(picture), pace=pace)
            await view.set_speed(wheels.left, wheels.right)

        await react(robot, set_up, min_timeout=SETUP_TIMEOUT)
        await react(robot, step, period=PERIOD)

    run.state("gathering")
    await robots.all.run(one)
