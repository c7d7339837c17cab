"""Follow a dark line on a bright floor with the three ground sensors.

The worlds are the track of the world ``line`` and three others, each with a start in either direction. To be solved, an
episode needs 60 % of the top speed with the line under the middle sensor all the time. A robot that drives back what it
drove forward earns nothing.
"""

from __future__ import annotations

import math
import random
from dataclasses import replace

from elib.learn.rooms import ROBOTS, STEP, TOP_SPEED, forward_speed, gallery
from elib.simulator.physics import Pose, Scene, Stripe
from elib.simulator.physics.geometry import unit
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

POINTS = 72


def reward(world: Records, i: int) -> float:
    """Return v b, -1..1: how fast the robot drives forward, times how black it is under its middle ground sensor.

    v is the mean speed of the wheels as a part of the top speed. b is 1 over black and 0 over white, whatever this
    robot reads there.
    """
    robot = world.robots[i]
    black = (robot.white[1] - world.views[i].ground[1]) / (robot.white[1] - robot.black[1])
    return forward_speed(robot) * min(max(black, 0.0), 1.0)


def track(seed: int) -> Stripe:
    """Return a closed line whose waves the seed chooses, in an arena of 1.4 x 1 m. No bend is tighter than 8 cm."""
    draw = random.Random(seed)
    waves = [(k, draw.uniform(0.0, 0.22) / k, draw.uniform(0.0, math.tau)) for k in (2, 3, 4)]
    points = []
    for number in range(POINTS):
        angle = math.tau * number / POINTS
        far = 0.78 + sum(size * unit(k * angle + phase)[0] for k, size, phase in waves)
        cosine, sine = unit(angle)
        points.append((round(0.7 + 0.58 * far * cosine, 3), round(0.5 + 0.40 * far * sine, 3)))
    return Stripe((*points, points[0]))


def scenes() -> tuple[Scene, ...]:
    """Return four tracks, each with a start in either direction."""
    given = gallery("line")
    lines = [stripe for stripe in given.paint if isinstance(stripe, Stripe)]
    lines += [track(seed) for seed in (1, 2, 3)]
    made = []
    for number, line in enumerate(lines):
        for way in (1, -1):
            at = 7 * (number + way)
            x, y = line.points[at]
            next_x, next_y = line.points[at + way]
            heading = round(math.atan2(next_y - y, next_x - x), 3)
            # The middle ground sensor, not the robot's middle, is over the line at the start.
            starts = (Pose(x - 0.03 * unit(heading)[0], y - 0.03 * unit(heading)[1], heading),)
            made.append(replace(given, name=f"track {number}", paint=(line,), starts=starts, step=STEP))
    return tuple(made)


TASK = Task(
    name="line-following",
    summary="Follow a line on the floor, fast.",
    source="The behaviour is one of the oldest exercises in robotics; the reward, speed times a reading, is made in "
    "the manner of Floreano and Mondada 1994",
    scenes=scenes(),
    sensors=("ground",),
    reward=reward,
    reward_sensors=("ground",),
    solved=0.6,
    top_speed=TOP_SPEED,
    randomisation=ROBOTS,
    on_board=True,
)
