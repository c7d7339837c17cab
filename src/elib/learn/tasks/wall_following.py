"""Follow the walls of a room, which the robot keeps on its right.

The worlds are rooms with blocks, so that there are inner and outer corners, and walls that stand aslant. The robot
starts anywhere, and has to find a wall first. A robot that drives along the walls at full speed, 1 to 3 cm away, and
loses them for a short time at corners, earns 0.5 to 0.7.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from elib.learn.rooms import FULL_SCALE, ROBOTS, TOP_SPEED, forward_speed, room
from elib.simulator.physics import Box, Scene, Wall
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

FAR: Final = 200.0
"""Reading of the right sensor, counts, from which the wall is near enough: 2.9 cm from the body of an ideal robot."""

NEAR: Final = 1000.0
"""Reading from which it is too near: 1.1 cm."""

TOUCHING: Final = 3000.0
"""Reading that earns nothing any more: 5 mm."""

RIGHT: Final = 2


def reward(world: Records, i: int) -> float:
    """Return v d (1 - n), -1..1: how fast the robot drives forward along a wall on its right.

    v is the mean speed of the wheels as a part of the top speed. d is 1 while the right sensor
    reads 200 to 1000 counts, a wall 1.1 to 2.9 cm away, and falls to 0 at 0 and at 3000 counts. n is the higher of the
    two front readings as a part of the full scale.
    """
    view = world.views[i]
    right = view.proximity[RIGHT]
    beside = min(right / FAR, 1.0, max((TOUCHING - right) / (TOUCHING - NEAR), 0.0))
    ahead = max(view.proximity[0], view.proximity[7]) / FULL_SCALE
    return forward_speed(world.robots[i]) * beside * (1.0 - ahead)


def scenes() -> tuple[Scene, ...]:
    """Return rooms with inner and outer corners, and with blocks to go round."""
    bare = room(0)
    blocks = (
        (Box(0.5, 0.5, 0.4, 0.3),),
        (Box(0.15, 0.15, 0.3, 0.3), Box(0.85, 0.8, 0.3, 0.4)),
        (Box(0.5, 0.1, 0.2, 0.2), Box(0.5, 0.9, 0.2, 0.2)),
        (Box(0.45, 0.55, 0.5, 0.2, angle=0.5),),
    )
    cut = (Wall(0.0, 0.85, 0.15, 1.0), Wall(0.85, 0.0, 1.0, 0.15))
    made = [replace(bare, name=f"blocks {number}", boxes=boxes) for number, boxes in enumerate(blocks)]
    return tuple(replace(each, walls=walls) for walls in ((), cut) for each in made[: 4 if not walls else 1])


TASK = Task(
    name="wall-following",
    summary="Find a wall, and follow it on the right.",
    source="Koza 1992, Evolution of subsumption using genetic programming, First European Conference on Artificial "
    "Life (the behaviour); the reward is made in the manner of Floreano and Mondada 1994",
    scenes=scenes(),
    reward=reward,
    reward_sensors=("proximity",),
    solved=0.5,
    top_speed=TOP_SPEED,
    randomisation=ROBOTS,
    on_board=True,
)
