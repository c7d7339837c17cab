"""Where results go and in which form: nothing that was there is ever destroyed."""

import contextlib
import csv
import io
import json
import os
import re
import stat
import subprocess
import sys
from pathlib import Path

import duckdb
import pytest
from et_runs import SAMPLE, complaint, result, run

import elib.records.et.work
from elib.base.extras import install
from elib.records.et.action import Figure
from elib.records.et.actions import actions
from elib.records.et.arguments import arguments_of
from elib.records.et.commandline import summary
from elib.records.et.formats import writing
from elib.records.et.rows import Block
from lanes import short
from shared import PATIENCE

ET = [sys.executable, "-c", "import sys; from elib.records.et import main; sys.exit(main())"]


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run.log").write_text(SAMPLE)
    return tmp_path


@pytest.mark.parametrize(
    "arguments",
    [
        ("Avg", "1"),
        ("Nothing", "1"),
        ("FromTo", "0", "0"),
        ("FromTo", "1", "0", "1"),
        ("Avg", "0", "-s", "missing.log"),
        ("Stats", "0", "--plot", "no/where.png"),
        ("Join", "--format", "xml"),
    ],
)
def test_a_failure_leaves_the_old_output_alone(arguments: tuple[str, ...], place: Path) -> None:
    old = place / "out.txt"
    old.write_text("precious")
    complaint(*arguments, "-d", "out.txt")
    assert old.read_text() == "precious"
    assert sorted(each.name for each in place.iterdir()) == ["out.txt", "run.log"]


def test_help_leaves_the_output_alone(place: Path) -> None:
    (place / "out.txt").write_text("precious")
    assert result("-s", "run.log", "-d", "out.txt", "-h").startswith("Usage")
    assert (place / "out.txt").read_text() == "precious"


def test_the_log_itself_may_be_the_destination(place: Path) -> None:
    result("FromCollection", "2", "ko", "-s", "run.log", "-d", "run.log")
    assert (place / "run.log").read_text() == "812.32700000 Ada ko Motors(..) 0 0\n"


@pytest.mark.skipif(os.name == "nt", reason="rights and links are not the same there")
def test_an_old_file_keeps_its_rights_and_a_link_stays_one(place: Path) -> None:
    old = place / "out.txt"
    old.write_text("old")
    old.chmod(0o640)
    (place / "link").symlink_to(old)
    result("Avg", "5", "-s", "run.log", "-d", "link")
    assert old.read_text() == "0.60000000\n"
    assert stat.S_IMODE(old.stat().st_mode) == 0o640
    assert (place / "link").is_symlink()


@pytest.mark.skipif(not Path("/dev/null").is_char_device(), reason="there is no such device")
def test_a_device_is_written_to_and_not_replaced(place: Path) -> None:
    result("Avg", "5", "-s", "run.log", "-d", "/dev/null")
    assert Path("/dev/null").is_char_device()


def test_a_full_disk_is_told(place: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("there is no such device")
    found = run("Avg", "5", "-d", "/dev/full")
    assert (found.code, found.err) == (1, "error: /dev/full: No space left on device\n")


@pytest.mark.skipif(os.name == "nt", reason="there are no such limits")
@pytest.mark.parametrize("name", short(["old.txt", "old.csv", "old.parquet"], "old.txt"))
def test_a_file_that_grows_too_large_is_told_and_the_old_one_stays(name: str, place: Path) -> None:
    (place / name).write_text("precious")
    limited = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000)); "
    found = subprocess.run(
        # -B: a module that is imported for the first time would be cached cut off, and fail in every later process.
        [sys.executable, "-B", "-c", limited + ET[2], "Join", "-d", name],
        input="".join(f"{time} a call c 0 0\n{time} a ok c 0 0\n" for time in range(1000)),
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert (found.returncode, found.stdout) == (1, "")
    assert re.fullmatch(r"error: \S+: File too large\n", found.stderr)
    assert (place / name).read_text() == "precious"
    assert sorted(each.name for each in place.iterdir()) == [name, "run.log"]


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="nothing is protected from root")
def test_a_write_protected_file_is_not_replaced(place: Path) -> None:
    (place / "old.txt").write_text("precious")
    (place / "old.txt").chmod(0o444)
    assert complaint("Avg", "5", "-d", "old.txt") == "'old.txt' cannot be written: it is write-protected"
    assert (place / "old.txt").read_text() == "precious"


