"""Remember a lamp: it stood on the side to which the T-maze has to be left.

The robot starts at the foot of the T and drives past a lamp, which stands on the left or on the right and is seen from
a few centimetres only. At the end of the corridor it must turn to the same side. Each end of the arms ends the episode;
it is solved at the right one. A robot that has forgotten the lamp solves one half. A network without a memory can solve
more: where it drives, at one wall or at the other, is a memory, too. The guide "Evolve a controller" says what
recurrent and feedforward networks reach with drawn seeds.
"""

from __future__ import annotations

from typing import Final

from elib.learn.rooms import ROBOTS, STEP
from elib.simulator.physics import Box, Light, Pose, Scene
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

WIDTH: Final = 1.0
"""m from the end of one arm to that of the other."""

CORRIDOR: Final = 0.2
"""m. As wide are the arms."""

LAMP: Final = 0.25
"""m from the foot of the T to the lamp."""

END: Final = 0.1
"""m from the end of an arm. There the robot has left the maze."""


def way(world: Records, x: float, y: float) -> float:
    """Return how far it is from (x, y) to the right end, by the corridor and the arm, m."""
    aside = WIDTH - x if world.lamps[0].x > 0.5 * WIDTH else x
    middle = world.setting[0].depth - 0.5 * CORRIDOR
    if y < middle - 0.5 * CORRIDOR:
        return middle - y + 0.5 * WIDTH
    return aside + abs(middle - y)


def is_out(world: Records, i: int) -> bool:
    """Return whether a robot is at the end of an arm."""
    return abs(world.robots[i].x - 0.5 * WIDTH) > 0.5 * WIDTH - END


def reward(world: Records, i: int) -> float:
    """Return by how many metres the way to the right end became shorter, and 1 more there.

    At the other end the way is 0.4 m longer than in the middle, and that is all.
    """
    robot = world.robots[i]
    left = way(world, robot.x, robot.y)
    nearer = way(world, robot.before_x, robot.before_y) - left
    return nearer + 1.0 if left < 2.0 * END and is_out(world, i) else nearer


def is_over(world: Records) -> bool:
    """Return whether the robot is at the end of an arm."""
    return is_out(world, 0)


def maze(side: int, length: float, heading: float) -> Scene:
    """Return a T with a lamp on the left (-1) or on the right (1) of its corridor, which is *length* m long."""
    wide = 0.5 * (WIDTH - CORRIDOR)
    return Scene(
        WIDTH,
        length + CORRIDOR,
        step=STEP,
        name=f"T {side} {length:g} {heading:g}",
        boxes=tuple(Box(x, 0.5 * length, wide, length) for x in (0.5 * wide, WIDTH - 0.5 * wide)),
        lights=(Light(0.5 * WIDTH + side * 0.45 * CORRIDOR, LAMP, height=0.03, intensity=0.1, name="sign"),),
        starts=(Pose(0.5 * WIDTH, 0.08, heading),),
    )


TASK = Task(
    name="t-maze",
    summary="Remember on which side a lamp stood, and turn to that side at the end of a corridor.",
    source="Rylatt and Czarnecki 2000, Embedding connectionist autonomous agents in time: the road sign problem, "
    "Neural Processing Letters 12(2) (a light beside the corridor, and a network that feeds itself)",
    scenes=tuple(
        maze(side, length, heading) for side in (-1, 1) for length in (0.7, 0.9) for heading in (1.37, 1.57, 1.77)
    ),
    sensors=("proximity", "ambient_light"),
    reward=reward,
    is_over=is_over,
    fitness="sum",
    solved=1.0,
    randomisation=ROBOTS,
)
