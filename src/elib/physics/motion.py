"""How an e-puck's wheels roll: what the firmware makes of a wanted speed, the steps it counts, and the arc of it.

Written in the part of Python that Numba compiles: loops, ``+ - * /`` and ``sqrt``, on the records of
:mod:`elib.physics.layout`.
"""

from __future__ import annotations

from typing import Final

from elib.body import METRES_PER_STEP
from elib.physics.engine import compiled_as, inner_kernel, kernel
from elib.physics.layout import (
    AXLE,
    BEFORE_HEADING_X,
    BEFORE_HEADING_Y,
    BEFORE_X,
    BEFORE_Y,
    COVERED,
    HEAD,
    HEADING_X,
    HEADING_Y,
    KEY,
    LAST_STEP_X,
    LAST_STEP_Y,
    LEFT_SCALE,
    LEFT_SPEED,
    LEFT_STEPS,
    LEFT_TRAVEL,
    MOTOR_NOISE,
    NOW,
    NUMBER,
    QUANTILES,
    RIGHT_SCALE,
    RIGHT_SPEED,
    RIGHT_STEPS,
    RIGHT_TRAVEL,
    ROBOT,
    ROBOTS,
    SEEN,
    SPEEDS,
    STEP,
    TICK,
    Floats,
    Ints,
    X,
    Y,
)
from elib.physics.noise import MASK, MOTOR, STRIDE, mix, tick_key

STEPS_PER_METRE: Final = 1.0 / METRES_PER_STEP

FASTEST: Final = 1000.0
"""steps/s. The e-puck1's firmware clips there."""

FASTEST_2: Final = 1100.0
"""steps/s. The e-puck2's firmware clips there."""

SIXTH: Final = 1 / 6
PART_20: Final = 1 / 20
PART_42: Final = 1 / 42
PART_72: Final = 1 / 72
PART_110: Final = 1 / 110
TWELFTH: Final = 1 / 12
PART_30: Final = 1 / 30
PART_56: Final = 1 / 56
PART_90: Final = 1 / 90
"""Terms of the series of sin(h)/h and cos(h): ten divisions would take as long as all the rest of a move."""

MAX_TRAVEL: Final = 0.02
"""Furthest a wheel may roll in one tick, m, before noise and the spread of wheels: half a radius, so nothing can be
passed through."""

TIMER: Final = 100.03e-6
"""s. The e-puck1's motor timer, nominally 0.1 ms (protocol.md, 5.1)."""


@kernel
def issued(speed: float, generation: int) -> float:
    """Return the step rate that the firmware makes of a wanted speed, steps/s.

    e-puck1: clipped to 1000 and stepped every int(10000 / speed) ticks of 100.03 us, so 600 becomes 625 and 900
    becomes 909 (less 0.03 %). e-puck2: clipped to 1100, a half step every int(100000 / (2 speed)) ticks of 10 us.

    Args:
        speed: As asked for, steps/s; the fraction is cut off, as in the command.
        generation: 1 or 2.
    """
    size = speed if speed > 0.0 else -speed
    if not size >= 1.0:  # Also what is not a number.
        return 0.0
    # Cut before it becomes a whole number: compiled, that has 64 bits.
    magnitude = int(min(size, FASTEST if generation == 1 else FASTEST_2))
    # Division of floats: of whole numbers it is slow.
    rate = 50_000.0 / int(50_000.0 / magnitude)
    if generation == 1:
        rate = 1.0 / (int(10_000.0 / magnitude) * TIMER)
    return rate if speed > 0.0 else -rate


@inner_kernel
def rim_speed(speed: float, fixed: Floats) -> float:
    """Return what :func:`issued` makes of a wanted speed, steps/s, at the nominal wheel's rim, m/s: looked up."""
    size = speed if speed > 0.0 else -speed
    if not size >= 1.0:  # Also what is not a number.
        return 0.0
    # Cut before it becomes a whole number: compiled, that has 64 bits.
    made = fixed[SPEEDS + int(size if size < FASTEST_2 else FASTEST_2)]
    return made if speed > 0.0 else -made


@inner_kernel
def bent(half: float) -> tuple[float, float]:
    """Return sin(half)/half and cos(half) of half a turn, rad; compiled also of eight at once."""
    q = half * half
    return (
        1.0 - q * SIXTH * (1.0 - q * PART_20 * (1.0 - q * PART_42 * (1.0 - q * PART_72 * (1.0 - q * PART_110)))),
        1.0 - q * 0.5 * (1.0 - q * TWELFTH * (1.0 - q * PART_30 * (1.0 - q * PART_56 * (1.0 - q * PART_90)))),
    )


