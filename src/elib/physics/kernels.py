"""A tick of a world, and many of them in a row, with a law that drives the robots.

Phases in fixed order over all robots in order of insertion: sense and drive if a law does, roll, hang into the grid,
push apart. Sensing without a law is done when somebody asks.
"""

from __future__ import annotations

from elib.physics.collision import collide
from elib.physics.engine import inner_kernel, kernel
from elib.physics.grid import is_listed, is_stale, regrid
from elib.physics.layout import (
    HEAD,
    LEFT_SPEED,
    NEAR_LACK,
    NUMBER,
    READINGS,
    RIGHT_SPEED,
    ROBOT,
    ROBOTS,
    TICK,
    Floats,
    Ints,
)
from elib.physics.motion import move, rim_speed
from elib.physics.sensors.infrared import sense, sense_all


@kernel
def advance(
    ticks: int,
    fixed: Floats,
    robots: Floats,
    bodies: Floats,
    walls: Floats,
    discs: Floats,
    cells: Ints,
    numbers: Ints,
    scratch: Floats,
) -> None:
    """Run *ticks* ticks, nobody sensing and nobody steering; stop early if there is no room to list what is near."""
    for _ in range(ticks):
        move(fixed, robots, numbers, scratch)
        collide(fixed, robots, bodies, walls, discs, cells, numbers)
        numbers[TICK] += 1
        if is_listed(numbers) and is_stale(robots, bodies, numbers):
            regrid(fixed, robots, bodies, walls, discs, cells, numbers)
            if numbers[NEAR_LACK]:
                return


def law(near: Ints, first: int, parameters: Floats, wheels: Floats) -> None:
    """Stand for a law: it reads eight counts from *near*, from *first* on, and sets both wheels, steps/s."""


@kernel
def steer(
    ticks: int,
    parameters: Floats,
    wheels: Floats,
    fixed: Floats,
    robots: Floats,
    bodies: Floats,
    walls: Floats,
    discs: Floats,
    cells: Ints,
    numbers: Ints,
    lights: Floats,
    scratch: Floats,
) -> None:
    """Run *ticks* ticks in each of which every robot senses and :func:`law` sets its wheels."""
    for _ in range(ticks):
        sense_all(fixed, robots, bodies, walls, discs, cells, numbers, lights, scratch)
        for i in range(numbers[ROBOTS]):
            wheels[0] = 0.0
            wheels[1] = 0.0
            law(numbers, HEAD + i * NUMBER + READINGS, parameters, wheels)
            r = i * ROBOT
            robots[r + LEFT_SPEED] = rim_speed(wheels[0], fixed)
            robots[r + RIGHT_SPEED] = rim_speed(wheels[1], fixed)
        advance(1, fixed, robots, bodies, walls, discs, cells, numbers, scratch)
        if numbers[NEAR_LACK]:
            return


@kernel
def turn(
    left: float,
    right: float,
    fixed: Floats,
    robots: Floats,
    bodies: Floats,
    walls: Floats,
    discs: Floats,
    cells: Ints,
    numbers: Ints,
    lights: Floats,
    scratch: Floats,
) -> tuple[int, int, int, int, int, int, int, int]:
    """Set the first robot's wheels, steps/s, run a tick, and return its eight infrared readings after it, counts.

    They are -1 if there was no room to list all that is near.
    """
    robots[LEFT_SPEED] = rim_speed(left, fixed)
    robots[RIGHT_SPEED] = rim_speed(right, fixed)
    advance(1, fixed, robots, bodies, walls, discs, cells, numbers, scratch)
    if numbers[NEAR_LACK]:
        return -1, -1, -1, -1, -1, -1, -1, -1
    sense(0, fixed, robots, bodies, walls, discs, cells, numbers, lights, scratch)
    m = HEAD + READINGS
    return (
        numbers[m],
        numbers[m + 1],
        numbers[m + 2],
        numbers[m + 3],
        numbers[m + 4],
        numbers[m + 5],
        numbers[m + 6],
        numbers[m + 7],
    )


@inner_kernel
def braitenberg(near: Ints, first: int, parameters: Floats, wheels: Floats) -> None:
    """Set each wheel to a base speed plus the weighted sum of the eight readings.

    Args:
        near: Infrared readings, counts.
        first: Where the robot's eight begin.
        parameters: Left base speed, steps/s, eight left weights, steps/s a count; then the same of the right wheel.
        wheels: Out: left and right, steps/s.
    """
    a, b, c, d = near[first], near[first + 1], near[first + 2], near[first + 3]
    e, f, g, h = near[first + 4], near[first + 5], near[first + 6], near[first + 7]
    p = parameters
    wheels[0] = p[0] + p[1] * a + p[2] * b + p[3] * c + p[4] * d + p[5] * e + p[6] * f + p[7] * g + p[8] * h
    wheels[1] = p[9] + p[10] * a + p[11] * b + p[12] * c + p[13] * d + p[14] * e + p[15] * f + p[16] * g + p[17] * h
