"""Find a target among obstacles, and touch none.

The worlds are the one of deepbots, with a long box between the robot and the target, the same one turned by half, and
six rooms with posts and boxes in which the target is in a corner. Over the target hangs a lamp, higher than the
obstacles: sensors see it from everywhere, and environments show distance and bearing of the target beside them. An
episode is solved if the robot comes to the target within a minute without a touch. One that drives straight to the
lamp touches what is in its way in two of three episodes. `elib evolve find-and-avoid` with seed 1 finds a network that
solves 95 % of new episodes, in a minute on two cores. Of its own agent, which learns by DDPG, deepbots says that it
does not converge well.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from elib.learn.rooms import ROBOTS, distance, room
from elib.simulator.physics import Box, Light, Pose, Scene
from elib.simulator.physics.observing import goal
from elib.simulator.physics.records import Records
from elib.simulator.physics.task import Task

REACHED: Final = 0.12
"""m from the target. There the robot has found it, as in deepbots."""

TOUCH: Final = 0.1
"""What a touch costs, as a part of what the target gives: 1 and 10 in deepbots."""

FARTHEST: Final = 1.3
"""m. No start is farther from the target."""

SIDE: Final = 0.7
"""m. Of the world of deepbots."""


def way(world: Records, x: float, y: float) -> float:
    """Return how far (x, y) is from the target, m."""
    return distance(x, y, world.lamps[0].x, world.lamps[0].y)


def reward(world: Records, i: int) -> float:
    """Return by what part of 1.3 m the robot came nearer to the target, 1 more when it is there, 0.1 less for a touch.

    All together that is below 1 until the target is reached, and above 0.9 then. In deepbots the reward is 10 at the
    target, -1 and the end where an infrared sensor reads more than 500, and -0.5 from 200 on.
    """
    robot = world.robots[i]
    far = way(world, robot.x, robot.y)
    earned = (way(world, robot.before_x, robot.before_y) - far) / FARTHEST
    if far < REACHED:
        earned += 1.0
    return earned - TOUCH if robot.touched >= 0 else earned


def is_over(world: Records) -> bool:
    """Return whether the robot has reached the target, or touches something."""
    robot = world.robots[0]
    return way(world, robot.x, robot.y) < REACHED or robot.touched >= 0


def lit(scene: Scene, x: float, y: float) -> Scene:
    """Return a world with a target, and its lamp, at (x, y)."""
    return replace(scene, lights=(Light(x, y, height=0.3, intensity=1.5, name="target"),))


def behind_a_box(is_turned: bool) -> Scene:
    """Return the world of deepbots, or the same one turned by half."""

    def place(x: float, y: float) -> tuple[float, float]:
        return (SIDE - x, SIDE - y) if is_turned else (x, y)

    scene = replace(
        room(0, width=SIDE, depth=SIDE),
        name=f"deepbots {int(is_turned)}",
        boxes=(Box(*place(0.25, 0.51), 0.5, 0.06),),
        starts=(Pose(*place(0.09, 0.62), 3.14 if is_turned else 0.0),),
    )
    return lit(scene, *place(0.61, 0.12))


CORNERS = ((0.12, 0.12), (0.88, 0.12), (0.88, 0.88), (0.12, 0.88))

TASK = Task(
    name="find-and-avoid",
    summary="Find a target among obstacles, and touch none.",
    source="Kirtas, Tsampazis, Passalis and Tefas 2020, Deepbots: a Webots-based deep reinforcement learning framework "
    "for robotics, AIAI 2020, and the example find_and_avoid of deepworlds",
    scenes=(
        *(behind_a_box(is_turned) for is_turned in (False, True)),
        *(lit(room(seed, posts=3, boxes=3), *CORNERS[seed % 4]) for seed in range(1, 7)),
    ),
    sensors=("proximity", "ambient_light"),
    reward=reward,
    is_over=is_over,
    observe=(goal(lamp=0),),
    fitness="sum",
    solved=1.0,
    randomisation=ROBOTS,
)
