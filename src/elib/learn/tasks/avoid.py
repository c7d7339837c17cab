"""Drive fast and straight, away from walls: the experiment with which evolutionary robotics began.

The worlds are a corridor round a block, as in the paper, the world ``arena``, and six rooms with posts and boxes at
random places. The robot starts anywhere. A robot that drives at full speed and turns away from walls earns 0.7 to 0.9
in each tick. One that only drives in circles where there is room earns less than 0.6, and so does one that stops or
turns on the spot at each wall for long.
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

from elib.learn.rooms import ROBOTS, TOP_SPEED, gallery, nearness, room
from elib.simulator.physics import Box, Scene, Wall
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task


def reward(world: Records, i: int) -> float:
    """Return V (1 - sqrt(dv)) (1 - n), -1..1: fast forward, straight, and far from everything.

    V is the mean speed of the wheels and dv half of their difference, both as parts of the top speed, and n the highest
    of the eight infrared readings as a part of the full scale. In the paper V has no sign; then a robot that shakes to
    and fro on one spot would earn as much as one that drives.
    """
    left = world.robots[i].left_speed / TOP_SPEED
    right = world.robots[i].right_speed / TOP_SPEED
    fast = min(max(0.5 * (left + right), -1.0), 1.0)
    turning = min(0.5 * abs(left - right), 1.0)
    return fast * (1.0 - sqrt(turning)) * (1.0 - nearness(world, i))


def corridor() -> Scene:
    """Return a corridor that goes round a block, as in the paper, but wider: an e-puck is wider than a Khepera."""
    block = (Box(0.55, 0.41, 0.66, 0.14), Box(0.36, 0.28, 0.28, 0.14))
    corners = (Wall(0.0, 0.60, 0.10, 0.70), Wall(1.10, 0.58, 0.98, 0.70), Wall(1.10, 0.12, 0.98, 0.0))
    return replace(room(0, width=1.1, depth=0.7), name="corridor", boxes=block, walls=corners)


TASK = Task(
    name="avoid",
    summary="Drive fast and straight, away from walls.",
    source="Floreano and Mondada 1994, Automatic creation of an autonomous agent, From Animals to Animats 3",
    scenes=(corridor(), gallery("arena"), *(room(seed, posts=3, boxes=2) for seed in range(1, 7))),
    reward=reward,
    reward_sensors=("proximity",),
    solved=0.6,
    top_speed=TOP_SPEED,
    randomisation=ROBOTS,
    on_board=True,
)
