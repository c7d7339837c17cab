"""Drive a square of 15 cm by exact motions.

In the library of 2011 each side was a pause between two commands, so a slow answer made a longer side. Here each side
and each turn is controlled by the step counters.
"""

from __future__ import annotations

import math
from typing import Annotated

from elib.behaviours import Quantity, RunContext, behaviour
from elib.robot.blocking import BlockingEpuck

Side = Annotated[float, Quantity("side", "m", 0.01, 2.0, scale=1000)]

CORNERS = 4
SPEED = 0.0515
"""m/s: 0.4 of full speed, as in 2011. The thesis of 2011 found that the wheels do not lose steps at this speed."""


@behaviour(world="arena", group="samples of 2011")
def go_and_turn(robot: BlockingEpuck, run: RunContext, *, side: Side = 0.15) -> None:
    """Drive a square, turning to the right at its corners.

    Args:
        robot: The robot to drive.
        run: The run.
        side: Length of a side.
    """
    for corner in range(1, CORNERS + 1):
        run.state(f"side-{corner}")
        if run.wait_for(robot.begin.drive(side, speed=SPEED)) is None:
            return
        run.state(f"turn-{corner}")
        pose = run.wait_for(robot.begin.turn(-math.pi / 2))
        if pose is None:
            return
        run.say(f"corner {corner}: ({100 * pose.x:+.1f} cm, {100 * pose.y:+.1f} cm), {pose.heading:+.2f} rad")
    missed = robot.pose()
    run.say(f"the square closes within {1000 * math.hypot(missed.x, missed.y):.1f} mm, by the step counters")
