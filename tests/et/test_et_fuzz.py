"""Whatever the rows and the command line are: a result or a message, never a traceback, never a lost file."""

import os
import tempfile
from pathlib import Path

import pytest
from et_runs import run
from hypothesis import example, given, settings
from hypothesis import strategies as st

from elib.records.et.actions import actions
from lanes import few_and_many

NUMBERS = st.sampled_from(
    ["0", "1", "-1", "2.5", "1e3", "1e308", "-1e308", "1e999", "nan", "1_0", "٣", "", "+", "1,5", "-"]
)
WORDS = st.one_of(
    NUMBERS, st.sampled_from(["Ada", "call", "ok", "ko", "Stop(..)", "#", "é", "\0", "\ufffd"]), st.text(max_size=5)
)
ROWS = st.lists(WORDS, max_size=8).map(" ".join)
PROPER = st.tuples(
    st.floats(-10, 1e6),
    st.sampled_from(["Ada", "Bob L"]),
    st.sampled_from(["call", "ok", "ko"]),
    st.sampled_from("xyz"),
).map(lambda cells: f"{cells[0]:.8f} {cells[1]} {cells[2]} {cells[3]}(..) 0 0")
LOGS = st.lists(st.one_of(PROPER, ROWS), max_size=12).flatmap(
    lambda rows: st.sampled_from(["\n", "\r\n"]).map(lambda end: end.join(rows).encode("utf-8", "surrogatepass"))
)
DATA = st.one_of(LOGS, st.binary(max_size=60))
ACTIONS = st.sampled_from([*actions(), "nothing"])
OPTIONS = st.sampled_from(
    [
        "--by",
        "--bins",
        "--every",
        "--percentiles",
        "--format",
        "-h",
        "-s",
        "-d",
        "--",
        "-",
        "--by=3",
        "--format=csv",
        "-x",
    ]
)
VALUES = st.one_of(
    WORDS,
    st.sampled_from(["3", "robot", "time", "-3", "csv", "json", "jsonl", "text", "50,99", "0.1", "99999999"]),
)
USUAL = st.tuples(
    ACTIONS, st.lists(st.sampled_from(["0", "1", "3", "5", "-1", "9"]), max_size=3), st.lists(OPTIONS, max_size=2)
).map(lambda parts: [parts[0], *parts[1], *parts[2]])
ARGUMENTS = st.one_of(USUAL, st.lists(st.one_of(ACTIONS, OPTIONS, VALUES), max_size=7))


MANY = [
    "Avg 0",
    "FromTo 0 0 5",
    "FromCollection 2 ok",
    "Stats 0 --by 2",
    "Join",
    "Latency",
    "Count 3",
    "Rate",
    "Histogram 0",
]


def check(arguments: list[str], data: bytes) -> None:
    """Run in a directory of its own; nothing is destroyed when et complains."""
    back = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            Path("old").write_text("precious")
            found = run(*arguments, log=data)
            left = {each.name: each.read_bytes() for each in Path().iterdir() if each.is_file()}
        finally:
            os.chdir(back)
    assert found.code in (0, 2), found
    assert "Traceback" not in found.err
    if found.code:
        assert found.err.startswith("error: ")
        assert left == {"old": b"precious"}


@few_and_many(50, 100)
def test_no_command_line_and_no_log_give_a_traceback(examples: int) -> None:
    @settings(max_examples=examples)
    @given(arguments=ARGUMENTS, data=DATA)
    @example(arguments=["Rate", "--every", "1e308"], data=b"-1e308 a\n1e308 a")
    @example(arguments=["Histogram", "0", "--bins", "1000"], data=b"5e-324 a\n0 a")
    @example(arguments=["Avg", "0", "-s", "old", "-d", "old"], data=b"")
    @example(arguments=["Join", "-s", "old", "-d", "old"], data=b"")
    @example(arguments=["Stats", "0", "--by", "-1"], data=b"-1e308 a\n1e308 a")
    def holds(arguments: list[str], data: bytes) -> None:
        check(arguments, data)

    holds()


@few_and_many(40, 80)
def test_no_log_gives_a_traceback_in_any_format(examples: int) -> None:
    @settings(max_examples=examples)
    @given(
        action=st.sampled_from(MANY),
        form=st.sampled_from(["text", "csv", "json", "jsonl"]),
        data=LOGS,
    )
    def holds(action: str, form: str, data: bytes) -> None:
        check([*action.split(), "--format", form, "-d", "old" if form == "text" else "new"], data)

    holds()


@few_and_many(25, 50)
def test_results_do_not_depend_on_how_a_log_is_read(examples: int) -> None:
    """Means may differ in their last digit, and of several errors another one may be found first."""

    @settings(max_examples=examples)
    @given(
        action=st.sampled_from([each for each in MANY if not each.startswith(("Avg", "Stats", "Latency"))]),
        form=st.sampled_from(["text", "csv", "json"]),
        data=LOGS,
        size=st.integers(1, 40),
    )
    def holds(action: str, form: str, data: bytes, size: int) -> None:
        arguments = [*action.split(), "--format", form]
        whole = run(*arguments, log=data)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("elib.records.et.rows.BLOCK", size)
            patch.setattr("elib.records.et.rows.MAX_LINE", 10_000)
            parts = run(*arguments, log=data)
        assert parts.code == whole.code
        assert whole.code or parts == whole

    holds()


@settings(max_examples=50)
@given(rows=st.lists(st.integers(-(10**6), 10**6), max_size=30), low=st.integers(-50, 50), high=st.integers(-50, 50))
def test_from_to_and_its_complement_are_the_whole(rows: list[int], low: int, high: int) -> None:
    log = "".join(f"{row} x\n" for row in rows)
    inside = run("FromTo", "0", str(low), str(high), log=log).out.splitlines()
    assert inside == [f"{row} x" for row in rows if low <= row < high]
