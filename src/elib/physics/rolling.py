"""How the wheels of many robots roll: what the compiled engine runs instead of :func:`elib.physics.motion.move`.

Eight robots at a time: first what the wheels of each travel, noise included, then the arcs of all eight as vectors
(:mod:`elib.physics.vector`), then where each robot stands. The operations are those of ``move``, one by one, so that
both engines agree to the last bit; but the processor does not wait for one robot's arc before it begins the next.
"""

from __future__ import annotations

from typing import Final

from elib.physics.engine import inner_kernel, kernel
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
    STEP,
    TICK,
    Floats,
    Ints,
    X,
    Y,
)
from elib.physics.motion import STEPS_PER_METRE, bent, roll
from elib.physics.noise import MASK, MOTOR, STRIDE, mix, tick_key
from elib.physics.room import AXLES, BLOCK, CHORDS, COSINES, LEFTS, RIGHTS, SINES
from elib.physics.vector import load, store

FEW: Final = 4
"""Fewer robots are faster one by one."""


@kernel
def move(fixed: Floats, robots: Floats, numbers: Ints, scratch: Floats) -> None:
    """Let every robot roll for one tick, as if nothing were in its way."""
    count = numbers[ROBOTS]
    if count < FEW:
        for i in range(count):
            roll(i, fixed, robots, numbers)
        return
    for first in range(0, count, BLOCK):
        last = min(first + BLOCK, count)
        for i in range(first, last):
            _travel(i, i - first, fixed, robots, numbers, scratch)
        _bend(scratch)
        for i in range(first, last):
            _arrive(i, i - first, robots, scratch)


@inner_kernel
def _travel(i: int, lane: int, fixed: Floats, robots: Floats, numbers: Ints, scratch: Floats) -> None:
    """Find what a robot's wheels travel; both 0 if they stand."""
    r = i * ROBOT
    rest = fixed[STEP] - robots[r + COVERED]
    left = robots[r + LEFT_TRAVEL] + robots[r + LEFT_SPEED] * rest
    right = robots[r + RIGHT_TRAVEL] + robots[r + RIGHT_SPEED] * rest
    robots[r + COVERED] = 0.0
    robots[r + LEFT_TRAVEL] = 0.0
    robots[r + RIGHT_TRAVEL] = 0.0
    robots[r + LEFT_STEPS] += left * STEPS_PER_METRE
    robots[r + RIGHT_STEPS] += right * STEPS_PER_METRE
    noise = fixed[MOTOR_NOISE]
    if noise > 0.0:
        n = HEAD + i * NUMBER
        key = numbers[n + NOW]
        if numbers[n + SEEN] != numbers[TICK]:
            key = tick_key(numbers[n + KEY], numbers[TICK])
        word = mix((key + MOTOR * STRIDE) & MASK)
        left *= 1.0 + noise * fixed[QUANTILES + (word & 1023)]
        right *= 1.0 + noise * fixed[QUANTILES + ((word >> 10) & 1023)]
    scratch[LEFTS + lane] = left * robots[r + LEFT_SCALE]
    scratch[RIGHTS + lane] = right * robots[r + RIGHT_SCALE]
    scratch[AXLES + lane] = robots[r + AXLE]


@inner_kernel
def _bend(scratch: Floats) -> None:
    """Find the arcs of eight robots: half the turn, as sine and cosine, and the chord, m."""
    left = load(scratch, LEFTS)
    right = load(scratch, RIGHTS)
    half = 0.5 * (right - left) / load(scratch, AXLES)
    sinc, cosine = bent(half)
    store(scratch, SINES, half * sinc)
    store(scratch, COSINES, cosine)
    store(scratch, CHORDS, 0.5 * (left + right) * sinc)


@inner_kernel
def _arrive(i: int, lane: int, robots: Floats, scratch: Floats) -> None:
    """Put a robot at the end of its arc."""
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
    if scratch[LEFTS + lane] == 0.0 and scratch[RIGHTS + lane] == 0.0:
        return
    sine = scratch[SINES + lane]
    cosine = scratch[COSINES + lane]
    chord = scratch[CHORDS + lane]
    middle_x = heading_x * cosine - heading_y * sine
    middle_y = heading_x * sine + heading_y * cosine
    robots[r + X] = x + chord * middle_x
    robots[r + Y] = y + chord * middle_y
    end_x = middle_x * cosine - middle_y * sine
    end_y = middle_x * sine + middle_y * cosine
    length = 1.5 - 0.5 * (end_x * end_x + end_y * end_y)
    robots[r + HEADING_X] = end_x * length
    robots[r + HEADING_Y] = end_y * length
