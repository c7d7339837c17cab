"""Bring a ball into a goal behind which a lamp shines: a team of two, without opponents.

The world is the field of the world ``soccer``. The robots start behind the ball, 10 to 36 cm away. The ball rolls, so
each touch decides where it goes. It is solved if the ball is in the goal in time.
"""

from __future__ import annotations

import random
from dataclasses import replace
from typing import Final

from elib.learn.rooms import ROBOTS, distance, gallery
from elib.simulator.physics import Light, Pose, Scene
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

COUNT = 2

LINE: Final = 1.6
"""x of the goal line, m."""

MIDDLE: Final = 0.5
"""y of the middle of the goal, m."""

POST: Final = 0.2
"""m from the middle of the goal to each post."""


def is_over(world: Records) -> bool:
    """Return whether the ball is in the goal."""
    ball = world.things[0]
    return ball.x > LINE and abs(ball.y - MIDDLE) < POST


def reward(world: Records, i: int) -> float:
    """Return by how many metres the ball came nearer to the goal in this tick, and 1 more when it is in.

    Both robots earn the same. All together that is below 1 without a goal, and above 1 with one.
    """
    ball = world.things[0]
    nearer = distance(ball.before_x, ball.before_y, LINE, MIDDLE) - distance(ball.x, ball.y, LINE, MIDDLE)
    return nearer + (1.0 if is_over(world) else 0.0)


def field(seed: int) -> Scene:
    """Return the field with a lamp behind one goal, and a ball that the two robots have before them.

    The seed chooses the places. From seed to seed the ball is farther away: "learning from easy missions".
    """
    given = gallery("soccer")
    draw = random.Random(seed)
    (ball,) = given.cylinders
    ball = replace(ball, x=round(draw.uniform(0.7, 1.0), 3), y=round(draw.uniform(0.35, 0.65), 3))
    behind = 0.1 + 0.03 * seed
    starts = tuple(
        Pose(
            round(ball.x - behind - draw.uniform(0.0, 0.05), 3),
            round(ball.y + aside + draw.uniform(-0.02, 0.02), 3),
            round(draw.uniform(-0.4, 0.4), 3),
        )
        for aside in (-0.06, 0.06)
    )
    lamp = Light(1.69, MIDDLE, height=0.12, intensity=2.0, name="lamp")
    return replace(given, name=f"field {seed}", cylinders=(ball,), lights=(lamp,), starts=starts)


TASK = Task(
    name="soccer",
    summary="Bring a ball into the goal, in a team of two.",
    source="Asada, Noda, Tawaratsumida and Hosoda 1996, Purposive behavior acquisition for a real robot by "
    "vision-based reinforcement learning, Machine Learning 23",
    robots=COUNT,
    scenes=tuple(field(seed) for seed in range(8)),
    sensors=("proximity", "ambient_light"),
    reward=reward,
    is_over=is_over,
    fitness="sum",
    solved=1.0,
    randomisation=ROBOTS,
)
