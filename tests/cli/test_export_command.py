"""``elib record export``: a recording as CSV and Parquet."""

from __future__ import annotations

import subprocess
import sys
from csv import DictReader
from datetime import UTC, datetime
from pathlib import Path

import pandas
import pytest
from elib_process import Told

import elib
from elib.cli import main
from elib.records.mcapfile import McapFile
from elib.records.messages import Message
from elib.records.topics import BYTES, READINGS


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("export") / "run.mcap"
    with elib.connect("sim://?speed=max", name="Ada, L") as robot, robot.record(path) as recorder:
        robot.set_speed(0.3, 0.3)
        for _ in range(20):
            robot.sensors()
            robot.sleep(0.1)
        robot.image()
        recorder.note('a "word", and more')
    return path


def test_a_folder_gets_a_file_for_each_table(path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "tables"
    assert main(["record", "export", str(path), "--csv", str(folder)]) == 0
    out, err = capsys.readouterr()
    tables = elib.read_recording(path).tables()
    assert {each.stem for each in folder.iterdir()} == {*tables}
    for name, table in tables.items():
        found, expected = pandas.read_csv(folder / f"{name}.csv"), pandas.DataFrame(table)
        assert list(found) == list(expected)
        assert len(found) == len(expected)
        for column in expected.select_dtypes("number"):
            assert found[column].tolist() == pytest.approx(expected[column].tolist(), rel=0, abs=0, nan_ok=True)
    assert pandas.read_csv(folder / "notes.csv")["text"].tolist()[-1] == 'a "word", and more'
    assert f"{folder / 'proximity.csv'}" in out
    assert "pictures (1) are not in the tables" in err


def test_parquet_keeps_the_types(path: Path, tmp_path: Path) -> None:
    import duckdb

    assert main(["record", "export", str(path), "calls", "proximity", "--parquet", str(tmp_path)]) == 0
    assert sorted(each.name for each in tmp_path.iterdir()) == ["calls.parquet", "proximity.parquet"]
    with duckdb.connect() as database:
        query = f"select time, proximity_left, robot from read_parquet('{tmp_path / 'proximity.parquet'}')"
        found = database.execute(query).fetchnumpy()
        oks = database.execute(f"select ok from read_parquet('{tmp_path / 'calls.parquet'}')").fetchnumpy()["ok"]
    near = elib.read_recording(path)["proximity"]
    assert found["time"].tolist() == near["time"].tolist()
    assert found["proximity_left"].tolist() == near["proximity_left"].tolist()
    assert {*found["robot"]} == {"Ada, L"}
    assert oks.dtype == bool


@pytest.mark.parametrize("text", ["a\rb", "a\r\nb", "a\nb"])
def test_a_line_end_of_any_kind_in_a_note_keeps_it_one_row(text: str, tmp_path: Path) -> None:
    import duckdb

    path, csv, parquet = tmp_path / "run.mcap", tmp_path / "notes.csv", tmp_path / "notes.parquet"
    with elib.connect("sim://?speed=max") as robot, robot.record(path) as recorder:
        recorder.note(text)
        recorder.note("after")
    assert main(["record", "export", str(path), "notes", "--csv", str(csv)]) == 0
    assert main(["record", "export", str(path), "notes", "--parquet", str(parquet)]) == 0
    with csv.open(newline="") as lines:
        assert [row["text"] for row in DictReader(lines)][:2] == [text, "after"]
    with duckdb.connect() as database:
        found = database.execute(f"select text from read_parquet('{parquet}')").fetchall()
    assert found[:2] == [(text,), ("after",)]


def test_one_table_can_go_into_one_file(refused: Told, path: Path, tmp_path: Path) -> None:
    file = tmp_path / "light.csv"
    assert main(["record", "export", str(path), "ambient-light", "--csv", str(file)]) == 0
    assert "ambient_light_front_left" in file.read_text().splitlines()[0]
    assert "is one file, and a recording has several tables" in refused(
        "record", "export", path, "--csv", tmp_path / "all.csv"
    )


def test_nothing_is_replaced_unless_told_and_all_is_written_or_nothing(
    refused: Told, path: Path, tmp_path: Path
) -> None:
    mine = tmp_path / "notes.csv"  # the last table that is begun
    mine.write_text("mine")
    assert "exists\nhint: choose another name, or add --replace" in refused("record", "export", path, "--csv", tmp_path)
    assert [each.name for each in tmp_path.iterdir()] == ["notes.csv"]
    assert mine.read_text() == "mine"
    assert main(["record", "export", str(path), "notes", "--csv", str(mine), "--replace"]) == 0
    assert mine.read_text() != "mine"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--csv", "x", "--parquet", "y"], "needs --csv or --parquet, one of them"),
        ([], "needs --csv or --parquet, one of them"),
        (["--csv"], "error: elib record export: --csv needs a value. Write CSV: a folder"),
        (["proxymity", "--csv", "x"], "has no table 'proxymity' with rows"),
        (["proximity", "--parquet", "near.csv"], "or a file for one: 'near.parquet'"),
        (["proximity", "--csv", "near.txt"], "'near.txt' has the name of a file, but a csv file ends in .csv"),
        (["--csv", "nowhere/tables"], "hint: name a folder in one that exists, and not a file"),
    ],
)
def test_mistakes_are_named(
    refused: Told, words: list[str], said: str, path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in refused("record", "export", path, *words)


def test_of_a_damaged_recording_what_is_whole_is_exported_and_said(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[:-3000])
    assert main(["record", "export", str(cut), "--csv", str(tmp_path / "out")]) == 0
    assert "cut.mcap is not complete: 0 damaged pieces were left out" in capsys.readouterr().err
    assert (tmp_path / "out" / "proximity.csv").exists()


def test_a_recording_without_a_whole_chunk_is_not_called_empty(refused: Told, path: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    content = path.read_bytes()
    cut.write_bytes(content[: len(content) // 8])
    assert "cut.mcap was cut off or damaged before its first whole chunk" in refused(
        "record", "export", cut, "--csv", tmp_path / "out"
    )


@pytest.mark.long
def test_a_long_recording_does_not_fill_the_memory(tmp_path: Path) -> None:
    path = tmp_path / "long.mcap"
    file = McapFile(path, {"format": "1", "robot": "Ada", "firmware": "epuck2", "began": "0.0"}, 0.0, datetime.now(UTC))
    for number in range(200_000):
        near = elib.Proximity(front_left=number % 4000, time=number / 10)
        data = {**{name: getattr(near, name) for name in ("time", "front_left", "front_right", "left", "right")}}
        file.write(Message(near.time, READINGS, {**data, "origin": "robot"}, "proximity"))
        if number % 1000 == 0:
            file.write(Message(near.time, BYTES, {"time": near.time, "to_robot": True, "data": "AAAA" * 50_000}))
            file.flush()
    file.finish()
    code = (
        "import resource, sys\n"
        "from elib.records.export import export; from elib import read_recording; from pathlib import Path\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "done = export(read_recording(sys.argv[1]), Path(sys.argv[2]), 'csv')\n"
        "print(sum(done.rows.values()), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", code, str(path), str(tmp_path / "out")],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    rows, grown = map(int, run.stdout.split())
    assert rows == 200_000
    assert grown < 60_000 * (1 if sys.platform != "darwin" else 1024)
