"""Readings as numbers over time, and two of them at the same times."""

import math
import random
from collections.abc import Sequence

import numpy as np
import pytest

from elib.base.pose import Pose
from elib.base.quantiles import quantile
from elib.link.protocol.values import Acceleration, AngularVelocity, Battery
from elib.link.session import LinkCounter
from elib.records.encoding import fields_of, numbers_in
from elib.records.et.groups import Groups, quantiles
from elib.records.reader import Entry
from elib.studies.comparison import Latencies, compare_series, distances
from elib.studies.series import Series, path_series, series_of


def readings(name: str, rows: list[tuple[float, dict[str, object]]]) -> list[Entry]:
    return [Entry(time, f"/readings/{name}", {**data, "time": time, "origin": "simulator"}) for time, data in rows]


def test_times_count_from_the_beginning_and_fields_are_numbers_alone() -> None:
    entries = readings("thing", [(10.0, {"count": 3, "name": "x"}), (10.5, {"count": 4, "name": "y"})])
    found = series_of(entries, 10.0)["thing"]
    assert found.fields == ("count",)
    assert found.times.tolist() == [0.0, 0.5]
    assert found.values.tolist() == [[3.0], [4.0]]


def test_step_counters_have_no_jumps() -> None:
    rows: list[tuple[float, dict[str, object]]] = [
        (0.0, {"left": 32760, "right": 0}),
        (0.1, {"left": -32766, "right": 5}),
    ]
    assert series_of(readings("encoders", rows), 0.0)["encoders"].values[:, 0].tolist() == [32760, 32770]


def counted(*rows: tuple[float, int], besides: Sequence[Entry] = ()) -> Series:
    entries = readings("encoders", [(time, {"left": count, "right": count}) for time, count in rows])
    return series_of(sorted([*entries, *besides], key=lambda entry: entry.time), 0.0)["encoders"]


def outcome(time: float, command: str, *, ok: bool = True, waited: float = 0.01) -> Entry:
    data = {"time": time, "command": command, "ok": ok, "waited": waited, "call": 1, "round_trip": waited}
    return Entry(time, "/outcomes", data)


@pytest.mark.parametrize("ok", [True, False])
@pytest.mark.parametrize("command", ["set_encoders", "reset"])
def test_counters_that_the_program_set_did_not_count_between(command: str, ok: bool) -> None:
    found = counted((0.0, 50), (0.1, 60), (0.2, 3), (0.3, 13), besides=[outcome(0.15, command, ok=ok)])
    assert found.broken.tolist() == [False, False, True, False]
    assert math.isnan(found.at(np.array([0.15]))[0, 0])
    assert found.at(np.array([0.25]))[0, 0] == pytest.approx(8)


def test_a_set_that_took_long_may_have_been_done_at_any_time_of_it() -> None:
    slow = outcome(0.25, "set_encoders", waited=0.2)
    found = counted((0.0, 50), (0.1, 60), (0.2, 3), (0.3, 13), (0.4, 23), besides=[slow])
    assert found.broken.tolist() == [False, True, True, True, False]


@pytest.mark.parametrize("event", ["greeted", "reset"])
def test_counters_of_a_robot_that_restarted_did_not_count_between(event: str) -> None:
    note = Entry(0.15, "/notes", {"time": 0.15, "name": "robot", "event": event})
    assert counted((0.0, 50), (0.1, 60), (0.2, 3), (0.3, 13), besides=[note]).broken.tolist()[2:] == [True, False]


def test_counters_that_jump_further_than_wheels_can_turn_were_set_by_somebody() -> None:
    found = counted((0.0, 4000), (0.1, 4100), (0.2, 10), (0.3, 110))
    assert found.broken.tolist() == [False, False, True, False]
    assert counted((0.0, 32760), (0.1, -32700)).broken.tolist() == [False, False]


def test_behind_a_break_counters_begin_with_what_is_read() -> None:
    rows = (0.0, 32760), (0.1, -32766), (0.2, 0), (0.3, 10)
    assert counted(*rows, besides=[outcome(0.15, "set_encoders")]).values[:, 0].tolist() == [32760, 32770, 0, 10]


def test_a_field_that_is_missing_now_and_then_is_not_a_number_there() -> None:
    found = series_of(readings("thing", [(0.0, {"raw": 1}), (1.0, {"raw": 2, "other": 3.7})]), 0.0)["thing"]
    assert math.isnan(found.values[0, 1])


def test_lists_are_fields_by_place_but_samples_of_sound_are_not() -> None:
    assert numbers_in({"axes": [1, 2.5], "samples": list(range(100)), "g": [0, 0, 1], "is_low": True}) == {
        "axes[0]": 1.0,
        "axes[1]": 2.5,
        "is_low": 1.0,
    }


