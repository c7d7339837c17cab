"""How red a picture is, and where the red lies."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elib.base.errors import ArgumentError
from elib.behaviours._vision import measure_redness

RED, WHITE, BLACK, GREEN, BLUE = (248, 0, 0), (255, 255, 255), (0, 0, 0), (0, 252, 0), (0, 0, 248)


def row(*pixels: tuple[int, int, int]) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """Return a picture of one row."""
    return np.array([pixels], np.uint8)


def test_the_fraction_counts_red_pixels_among_all() -> None:
    assert measure_redness(row(RED, RED, WHITE, BLACK)).fraction == 0.5


@pytest.mark.parametrize(
    ("pixels", "direction"),
    [
        ((RED, BLACK, BLACK, BLACK), 0.0),
        ((BLACK, BLACK, RED, BLACK), 0.5),
        ((BLACK, BLACK, BLACK, RED), 0.75),
        ((RED, BLACK, RED, BLACK), 0.25),
    ],
)
def test_the_direction_is_the_mean_column_over_the_width(
    pixels: tuple[tuple[int, int, int], ...], direction: float
) -> None:
    assert measure_redness(row(*pixels)).direction == direction


def test_without_red_there_is_no_direction() -> None:
    fraction, direction = measure_redness(row(WHITE, BLACK))
    assert fraction == 0
    assert math.isnan(direction)


def test_every_row_counts_alike() -> None:
    picture = np.zeros((4, 8, 3), np.uint8)
    picture[1, 2] = picture[3, 4] = RED
    assert measure_redness(picture) == (2 / 32, 3 / 8)


def test_a_grey_picture_is_refused_with_the_cure() -> None:
    with pytest.raises(ArgumentError, match="has no colours") as caught:
        measure_redness(np.zeros((4, 8), np.uint8))
    assert "COLOUR" in caught.value.hint
