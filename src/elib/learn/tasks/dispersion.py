"""Spread out: a swarm of robots that start close together.

The world is an empty room, in which nine robots start side by side at one of eight places. To be solved, an episode
needs a mean distance of 17 cm to the nearest robot. The infrared sensors see another robot up to 13 cm away, so robots
that stop as soon as they see no other one do not reach it: they have to drive on for a while.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from elib.learn.rooms import ROBOTS, WIDTH, cluster, distance, room
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

COUNT = 9

SPACED: Final = 0.25
"""m to the nearest robot: far enough. The infrared sensors see a robot up to 13 cm away, from middle to middle."""

CORNERS = ((0.25, 0.25), (0.75, 0.25), (0.5, 0.5), (0.25, 0.75), (0.8, 0.8), (0.5, 0.2), (0.2, 0.5), (0.7, 0.5))
"""Where the robots start, m: one place in each world."""


def reward(world: Records, i: int) -> float:
    """Return how far the nearest other robot is, 0..1: 0 if it touches, and 1 from 25 cm on."""
    robot = world.robots[i]
    nearest = SPACED
    for k in range(len(world.robots)):
        if k != i:
            nearest = min(nearest, distance(robot.x, robot.y, world.robots[k].x, world.robots[k].y))
    return max((nearest - WIDTH) / (SPACED - WIDTH), 0.0)


BARE = room(0, width=1.2, depth=1.2)

TASK = Task(
    name="dispersion",
    summary="Spread out, as a swarm.",
    source="Duarte and others 2016, Evolution of collective behaviors for a real swarm of aquatic surface robots, "
    "PLoS ONE 11(3) (the distance to the nearest robot)",
    robots=COUNT,
    scenes=tuple(
        replace(BARE, name=f"cluster {seed}", starts=cluster(seed, COUNT, 1.2 * x, 1.2 * y))
        for seed, (x, y) in enumerate(CORNERS)
    ),
    reward=reward,
    solved=0.55,
    randomisation=ROBOTS,
)
