"""What et finds out: statistics, counts, rates, histograms, latencies."""

import math
import random
import statistics
import tracemalloc

import numpy as np
import pytest
from et_runs import SAMPLE, complaint, result, run
from hypothesis import given
from hypothesis import strategies as st

from elib.base.quantiles import quantile
from elib.records.et.groups import Groups, deviation, mean, quantiles
from elib.records.et.pairing import Pairing
from elib.records.et.rows import BLOCK, Block, RowError, blocks_of

DRAW = random.Random(1)
VALUES = [round(DRAW.gauss(50, 10), 3) for _ in range(1000)]
LOG = "".join(f"{value} {'odd' if place % 2 else 'even'}\n" for place, value in enumerate(VALUES))


def cells(text: str) -> list[list[str]]:
    return [line.split() for line in text.splitlines()]


def test_single_numbers_are_those_of_the_statistics_module() -> None:
    assert float(result("Min", "0", log=LOG)) == min(VALUES)
    assert float(result("Max", "0", log=LOG)) == max(VALUES)
    assert float(result("Sd", "0", log=LOG)) == pytest.approx(statistics.stdev(VALUES), abs=1e-8)
    assert float(result("Percentile", "0", "50", log=LOG)) == statistics.median_low(VALUES)
    assert float(result("Percentile", "0", "0", log=LOG)) == min(VALUES)
    assert float(result("Percentile", "0", "100", log=LOG)) == max(VALUES)


@pytest.mark.parametrize("arguments", [("Min", "0"), ("Max", "0"), ("Sd", "0"), ("Percentile", "0", "5")])
def test_of_no_rows_there_is_no_number(arguments: tuple[str, ...]) -> None:
    assert result(*arguments, log="") == "-\n" or result(*arguments, log="") == "nan\n"


def test_stats_describe_a_column() -> None:
    heads, row = cells(result("Stats", "0", log=LOG))
    assert heads == ["count", "mean", "sd", "min", "p5", "p50", "p95", "max"]
    ranks = sorted(VALUES)
    expected = [1000, statistics.fmean(VALUES), statistics.stdev(VALUES), ranks[0], ranks[49], ranks[499], ranks[949]]
    assert [float(cell) for cell in row] == pytest.approx([*expected, ranks[-1]], rel=1e-6)


def test_stats_by_a_column_have_a_row_for_each_word() -> None:
    heads, *rows = cells(result("Stats", "0", "--by", "1", "--percentiles", "99.9", log=LOG))
    assert heads == ["word", "count", "mean", "sd", "min", "p99.9", "max"]
    assert [row[:2] for row in rows] == [["even", "500"], ["odd", "500"]]
    assert float(rows[1][2]) == pytest.approx(statistics.fmean(VALUES[1::2]), rel=1e-6)


def test_stats_of_no_rows_are_dashes() -> None:
    assert cells(result("Stats", "0", log=""))[1] == ["0", *["-"] * 7]
    assert len(cells(result("Stats", "0", "--by", "1", log=""))) == 1


def test_late_times_keep_their_digits() -> None:
    late = "".join(f"{value + 1e9:.3f} x\n" for value in VALUES)  # a sum of squares would lose everything here
    assert float(result("Avg", "0", log=late)) == pytest.approx(statistics.fmean(VALUES) + 1e9, abs=1e-6)
    assert float(result("Sd", "0", log=late)) == pytest.approx(statistics.stdev(VALUES), rel=1e-6)


@given(
    st.lists(st.tuples(st.floats(-1e9, 1e9), st.sampled_from([b"", b"a", b"b"])), max_size=60),
    st.integers(1, 20),
    st.floats(0, 1),
)
def test_the_numbers_of_each_word_are_described_apart_however_they_come(
    rows: list[tuple[float, bytes]], size: int, share: float
) -> None:
    numbers = Groups()
    for place in range(0, len(rows), size):
        part = rows[place : place + size]
        numbers.add(np.array([value for value, _ in part]), [word for _, word in part])
    assert numbers.words == list(dict.fromkeys(word for _, word in rows))
    for word in numbers.words:
        own = sorted(value for value, its in rows if its == word)
        found = numbers.of(word)
        assert found.tolist() == own
        assert quantiles(found, [share]) == [quantile(own, share)]
        assert mean(found) == pytest.approx(statistics.fmean(own), abs=1e-6)
        if len(own) > 1:
            assert deviation(found) == pytest.approx(statistics.stdev(own), abs=1e-6, rel=1e-6)


def test_a_column_takes_eight_bytes_a_row() -> None:
    values, numbers = np.array(VALUES), Groups()
    tracemalloc.start()
    try:
        for _ in range(500):
            numbers.add(values)
        assert quantiles(numbers.of(), [0.5]) == [statistics.median_low(VALUES)]
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 500_000 * 8 * 1.25


