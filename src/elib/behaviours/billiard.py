"""Billiard: roll straight to a cushion, turn as a ball would, and roll on, in the begin style.

The sample of the same name in the C# library elib took the two sensors on the right for those behind, and averaged
angles as numbers, so that the mean of 10 degrees left and 10 degrees right of the front was behind.

The begin style lets a program ask for several things before it waits for the first of them: ``begin`` returns at once,
and ``end()`` waits for the outcome. Here the next reading is asked for while the wheels' command is still unanswered,
a sound is begun and its end is not waited for, and ``run.wait_for`` checks during a turn whether the run is over.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

from elib.base.body import SENSOR_DIRECTIONS
from elib.behaviours import OpenAir, Quantity, RunContext, behaviour, react_blocking
from elib.link.protocol.values import Proximity
from elib.robot.blocking import BlockingEpuck

Cruise = Annotated[float, Quantity("cruise", "rev/s", 0.05, 0.6, scale=1000)]

BEHIND = (3, 4)
"""Sensors that look backwards. The sample of 2011 used 2 and 3."""
NEAR = 350
"""Counts of the nearest sensor at a cushion, 2 cm away (e-puck.md, 3)."""
NOISE = 25
"""Counts that are ignored, as in :mod:`~elib.behaviours.avoid`."""
SPIN = 2.0
"""rad/s of a turn: half a turn in a second and a half."""
STUCK_SOUND = 4
"""The sound that it plays when it is stuck (as in Elib of 2011)."""
PAUSE = 1.0
"""s that it stands when it is stuck, before it tries another direction."""
PERIOD = 0.15
"""s from one reading to the next, if the link is quick enough: at 0.4 rev/s it rolls 8 mm meanwhile, of the 20 mm that
there are. If readings come more slowly, the ball rolls more slowly."""


def circular_mean(angles: Sequence[float], weights: Sequence[float]) -> float:
    """Return the weighted mean of directions, rad, -pi to pi: the direction of the sum of vectors.

    Args:
        angles: Directions of the vectors, rad.
        weights: Lengths of the vectors.
    """
    return math.atan2(
        sum(weight * math.sin(angle) for angle, weight in zip(angles, weights, strict=True)),
        sum(weight * math.cos(angle) for angle, weight in zip(angles, weights, strict=True)),
    )


def cushion(near: Proximity) -> float | None:
    """Return the direction of the cushion that the robot rolls into, rad, positive to the left; None if there is none.

    The nearer a sensor sees something, the more it counts. The mean then points at a straight cushion, to 9 degrees.
    The robot does not roll into what is beside or behind it.
    """
    if max(near) < NEAR:
        return None
    direction = circular_mean(SENSOR_DIRECTIONS, [count if count > NOISE else 0 for count in near])
    return direction if abs(direction) < math.pi / 2 else None


def rebound(direction: float) -> float:
    """Return the turn, rad, after which the robot leaves a cushion in this *direction*, rad, as a ball would."""
    return math.remainder(math.pi + 2 * direction, math.tau)


def is_stuck(near: Proximity) -> bool:
    """Return whether something is near both in front and behind: a rebound would lead into it."""
    front = (near.front_left, near.front_right, near.diagonal_left, near.diagonal_right)
    return max(front) >= NEAR and max(near[sensor] for sensor in BEHIND) >= NEAR


@behaviour(world="billiard", reconnects=True, group="samples of 2011")
def roll(robot: BlockingEpuck, run: RunContext, *, cruise: Cruise = 0.4) -> None:
    """Roll straight to a cushion, turn as a ball would, and roll on.

    Between a cushion and something behind, it plays a sound and turns in a random direction. The sample of 2011 ended
    there.

    Args:
        robot: The ball.
        run: The run.
        cruise: Speed on the cloth.
    """
    pace, seen, open_air = cruise, robot.time, OpenAir()

    def step(view: BlockingEpuck) -> None:
        nonlocal pace, seen
        rolling = view.begin.set_speed(pace, pace)
        looking = view.begin.proximity()
        rolling.end()
        run.state("rolling")
        near = open_air(looking.end())
        age, seen = near.time - seen, near.time
        pace = cruise * PERIOD / max(age, PERIOD)
        direction = cushion(near)
        if is_stuck(near):
            run.state("stuck")
            standing = view.begin.stop()
            robot.begin.play_sound(STUCK_SOUND)
            standing.end()
            robot.sleep(PAUSE)
            run.wait_for(robot.begin.turn(run.random.uniform(-math.pi, math.pi), turn_rate=SPIN))
            seen = robot.time
        elif direction is not None:
            run.state("rebounding")
            run.wait_for(robot.begin.turn(rebound(direction), turn_rate=SPIN))
            seen = robot.time

    react_blocking(robot, run, step, period=PERIOD)
