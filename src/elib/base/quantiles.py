"""Medians and percentiles by the nearest rank, as all of elib computes them."""

from __future__ import annotations

import math
from collections.abc import Sequence


def rank(share: float, count: int) -> int:
    """Return the index of the least of *count* rising values that a share of them does not exceed.

    Args:
        share: The share, 0..1.
        count: The number of values, at least 1.
    """
    # Rounded first: 0.07 * 100 is a little more than 7.
    return min(max(0, math.ceil(round(share * count, 6)) - 1), count - 1)


def quantile(values: Sequence[float], share: float) -> float:
    """Return the least value that a share of the values does not exceed; it is one of them, or nan without any."""
    return sorted(values)[rank(share, len(values))] if values else math.nan
