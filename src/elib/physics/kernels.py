"""Motion and contact of all robots, tick by tick, on flat sequences.

Written in the part of Python that Numba compiles: loops, ``+ - * /`` and ``sqrt`` on lists now, on arrays
when compiled, to the same last bit. A heading is a unit vector (cosine, sine); a wall is five numbers
(:data:`WALL_STRIDE`), a disc three.
"""

from __future__ import annotations

from math import sqrt
from typing import Final, Protocol

from elib.physics.noise import MOTOR, gauss

WALL_STRIDE: Final = 5
"""One wall: an end x, y; the unit tangent x, y; the length. m"""

DISC_STRIDE: Final = 3
"""One fixed disc: centre x, y; radius. m"""

CONTACT_PASSES: Final = 24
"""Each halves what is left in a squeezed pair; this many also settle a row of several robots."""

CONTACT_TOLERANCE: Final = 1e-6  # m. Far below what a sensor can tell.


class Floats(Protocol):
    """A flat sequence of floats: a list, or an array once compiled."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> float: ...
    def __setitem__(self, index: int, value: float, /) -> None: ...


class Ints(Protocol):
    """A flat sequence of integers."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> int: ...
    def __setitem__(self, index: int, value: int, /) -> None: ...


def actuate(
    step: float,
    left_speed: Floats,
    right_speed: Floats,
    left_travel: Floats,
    right_travel: Floats,
    covered: Floats,
) -> None:
    """Complete each wheel's travel of this tick.

    Args:
        step: Length of a tick, s.
        left_speed: Rim speed since the last change, m/s, one a robot.
        right_speed: The same of the right wheel.
        left_travel: In: what earlier speeds of this tick added, m. Out: the whole tick's.
        right_travel: The same of the right wheel.
        covered: In: how much of the tick that was, s. Out: 0.
    """
    for i in range(len(covered)):
        rest = step - covered[i]
        left_travel[i] += left_speed[i] * rest
        right_travel[i] += right_speed[i] * rest
        covered[i] = 0.0


def disturb(keys: Ints, deviation: float, left_travel: Floats, right_travel: Floats) -> None:
    """Multiply each wheel's travel by noise around 1; *keys* are the robots' keys of this tick."""
    for i in range(len(keys)):
        left_travel[i] *= 1.0 + deviation * gauss(keys[i], MOTOR)
        right_travel[i] *= 1.0 + deviation * gauss(keys[i], MOTOR + 1)


def integrate(
    x: Floats,
    y: Floats,
    heading_x: Floats,
    heading_y: Floats,
    left_travel: Floats,
    right_travel: Floats,
    left_scale: Floats,
    right_scale: Floats,
    axle: Floats,
) -> None:
    """Move each robot along the arc its wheels have rolled, and use the travel up.

    The arc is exact to rounding: its chord is the path times sin(h)/h in the direction of the heading
    turned by h, half the turn. The series end after the tenth power, exact below half a radian
    (:data:`~elib.physics.world.MAX_TRAVEL`).
    """
    for i in range(len(x)):
        left = left_travel[i] * left_scale[i]
        right = right_travel[i] * right_scale[i]
        if left == 0.0 and right == 0.0:
            continue
        left_travel[i] = 0.0
        right_travel[i] = 0.0
        half = 0.5 * (right - left) / axle[i]
        q = half * half
        sinc = 1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0))))
        cosine = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0))))
        sine = half * sinc
        middle_x = heading_x[i] * cosine - heading_y[i] * sine
        middle_y = heading_x[i] * sine + heading_y[i] * cosine
        chord = 0.5 * (left + right) * sinc
        x[i] += chord * middle_x
        y[i] += chord * middle_y
        end_x = middle_x * cosine - middle_y * sine
        end_y = middle_x * sine + middle_y * cosine
        # One Newton step towards length 1 each tick, or rounding would let the vector grow over hours.
        length = 1.5 - 0.5 * (end_x * end_x + end_y * end_y)
        heading_x[i] = end_x * length
        heading_y[i] = end_y * length


