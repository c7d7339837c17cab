"""How an e-puck's wheels roll: the steps that are counted, and the arc that the robot drives."""

from __future__ import annotations

from typing import Final

from elib.base.body import FASTEST_2, METRES_PER_STEP
from elib.simulator.physics.defects import pace
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.noise import MASK, MOTOR, STRIDE, mix, tick_key
from elib.simulator.physics.records import Records, Robot, Tables

STEPS_PER_METRE: Final = 1.0 / METRES_PER_STEP

SHAKY: Final = 340.0
"""steps/s up to which the motors shake a robot alike, from the slowest; at twice as much they shake it twice as hard
(measured-robots: accelerometer.magnitude_by_speed: 5 to 340 steps/s 31..42 counts, 679 and 796 103 and 63)."""

MAX_TRAVEL: Final = 0.02
"""Furthest a wheel may roll in one tick, m, before noise and the spread of wheels: half a radius, so nothing can be
passed through."""


@kernel
def rim_speed(tables: Tables, speed: float) -> float:
    """Return the speed of a wheel's rim, m/s, that the firmware makes of a wanted speed, steps/s.

    It is looked up (:func:`elib.base.body.step_rate`). What is not a number stands for 0.
    """
    size = abs(speed)
    if not size >= 1.0:
        return 0.0
    # Limited before it becomes a whole number: compiled, that has 64 bits.
    made = tables.rim_speeds[int(min(size, FASTEST_2))]
    return made if speed > 0.0 else -made


@kernel
def turn_wheels(world: Records, i: int) -> None:
    """Let the wheels of robot *i* turn as its view says."""
    robot = world.robots[i]
    robot.left_speed = rim_speed(world.tables[0], world.views[i].left) * pace(robot)
    robot.right_speed = rim_speed(world.tables[0], world.views[i].right) * pace(robot)


@kernel
def shaking(robot: Robot) -> float:
    """Return how hard the motors shake a robot: 0 while it stands, 1 up to 340 steps/s, and up to 2 from 680 on."""
    fastest = max(abs(robot.left_speed), abs(robot.right_speed)) * STEPS_PER_METRE
    return min(max(fastest / SHAKY, 1.0), 2.0) if fastest > 0.0 else 0.0


@kernel
def move(world: Records) -> None:
    """Let every robot roll for one tick, as if nothing were in its way.

    Steps are counted as they are issued: before noise and the spread of wheels, and whether or not the robot can
    follow.
    """
    setting = world.setting[0]
    tables = world.tables[0]
    noise = setting.motor_noise
    for i in range(len(world.robots)):
        robot = world.robots[i]
        rest = setting.step - robot.covered
        left = robot.left_travel + robot.left_speed * rest
        right = robot.right_travel + robot.right_speed * rest
        robot.covered = 0.0
        robot.left_travel = 0.0
        robot.right_travel = 0.0
        robot.last_step_x = robot.x - robot.before_x
        robot.last_step_y = robot.y - robot.before_y
        robot.before_x = robot.x
        robot.before_y = robot.y
        robot.before_heading_x = robot.heading_x
        robot.before_heading_y = robot.heading_y
        if left == 0.0 and right == 0.0:
            continue
        robot.left_steps += left * STEPS_PER_METRE
        robot.right_steps += right * STEPS_PER_METRE
        if robot.energy == 0.0:
            continue
        if noise > 0.0:
            word = mix((tick_key(robot.key, setting.tick) + MOTOR * STRIDE) & MASK)
            left *= 1.0 + noise * tables.quantiles[word & 1023]
            right *= 1.0 + noise * tables.quantiles[(word >> 10) & 1023]
        roll(robot, left * robot.left_scale, right * robot.right_scale)


@kernel
def roll(robot: Robot, left: float, right: float) -> None:
    """Put *robot* at the end of the arc on which its wheels travel *left* and *right*, m.

    The arc is exact to rounding. With h half the turn, its chord is the path times sin(h)/h, in the direction of the
    heading turned by h. The series of sin(h)/h and cos(h) end after the tenth power: exact below half a radian
    (:data:`MAX_TRAVEL`).
    """
    half = 0.5 * (right - left) / robot.axle
    q = half * half
    sinc = 1.0 - q * (1 / 6) * (
        1.0 - q * (1 / 20) * (1.0 - q * (1 / 42) * (1.0 - q * (1 / 72) * (1.0 - q * (1 / 110))))
    )
    cosine = 1.0 - q * 0.5 * (1.0 - q * (1 / 12) * (1.0 - q * (1 / 30) * (1.0 - q * (1 / 56) * (1.0 - q * (1 / 90)))))
    sine = half * sinc
    chord = 0.5 * (left + right) * sinc
    middle_x = robot.heading_x * cosine - robot.heading_y * sine
    middle_y = robot.heading_x * sine + robot.heading_y * cosine
    robot.x += chord * middle_x
    robot.y += chord * middle_y
    end_x = middle_x * cosine - middle_y * sine
    end_y = middle_x * sine + middle_y * cosine
    # One Newton step towards length 1 each tick, or rounding would let the vector grow over hours.
    length = 1.5 - 0.5 * (end_x * end_x + end_y * end_y)
    robot.heading_x = end_x * length
    robot.heading_y = end_y * length
