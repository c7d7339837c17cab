"""A map that a program prints as its result, compared with the world: without NumPy, which a browser may not have."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import product

from elib.lab.goal import Place

STEP = 0.01
"""m between two places at which a map is compared."""
TURNS, SHIFTS = range(-3, 4), range(-2, 3)
"""How a map is laid over the world: turned by so many times 2 degrees, and moved by so many centimetres each way. No
robot knows its place and its heading at the start exactly, and a map is not worse for that."""
MAX_SQUARES = 100_000
MAX_TRIED = 2_000
"""Occupied squares that are looked for in the world: a map that is black all over would keep a marker busy."""
HEAD = re.compile(r"^map (\S+) (\S+) (\S+)\n((?:[#.?]+(?:\n|\Z))+)", re.MULTILINE)

Moves = Callable[[float, float], tuple[float, float]]
Surface = tuple[float, float, float, float]
Square = tuple[int, int]
Patch = tuple[bool, tuple[tuple[float, float], ...]]
"""A part of the floor on a map: whether something stands there, and its corners in the world, m."""


@dataclass(frozen=True, slots=True)
class PrintedMap:
    """A map as :meth:`elib.Grid.to_text` writes it: its rows begin with that of the least y."""

    cell: float
    x: float
    y: float
    rows: tuple[str, ...]

    def is_free(self, x: float, y: float) -> bool:
        """Return whether it has a place as free."""
        row, column = round((y - self.y) / self.cell), round((x - self.x) / self.cell)
        return 0 <= row < len(self.rows) and 0 <= column < len(self.rows[row]) and self.rows[row][column] == "."

    def occupied(self) -> set[Square]:
        """Return the squares of :data:`STEP` in which it has something."""
        return {
            _square(self.x + column * self.cell, self.y + row * self.cell)
            for row, text in enumerate(self.rows)
            for column, what in enumerate(text)
            if what == "#"
        }

    def patches(self, start: Place, fit: Place) -> list[Patch]:
        """Return the parts of each row that are equal in the world, laid over it as :attr:`Shares.fit` says."""
        to_world, half = _placed(start, *fit)[1], self.cell / 2
        found: list[Patch] = []
        for row, text in enumerate(self.rows):
            y = self.y + row * self.cell
            for part in re.finditer(r"#+|\.+", text):
                left, right = (self.x + column * self.cell - half for column in part.span())
                corners = (left, y - half), (right, y - half), (right, y + half), (left, y + half)
                found.append((part[0][0] == "#", tuple(to_world(*corner) for corner in corners)))
        return found


def last_map(output: str) -> PrintedMap | None:
    """Return the last map that a program printed; None if there is none, or if it is too large."""
    found = list(HEAD.finditer(output))
    try:
        cell, x, y = map(float, found[-1].group(1, 2, 3))
    except (IndexError, ValueError):
        return None
    rows = tuple(found[-1][4].split()[::-1])
    is_sound = 0.001 <= cell <= 1 and abs(x) < 1000 and abs(y) < 1000 and sum(map(len, rows)) <= MAX_SQUARES
    return PrintedMap(cell, x, y, rows) if is_sound else None


@dataclass(frozen=True, slots=True)
class Shares:
    """How much of a map is right, each from 0 to 1."""

    free: float  # of the ground on which the robot could drive, what the map has as free
    walls: float  # of the walls, what it has as occupied
    occupied: float  # of what it has as occupied, what stands there
    # where the map fits best: by how much it is turned, rad, and moved ahead and to the left, m
    fit: Place = field(default=(0.0, 0.0, 0.0), compare=False)

    @property
    def least(self) -> float:
        """The smallest of them."""
        return min(self.free, self.walls, self.occupied)


@lru_cache(1)  # the judge asks for the shares, and the picture for the fit
def compared(told: PrintedMap, start: Place, surfaces: tuple[Surface, ...], within: float) -> Shares:
    """Return how right a map is, where it fits best, in which the robot starts at (0, 0) and looks along x.

    Args:
        told: The map.
        start: Where the robot starts in the world: x and y, m, and heading, rad.
        surfaces: All that stands there, as lines.
        within: How far a wall may be off, m.
    """
    points = [point for each in surfaces for point in _points(*each)]
    near = _spread((_square(*point) for point in points), within)
    ground = _reached(_square(*start[:2]), near)
    seen = _spread(ground, within + 2 * STEP)
    walls = [point for point in points if _square(*point) in seen]
    free = [(column * STEP, row * STEP) for column, row in ground if column % 2 == row % 2 == 0]
    solid = told.occupied()
    beside = _spread(solid, within)
    tried = sorted(solid)[:: 1 + len(solid) // MAX_TRIED]

    def shares(turn: float, right: float, up: float) -> Shares:
        to_map, to_world = _placed(start, turn, right, up)
        return Shares(
            _share([told.is_free(*to_map(*place)) for place in free]),
            _share([_square(*to_map(*place)) in beside for place in walls]),
            _share([_square(*to_world(column * STEP, row * STEP)) in near for column, row in tried]),
            (turn, right, up),
        )

    # Of equal fits the first counts, and a picture shows it: that which moves the map least.
    moves = sorted(product(TURNS, SHIFTS, SHIFTS), key=lambda each: sum(map(abs, each)))
    fits = (shares(math.radians(2 * turn), STEP * x, STEP * y) for turn, x, y in moves)
    return max(fits, key=lambda each: (each.least, each.free + each.walls + each.occupied))


def _placed(start: Place, turn: float, right: float, up: float) -> tuple[Moves, Moves]:
    """Return what turns a place of the world into one of a map, and back."""
    cos, sin = math.cos(start[2] + turn), math.sin(start[2] + turn)

    def to_map(x: float, y: float) -> tuple[float, float]:
        x, y = x - start[0], y - start[1]
        return x * cos + y * sin + right, y * cos - x * sin + up

    def to_world(x: float, y: float) -> tuple[float, float]:
        x, y = x - right, y - up
        return x * cos - y * sin + start[0], y * cos + x * sin + start[1]

    return to_map, to_world


def _share(flags: Sequence[bool]) -> float:
    return sum(flags) / max(len(flags), 1)


def _square(x: float, y: float) -> Square:
    return round(x / STEP), round(y / STEP)


def _points(x1: float, y1: float, x2: float, y2: float) -> list[tuple[float, float]]:
    """Return places along a line, half a square apart."""
    count = max(1, math.ceil(2 * math.dist((x1, y1), (x2, y2)) / STEP))
    return [(x1 + (x2 - x1) * part / count, y1 + (y2 - y1) * part / count) for part in range(count + 1)]


def _spread(squares: Iterable[Square], radius: float) -> set[Square]:
    """Return the squares within a distance of others."""
    reach = range(-int(radius / STEP), int(radius / STEP) + 1)
    around = [(i, k) for i, k in product(reach, reach) if STEP * math.hypot(i, k) <= radius]
    return {(column + i, row + k) for column, row in set(squares) for i, k in around}


def _reached(start: Square, near: set[Square]) -> set[Square]:
    """Return the squares to which one comes from the start without those near a wall."""
    reached, left = {start}, [start]
    while left:
        column, row = left.pop()
        beside = {(column + 1, row), (column - 1, row), (column, row + 1), (column, row - 1)} - near - reached
        reached |= beside
        left += beside
    return reached
