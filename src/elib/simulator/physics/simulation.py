"""A tick of a world, and many of them in a row under a controller that drives the robots.

The phases of a tick stand in fixed order: sense and drive if a controller does, roll, push apart, list what is near.
Sensing without a controller is done when somebody asks.
"""

from __future__ import annotations

from collections.abc import Callable, MutableSequence, Sequence
from typing import Any

from elib.simulator.physics.contacts import collide
from elib.simulator.physics.engine import kernel, loop
from elib.simulator.physics.motion import move, rim_speed
from elib.simulator.physics.neighbours import is_stale, list_near
from elib.simulator.physics.pushing import finish_things, start_things
from elib.simulator.physics.records import Records, SensorView


@kernel
def advance(world: Records, ticks: int) -> None:
    """Run *ticks* ticks."""
    for _ in range(ticks):
        move(world)
        if len(world.things) > 0:
            start_things(world)
        collide(world)
        if len(world.things) > 0:
            finish_things(world)
        world.setting[0].tick += 1
        if is_stale(world):
            list_near(world)


def sense(world: Records, i: int) -> None:
    """Stand for the sensors that a controller asked for: each reads those of robot *i*."""


def decide(robot: SensorView, parameters: Any, memory: Any) -> None:
    """Stand for the function of a controller."""


@kernel
def sense_all(world: Records, lanes: int) -> None:
    """Let every robot read its sensors, those of different lanes at the same time."""
    for lane in loop(lanes):
        count = len(world.robots)
        for i in range(lane * count // lanes, (lane + 1) * count // lanes):
            sense(world, i)


@kernel
def control(world: Records, lanes: int, parameters: Sequence[Any], memory: Sequence[Any]) -> None:
    """Let every robot sense, and set its wheels by the control function, those of different lanes at the same time."""
    for lane in loop(lanes):
        count = len(world.robots)
        for i in range(lane * count // lanes, (lane + 1) * count // lanes):
            drive(world, i, parameters[i], memory[i])


@kernel
def drive(world: Records, i: int, parameters: Any, memory: Any) -> None:
    """Let robot *i* sense, and set its wheels by the control function."""
    setting = world.setting[0]
    view = world.views[i]
    view.time = setting.tick * setting.step
    view.left = 0.0
    view.right = 0.0
    sense(world, i)
    decide(view, parameters, memory)
    world.robots[i].left_speed = rim_speed(world.tables[0], view.left)
    world.robots[i].right_speed = rim_speed(world.tables[0], view.right)


@kernel
def steer(world: Records, ticks: int, lanes: int, parameters: Sequence[Any], memory: Sequence[Any]) -> None:
    """Run *ticks* ticks in each of which every robot senses and the control function sets its wheels."""
    for _ in range(ticks):
        control(world, lanes, parameters, memory)
        advance(world, 1)


def all_of(reads: Sequence[Callable[[Records, int], None]]) -> Callable[[Records, int], None]:
    """Return one function that reads several sensors of a robot, one after the other."""
    if not reads:
        return sense
    first, *rest = reads
    if not rest:
        return first
    others = all_of(rest)

    def read(world: Records, i: int) -> None:
        first(world, i)
        others(world, i)

    return read


@kernel
def braitenberg(robot: SensorView, parameters: Sequence[float], memory: MutableSequence[float]) -> None:
    """Set each wheel to a base speed plus the weighted sum of the eight proximity readings.

    Parameters: left base speed, steps/s, eight left weights, steps/s a count; then the same of the right wheel.
    """
    p = parameters
    a, b, c, d = robot.proximity[0], robot.proximity[1], robot.proximity[2], robot.proximity[3]
    e, f, g, h = robot.proximity[4], robot.proximity[5], robot.proximity[6], robot.proximity[7]
    robot.left = p[0] + p[1] * a + p[2] * b + p[3] * c + p[4] * d + p[5] * e + p[6] * f + p[7] * g + p[8] * h
    robot.right = p[9] + p[10] * a + p[11] * b + p[12] * c + p[13] * d + p[14] * e + p[15] * f + p[16] * g + p[17] * h
