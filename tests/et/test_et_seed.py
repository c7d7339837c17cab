"""The actions of 2011, by their syntax and with their results."""

from pathlib import Path

import pytest
from et_runs import SAMPLE, complaint, result, run

ROWS = [line for line in SAMPLE.splitlines(keepends=True) if not line.startswith("#")]


def test_avg_prints_the_mean_with_8_decimals() -> None:
    assert result("Avg", "0") == "812.32071000\n"
    assert result("Avg", "5") == "0.60000000\n"


def test_avg_of_no_rows_is_zero() -> None:
    assert result("Avg", "0", log="") == "0.00000000\n"
    assert result("Avg", "0", log="#only a comment\n") == "0.00000000\n"


def test_from_to_takes_its_lower_bound_and_leaves_its_upper_one() -> None:
    assert result("FromTo", "0", "812.15120000", "812.5") == "".join(ROWS[3:6])
    assert result("FromTo", "5", "1", "2") == ROWS[1] + ROWS[4]
    assert result("FromTo", "0", "812", "813") == "".join(ROWS)


def test_bounds_may_be_negative_or_have_exponents() -> None:
    assert result("FromTo", "0", "-5", "8.121240e2") == "".join(ROWS[:3])


def test_from_collection_copies_exact_words_only() -> None:
    assert result("FromCollection", "2", "ko") == ROWS[5]
    assert result("FromCollection", "3", "Stop(..)", "Motors(..)") == ROWS[2] + ROWS[5] + ROWS[7] + ROWS[8]
    assert result("FromCollection", "3", "Stop", "stop(..)") == ""


def test_from_collection_without_words_copies_nothing() -> None:
    assert result("FromCollection", "2") == ""


def test_a_word_that_begins_with_a_dash_stands_behind_two() -> None:
    log = "1 -x ok\n2 y ok\n"
    assert result("FromCollection", "1", "--", "-x", log=log) == "1 -x ok\n"


def test_words_are_compared_byte_by_byte() -> None:
    assert result("FromCollection", "1", "Žofie", log="1 Žofie ok\n2 Zofie ok\n") == "1 Žofie ok\n"


def test_comments_and_empty_lines_are_skipped_and_not_copied() -> None:
    assert result("FromTo", "0", "0", "9", log="#a\n\n1 x\n#b\n\n2 y\n#c") == "1 x\n2 y\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ("-s", "run.log", "-d", "out.log", "FromCollection", "2", "ko"),
        ("FromCollection", "2", "ko", "-s", "run.log", "-d", "out.log"),
        ("FromCollection", "-d", "out.log", "2", "--source=run.log", "ko"),
        ("-s", "other.log", "FromCollection", "2", "-s", "run.log", "ko", "--destination", "out.log"),
    ],
)
def test_options_stand_anywhere_and_the_last_one_holds(
    arguments: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("run.log").write_text(SAMPLE)
    assert result(*arguments, log="") == ""
    assert Path("out.log").read_text() == ROWS[5]


def test_actions_are_piped_into_each_other() -> None:
    late = result("FromTo", "0", "812.2", "813")
    assert result("Avg", "0", log=result("FromCollection", "2", "call", log=late)) == "812.52000000\n"


def test_names_of_columns_and_columns_from_the_end_are_understood() -> None:
    assert result("Avg", "not_answered") == result("Avg", "5") == result("Avg", "-1")


def test_an_action_is_found_in_small_letters_too() -> None:
    assert result("avg", "5") == result("Avg", "5")


def test_a_log_from_windows_is_read_also_with_decimal_commas() -> None:
    log = "\ufeff1,5 Ada call Stop(..) 0 0\r\n2,5 Ada ok Stop(..) 0 0\r\n"
    assert result("Avg", "0", log=log) == "2.00000000\n"
    assert result("FromTo", "0", "2", "3", log=log) == "2,5 Ada ok Stop(..) 0 0\n"


@pytest.mark.parametrize("arguments", [(), ("-h",), ("--help",), ("-s", "nowhere", "-h")])
def test_help_shows_every_action(arguments: tuple[str, ...]) -> None:
    page = result(*arguments)
    for part in ("Usage: et ", "six columns", "Avg COLUMN ", "FromTo COLUMN X Y ", "FromCollection COLUMN [WORD...]"):
        assert part in page
    assert max(map(len, page.splitlines())) <= 80


def test_help_of_an_action_shows_its_arguments_and_defaults() -> None:
    page = result("Rate", "-h")
    assert page.startswith("Usage: et Rate [--every S] [--by COLUMN]\n")
    assert "(default: 1.0)" in page
    assert "--plot FILE" in page
    assert "--plot FILE" not in result("Avg", "--help")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("-s", "x.log"), "et needs an action"),
        (("Average", "0"), "et has no action 'Average'\nhint: did you mean Avg?"),
        (("Avg",), "Avg needs COLUMN: a number from 0"),
        (("Avg", "0", "1"), "Avg does not take '1'"),
        (("Avg", "x"), "COLUMN of Avg is 'x'; it must be a number, counted from 0, or one of time,"),
        (("Avg", "1.5"), "COLUMN of Avg is '1.5'"),
        (("FromTo", "0", "1"), "FromTo needs Y"),
        (("FromTo", "0", "1", "nan"), "Y of FromTo is nan; it must be a finite number"),
        (("FromTo", "0", "1", "1e999"), "Y of FromTo is inf; it must be a finite number"),
        (("Avg", "0", "-s"), "-s needs a value\nhint: et --help"),
        (("Avg", "0", "-s", ""), "-s is ''; it must be the name of a file"),
        (("Avg", "0", "-s", "no\0thing"), "-s is 'no\\x00thing'"),
        (("Avg", "0", "-s", "nothing.log"), "'nothing.log' cannot be read: No such file"),
        (("Avg", "0", "-s", "."), "cannot be read: Is a directory"),
        (("Avg", "0", "-d", "no/where.txt"), "'no/where.txt' cannot be written: No such file"),
        (("Avg", "0", "-d", "."), "'.' is a directory"),
        (("Avg", "0", "--bin", "3"), "Avg has no option '--bin'"),
        (("Histogram", "0", "--bin", "3"), "Histogram has no option '--bin'\nhint: did you mean --bins?"),
        (("Histogram", "0", "--bins", "0"), "--bins of Histogram is 0; it must be a whole number from 1 to 1000"),
        (("Percentile", "0", "101"), "P of Percentile is 101; it must be a number from 0 to 100"),
        (
            ("Stats", "0", "--percentiles", "5,x"),
            "--percentiles of Stats is [5, 'x']; it must be 1 to 100 numbers, each from 0",
        ),
        (("Rate", "--every", "0"), "--every of Rate is 0 s; it must be a number above 0 s"),
        (("Latency", "--by", "2"), '--by of Latency is \'2\'; it must be "command" or "robot"'),
        (("Avg", "0", "--format", "xml"), '--format is \'xml\'; it must be "text" or "csv" or'),
        (("Avg", "0", "--format", "parquet"), "Parquet cannot go to standard output"),
        (("Avg", "0", "--plot", "a.png"), "Avg has no plot"),
        (("Stats", "0", "--plot", "a.bmp"), "a plot cannot become 'a.bmp'"),
    ],
)
def test_wrong_usage_is_explained(
    arguments: tuple[str, ...], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in complaint(*arguments)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "row", "said"),
    [
        (("Avg", "0"), "x Ada ok", "column 0 is 'x', which is not a number"),
        (("Avg", "0"), "nan Ada ok", "column 0 is 'nan'"),
        (("Avg", "0"), "1_0 Ada ok", "column 0 is '1_0'"),
        (("Avg", "0"), "1e999 Ada ok", "column 0 is '1e999'"),
        (("Avg", "0"), " 1 Ada ok", "column 0 is ''"),
        (("Avg", "1"), "1  5", "column 1 is ''"),
        (("FromTo", "1", "0", "1"), "1 x", "column 1 is 'x'"),
        (("FromCollection", "4", "a"), "1 2 3", "there is no column 4: the row has 3, counted from 0: '1 2 3'"),
        (("Avg", "-4"), "1 2 3", "there is no column -4"),
        (("Join",), "1 Ada ok", "a row of a log has 6 columns; this one has 3"),
        (("Latency",), "1 Ada begun Stop(..) 0 0", "the third column is 'begun'; it must be call, ok or ko"),
    ],
)
def test_bad_input_is_told_with_its_line(arguments: tuple[str, ...], row: str, said: str) -> None:
    good = "0 0 call 0 0 0\n"
    assert complaint(*arguments, log=f"#a comment\n{good}\n{row}\n{good}").startswith(f"stdin:4: {said}")


