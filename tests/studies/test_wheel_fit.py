"""The least squares behind ``elib fit``, on made drives whose every number is known."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from elib.base.body import AXLE, METRES_PER_STEP
from elib.base.errors import ArgumentError
from elib.studies import wheels
from elib.studies.series import Numbers, Series, unwrapped_steps
from elib.studies.wheels import fit_wheels, integrated

PERIOD = 0.1
LEGS = [(500, 500), (0, 0), (-500, -500), (0, 0), (-300, 300), (0, 0), (300, -300), (0, 0), (250, 500), (500, 250)]


def course(times: Numbers, values: Numbers, broken: NDArray[np.bool_] | None = None) -> Series:
    names = tuple(map(str, range(values.shape[1])))
    return Series(names, times, values) if broken is None else Series(names, times, values, broken)


def made(
    left: float = 1.01, right: float = 0.99, axle: float = 0.0535, delay: float = 0.03, rounds: int = 3
) -> tuple[Series, Series]:
    """Counters and poses of a drive: four seconds of each movement."""
    times = np.arange(0, 4.0 * len(LEGS) * rounds, PERIOD)
    speeds = np.array([LEGS[int(time / 4.0 + 1e-9) % len(LEGS)] for time in times], dtype=float)
    counts = np.vstack([[0, 0], np.cumsum(speeds[:-1] * PERIOD, axis=0)])
    exact = course(times, counts)
    poses = integrated(exact, times, left, right, axle)
    # A reading arrives later than it was taken.
    return course(times + delay, np.floor(counts)), course(times, poses)


def test_an_exact_drive_gives_exact_wheels() -> None:
    found = fit_wheels(*made())
    assert (found.left, found.right) == (pytest.approx(1.01, rel=1e-3), pytest.approx(0.99, rel=1e-3))
    assert found.axle == pytest.approx(0.0535, rel=1e-3)
    assert found.delay == pytest.approx(0.03, abs=0.002)
    assert found.left_out == 0


def test_noisy_poses_give_wheels_within_the_errors_that_are_stated() -> None:
    steps, poses = made()
    noise = np.random.default_rng(5).normal(size=poses.values.shape) * [0.001, 0.001, 0.01]
    found = fit_wheels(steps, course(poses.times, poses.values + noise))
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
    found = fit_wheels(steps, course(poses.times, values))
    assert found.left_out >= 1
    assert found.left == pytest.approx(1.01, rel=2e-3)
    assert found.axle == pytest.approx(0.0535, rel=2e-3)


def held(poses: Series, share: float, legs: tuple[int, ...]) -> Series:
    """The same headings, but only a share of the way in some movements: the robot pushes a wall."""
    number = (poses.times / 4.0 + 1e-9).astype(int)[:-1] % len(LEGS)
    change = np.diff(poses.values[:, :2], axis=0) * np.where(np.isin(number, legs), share, 1.0)[:, None]
    return course(poses.times, np.column_stack([np.vstack([[0, 0], np.cumsum(change, axis=0)]), poses.values[:, 2]]))


def test_a_robot_that_pushed_a_wall_for_half_of_the_drive_has_the_wheels_of_the_rest() -> None:
    steps, poses = made(rounds=5)
    found = fit_wheels(steps, held(poses, 0.2, (0, 2)))
    assert found.left_out > 0.9 * found.windows
    assert (found.left, found.right) == (pytest.approx(1.01, rel=2e-3), pytest.approx(0.99, rel=2e-3))
    assert found.axle == pytest.approx(0.0535, rel=2e-3)


def test_a_robot_that_was_held_up_nearly_all_the_time_is_refused_with_the_likely_cause() -> None:
    steps, poses = made()
    with pytest.raises(ArgumentError, match=r"(?s)slipped or pushed.*keep it off walls"):
        fit_wheels(steps, held(poses, 0.2, (0, 2, 8)))


@pytest.mark.parametrize(
    ("scatter", "says"), [((0.001, 0.03), "miss by"), ((0.01, 0.01), "miss by"), ((0.001, 0.1), "pieces .* agree")]
)
def test_a_drive_whose_pieces_miss_by_degrees_or_centimetres_is_refused(
    scatter: tuple[float, float], says: str
) -> None:
    steps, poses = made()
    place, turn = scatter
    noise = np.random.default_rng(5).normal(size=poses.values.shape) * [place, place, turn]
    with pytest.raises(ArgumentError, match=f"(?s){says}.*slipped or pushed.*m and rad"):
        fit_wheels(steps, course(poses.times, poses.values + noise))


@pytest.mark.parametrize(("rounds", "says"), [(1, "hardly known"), (2, r"known only within 0\.\d %")])
def test_wheels_whose_standard_error_is_large_are_refused(
    rounds: int, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wheels, "MAX_ERROR", 0.0005)
    steps, poses = made(rounds=rounds)
    noise = np.random.default_rng(5).normal(size=poses.values.shape) * [0.003, 0.003, 0.006]
    with pytest.raises(ArgumentError, match=f"(?s){says}.*slipped or pushed.*longer"):
        fit_wheels(steps, course(poses.times, poses.values + noise))


@pytest.mark.parametrize("factor", [-1.0, 180 / math.pi])
def test_headings_of_another_kind_are_refused(factor: float) -> None:
    steps, poses = made()
    with pytest.raises(ArgumentError, match=r"(?s)m and rad, heading positive to the left"):
        fit_wheels(steps, course(poses.times, poses.values * [1, 1, factor]))


def test_no_piece_of_the_drive_reaches_over_a_break() -> None:
    steps, poses = made(rounds=4)
    broken = np.zeros(len(steps.times), dtype=bool)
    broken[[301, 850]] = True
    values = steps.values - np.where(np.arange(len(broken)) >= 301, 12000, 0)[:, None]
    values -= np.where(np.arange(len(broken)) >= 850, 300, 0)[:, None]
    found = fit_wheels(course(steps.times, values, broken), poses)
    assert (found.left, found.right) == (pytest.approx(1.01, rel=1e-3), pytest.approx(0.99, rel=1e-3))
    assert found.left_out == 0


def test_counters_that_are_set_before_each_movement_are_refused_with_the_reason() -> None:
    steps, poses = made()
    broken = np.arange(len(steps.times)) % 40 == 39
    with pytest.raises(ArgumentError, match=r"(?s)only 0 pieces.*set or reset 30 times"):
        fit_wheels(course(steps.times, steps.values, broken), poses)


def test_what_is_counted_over_a_break_is_not_motion() -> None:
    steps, poses = made()
    straight = np.column_stack([steps.values[:, 0]] * 2)
    broken = np.arange(len(steps.times)) % 100 == 99
    straight[:, 1] += np.cumsum(broken) * 3000
    with pytest.raises(ArgumentError, match=r"turned 0\.0 times"):
        fit_wheels(course(steps.times, straight, broken), poses)


def test_a_drive_without_turns_is_refused() -> None:
    steps, poses = made()
    straight = course(steps.times, np.column_stack([steps.values[:, 0]] * 2))
    with pytest.raises(ArgumentError, match=r"turned 0\.0 times.*2 turns"):
        fit_wheels(straight, poses)


def test_a_drive_that_only_turns_is_refused() -> None:
    steps, poses = made()
    with pytest.raises(ArgumentError, match=r"rolled 0\.\d+ m"):
        fit_wheels(course(steps.times, steps.values * [0.1, -0.1]), poses)


def test_a_drive_that_never_goes_on_evenly_is_refused() -> None:
    times = np.arange(0, 60, 1.0)
    counts = np.cumsum(np.random.default_rng(1).uniform(-800, 800, (60, 2)), axis=0)
    steps = course(times, counts)
    with pytest.raises(ArgumentError, match="only 0 pieces"):
        fit_wheels(steps, course(times, integrated(steps, times, 1, 1, AXLE)))


def test_an_empty_recording_is_refused() -> None:
    nothing = course(np.zeros(0), np.zeros((0, 2)))
    with pytest.raises(ArgumentError, match="0 readings of the counters"):
        fit_wheels(nothing, course(np.zeros(0), np.zeros((0, 3))))


def test_counters_that_wrap_go_on() -> None:
    counts = np.array([[32000.0, -32000.0], [-32736.0, 32736.0], [-32000.0, 32000.0]])
    assert unwrapped_steps(counts).tolist() == [[32000, -32000], [32800, -32800], [33536, -33536]]


def test_counters_become_an_arc() -> None:
    steps = course(np.array([0.0, 1.0]), np.array([[0.0, 0.0], [0.0, math.pi * AXLE / METRES_PER_STEP]]))
    x, y, heading = integrated(steps, np.array([1.0]), 1, 1, AXLE)[0]
    assert (x, y, heading) == (pytest.approx(0, abs=1e-12), pytest.approx(AXLE), pytest.approx(math.pi))
