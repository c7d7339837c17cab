"""Go to a lamp and stay there, by the light that the infrared sensors read with their emitters off.

The worlds are 24 empty rooms with a lamp somewhere. The robot starts at least half a metre away from it; if it stands
there, it earns 0.3 at most. A robot that drives to the lamp within a quarter of the time, and presses its front
against it, has the lamp between two sensors and earns 0.4 to 0.6, which solves it. One that turns a sensor to the lamp
earns up to 0.75. What evolves usually drives round the lamp in a small circle, with one sensor always turned to it: the
reward does not ask the robot to stand.
"""

from __future__ import annotations

import math
import random
from dataclasses import replace
from typing import Final

from elib.base.infrared import ROOM_READING
from elib.learn.rooms import ROBOTS, room
from elib.simulator.physics import Cylinder, Light, Pose, Scene
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

DARK: Final = ROOM_READING
"""What a sensor reads in a normal room without a lamp, counts (docs/reference/e-puck.md, 4)."""

SIDE = 1.4
"""Of the room, m."""

FAR = 0.5
"""m. Least way from the start to the lamp: from there a robot that stands still does not earn enough."""


def reward(world: Records, i: int) -> float:
    """Return how bright the brightest sensor sees the lamp, 0..1.

    0 is the room's own light. 1 is as bright as can be: the lamp stands right before a sensor.
    """
    brightest = DARK
    for s in range(8):
        brightest = min(brightest, 1.0 * world.views[i].ambient_light[s])
    return 1.0 - brightest / DARK


def lit(seed: int) -> Scene:
    """Return a room with a lamp whose light falls to 1/e within 35 cm; the seed chooses its place and the start.

    The lamp stands on a foot lower than the infrared sensors: a robot can touch it, but not drive over it.
    """
    draw = random.Random(seed)
    x, y, start_x, start_y = 0.0, 0.0, 0.0, 0.0
    while (x - start_x) * (x - start_x) + (y - start_y) * (y - start_y) < FAR * FAR:
        x, y, start_x, start_y = (round(draw.uniform(0.15, SIDE - 0.15), 3) for _ in range(4))
    return replace(
        room(0, width=SIDE, depth=SIDE),
        name=f"lamp {seed}",
        lights=(Light(x, y, height=0.04, intensity=0.7, name="lamp"),),
        cylinders=(Cylinder(x, y, 0.02, height=0.03, name="foot"),),
        starts=(Pose(start_x, start_y, round(draw.uniform(-math.pi, math.pi), 3)),),
    )


TASK = Task(
    name="phototaxis",
    summary="Go to a lamp and stay there.",
    source="Braitenberg 1984, Vehicles, MIT Press (the behaviour, vehicle 2b); the reward is what the robot's own "
    "sensors read",
    scenes=tuple(lit(seed) for seed in range(24)),
    sensors=("ambient_light",),
    reward=reward,
    reward_sensors=("ambient_light",),
    solved=0.4,
    randomisation=ROBOTS,
    on_board=True,
)
