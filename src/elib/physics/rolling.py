"""How the wheels of many robots roll: what the compiled engine runs instead of :func:`elib.physics.motion.move`.

Eight robots at a time: first what the wheels of each travel, noise included, then the arcs of all eight as vectors
(:mod:`elib.physics.vector`), then where each robot stands. The operations are those of ``move``, one by one, so that
both engines agree to the last bit; but the processor does not wait for one robot's arc before it begins the next.
"""

from __future__ import annotations

from typing import Final

from elib.physics.engine import kernel
from elib.physics.layout import (
    AXLE,
    ROBOT,
    ROBOTS,
    Floats,
    Ints,
)
from elib.physics.motion import arc, arrive, roll, travel
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
            k = i - first
            scratch[LEFTS + k], scratch[RIGHTS + k] = travel(i, fixed, robots, numbers)
            scratch[AXLES + k] = robots[i * ROBOT + AXLE]
        sine, cosine, chord = arc(load(scratch, LEFTS), load(scratch, RIGHTS), load(scratch, AXLES))
        store(scratch, SINES, sine)
        store(scratch, COSINES, cosine)
        store(scratch, CHORDS, chord)
        for i in range(first, last):
            k = i - first
            arrive(
                i,
                scratch[LEFTS + k],
                scratch[RIGHTS + k],
                scratch[SINES + k],
                scratch[COSINES + k],
                scratch[CHORDS + k],
                robots,
            )
