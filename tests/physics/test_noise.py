"""Noise: near normal, independent, and a function of nothing but its key."""

import math

import pytest

from elib.simulator.physics.noise import MASK, bits, gauss, mix, robot_key, tick_key, uniform


def correlation(a, b):
    mean_a, mean_b = sum(a) / len(a), sum(b) / len(b)
    covariance = sum((x - mean_a) * (y - mean_b) for x, y in zip(a, b, strict=True))
    return covariance / math.sqrt(sum((x - mean_a) ** 2 for x in a) * sum((y - mean_b) ** 2 for y in b))


def series(seed=1, robot=0, channel=16, count=4000):
    key = robot_key(seed, robot)
    return [gauss(tick_key(key, tick), channel) for tick in range(count)]


def test_scrambling_is_one_to_one_on_a_sample():
    assert len({mix(word) for word in range(50_000)}) == 50_000
    assert all(0 <= mix(word) <= MASK for word in range(0, MASK, 99_999_989))


def test_the_noise_has_mean_0_deviation_1_and_the_tails_of_four_bytes():
    values = series()
    count = len(values)
    assert sum(values) / count == pytest.approx(0, abs=4 / math.sqrt(count))
    assert sum(value**2 for value in values) / count == pytest.approx(1, abs=0.1)
    inside = sum(abs(value) < 1 for value in values) / count
    assert inside == pytest.approx(0.68, abs=0.04)
    assert max(map(abs, values)) <= 510 / 147.8


@pytest.mark.parametrize("other", [{"seed": 2}, {"robot": 1}, {"channel": 17}, {"seed": 1 + (1 << 32)}])
def test_two_streams_are_unrelated(other):
    assert abs(correlation(series(), series(**other))) < 4 / math.sqrt(4000)


def test_a_stream_does_not_resemble_itself_a_tick_later():
    values = series()
    assert abs(correlation(values[1:], values[:-1])) < 4 / math.sqrt(4000)


def test_two_robots_are_not_shifted_copies_of_each_other():
    first, second = ([bits(tick_key(robot_key(0, robot), tick), 0) for tick in range(2000)] for robot in (0, 1))
    assert len(set(first) & set(second)) <= 1


def test_even_numbers_fill_the_interval():
    key = robot_key(3, 0)
    values = [uniform(tick_key(key, tick), 0) for tick in range(4000)]
    assert all(0 <= value < 1 for value in values)
    for k in range(10):
        assert sum(k / 10 <= value < (k + 1) / 10 for value in values) == pytest.approx(400, abs=80)