def test_a_reading_of_text_alone_is_not_a_series() -> None:
    assert series_of(readings("version", [(0.0, {"text": "1.2"})]), 0.0) == {}


def test_values_between_two_readings_lie_on_a_straight_line_except_over_a_gap() -> None:
    series = Series(("count",), np.array([0.0, 0.1, 0.2, 2.0, 2.1]), np.array([[0.0], [1], [2], [20], [21]]))
    assert series.at(np.array([0.05, 1.0, 2.05, -1.0, 3.0]))[:, 0] == pytest.approx(
        [0.5, math.nan, 20.5, math.nan, math.nan], nan_ok=True
    )


def test_one_reading_says_nothing_about_other_times() -> None:
    assert np.isnan(Series(("count",), np.array([1.0]), np.array([[1.0]])).at(np.array([1.0]))).all()


def test_a_reading_that_is_not_later_than_the_one_before_is_left_out() -> None:
    found = path_series([Pose(0, 0, 0, time=1.0), Pose(1, 0, 0, time=1.0), Pose(2, 0, 0, time=2.0)], 0.0)
    assert found.times.tolist() == [1.0, 2.0]


def test_headings_go_on_over_half_a_turn() -> None:
    found = path_series([Pose(0, 0, 3.1, time=0.0), Pose(0, 0, -3.1, time=1.0)], 0.0)
    assert found.values[1, 2] == pytest.approx(math.tau - 3.1)


def test_a_shifted_reading_has_that_difference_and_full_correlation() -> None:
    times = np.arange(0, 5, 0.1)
    wave = np.sin(times)[:, None]
    (found,) = compare_series(
        "thing", Series(("a", "b"), times, np.hstack([wave, wave])), Series(("a",), times, wave + 2)
    )
    assert (found.field, found.count) == ("a", 50)
    assert (found.rms, found.correlation) == (pytest.approx(2), pytest.approx(1))


def test_a_constant_has_no_correlation() -> None:
    times = np.arange(3.0) / 10
    (found,) = compare_series("thing", Series(("a",), times, np.ones((3, 1))), Series(("a",), times, np.ones((3, 1))))
    assert math.isnan(found.correlation)
    assert found.rms == 0


def test_paths_are_compared_over_the_time_that_both_have() -> None:
    first = path_series([Pose(0.1 * k, 0, 0, time=0.1 * k) for k in range(20)], 0.0)
    second = path_series([Pose(0.1 * k, 0.5, 0, time=0.1 * k) for k in range(10, 30)], 0.0)
    assert distances(first, second) == pytest.approx(0.5)
    assert len(distances(first, second)) == pytest.approx(18, abs=1)


def test_quantiles_are_nearest_ranks_and_unknown_without_calls() -> None:
    found = Latencies(4, 0, tuple(enumerate((0.4, 0.1, 0.3, 0.2))))
    assert [found.quantile(share) for share in (0.5, 0.95)] == [0.2, 0.4]
    assert math.isnan(Latencies(1, 1, ()).quantile(0.5))


def test_constants_and_other_units_of_a_reading_are_not_compared() -> None:
    times = {"time": 1.0, "origin": "robot"}
    at_rest = Acceleration(2048, 2048, 2816, time=1.0)
    turning = AngularVelocity(1, 2, 3, time=1.0)
    battery = Battery(2400, 3.9, 0.6, time=1.0)
    assert numbers_in(fields_of(at_rest)) == {"x": 2048, "y": 2048, "z": 2816}
    assert numbers_in(fields_of(turning)) == {"x": 1, "y": 2, "z": 3}
    assert numbers_in({**fields_of(battery), **times}) == {"raw": 2400}


def test_all_percentiles_of_elib_follow_one_rule() -> None:
    for seed in range(30):
        check_percentiles(random.Random(seed))


def check_percentiles(chance: random.Random) -> None:
    values = [round(chance.expovariate(20), 4) for _ in range(chance.randrange(1, 60))]
    share = chance.choice((0.01, 0.05, 0.07, 0.5, 0.55, 0.95, 0.99, 1.0))
    expected = quantile(values, share)
    # The least value that the share does not exceed.
    assert sum(value <= expected for value in values) >= round(share * len(values), 9)
    assert sum(value < expected for value in values) < round(share * len(values), 9)
    assert Latencies(len(values), 0, tuple(enumerate(values))).quantile(share) == expected
    counter = LinkCounter()
    counter._trips.extend(values)
    found = counter.read(0.0)
    assert (found.median, found.p99) == (quantile(values, 0.5), quantile(values, 0.99))
    numbers = Groups()
    numbers.add(np.array(values))
    assert quantiles(numbers.of(), [share]) == [expected]
