"""The few functions that laws need beyond + - * / and sqrt, the same to the last bit everywhere.

Those of the C library differ in the last bit between systems, and Numba brings its own. These are written for the
kernels: nothing but the five operations that every machine rounds alike, in a fixed order.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.simulator.physics.engine import kernel

HALF_TURN: Final = 3.141592653589793
QUARTER_TURN: Final = 1.5707963267948966

# ln 2 in two parts: a whole multiple of the first is exact, the second is what it leaves out.
LN2_HIGH: Final = 0.6931471803691238
LN2_LOW: Final = 1.9082149292705877e-10

MAX_EXPONENT: Final = 700.0
"""Beyond plus or minus this the exponential leaves the range of floats."""


@kernel
def exponential(x: float) -> float:
    """Return e to the power of *x*, to about 1e-15 of it; 0 below -700, and what 700 gives above.

    e^x = 2^k e^r with |r| <= ln 2 / 2, the latter by its series: the first term left out is below 1e-17.
    """
    if x < -MAX_EXPONENT:
        return 0.0
    x = min(x, MAX_EXPONENT)
    halves = int(x / LN2_HIGH + 0.5) if x >= 0.0 else int(x / LN2_HIGH - 0.5)
    rest = (x - halves * LN2_HIGH) - halves * LN2_LOW
    value = 1.0
    for order in range(14, 0, -1):
        value = 1.0 + rest / order * value
    factor = 2.0
    if halves < 0:
        factor = 0.5
        halves = -halves
    while halves > 0:
        if halves % 2 == 1:
            value *= factor
        factor *= factor
        halves //= 2
    return value


@kernel
def angle(x: float, y: float) -> float:
    """Return the angle from the x axis to the vector (x, y), rad, -pi..pi, to about 1e-15; 0 for no vector.

    Halved three times, tan(a / 2) = y / (x + |(x, y)|), it is small enough for the series of the arc tangent: the
    first term left out is below 1e-17.
    """
    length = sqrt(x * x + y * y)
    if length == 0.0:
        return 0.0
    # The half angle's tangent without cancellation; beyond a quarter turn, of what is left to the half turn.
    tangent = y / (length + x) if x >= 0.0 else y / (length - x)
    for _ in range(2):
        tangent = tangent / (1.0 + sqrt(1.0 + tangent * tangent))
    square = tangent * tangent
    series = 0.0
    for order in range(23, -1, -2):
        series = 1.0 / order - square * series
    eighth = tangent * series
    turned = 8.0 * eighth
    if x >= 0.0:
        return turned
    return HALF_TURN - turned if y >= 0.0 else -HALF_TURN - turned


@kernel
def arc_cosine(x: float) -> float:
    """Return the angle whose cosine is *x*, rad, 0..pi, to about 1e-15; *x* beyond -1..1 counts as its end."""
    x = min(max(x, -1.0), 1.0)
    return angle(x, sqrt((1.0 - x) * (1.0 + x)))
