"""The latency and jitter behind ``elib fit``, from made round trips."""

import math

import numpy as np
import pytest

from elib.base.errors import ArgumentError
from elib.studies.fit import LinkFit, fit_link


def test_half_of_what_round_trips_take_longer_is_the_latency() -> None:
    found = fit_link([0.047, 0.048, 0.049], [0.007, 0.008, 0.009])
    assert (found.latency, found.jitter) == (pytest.approx(0.02), pytest.approx(0, abs=1e-9))


def test_the_latency_of_the_simulated_link_is_added_to_what_is_missing() -> None:
    assert fit_link([0.05] * 4, [0.048] * 4, LinkFit(0.02, 0.0, 0.0, 4)).latency == pytest.approx(0.021)


def test_a_latency_is_never_negative() -> None:
    assert fit_link([0.001], [0.003]).latency == 0


def test_scattered_round_trips_are_jitter_of_both_ways() -> None:
    trips = 0.06 + np.random.default_rng(2).normal(size=4000) * 0.004 * math.sqrt(2)
    found = fit_link(list(trips), [0.01] * 4000)
    assert found.jitter == pytest.approx(0.004, rel=0.05)
    assert abs(found.latency - 0.025) < 4 * found.error


def test_nothing_to_compare_is_an_error() -> None:
    with pytest.raises(ArgumentError, match="cannot be fitted"):
        fit_link([], [])
