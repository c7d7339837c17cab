"""Push a box to a lamp, together: the box is too heavy for one robot.

The box stands between four robots and a lamp. It is lower than the infrared sensors, so it does not hide the lamp:
robots that drive to the lamp meet it. One robot alone can only turn it; two move it. It is solved if the box arrives.
"""

from __future__ import annotations

import math
import random
from typing import Final

from elib.learn.rooms import ROBOTS, STEP, distance
from elib.simulator.physics import Box, Light, Pose, Scene
from elib.simulator.physics.geometry import unit
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

COUNT = 4

LAMP = (1.5, 0.5)
"""Where the lamp is, m."""

MASS = 0.3
"""kg. Friction of 0.5 holds the box with 1.47 N; one robot pushes with 1.03 N (docs/reference/e-puck.md, 1)."""

HEIGHT = 0.03
"""m. Lower than the infrared sensors, 33 mm, so that the box does not hide the lamp from the robots behind it."""

ARRIVED: Final = 0.3
"""m from the box's middle to the lamp."""

TRIP: Final = 0.6
"""m that the box has to go."""


def lamp_distance(world: Records, x: float, y: float) -> float:
    """Return how far (x, y) is from the lamp, m."""
    return distance(x, y, world.lamps[0].x, world.lamps[0].y)


def reward(world: Records, i: int) -> float:
    """Return by how much the box came nearer to the lamp in this tick, as a part of the 60 cm that it has to go.

    All robots earn the same, and about 1 if the box arrives.
    """
    box = world.things[0]
    return (lamp_distance(world, box.before_x, box.before_y) - lamp_distance(world, box.x, box.y)) / TRIP


def is_over(world: Records) -> bool:
    """Return whether the box has arrived at the lamp."""
    return lamp_distance(world, world.things[0].x, world.things[0].y) < ARRIVED


def scene(seed: int) -> Scene:
    """Return a room with a lamp at one end, the robots at the other, and the box between, at places of the seed."""
    draw = random.Random(seed)
    cosine, sine = unit(round(draw.uniform(-0.1, 0.1), 3))
    far = ARRIVED + TRIP
    box = Box(LAMP[0] - far * cosine, LAMP[1] + far * sine, 0.2, 0.3, height=HEIGHT, is_pushable=True, mass=MASS)
    starts = tuple(
        Pose(
            round(draw.uniform(0.1, 0.38), 3),
            round(0.2 + 0.2 * k + draw.uniform(-0.04, 0.04), 3),
            round(draw.uniform(-math.pi, math.pi), 3),
        )
        for k in range(COUNT)
    )
    lamp = Light(*LAMP, height=0.06, intensity=2.0, name="lamp")
    return Scene(1.6, 1.0, step=STEP, name=f"box {seed}", boxes=(box,), lights=(lamp,), starts=starts)


TASK = Task(
    name="box-pushing",
    summary="Push a box to a lamp, together: it is too heavy for one robot.",
    source="Kube and Bonabeau 2000, Cooperative transport by ants and robots, Robotics and Autonomous Systems 30 "
    "(several robots push a box that is too heavy for one to a lamp); the reward is the box's progress",
    robots=COUNT,
    scenes=tuple(scene(seed) for seed in range(8)),
    sensors=("proximity", "ambient_light"),
    reward=reward,
    is_over=is_over,
    fitness="sum",
    solved=0.99,
    randomisation=ROBOTS,
)
