"""A tick of a world, and many of them in a row under a controller that drives the robots.

The phases of a tick stand in fixed order: sense and drive if a controller does, roll, push apart, list what is near.
Sensing without a controller is done when somebody asks.
"""

from __future__ import annotations

from collections.abc import Callable, MutableSequence, Sequence
from typing import Any, TypeAlias

from elib.simulator.physics.contacts import collide
from elib.simulator.physics.engine import Engine, call, kernel, loop
from elib.simulator.physics.motion import move, turn_wheels
from elib.simulator.physics.neighbours import is_stale, list_near
from elib.simulator.physics.pushing import finish_things, start_things
from elib.simulator.physics.records import Records, SensorView
from elib.simulator.physics.sensors import sense
from elib.simulator.physics.zones import act

Law: TypeAlias = Any
"""A control function as kernels call it (:func:`law_of`)."""


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
        if world.setting[0].has_states:
            act(world)
        if is_stale(world):
            list_near(world)


@kernel
def sense_all(world: Records, lanes: int, sensors: int) -> None:
    """Let every robot read these sensors, those of different lanes at the same time."""
    count = len(world.robots)
    for lane in loop(lanes):
        for i in range(lane * count // lanes, (lane + 1) * count // lanes):
            sense(world, i, sensors)


@kernel
def drive(
    law: Law, world: Records, first: int, end: int, sensors: int, parameters: Sequence[Any], memory: Sequence[Any]
) -> None:
    """Let robots first..end - 1 sense, and set their wheels by the control function."""
    setting = world.setting[0]
    for i in range(first, end):
        view = world.views[i]
        view.time = setting.tick * setting.step
        view.left = 0.0
        view.right = 0.0
        sense(world, i, sensors)
    call(law, (world.views, first, end, parameters, memory))
    for i in range(first, end):
        turn_wheels(world, i)


@kernel
def steer(
    law: Law, world: Records, ticks: int, lanes: int, sensors: int, parameters: Sequence[Any], memory: Sequence[Any]
) -> None:
    """Run *ticks* ticks in each of which every robot senses and the control function sets its wheels.

    The robots of different lanes do so at the same time.
    """
    count = len(world.robots)
    for _ in range(ticks):
        for lane in loop(lanes):
            drive(law, world, lane * count // lanes, (lane + 1) * count // lanes, sensors, parameters, memory)
        advance(world, 1)


def law_of(engine: Engine, function: Callable[..., Any]) -> Law:
    """Return a control function as kernels of *engine* call it: for many robots, of which the last rows may be one."""

    def decide(views: Any, first: int, end: int, parameters: Any, memory: Any) -> None:
        for i in range(first, end):
            function(views[i], parameters[min(i, len(parameters) - 1)], memory[i])

    return engine.argument(decide, lambda: (engine.blank(SensorView, 1), 0, 1, *[engine.table([[0.0]])] * 2))


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
