"""The grid of moving things: who may be near whom, in time that grows with their number alone.

Every robot and every pushable thing hangs in the chain of the cell in which its centre lay when the grid was last
made. A cell is so wide that whatever a robot may touch or see lies in the nine cells around it, even after contacts
have shifted things by :data:`SLACK`.
"""

from __future__ import annotations

from typing import Final

from elib.physics.engine import kernel
from elib.physics.layout import (
    BEFORE_X,
    BEFORE_Y,
    BODIES,
    BODY,
    GRID_COLUMNS,
    GRID_ROWS,
    GRID_SCALE,
    HEADS_AT,
    NEXT_AT,
    PLACE_AT,
    ROBOT,
    ROBOTS,
    Floats,
    Ints,
    X,
    Y,
)

SLACK: Final = 0.04
"""How far contacts may shift a thing before the grid is made anew, m: two wheels' longest travel in a tick."""


@kernel
def cell(coordinate: float, scale: float, count: int) -> int:
    """Return the row or column of a place, 0..count - 1; what lies outside belongs to the outermost cells."""
    index = int(coordinate * scale)
    if index >= count:
        return count - 1
    return index if index > 0 else 0


@kernel
def regrid(fixed: Floats, robots: Floats, bodies: Floats, numbers: Ints) -> None:
    """Hang every moving thing into the chain of its cell, in rising order within a chain."""
    scale = fixed[GRID_SCALE]
    columns = numbers[GRID_COLUMNS]
    rows = numbers[GRID_ROWS]
    following = numbers[NEXT_AT]
    place = numbers[PLACE_AT]
    heads = numbers[HEADS_AT]
    count = numbers[ROBOTS]
    total = count + numbers[BODIES]
    for k in range(total):
        numbers[heads + numbers[place + k]] = -1
    for k in range(total - 1, -1, -1):
        if k < count:
            x = robots[k * ROBOT + X]
            y = robots[k * ROBOT + Y]
        else:
            x = bodies[(k - count) * BODY + X]
            y = bodies[(k - count) * BODY + Y]
        here = cell(y, scale, rows) * columns + cell(x, scale, columns)
        numbers[place + k] = here
        numbers[following + k] = numbers[heads + here]
        numbers[heads + here] = k


@kernel
def is_stale(robots: Floats, numbers: Ints) -> bool:
    """Return whether contacts have shifted a robot further than the grid allows."""
    for i in range(numbers[ROBOTS]):
        r = i * ROBOT
        dx = robots[r + X] - robots[r + BEFORE_X]
        dy = robots[r + Y] - robots[r + BEFORE_Y]
        if dx * dx + dy * dy > SLACK * SLACK:
            return True
    return False