def test_a_message_names_the_file(tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    log.write_text("1 a\n2 b\nthree c\n")
    assert complaint("Avg", "0", "-s", str(log)) == f"{log}:3: column 0 is 'three', which is not a number"


def test_the_rows_before_a_bad_block_have_been_piped_on() -> None:
    found = run("FromTo", "0", "0", "9", log="1 a\n" * 300_000 + "x\n")
    assert found.code == 2
    assert found.err.startswith("error: stdin:300001:")
    assert set(found.out.splitlines()) == {"1 a"}


NEW = """\
# elib log 1, names: python
812.1 Ada call proximity 0 0
812.2 Ada ok proximity 0 0
# a comment
812.3 Ada call ground 0 0
812.4 Ada ok ground 0 0
812.5 Ada call reset 0 0
812.6 Ada ok reset 0 0
"""
"""A log with the names of Python, and its first line."""
OLD = "".join(line for line in NEW.splitlines(keepends=True) if not line.startswith("#"))
for name, name_of_2011 in (("proximity", "GetIR(..)"), ("ground", "ground(..)"), ("reset", "Reset()")):
    OLD = OLD.replace(f" {name} ", f" {name_of_2011} ")


def test_the_first_line_of_a_log_is_a_comment() -> None:
    assert result("FromTo", "0", "0", "999", log=NEW).splitlines() == [
        line for line in NEW.splitlines() if not line.startswith("#")
    ]
    assert result("Latency", "--format", "csv", log=NEW).splitlines()[2].startswith("proximity,1,0,0,100.0")


@pytest.mark.parametrize("column", ["3", "command"])
@pytest.mark.parametrize(
    ("word", "rows"), [("proximity", 2), ("GetIR(..)", 2), ("ground", 2), ("ground(..)", 2), ("reset", 2)]
)
def test_either_name_of_a_command_finds_its_rows_in_logs_of_both_vocabularies(
    column: str, word: str, rows: int
) -> None:
    found = [result("FromCollection", column, word, log=log).splitlines() for log in (NEW, OLD)]
    assert [len(each) for each in found] == [rows, rows]
    assert all(row in log.splitlines() for each, log in zip(found, (NEW, OLD), strict=True) for row in each)


@pytest.mark.parametrize("word", ["GetIR", "Getir(..)", "proximity()", "proximity(..)", "Ground(..)", "reset(..)"])
def test_other_spellings_of_a_command_find_nothing(word: str) -> None:
    assert result("FromCollection", "3", word, log=NEW + OLD) == ""


def test_in_other_columns_a_command_is_a_word_like_any_other() -> None:
    assert result("FromCollection", "1", "proximity", log="1 GetIR(..) x\n2 proximity x\n") == "2 proximity x\n"