def test_results_and_plot_need_a_file_each(place: Path) -> None:
    assert "are both './a.png'" in complaint("Join", "-d", "a.png", "--plot", "./a.png")


def test_the_name_of_the_file_tells_the_format(place: Path) -> None:
    result("Count", "2", "-s", "run.log", "-d", "counts.CSV")
    assert (place / "counts.CSV").read_text() == "word,count,share\ncall,5,0.5\nok,4,0.4\nko,1,0.1\n"
    result("Count", "2", "-s", "run.log", "-d", "counts.csv", "--format", "text")
    assert (place / "counts.csv").read_text().startswith("word  count")


def test_json_is_one_document_and_jsonl_one_each_line() -> None:
    rows = json.loads(result("Latency", "--format", "json"))
    assert [row["command"] for row in rows][:2] == ["GetIR(..)", "GetLight(..)"]
    assert rows[0]["sd_ms"] is None
    assert rows == [json.loads(line) for line in result("Latency", "--format", "jsonl").splitlines()]
    assert json.loads(result("Avg", "5", "--format", "json")) == [{"avg": 0.6}]


def test_rows_that_are_copied_get_names_and_kinds() -> None:
    first = {"time": 812.327, "robot": "Ada", "event": "ko", "command": "Motors(..)", "not_sent": 0, "not_answered": 0}
    assert json.loads(result("FromCollection", "2", "ko", "--format", "json")) == [first]
    rows = list(csv.DictReader(io.StringIO(result("FromCollection", "2", "ko", "--format", "csv"))))
    assert rows == [{**{name: str(value) for name, value in first.items()}, "time": "812.32700000"}]


def test_a_robot_that_is_called_by_a_number_keeps_its_name() -> None:
    rows = json.loads(result("FromTo", "0", "0", "9", "--format", "json", log="1,5 007 call Stop(..) 0 0\n"))
    assert (rows[0]["time"], rows[0]["robot"]) == (1.5, "007")


def test_other_columns_are_numbered() -> None:
    rows = json.loads(result("FromTo", "0", "0", "9", "--format", "json", log="1 x\n2 3.5\n3 007e400\n"))
    assert rows == [
        {"column_0": 1, "column_1": "x"},
        {"column_0": 2, "column_1": 3.5},
        {"column_0": 3, "column_1": None},
    ]


def test_formats_need_the_same_columns_in_all_rows() -> None:
    said = complaint("FromTo", "0", "0", "9", "--format", "csv", log="1 x\n2 y z\n")
    assert said == "stdin:2: the row has 3 columns, but the first one has 2, and csv needs as many in each"


def test_quotes_and_commas_are_kept_in_csv() -> None:
    log = '1,5 a"b call x,y 0 0\n2.5 é call z 0 0\n'
    rows = list(csv.reader(io.StringIO(result("FromTo", "0", "0", "9", "--format", "csv", log=log))))
    assert rows[1:] == [["1.5", 'a"b', "call", "x,y", "0", "0"], ["2.5", "é", "call", "z", "0", "0"]]
    plain = result("FromTo", "0", "2", "9", "--format", "csv", log=log)
    assert plain.splitlines()[1] == "2.5,é,call,z,0,0"


@pytest.mark.parametrize(
    ("form", "expected"), [("csv", "time,robot,event,command,not_sent,not_answered\n"), ("json", "[]\n")]
)
def test_no_rows_are_a_valid_file_too(form: str, expected: str) -> None:
    assert result("FromTo", "0", "0", "9", "--format", form, log="") == expected


def test_parquet_has_the_rows_and_their_types(place: Path) -> None:
    result("Join", "-s", "run.log", "-d", "it's.parquet")
    found = duckdb.connect().execute("SELECT * FROM read_parquet(?)", [str(place / "it's.parquet")])
    assert [(each[0], str(each[1])) for each in found.description] == [
        ("time", "DOUBLE"),
        ("robot", "VARCHAR"),
        ("event", "VARCHAR"),
        ("command", "VARCHAR"),
        ("latency", "DOUBLE"),
    ]
    assert found.fetchone() == (812.1025, "Ada", "ok", "GetIR(..)", 0.0487)
    result("FromTo", "0", "0", "1", "-s", "run.log", "-d", "none.parquet")
    assert duckdb.connect().execute("SELECT count(*) FROM read_parquet('none.parquet')").fetchone() == (0,)


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="all names are UTF-8 there")
def test_parquet_goes_into_a_folder_whose_name_is_not_utf_8(place: Path) -> None:
    folder = place / os.fsdecode(b"caf\xe9")
    folder.mkdir()
    result("Join", "-s", "run.log", "-d", str(folder / "pairs.parquet"))
    (folder / "pairs.parquet").rename(place / "pairs.parquet")
    assert duckdb.connect().execute("SELECT count(*) FROM read_parquet('pairs.parquet')").fetchone() == (5,)


