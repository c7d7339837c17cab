"""The least squares behind ``elib fit``, on made drives whose every number is known."""

import math

import numpy as np
import pytest

from elib.body import AXLE, METRES_PER_STEP
from elib.errors import ArgumentError
from elib.recording.fitting import Course, LinkFit, fit_link, fit_wheels, integrated, unwrapped_steps

PERIOD = 0.1
LEGS = [(500, 500), (0, 0), (-500, -500), (0, 0), (-300, 300), (0, 0), (300, -300), (0, 0), (250, 500), (500, 250)]


def made(
    left: float = 1.01, right: float = 0.99, axle: float = 0.0535, delay: float = 0.03, rounds: int = 3
) -> tuple[Course, Course]:
    """Counters and poses of a drive: four seconds of each movement."""
    times = np.arange(0, 4.0 * len(LEGS) * rounds, PERIOD)
    speeds = np.array([LEGS[int(time / 4.0 + 1e-9) % len(LEGS)] for time in times], dtype=float)
    counts = np.vstack([[0, 0], np.cumsum(speeds[:-1] * PERIOD, axis=0)])
    exact = Course(times, counts)
    poses = integrated(exact, times, left, right, axle)
    # A reading arrives later than it was taken.
    return Course(times + delay, np.floor(counts)), Course(times, poses)


def test_an_exact_drive_gives_exact_wheels() -> None:
    found = fit_wheels(*made())
    assert (found.left, found.right) == (pytest.approx(1.01, rel=1e-3), pytest.approx(0.99, rel=1e-3))
    assert found.axle == pytest.approx(0.0535, rel=1e-3)
    assert found.delay == pytest.approx(0.03, abs=0.002)
    assert found.left_out == 0


def test_noisy_poses_give_wheels_within_the_errors_that_are_stated() -> None:
    steps, poses = made()
    noise = np.random.default_rng(5).normal(size=poses.values.shape) * [0.001, 0.001, 0.01]
    found = fit_wheels(steps, Course(poses.times, poses.values + noise))
    for value, true, error in zip(
        (found.left, found.right, found.axle), (1.01, 0.99, 0.0535), found.errors, strict=False
    ):
        assert abs(value - true) < 4 * error
        assert error < 0.005 * true


def test_a_robot_that_was_held_up_for_a_while_is_not_taken_for_one_with_small_wheels() -> None:
    steps, poses = made()
    values = poses.values.copy()
    held = (poses.times > 40.5) & (poses.times < 43.5)
    back = values[held][-1] - values[held][0]
    values[held] = values[held][0]
    after = poses.times >= 43.5
    values[after, :2] -= back[:2]
    found = fit_wheels(steps, Course(poses.times, values))
    assert found.left_out >= 1
    assert found.left == pytest.approx(1.01, rel=2e-3)
    assert found.axle == pytest.approx(0.0535, rel=2e-3)


def test_a_drive_without_turns_is_refused() -> None:
    steps, poses = made()
    straight = Course(steps.times, np.column_stack([steps.values[:, 0]] * 2))
    with pytest.raises(ArgumentError, match=r"turned 0\.0 times.*2 turns"):
        fit_wheels(straight, poses)


def test_a_drive_that_only_turns_is_refused() -> None:
    steps, poses = made()
    with pytest.raises(ArgumentError, match=r"rolled 0\.\d+ m"):
        fit_wheels(Course(steps.times, steps.values * [0.1, -0.1]), poses)


def test_a_drive_that_never_goes_on_evenly_is_refused() -> None:
    times = np.arange(0, 60, 1.0)
    counts = np.cumsum(np.random.default_rng(1).uniform(-800, 800, (60, 2)), axis=0)
    steps = Course(times, counts)
    with pytest.raises(ArgumentError, match="only 0 pieces"):
        fit_wheels(steps, Course(times, integrated(steps, times, 1, 1, AXLE)))


def test_an_empty_recording_is_refused() -> None:
    nothing = Course(np.zeros(0), np.zeros((0, 2)))
    with pytest.raises(ArgumentError, match="0 readings of the counters"):
        fit_wheels(nothing, Course(np.zeros(0), np.zeros((0, 3))))


def test_counters_that_wrap_go_on() -> None:
    counts = np.array([[32000.0, -32000.0], [-32736.0, 32736.0], [-32000.0, 32000.0]])
    assert unwrapped_steps(counts).tolist() == [[32000, -32000], [32800, -32800], [33536, -33536]]


def test_counters_become_an_arc() -> None:
    steps = Course(np.array([0.0, 1.0]), np.array([[0.0, 0.0], [0.0, math.pi * AXLE / METRES_PER_STEP]]))
    x, y, heading = integrated(steps, np.array([1.0]), 1, 1, AXLE)[0]
    assert (x, y, heading) == (pytest.approx(0, abs=1e-12), pytest.approx(AXLE), pytest.approx(math.pi))


def test_half_of_what_round_trips_take_longer_is_the_latency() -> None:
    found = fit_link([0.047, 0.048, 0.049], [0.007, 0.008, 0.009])
    assert (found.latency, found.jitter) == (pytest.approx(0.02), pytest.approx(0, abs=1e-9))


def test_what_the_simulated_link_took_already_counts() -> None:
    assert fit_link([0.05] * 4, [0.048] * 4, LinkFit(0.02, 0.0, 0.0, 4)).latency == pytest.approx(0.021)


def test_a_link_is_never_quicker_than_none() -> None:
    assert fit_link([0.001], [0.003]).latency == 0


def test_scattered_round_trips_are_jitter_of_both_ways() -> None:
    trips = 0.06 + np.random.default_rng(2).normal(size=4000) * 0.004 * math.sqrt(2)
    found = fit_link(list(trips), [0.01] * 4000)
    assert found.jitter == pytest.approx(0.004, rel=0.05)
    assert abs(found.latency - 0.025) < 4 * found.error


def test_nothing_to_compare_is_an_error() -> None:
    with pytest.raises(ArgumentError, match="cannot be fitted"):
        fit_link([], [])
