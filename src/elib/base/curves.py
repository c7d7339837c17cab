"""Curves that are given by points."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise


def interpolated(knots: Sequence[tuple[float, float]], x: float) -> float:
    """Return the value at *x* on straight lines between *knots*; beyond their ends that of the nearest one.

    Args:
        knots: Pairs of x and value, at least two, x rising.
        x: Where.
    """
    for (low, start), (high, end) in pairwise(knots):
        if x <= high:
            return start + (end - start) * (max(x, low) - low) / (high - low)
    return knots[-1][1]
