"""What stays as it is while a kernel runs, so that a folded one may have it in it as literals.

Only what belongs to a model, and not what differs from world to world: kernels are folded anew for each combination.
"""

from __future__ import annotations

from operator import eq, itemgetter
from typing import Final, TypeAlias

from elib.physics.layout import (
    BODIES,
    CLEAR,
    DISCS,
    IR_REACH,
    LAST,
    LIGHTS,
    MOTOR_NOISE,
    RAY,
    RAY_COUNT,
    RAYS,
    ROBOTS,
    SENSOR_NOISE,
    SPREAD,
    STEP,
    UNEVEN,
    WIDEST,
    Floats,
    Ints,
)

SETTINGS: Final = (STEP, MOTOR_NOISE, SENSOR_NOISE, IR_REACH, SPREAD, WIDEST, CLEAR, *range(RAYS, RAYS + 5 * RAY))
"""Elements of "fixed"."""

COUNTS: Final = (RAY_COUNT, LAST, UNEVEN)
"""Elements of "numbers"."""

USUAL: Final = {ROBOTS: 1, BODIES: 0, DISCS: 0, LIGHTS: 0}
"""Elements of "numbers" that are settled only where they have this value: then much can be left out."""

Settled: TypeAlias = tuple[tuple[float, ...], tuple[int, ...], tuple[bool, ...]]
"""Settings, counts, and whether each usual value is there."""

_settings = itemgetter(*SETTINGS)
_counts = itemgetter(*COUNTS)
_usual = itemgetter(*USUAL)
_values = tuple(USUAL.values())


def settled_in(fixed: Floats, numbers: Ints) -> Settled:
    """Return what is settled for a run on these sequences."""
    return _settings(fixed), _counts(numbers), tuple(map(eq, _usual(numbers), _values))


def literals(settled: Settled) -> dict[tuple[str, int], float]:
    """Return the settled elements: their values by the sequence's name and the index."""
    settings, counts, usual = settled
    return {
        **{("fixed", at): value for at, value in zip(SETTINGS, settings, strict=True)},
        **{("numbers", at): value for at, value in zip(COUNTS, counts, strict=True)},
        **{("numbers", at): value for (at, value), is_so in zip(USUAL.items(), usual, strict=True) if is_so},
    }
