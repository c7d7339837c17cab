"""Come together: a swarm of robots, each of which sees what is near, and how far it is to what is ahead.

The world is a room whose edge is a step, too low for the infrared and the distance sensors; the walls around it are at
least 1 m away. So what a robot sees nearer than that is another robot. Eight robots start anywhere. To be solved, an
episode needs a mean distance of 25 cm between two robots: that is one cluster, for most of the time. The controller of
Gauci and others earns 0.83.
"""

from __future__ import annotations

from typing import Final

from elib.learn.rooms import ROBOTS, STEP, WIDTH, distance
from elib.simulator.physics import Box, EpuckModel, Scene
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

COUNT = 8

ROOM = 1.2
"""m. Side of the room, in which eight robots need minutes to meet by chance."""

AROUND = 1.0
"""m. How far the walls stand around it: what the distance sensor sees nearer than this is a robot."""

KERB = 0.02
"""m. Height of the step that keeps the robots in, below their infrared and distance sensors at 33 mm."""

TOGETHER: Final = 0.6
"""m between two robots, beyond which they count as apart."""


def reward(world: Records, i: int) -> float:
    """Return how near the others are, 0..1: the mean of 1 - (d - 7.4 cm) / 60 cm, and 0 for those farther away.

    d is the distance from the middle of this robot to that of another one.
    """
    robot = world.robots[i]
    near = 0.0
    for k in range(len(world.robots)):
        if k != i:
            apart = distance(robot.x, robot.y, world.robots[k].x, world.robots[k].y)
            near += min(max(1.0 - (apart - WIDTH) / TOGETHER, 0.0), 1.0)
    return near / (len(world.robots) - 1)


def open_room() -> Scene:
    """Return a room whose edge is a low step that the robots cannot see, with walls far behind it."""
    side = ROOM + 2 * AROUND
    middle = side / 2
    beside = AROUND / 2
    steps = (
        Box(middle, beside, side, AROUND, height=KERB, name="south"),
        Box(middle, side - beside, side, AROUND, height=KERB, name="north"),
        Box(beside, middle, AROUND, ROOM, height=KERB, name="west"),
        Box(side - beside, middle, AROUND, ROOM, height=KERB, name="east"),
    )
    return Scene(side, side, step=STEP, name="open room", boxes=steps, model=EpuckModel(generation=2))


TASK = Task(
    name="aggregation",
    summary="Come together, as a swarm.",
    source="Trianni, Gross, Labella, Sahin and Dorigo 2003, Evolving aggregation behaviors in a swarm of robots, "
    "European Conference on Artificial Life (a fitness by distances); Gauci and others 2014, Self-organized "
    "aggregation without computation, International Journal of Robotics Research 33(8) (robots that only see "
    "whether one is ahead)",
    robots=COUNT,
    scenes=(open_room(),),
    sensors=("proximity", "distance"),
    reward=reward,
    solved=0.7,
    seconds=120.0,
    randomisation=ROBOTS,
)
