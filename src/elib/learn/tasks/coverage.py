"""Visit every part of a room: the floor is divided into cells, and a cell that the robot enters first counts.

The worlds are an empty room and seven with posts and boxes at random places. Each has 100 cells of 10 x 10 cm; those
under an obstacle count too. The robot starts anywhere. A robot that drives straight and turns away from walls by a
fixed angle earns 0.55 to 0.8 in the two minutes, which solves it or nearly; one that drives in a circle earns 0.1.
"""

from __future__ import annotations

from typing import Any, Final

from elib.learn.rooms import ROBOTS, room
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

CELLS: Final = 10
"""Cells along each side of the room, which is 1 m long."""


def reward(world: Records, i: int, memory: Any) -> float:
    """Return 1 % for each cell of the room that no robot had entered before, and 0 otherwise."""
    column = min(max(int(world.robots[i].x * CELLS), 0), CELLS - 1)
    row = min(max(int(world.robots[i].y * CELLS), 0), CELLS - 1)
    if memory.visited[row][column] > 0.0:
        return 0.0
    memory.visited[row][column] = 1.0
    return 1.0 / (CELLS * CELLS)


TASK = Task(
    name="coverage",
    summary="Visit every part of a room.",
    source="Wagner, Lindenbaum and Bruckstein 1999, Distributed covering by ant-robots using evaporating traces, IEEE "
    "Transactions on Robotics and Automation 15(5) (robots that have to visit every cell of a floor); the fitness is "
    "the share of cells visited",
    scenes=(room(0), *(room(seed, posts=3, boxes=2) for seed in range(1, 8))),
    reward=reward,
    memory={"visited": [[0.0] * CELLS] * CELLS},
    fitness="sum",
    solved=0.6,
    seconds=120.0,
    randomisation=ROBOTS,
)
