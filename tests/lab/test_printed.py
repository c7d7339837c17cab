"""A map that a program prints is compared with the world: where it fits best, and by walls as well as by ground."""

from __future__ import annotations

import math

import numpy as np
import pytest

import elib
from elib.lab.printed import MAX_SQUARES, PrintedMap, Shares, compared, last_map
from elib.simulator.physics.geometry import segment_distance

SIDES = ((0, 0, 0.5, 0), (0.5, 0, 0.5, 0.4), (0.5, 0.4, 0, 0.4), (0, 0.4, 0, 0), (0.2, 0, 0.2, 0.25))
"""A room with one wall in it."""
START = (0.1, 0.1, math.pi / 2)


def drawn(turned: float = 0.0, moved: float = 0.0) -> PrintedMap:
    """Return the room's map as the robot at the start has it, turned and moved."""
    grid = elib.Grid()
    grid.x = grid.y = -0.6
    grid.odds = np.full((120, 120), -4, np.float32)
    angle = START[2] + turned
    for x1, y1, x2, y2 in SIDES:
        for part in range(201):
            x, y = x1 + (x2 - x1) * part / 200 - START[0], y1 + (y2 - y1) * part / 200 - START[1]
            ahead = x * math.cos(angle) + y * math.sin(angle) + moved
            grid.odds[grid.square(ahead, y * math.cos(angle) - x * math.sin(angle))] = 4
    found = last_map(grid.to_text())
    assert found is not None
    return found


def least(told: PrintedMap) -> float:
    return compared(told, START, SIDES, 0.02).least


def test_a_true_map_is_all_right() -> None:
    assert compared(drawn(), START, SIDES, 0.02) == Shares(1, 1, 1)


@pytest.mark.parametrize(("turned", "moved", "wanted"), [(0.1, 0.02, 0.98), (0.0, 0.1, 0.0), (0.5, 0.0, 0.0)])
def test_a_map_may_be_turned_and_moved_a_little_and_no_more(turned: float, moved: float, wanted: float) -> None:
    share = least(drawn(turned, moved))
    assert share >= wanted if wanted else share < 0.8


def test_the_picture_of_a_map_lies_over_the_walls_where_it_fits_best() -> None:
    told = drawn(math.radians(4), 0.02)
    patches = told.patches(START, compared(told, START, SIDES, 0.02).fit)
    sides = [
        min(segment_distance(sum(x for x, _ in corners) / 4, sum(y for _, y in corners) / 4, *side) for side in SIDES)
        for is_solid, corners in patches
        if is_solid and math.dist(corners[0], corners[1]) < 0.03
    ]
    assert len(sides) > 50
    assert max(sides) < 0.025


@pytest.mark.parametrize("cheat", [".", "#.", "#...", ".#.#.?"])
def test_a_pattern_is_no_map(cheat: str) -> None:
    rows = tuple((cheat * 90)[k : k + 60] for k in range(60))
    assert least(PrintedMap(0.01, -0.3, -0.3, rows)) < 0.7


def test_the_last_map_counts_and_what_is_printed_around_it_does_not_matter() -> None:
    found = last_map("map 0.1 0 0\n##\nhello\nmap 0.02 -0.1 0.3\n.#?\n..\n\n42\n")
    assert found == PrintedMap(0.02, -0.1, 0.3, ("..", ".#?"))
    assert (found.is_free(-0.1, 0.3), found.is_free(-0.08, 0.32), found.is_free(9, 9)) == (True, False, False)


@pytest.mark.parametrize(
    "output",
    [
        "",
        "map 0.1 0 0",
        "map 0 0 0\n#\n",
        "map nan 0 0\n#\n",
        "map inf 0 0\n#\n",
        "map 1e308 0 0\n..#\n",
        "map 1.01 0 0\n#\n",
        "map 0.1 nan 0\n#\n",
        "map 0.1 0 -inf\n#\n",
        "map x 0 0\n#\n",
        "map 0.1 1e9 0\n#\n",
        "map 0.1 0 0\nx\n",
    ],
)
def test_what_is_no_map_is_none(output: str) -> None:
    assert last_map(output) is None


def test_a_map_that_is_too_large_is_refused() -> None:
    assert last_map(f"map 0.1 0 0\n{'.' * MAX_SQUARES}\n") is not None
    assert last_map(f"map 0.1 0 0\n{'.' * MAX_SQUARES}\n.\n") is None