def test_count_gives_shares_the_most_frequent_first() -> None:
    assert cells(result("Count", "event")) == [
        ["word", "count", "share"],
        ["call", "5", "0.5000"],
        ["ok", "4", "0.4000"],
        ["ko", "1", "0.1000"],
    ]


def test_histogram_counts_every_number_once() -> None:
    rows = cells(result("Histogram", "5", "--bins", "2"))[1:]
    assert [row[:3] for row in rows] == [["0", "1", "6"], ["1", "2", "4"]]
    assert len(rows[0][3]) == 40
    assert sum(int(row[2]) for row in cells(result("Histogram", "0", log=LOG))[1:]) == 1000


def test_a_histogram_of_one_number_has_one_bin() -> None:
    assert [row[:3] for row in cells(result("Histogram", "0", log="3 x\n3 y\n"))[1:]] == [["3", "3", "2"]]
    assert len(cells(result("Histogram", "0", log=""))) == 1


def test_rate_has_a_row_for_each_window_also_for_those_without_rows() -> None:
    log = "".join(f"{time} a\n" for time in (0.1, 0.2, 0.9, 4.5))
    rows = cells(result("Rate", "--every", "2", log=log))[1:]
    assert rows == [["0", "3", "1.5"], ["2", "0", "0"], ["4", "1", "0.5"]]
    assert len(cells(result("Rate", log=""))) == 1


def test_times_and_values_on_an_edge_count_behind_it_also_where_they_are_less_in_binary() -> None:
    tenths = "".join(f"{number / 10} a\n" for number in range(13))
    assert [row[1] for row in cells(result("Rate", "--every", "0.1", log=tenths))[1:]] == ["1"] * 13
    late = "".join(f"{100_000 + number / 10:.8f} a\n" for number in range(13))
    assert [row[1] for row in cells(result("Rate", "--every", "0.1", log=late))[1:]] == ["1"] * 13
    assert [row[2] for row in cells(result("Histogram", "0", "--bins", "12", log=tenths))[1:]] == [*["1"] * 11, "2"]


def test_rate_refuses_more_windows_than_a_table_can_have() -> None:
    assert "take a longer --every" in complaint("Rate", log="0 a\n1e9 b\n")
    assert "take a longer --every" in complaint("Rate", "--every", "1e-300", log="1e9 b\n")


def test_grouping_by_numbers_is_refused_before_it_fills_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("elib.records.et.groups.MAX_WORDS", 900)
    log = "".join(f"{place} a\n" for place in range(1000))
    for arguments in (("Stats", "0", "--by", "0"), ("Count", "0")):
        assert "more than 900 different words to tell apart" in complaint(*arguments, log=log)


def test_many_words_in_many_windows_are_refused_before_they_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    log = "".join(f"{place} a{place}\n" for place in range(1000))
    assert "1000 words in 1000 windows of 1 s are too many" in complaint("Rate", "--by", "1", log=log)
    assert len(result("Rate", "--by", "1", "--every", "100", log=log).splitlines()) == 10_001


def test_rates_of_words_add_up_over_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("elib.records.et.rows.BLOCK", 7)
    rows = cells(result("Rate", "--by", "1", log="0.1 x\n0.2 y\n-0.5 y\n2 x\n0.3 x\n"))[1:]
    assert [[row[0], row[1], row[2]] for row in rows if row[2] != "0"] == [
        ["x", "0", "2"],
        ["x", "2", "1"],
        ["y", "-1", "1"],
        ["y", "0", "1"],
    ]
    assert len(rows) == 8


# Calls and their ends


def test_join_gives_the_latency_of_each_call() -> None:
    assert result("Join") == (
        "#time robot event command latency\n"
        "812.10250000 Ada ok GetIR(..) 0.04870000\n"
        "812.11310000 Ada ok GetLight(..) 0.08530000\n"
        "812.12390000 Ada ko Motors(..) 0.20310000\n"
        "812.54000000 Ada ok Stop(..) 0.03500000\n"
        "812.50000000 Ada ok GetSelector(..) 0.07600000\n"
    )


def test_what_join_writes_can_be_read_again() -> None:
    joined = result("Join")
    assert result("Max", "latency", log=joined) == "0.20310000\n"
    assert "Stop(..)" in result("Stats", "latency", "--by", "command", log=joined)


def test_calls_of_one_command_are_joined_in_order_and_robots_apart() -> None:
    log = (
        "1 Ada call Stop(..) 0 0\n"
        "2 Bob call Stop(..) 0 0\n"
        "3 Ada call Stop(..) 0 0\n"
        "4 Ada ok Stop(..) 0 0\n"
        "5 Ada ko Stop(..) 0 0\n"
        "9 Bob ok Stop(..) 0 0\n"
    )
    rows = [row.split() for row in result("Join", log=log).splitlines()[1:]]
    assert [(row[0], row[1], row[2], float(row[4])) for row in rows] == [
        ("1.00000000", "Ada", "ok", 3),
        ("3.00000000", "Ada", "ko", 2),
        ("2.00000000", "Bob", "ok", 7),
    ]


