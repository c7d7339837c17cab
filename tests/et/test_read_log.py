"""``elib.read_log``: a log as a table of its calls."""

from pathlib import Path

import numpy as np
import pandas
import pytest

import elib

LOG = """# elib log 1, names: python
812.10250000 Ada%20L call proximity 0 0
812.12390000 Ada%20L call set_speed 1 2
812.15120000 Ada%20L ok proximity 1 2
#start of second round
812.32700000 Ada%20L ko set_speed 0 0
812.50000000 Ada%20L call selector 0 0
"""
OLD = """812,1 Ada L call GetIR(..) 0 0
812,2 Ada L ok GetIR(..) 0 0
812,3 Ada L call Reset() 0 1
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "run.log"
    path.write_text(text, newline="")
    return path


def test_a_call_is_a_row_with_its_outcome_and_pandas_takes_the_table_as_it_is(tmp_path: Path) -> None:
    table = pandas.DataFrame(elib.read_log(written(tmp_path, LOG)))
    assert table["time"].tolist() == [812.1025, 812.1239, 812.5]
    assert table["robot"].unique().tolist() == ["Ada L"]
    assert table["command"].tolist() == ["proximity", "set_speed", "selector"]
    assert table["outcome"].tolist() == ["ok", "ko", ""]
    assert table["seconds"].tolist()[:2] == pytest.approx([0.0487, 0.2031])
    assert np.isnan(table["seconds"][2])
    assert table["not_sent"].tolist() == [0, 1, 0]
    assert table["not_answered"].tolist() == [0, 2, 0]
    assert [str(kind) for kind in (table["time"].dtype, table["not_sent"].dtype)] == ["float64", "int64"]


def test_logs_of_2011_are_read_and_commands_have_the_names_that_are_asked_for(tmp_path: Path) -> None:
    path = written(tmp_path, OLD)
    assert elib.read_log(path)["command"].tolist() == ["proximity", "reset"]
    assert elib.read_log(path, names="2011")["command"].tolist() == ["GetIR(..)", "Reset()"]
    assert elib.read_log(path)["robot"].tolist() == ["Ada L"] * 2
    assert elib.read_log(path)["seconds"][0] == pytest.approx(0.1)
    assert elib.read_log(written(tmp_path, LOG), names="2011")["command"].tolist()[1] == "Motors(..)"


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_wherever_the_last_line_was_cut_off_the_others_are_read(newline: str, tmp_path: Path) -> None:
    text = LOG.replace("\n", newline)
    begin = text.rstrip().rindex("\n") + 1
    for end in range(begin, len(text)):
        found = elib.read_log(written(tmp_path, text[:end]))
        assert found["command"].tolist()[:2] == ["proximity", "set_speed"]
        assert found["outcome"].tolist()[:2] == ["ok", "ko"]


def test_a_log_that_was_begun_again_leaves_the_calls_of_the_first_run_without_outcome(tmp_path: Path) -> None:
    again = "812.6 Ada call stop 0 0\n1.0 Ada call stop 0 0\n1.1 Ada ok stop 0 0\n"
    assert elib.read_log(written(tmp_path, again))["outcome"].tolist() == ["", "ok"]


def test_an_empty_log_has_the_columns_and_no_rows(tmp_path: Path) -> None:
    table = elib.read_log(written(tmp_path, "# elib log 1, names: python\n"))
    assert {name: (len(column), column.dtype.kind) for name, column in table.items()} == {
        "time": (0, "f"),
        "robot": (0, "U"),
        "command": (0, "U"),
        "outcome": (0, "U"),
        "seconds": (0, "f"),
        "not_sent": (0, "i"),
        "not_answered": (0, "i"),
    }


def test_what_is_not_a_log_is_named_by_its_line(tmp_path: Path) -> None:
    path = written(tmp_path, "1.0 Ada call stop 0 0\nnonsense\n1.1 Ada ok stop 0 0\n")
    with pytest.raises(elib.ArgumentError, match=r"run\.log:2: "):
        elib.read_log(path)
    with pytest.raises(elib.ArgumentError, match="cannot be read: No such file"):
        elib.read_log(tmp_path / "no.log")
    with pytest.raises(elib.ArgumentError, match="names is 'french'"):
        elib.read_log(path, names="french")  # type: ignore[arg-type]  # that is the mistake


def test_the_blocks_of_a_long_log_make_one_table(tmp_path: Path) -> None:
    lines = "".join(
        f"{k / 100:.8f} Ada call proximity 0 0\n{k / 100 + 0.002:.8f} Ada ok proximity 0 0\n" for k in range(50_000)
    )
    table = elib.read_log(written(tmp_path, lines))
    assert len(table["time"]) == 50_000
    assert (table["outcome"] == "ok").all()