def test_rows_that_do_not_fit_parquet_leave_the_old_file_alone(place: Path) -> None:
    (place / "old.parquet").write_text("precious")
    log = "1 Ada call Stop(..) none 0\n"
    assert "do not fit Parquet" in complaint("FromTo", "0", "0", "9", "-d", "old.parquet", log=log)
    assert (place / "old.parquet").read_text() == "precious"


@pytest.mark.parametrize(
    ("module", "arguments", "extra"),
    [("duckdb", ("Join", "-d", "a.parquet"), "parquet"), ("matplotlib", ("Join", "--plot", "a.png"), "plot")],
)
def test_what_is_not_installed_is_told_with_its_extra(
    module: str, arguments: tuple[str, ...], extra: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == module else object())
    found = run(*arguments)
    assert found.code == 1
    assert install(extra) in found.err
    assert [each.name for each in place.iterdir()] == ["run.log"]


DRAWN = (
    ("Latency",),
    ("Join",),
    ("Stats", "0", "--by", "3"),
    ("Count", "3"),
    ("Histogram", "5"),
    ("Rate", "--every", "0.1", "--by", "1"),
)


@pytest.mark.parametrize(
    ("arguments", "log"),
    [
        pytest.param(arguments, log, id=f"{arguments[0]}-{name}", marks=marks)
        for arguments in DRAWN
        for name, log, marks in (
            ("sample", SAMPLE, ()),
            ("empty", "", pytest.mark.long),
            (
                "dollars",
                "1 $x$ call $y 0 0\n2 $x$ ok $y 0 0\n",
                () if arguments == ("Count", "3") else pytest.mark.long,
            ),
        )
    ],
)
def test_every_summary_can_be_drawn(arguments: tuple[str, ...], log: str, place: Path) -> None:
    assert result(*arguments, "--plot", "plot.svg", log=log) == result(*arguments, log=log)
    assert "<svg" in (place / "plot.svg").read_text()


def test_names_that_no_font_has_room_for_are_drawn(place: Path) -> None:
    log = f"1 \x1b\x00 call {'w' * 3000} 0 0\n2 \x1b\x00 ok {'w' * 3000} 0 0\n3 a call 機 0 0\n3 a ok 機 0 0\n"
    for arguments in (("Latency",), ("Stats", "0", "--by", "1")):
        result(*arguments, "--plot", "plot.png", log=log)
        assert (place / "plot.png").read_bytes().startswith(b"\x89PNG")


def test_times_far_apart_are_drawn_on_a_logarithmic_axis(place: Path) -> None:
    log = "1 a call b 0 0\n1 a call c 0 0\n1.001 a ok b 0 0\n1.5 a ok c 0 0\n"
    result("Latency", "--plot", "plot.svg", log=log)
    assert "<!-- 200 -->" in (place / "plot.svg").read_text()