def test_rows_without_a_partner_are_counted_on_stderr() -> None:
    log = "1 Ada ok Stop(..) 0 0\n2 Ada call Stop(..) 0 0\n"
    found = run("Join", log=log)
    assert (found.code, found.out) == (0, "#time robot event command latency\n")
    assert "calls without ok or ko: 1;" in found.err
    assert "ok or ko without a call: 1;" in found.err


def test_a_run_that_was_appended_is_not_joined_with_the_one_before() -> None:
    log = "90 Ada call Stop(..) 0 0\n1 Ada call Stop(..) 0 0\n1.5 Ada ok Stop(..) 0 0\n"
    found = run("Latency", log=log)
    assert cells(found.out)[1] == ["Stop(..)", "1", "0", "1", "500.000", "-", *["500.000"] * 4]


def test_a_blank_in_the_name_is_bridged_as_logs_of_2011_need() -> None:
    log = "1 Ada L call Stop(..) 0 0\n2 Ada L ok Stop(..) 0 0\n"
    assert "1.00000000 Ada%20L ok Stop(..) 1.00000000" in result("Join", log=log)


def test_latency_has_a_row_for_each_command() -> None:
    heads, *rows = cells(result("latency"))
    assert heads == "command ok ko open mean_ms sd_ms min_ms p50_ms p95_ms max_ms".split()
    assert [row[0] for row in rows] == ["GetIR(..)", "GetLight(..)", "GetSelector(..)", "Motors(..)", "Stop(..)"]
    assert rows[0] == ["GetIR(..)", "1", "0", "0", "48.700", "-", *["48.700"] * 4]
    assert rows[3] == ["Motors(..)", "0", "1", "0", *["-"] * 6]


def test_latency_by_robot_takes_all_its_commands_together() -> None:
    rows = cells(result("Latency", "--by", "robot"))
    assert rows[1][:4] == ["Ada", "4", "1", "0"]
    assert float(rows[1][4]) == pytest.approx((48.7 + 85.3 + 76 + 35) / 4)


def test_pairing_does_not_depend_on_where_blocks_end() -> None:
    lines = SAMPLE.splitlines(keepends=True)
    whole = list(Pairing().pairs(Block(SAMPLE.encode())))
    pairing = Pairing()
    assert [pair for line in lines for pair in pairing.pairs(Block(line.encode()))] == whole


def test_calls_that_never_end_do_not_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("elib.records.et.pairing.MAX_OPEN", 3)
    with pytest.raises(RowError, match="x:4: more than 3 calls"):
        list(Pairing().pairs(Block(b"1 Ada call Stop(..) 0 0\n" * 5, "x")))
    begun_again = b"".join(b"%d Ada call Stop(..) 0 0\n" % time for time in range(5, 0, -1))
    assert list(Pairing().pairs(Block(begun_again))) == []


def test_robots_and_commands_without_end_do_not_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    log = "".join(f"{place} Ada {event} c{place} 0 0\n" for place in range(100) for event in ("call", "ok", "ko"))
    pairing = Pairing()
    assert len(list(pairing.pairs(Block(log.encode())))) == pairing.orphans == 100
    assert not pairing._open
    monkeypatch.setattr("elib.records.et.pairing.MAX_ROBOTS", 3)
    with pytest.raises(RowError, match="more than 3 robots"):
        list(Pairing().pairs(Block("".join(f"1 r{place} ok c 0 0\n" for place in range(4)).encode())))


# Rows


@pytest.mark.parametrize("size", [1, 2, 3, 7, 1000])
def test_lines_are_whole_however_they_are_read(size: int) -> None:
    data = b"\xef\xbb\xbf1 a\r\n#c\r\n\r\n22 b\r\n333 c"
    place = 0

    def read(_: int) -> bytes:
        nonlocal place
        place += size
        return data[place - size : place]

    blocks = list(blocks_of(read))
    assert [row for block in blocks for row in block.rows] == [b"1 a", b"22 b", b"333 c"]
    assert [value for block in blocks for value in block.numbers(0)] == [1, 22, 333]
    assert blocks[-1].line + blocks[-1].count == 6


def test_a_line_without_an_end_is_refused_before_it_fills_the_memory() -> None:
    sizes = []

    def read(most: int) -> bytes:
        sizes.append(most)
        return b"x" * most

    with pytest.raises(RowError, match=r"stdin:1: the line is longer than 16 MiB; this is not a log"):
        list(blocks_of(read))
    assert sum(sizes) <= 17 * BLOCK


def test_huge_numbers_give_no_warning() -> None:
    log = "1e308 a\n-1e308 a\n1e308 a\n"
    for arguments in (("Avg", "0"), ("Sd", "0"), ("Stats", "0"), ("Histogram", "0")):
        assert run(*arguments, log=log).err == ""
    assert math.isfinite(float(result("Max", "0", log=log)))