@inner_kernel
def roll(i: int, fixed: Floats, robots: Floats, numbers: Ints) -> None:
    """Let a robot roll for one tick, as if nothing were in its way."""
    left, right = travel(i, fixed, robots, numbers)
    sine = 0.0
    cosine = 1.0
    chord = 0.0
    if left != 0.0 or right != 0.0:
        sine, cosine, chord = arc(left, right, robots[i * ROBOT + AXLE])
    arrive(i, left, right, sine, cosine, chord, robots)


@inner_kernel
def travel(i: int, fixed: Floats, robots: Floats, numbers: Ints) -> tuple[float, float]:
    """Return what a robot's wheels travel in a tick, m, left and right; both 0 if they stand.

    Steps are counted as they are issued, before noise and the spread of wheels, and whether or not the robot can
    follow.
    """
    r = i * ROBOT
    rest = fixed[STEP] - robots[r + COVERED]
    left = robots[r + LEFT_TRAVEL] + robots[r + LEFT_SPEED] * rest
    right = robots[r + RIGHT_TRAVEL] + robots[r + RIGHT_SPEED] * rest
    robots[r + COVERED] = 0.0
    robots[r + LEFT_TRAVEL] = 0.0
    robots[r + RIGHT_TRAVEL] = 0.0
    if left != 0.0 or right != 0.0:
        robots[r + LEFT_STEPS] += left * STEPS_PER_METRE
        robots[r + RIGHT_STEPS] += right * STEPS_PER_METRE
        noise = fixed[MOTOR_NOISE]
        if noise > 0.0:
            n = HEAD + i * NUMBER
            # Whoever sensed in this tick knows its key already.
            key = numbers[n + NOW]
            if numbers[n + SEEN] != numbers[TICK]:
                key = tick_key(numbers[n + KEY], numbers[TICK])
            word = mix((key + MOTOR * STRIDE) & MASK)
            left *= 1.0 + noise * fixed[QUANTILES + (word & 1023)]
            right *= 1.0 + noise * fixed[QUANTILES + ((word >> 10) & 1023)]
    return left * robots[r + LEFT_SCALE], right * robots[r + RIGHT_SCALE]


@inner_kernel
def arc(left: float, right: float, axle: float) -> tuple[float, float, float]:
    """Return half the turn, as sine and cosine, and the chord, m; compiled also of eight robots at once.

    The arc is exact to rounding: its chord is the path times sin(h)/h in the direction of the heading turned by h,
    half the turn. The series end after the tenth power, exact below half a radian (:data:`MAX_TRAVEL`).
    """
    half = 0.5 * (right - left) / axle
    sinc, cosine = bent(half)
    return half * sinc, cosine, 0.5 * (left + right) * sinc


@inner_kernel
def arrive(i: int, left: float, right: float, sine: float, cosine: float, chord: float, robots: Floats) -> None:
    """Put a robot at the end of its arc, unless its wheels stood."""
    r = i * ROBOT
    x = robots[r + X]
    y = robots[r + Y]
    heading_x = robots[r + HEADING_X]
    heading_y = robots[r + HEADING_Y]
    robots[r + LAST_STEP_X] = x - robots[r + BEFORE_X]
    robots[r + LAST_STEP_Y] = y - robots[r + BEFORE_Y]
    robots[r + BEFORE_X] = x
    robots[r + BEFORE_Y] = y
    robots[r + BEFORE_HEADING_X] = heading_x
    robots[r + BEFORE_HEADING_Y] = heading_y
    if left != 0.0 or right != 0.0:
        middle_x = heading_x * cosine - heading_y * sine
        middle_y = heading_x * sine + heading_y * cosine
        robots[r + X] = x + chord * middle_x
        robots[r + Y] = y + chord * middle_y
        end_x = middle_x * cosine - middle_y * sine
        end_y = middle_x * sine + middle_y * cosine
        # One Newton step towards length 1 each tick, or rounding would let the vector grow over hours.
        length = 1.5 - 0.5 * (end_x * end_x + end_y * end_y)
        robots[r + HEADING_X] = end_x * length
        robots[r + HEADING_Y] = end_y * length


@compiled_as("elib.physics.rolling:move")
def move(fixed: Floats, robots: Floats, numbers: Ints, scratch: Floats) -> None:
    """Let every robot roll for one tick."""
    for i in range(numbers[ROBOTS]):
        roll(i, fixed, robots, numbers)