def collide(
    x: Floats,
    y: Floats,
    radius: Floats,
    touching: Ints,
    width: float,
    depth: float,
    walls: Floats,
    discs: Floats,
) -> None:
    """Push overlapping bodies apart until nothing overlaps by more than :data:`CONTACT_TOLERANCE`.

    Positions are projected: no bounce, no friction, so a robot slides along what it touches. Two robots
    give way by half each; what is fixed does not; the arena's edge has the last word.

    Args:
        x: Centres, m.
        y: Centres, m.
        radius: m, one a robot.
        touching: Out: 1 where the robot was pushed in this tick.
        width: Of the arena, m: the robots stay within 0..width.
        depth: Of the arena, m.
        walls: Interior walls and sides of boxes, :data:`WALL_STRIDE` numbers each.
        discs: Fixed discs, :data:`DISC_STRIDE` numbers each.
    """
    count = len(x)
    for i in range(count):
        touching[i] = 0
    for _ in range(CONTACT_PASSES):
        moved = 0.0
        for i in range(count - 1):
            for j in range(i + 1, count):
                dx = x[j] - x[i]
                dy = y[j] - y[i]
                reach = radius[i] + radius[j]
                square = dx * dx + dy * dy
                if square >= reach * reach:
                    continue
                distance = sqrt(square)
                if distance > 0.0:
                    push = 0.5 * (reach - distance) / distance
                else:
                    push = 0.5 * reach
                    dx = 1.0  # On top of each other: any direction will do, if it is always the same.
                x[i] -= push * dx
                y[i] -= push * dy
                x[j] += push * dx
                y[j] += push * dy
                touching[i] = 1
                touching[j] = 1
                moved = max(moved, reach - distance)
        for i in range(count):
            deepest = max(
                _leave_discs(i, x, y, radius[i], discs),
                _leave_walls(i, x, y, radius[i], walls),
                _stay_inside(i, x, y, radius[i], width, depth),
            )
            if deepest > 0.0:
                touching[i] = 1
                moved = max(moved, deepest)
        if moved <= CONTACT_TOLERANCE:
            break


def _leave_discs(i: int, x: Floats, y: Floats, radius: float, discs: Floats) -> float:
    deepest = 0.0
    for k in range(0, len(discs), 3):
        dx = x[i] - discs[k]
        dy = y[i] - discs[k + 1]
        reach = radius + discs[k + 2]
        square = dx * dx + dy * dy
        if square >= reach * reach:
            continue
        distance = sqrt(square)
        if distance > 0.0:
            x[i] += (reach - distance) / distance * dx
            y[i] += (reach - distance) / distance * dy
        else:
            x[i] += reach
        deepest = max(deepest, reach - distance)
    return deepest


def _leave_walls(i: int, x: Floats, y: Floats, radius: float, walls: Floats) -> float:
    deepest = 0.0
    for k in range(0, len(walls), 5):
        dx = x[i] - walls[k]
        dy = y[i] - walls[k + 1]
        tangent_x = walls[k + 2]
        tangent_y = walls[k + 3]
        offset = tangent_x * dy - tangent_y * dx
        if offset >= radius or offset <= -radius:
            continue
        along = tangent_x * dx + tangent_y * dy
        # Nearest point of the wall: an end, or the foot of the perpendicular.
        nearest = min(max(along, 0.0), walls[k + 4])
        dx -= nearest * tangent_x
        dy -= nearest * tangent_y
        square = dx * dx + dy * dy
        if square >= radius * radius:
            continue
        distance = sqrt(square)
        if distance > 0.0:
            x[i] += (radius - distance) / distance * dx
            y[i] += (radius - distance) / distance * dy
        else:
            x[i] -= radius * tangent_y
            y[i] += radius * tangent_x
        deepest = max(deepest, radius - distance)
    return deepest


def _stay_inside(i: int, x: Floats, y: Floats, radius: float, width: float, depth: float) -> float:
    deepest = 0.0
    if x[i] < radius:
        deepest = radius - x[i]
        x[i] = radius
    elif x[i] > width - radius:
        deepest = x[i] - (width - radius)
        x[i] = width - radius
    if y[i] < radius:
        deepest = max(deepest, radius - y[i])
        y[i] = radius
    elif y[i] > depth - radius:
        deepest = max(deepest, y[i] - (depth - radius))
        y[i] = depth - radius
    return deepest
