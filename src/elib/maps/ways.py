"""Ways on a map: the cheapest one for a body of the robot's size, and no longer than it must be."""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

import numpy as np

from elib.base.body import RADIUS
from elib.base.errors import NoWay
from elib.maps.grid import Grid

if TYPE_CHECKING:
    from numpy.typing import NDArray

MARGIN: Final = 0.008
"""m that the body keeps from what is on the map: as much as a place on it is wrong."""
WIDE: Final = 0.03
"""m beyond that from where a way no longer costs more: it leads through the middle of what is narrow."""
FEAR: Final = 4.0
"""How much more a way costs at MARGIN from something."""
SIGHT: Final = RADIUS + MARGIN + 0.01
"""m from something unknown at which a robot sees it, if it drives towards it."""
GIVEN_UP: Final = 0.03
"""m around a place in which no other one is better."""
STEPS: Final = tuple((up, aside, math.hypot(up, aside)) for up in (-1, 0, 1) for aside in (-1, 0, 1) if up or aside)

Place = tuple[float, float]
Square = tuple[int, int]


def way(grid: Grid, start: Place, goal: Place, *, through_unknown: bool = False) -> list[Place]:
    """Return places to drive to one after the other, m, from *start*, which is left out, to *goal*.

    Args:
        grid: The map.
        start: Where the robot is. If something is too near there, it may drive out of that.
        goal: Where its middle is to come.
        through_unknown: Whether it may drive where nothing is known.

    Raises:
        NoWay: There is none.
    """
    begin, end = grid.square(*start), grid.square(*goal)
    for what, (x, y), square in (("start", start, begin), ("goal", goal, end)):
        if not grid.has(*square):
            raise NoWay(
                f"the {what} ({x:.2f}, {y:.2f}) m is not on the map",
                hint="are both in the coordinates of the map? robot.set_pose(x, y, heading) says where the robot is",
            )
    x, y = goal
    room, costs = _costs(grid, begin, through_unknown=through_unknown)
    if math.isinf(costs[end]):
        known = (
            "it is not known what is there" if grid.odds[end] == 0 else f"something is {100 * room[end]:.0f} cm away"
        )
        raise NoWay(
            f"the robot has no room at the goal ({x:.2f}, {y:.2f}) m: {known}",
            hint=f"its middle must be {100 * (RADIUS + MARGIN):.1f} cm from everything",
        )
    is_end = np.zeros(costs.shape, bool)
    is_end[end] = True
    found = _search(costs, begin, is_end, end)
    if not found:
        raise NoWay(
            f"no way leads to ({x:.2f}, {y:.2f}) m on the map",
            hint=f"a gap must be {200 * (RADIUS + MARGIN):.0f} cm wide; is on the map what is there no longer?",
        )
    return [*(grid.place(*square) for square in _straightened(costs, found)[1:-1]), goal]


def frontier(grid: Grid, start: Place, given_up: Iterable[Place] = ()) -> Place | None:
    """Return the nearest place from which a robot sees what is unknown, m; None if there is nothing left to see.

    Args:
        grid: The map.
        start: Where the robot is.
        given_up: Places from where it saw nothing new.
    """
    begin = grid.square(*start)
    _, costs = _costs(grid, begin, through_unknown=True)
    is_end = (grid.distance_from(grid.edge, SIGHT + grid.cell) <= SIGHT) & grid.free
    rows, columns = np.ogrid[: costs.shape[0], : costs.shape[1]]
    for place in given_up:
        row, column = grid.square(*place)
        is_end &= np.hypot(rows - row, columns - column) * grid.cell > GIVEN_UP
    found = _search(costs, begin, is_end)
    return grid.place(*found[-1]) if found else None


def is_seen(grid: Grid, place: Place) -> bool:
    """Return whether from a place, m, nothing unknown is left to see."""
    row, column = grid.square(*place)
    reach = int(SIGHT / grid.cell)
    rows, columns = np.nonzero(
        grid.edge[max(0, row - reach) : row + reach + 1, max(0, column - reach) : column + reach + 1]
    )
    return not bool((np.hypot(rows - min(row, reach), columns - min(column, reach)) * grid.cell <= SIGHT).any())


def _costs(grid: Grid, begin: Square, *, through_unknown: bool) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Return how much room each square has, m, and what a robot at *begin* pays to drive over it."""
    room = grid.clearance(RADIUS + MARGIN + WIDE, is_unknown_free=through_unknown)
    tight = (RADIUS + MARGIN + WIDE - room) / WIDE
    costs = np.where(tight <= 1, 1 + FEAR * tight * tight, np.inf)
    rows, columns = np.ogrid[: costs.shape[0], : costs.shape[1]]
    is_near = np.hypot(columns - begin[1], rows - begin[0]) * grid.cell < RADIUS
    costs = np.where(is_near & (room > grid.cell) & np.isinf(costs), 10 * FEAR, costs)
    costs[begin] = 1
    return room, costs


def _search(
    costs: NDArray[np.float64], begin: Square, is_end: NDArray[np.bool_], towards: Square | None = None
) -> list[Square]:
    """Return the squares of the cheapest way to an end (A*, if one lies *towards* it); none if there is no way."""
    paid, ends, (rows, columns) = costs.tolist(), is_end.tolist(), costs.shape
    known, before = {begin: 0.0}, {begin: begin}
    waiting = [(0.0, begin)]
    done: set[Square] = set()
    while waiting:
        _, here = heapq.heappop(waiting)
        if ends[here[0]][here[1]]:
            squares = [here]
            while squares[-1] != begin:
                squares.append(before[squares[-1]])
            return squares[::-1]
        if here in done:
            continue
        done.add(here)
        for up, aside, far in STEPS:
            row, column = there = here[0] + up, here[1] + aside
            if not (0 <= row < rows and 0 <= column < columns):
                continue
            cost = known[here] + far * paid[row][column]
            if cost < known.get(there, math.inf):
                known[there], before[there] = cost, here
                heapq.heappush(waiting, (cost + (math.dist(there, towards) if towards else 0.0), there))
    return []


def _straightened(costs: NDArray[np.float64], squares: list[Square]) -> list[Square]:
    """Return the corners of a way: straight lines between them cost no more than the way along the squares."""
    paid = [0.0]
    for before, here in itertools.pairwise(squares):
        paid.append(paid[-1] + math.dist(before, here) * float(costs[here]))
    corners, at = [squares[0]], 0
    while at < len(squares) - 1:
        last = len(squares) - 1
        while last > at + 1 and _line(costs, squares[at], squares[last]) > 1.02 * (paid[last] - paid[at]) + 0.5:
            last -= 1
        corners.append(squares[last])
        at = last
    return corners


def _line(costs: NDArray[np.float64], start: Square, end: Square) -> float:
    """Return what the straight line between two squares costs."""
    far = math.dist(start, end)
    rows, columns = (
        np.rint(np.linspace(a, b, 2 * math.ceil(far) + 1)).astype(int) for a, b in zip(start, end, strict=True)
    )
    return far * float(costs[rows, columns].mean())