def test_points_of_a_long_log_are_thinned_out(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("elib.records.et.actions.join.MAX_POINTS", 8)
    join = actions()["Join"]()
    log = "".join(f"{time} a call c 0 0\n{time} a ok c 0 0\n" for time in range(100))
    with writing("text", str(place / "out")) as writer:
        join.run([Block(log.encode())], writer)
    assert [pair.time for pair in join.points] == list(range(0, 100, 16))


def test_a_large_file_shows_its_progress_on_a_terminal_only(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(elib.records.et.work, "LARGE_FILE", 100)
    assert result("Avg", "5", "-s", "run.log") == "0.60000000\n"
    monkeypatch.setenv("TERM", "xterm")
    found = run("Avg", "5", "-s", "run.log", on_terminal=True)
    assert found.out == "0.60000000\n"
    assert "run.log" in found.err


@pytest.mark.skipif(sys.platform not in ("linux", "darwin"), reason="there are no pseudo-terminals")
def test_the_bar_is_gone_before_the_result_comes_and_never_among_rows(place: Path) -> None:
    for arguments, has_bar, last in (
        (("Avg", "5"), True, "\x1b[2K0.60000000\r\n"),
        (("FromTo", "0", "812.57", "812.5751"), False, "812.57500000 Ada ok Stop(..) 0 0\r\n"),
        (("FromTo", "0", "0", "1", "-d", "none.log"), True, "\x1b[2K"),
    ):
        shown = on_pty(*arguments, "-s", "run.log")
        assert ("━" in shown) == has_bar
        assert shown.endswith(last)


def on_pty(*arguments: str) -> str:
    """Run ``et`` on a terminal, as if every file were large, and return what it shows."""
    import pty

    ours, theirs = pty.openpty()
    code = "import sys, elib.records.et as et, elib.records.et.work as work; work.LARGE_FILE = 100; sys.exit(et.main())"
    environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "90", "PYTHONUTF8": "1"}
    with subprocess.Popen(
        [sys.executable, "-c", code, *arguments], stdin=theirs, stdout=theirs, stderr=theirs, env=environment
    ) as process:
        os.close(theirs)
        shown = b""
        with contextlib.suppress(OSError):  # the terminal ends with its last program
            while part := os.read(ours, 4096):
                shown += part
        assert process.wait(PATIENCE) == 0
    os.close(ours)
    return shown.decode()


def test_a_new_action_is_a_class_in_a_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from elib.records.et import actions as package

    (tmp_path / "longest.py").write_text(
        "from dataclasses import dataclass\n"
        "from elib.records.et.action import Figure\n"
        "@dataclass\n"
        "class Longest(Figure):\n"
        '    """Print the length of the longest row."""\n'
        "    def figure(self, blocks):\n"
        "        return max(len(row) for block in blocks for row in block.rows)\n"
    )
    monkeypatch.setattr(package, "__path__", [*package.__path__, str(tmp_path)])
    assert result("longest") == "41.00000000\n"
    assert "Print the length of the longest row." in result("-h")
    sys.modules.pop("elib.records.et.actions.longest")


def test_every_action_explains_itself_and_its_arguments() -> None:
    for kind in actions().values():
        assert summary(kind).endswith((".", ".)", "rows.")), kind
        assert all(each.help.endswith(".") for each in arguments_of(kind))
    assert issubclass(actions()["Avg"], Figure)
    assert Block(b"").rows == []


# As a process


@pytest.mark.parametrize(
    "arguments", [("Join",), *(pytest.param(each, marks=pytest.mark.long) for each in (("--help",), ("Avg", "0")))]
)
def test_nothing_is_imported_that_takes_long_or_may_be_missing(arguments: tuple[str, ...]) -> None:
    code = "import sys; from elib.records.et import main; main(); print(*sys.modules, file=sys.stderr)"
    found = subprocess.run(
        [sys.executable, "-c", code, *arguments], input=SAMPLE, capture_output=True, text=True, timeout=PATIENCE
    )
    tops = {name.partition(".")[0] for name in found.stderr.split()}
    assert "numpy" in tops
    assert not tops & {"matplotlib", "duckdb", "mcap", "rich", "cyclopts", "asyncio", "PIL"}


@pytest.mark.skipif(os.name == "nt", reason="there is no such device")
def test_a_listener_that_left_gives_no_traceback() -> None:
    for arguments, code in ((["Avg", "x"], 2), (["Join"], 0)):
        reader, writer = os.pipe()
        os.close(reader)
        found = subprocess.run([*ET, *arguments], input=b"", stdout=-1, stderr=writer, timeout=PATIENCE)
        os.close(writer)
        assert found.returncode == code


def test_a_reader_that_closes_the_pipe_early_ends_et_quietly() -> None:
    with subprocess.Popen([*ET, "FromTo", "0", "0", "2"], stdin=-1, stdout=-1, stderr=-1) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdin.write(b"1 a\n")
        process.stdin.flush()
        assert process.stdout.readline() == b"1 a\n"  # a slow pipe is followed live
        process.stdout.close()
        try:
            process.stdin.write(b"1 a\n" * 100_000)
            process.stdin.close()
        except BrokenPipeError:
            pass
        assert process.wait(PATIENCE) == 1
        assert process.stderr.read() == b""
