"""``elib record``, and ``--log`` and ``--record`` of every program that runs a robot."""

from __future__ import annotations

import json
import re
import signal
from pathlib import Path

import pytest
from elib_process import Told, started

import elib
from elib.behaviours import find
from elib.cli import main
from elib.cli.recordoptions import own_name
from elib.records.reader import read_recording, summary_of
from elib.robot.aio import on_open
from elib.robot.link import Record
from elib.robot.watchdog import is_supported
from shared import PATIENCE, wait_until

FAST = "sim://?speed=max"


def notes(path: Path) -> list[tuple[str, str]]:
    return [(each.data["name"], each.data["message"]) for each in read_recording(path).entries("/notes")]


def commands(path: Path) -> list[str]:
    return [each.data["command"] for each in read_recording(path).entries("/calls")]


# -- elib record -----------------------------------------------------------------------------------------------------


def test_a_robot_is_recorded_while_its_sensors_are_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "run.mcap"
    assert main(["record", str(path), "proximity", "ambient-light", "--rate", "10", "--for", "5", "--robot", FAST]) == 0
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines()[0] == "robot time  5.0 s"
    assert re.search(r"^recording   \d+ messages, \d+ KB in\s", err, re.MULTILINE)
    summary = summary_of(read_recording(path))
    assert summary.is_complete
    assert summary.messages["/readings/proximity"] in (50, 51)
    assert summary.messages["/readings/ambient_light"] in (50, 51)


def test_parts_are_made_and_kept_as_asked(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    options = ["--part-seconds", "5", "--keep", "2", "--for", "22", "--robot", FAST]
    assert main(["record", str(path), "proximity", *options]) == 0
    assert len(list(tmp_path.iterdir())) == 2


def test_for_reality_the_robot_drives_by_itself_watched_and_its_parts_are_noted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, settings = tmp_path / "own.mcap", []

    def look(robot: elib.Epuck) -> list[Record]:
        settings.append((robot.is_reconnecting, robot._link.settings.is_watched, robot._link.settings.keep_moving))
        return []

    with on_open(look):
        assert main(["record", str(path), "--reality", "--robot", FAST]) == 0
    assert settings == [(True, is_supported(), False)]
    assert [text for kind, text in notes(path) if kind == "state"] == [
        *("standing", "pictures", "turning", "placing", "driving", "end")
    ]
    out, err = capsys.readouterr()
    assert out == ""
    assert "put its front against a white wall" in err
    assert main(["record", str(tmp_path / "other.mcap"), "proximity", "--reality", "--robot", FAST]) == 2
    assert "--reality records all readings" in capsys.readouterr().err


@pytest.mark.parametrize("end", ["enter", "ctrl-c", "sigterm"])
def test_enter_ctrl_c_or_a_signal_ends_a_recording_that_is_then_whole(end: str, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with started("record", str(path), "proximity", "--robot", "sim://") as running:
        wait_until(lambda: path.exists() or running.process.poll() is not None)
        number = {"ctrl-c": signal.SIGINT, "sigterm": signal.SIGTERM}.get(end)
        if number is None:
            running.press_enter()
            assert running.process.wait(PATIENCE) == 0
        else:
            assert running.end(number) == 128 + number
        assert "messages" in running.err.until("recording  ")
    assert summary_of(read_recording(path)).is_complete


@pytest.mark.parametrize(
    ("tokens", "message"),
    [
        (["run.txt"], "its name must end in .mcap"),
        ([], "elib record needs FILE"),
        (["run.mcap", "proximty"], "did you mean 'proximity'?"),
        (["run.mcap", "--rate", "0"], "rate is 0.0 Hz"),
        (["run.mcap", "--for", "0"], "--for is 0.0 s"),
        (["run.mcap", "--keep", "3"], "keep counts parts"),
        (["there.mcap"], "'there.mcap' exists; a recording never replaces a file"),
        (["none/run.mcap", "--robot", FAST], "none/run.mcap cannot be written: No such file or directory"),
    ],
)
def test_a_wrong_call_is_told_what_is_wrong(
    refused: Told, tokens: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.mcap").touch()
    robot = [] if "--robot" in tokens else ["--robot", "tcp://127.0.0.1:9"]
    assert message in refused("record", *tokens, *robot)
    assert [each.name for each in tmp_path.iterdir()] == ["there.mcap"]


# -- elib record info ------------------------------------------------------------------------------------------------


@pytest.fixture
def run(tmp_path: Path) -> Path:
    path = tmp_path / "run.mcap"
    with elib.connect(FAST) as robot, robot.record(path) as recorder:
        for number in range(25):
            robot.proximity()
            robot.sleep(0.1)
            recorder.note(f"note {number}")
    return path


def test_info_says_what_was_recorded(printed: Told, run: Path) -> None:
    out = printed("record", "info", run)
    assert "robot     sim://?speed=max (asercom-1.2.2)" in out
    assert "world     arena, seed 1" in out
    assert re.search(r"duration  2\.\d+ s of robot time", out)
    assert "state     complete" in out
    assert re.search(r"/readings/proximity +25 +\d+\.\d\d /s", out)
    assert "note      note 19" in out
    assert "note 20" not in out
    assert "and 5 more notes; --json has them all" in out


def test_the_json_of_info_has_this_shape(printed: Told, run: Path) -> None:
    found = json.loads(printed("record", "info", run, "--json"))
    assert list(found) == ["about", "duration", "complete", "parts", "topics", "notes"]
    assert found["about"]["firmware"] == "asercom-1.2.2"
    assert found["complete"] is True
    assert [list(part) for part in found["parts"]] == [["path", "bytes", "complete", "damaged", "readable_bytes"]]
    assert found["topics"]["/calls"] == {"messages": 25, "rate": pytest.approx(25 / found["duration"], rel=1e-4)}
    assert len(found["notes"]) == 25
    assert found["notes"][3]["text"] == "note 3"


def test_info_about_a_file_that_is_not_a_recording_is_an_error_in_words(refused: Told, tmp_path: Path) -> None:
    (tmp_path / "text.mcap").write_text("no recording")
    for name in ("none.mcap", "text.mcap"):
        assert name in refused("record", "info", tmp_path / name)


# -- elib record repair ----------------------------------------------------------------------------------------------


def test_a_cut_file_is_made_whole_beside_the_old_one(
    printed: Told, refused: Told, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = run.with_name("cut.mcap")
    cut.write_bytes(run.read_bytes()[:-100])
    assert "not complete: elib record repair FILE repairs it" in printed("record", "info", cut)
    assert main(["record", "repair", str(cut)]) == 0
    out, err = capsys.readouterr()
    assert out == ""
    assert re.match(r"lost: 0 damaged pieces inside and the last \d+ bytes of \d+\nwrote ", err)
    assert summary_of(read_recording(run.with_name("cut.repaired.mcap"))).is_complete
    assert "exists; a recording never replaces a file" in refused("record", "repair", cut)
    assert main(["record", "repair", str(cut), "-o", str(run.with_name("new.mcap"))]) == 0


def test_a_whole_file_has_lost_nothing(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["record", "repair", str(run)]) == 0
    assert "is complete; nothing was lost" in capsys.readouterr().err


# -- --log and --record everywhere -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tokens", "command"),
    [
        (["demo", "--for", "2"], "proximity"),
        (["watch", "selector", "--once"], "selector"),
        (["bench", "--count", "1"], "set_speed"),
        (["send", "proximity"], "proximity"),
        (["run", "avoid", "--for", "2", "--robot", FAST], "proximity"),
        (["run", "go-x-cm", "--for", "2", "--robot", FAST], "set_speed"),
    ],
)
def test_every_program_logs_and_records(
    tokens: list[str], command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    robot = [] if "--robot" in tokens else ["--robot", FAST]
    assert main([*tokens, *robot, "--log", "run.log", "--record", "run.mcap"]) == 0
    assert command in commands(tmp_path / "run.mcap")
    assert summary_of(read_recording(tmp_path / "run.mcap")).is_complete
    lines = (tmp_path / "run.log").read_text().splitlines()
    assert sum(" call " in line for line in lines) == len(commands(tmp_path / "run.mcap"))


@pytest.mark.parametrize("program", ["demo --for 1", "watch proximity --once", "bench --count 1", "run avoid --for 1"])
def test_every_program_logs_with_the_names_of_2011_if_asked(program: str, tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    assert main([*program.split(), "--robot", FAST, "--log", str(log), "--log-names", "2011"]) == 0
    header, *rows = log.read_text().splitlines()
    assert header == "# elib log 1, names: 2011"
    assert all(row.split()[3].endswith(")") for row in rows if not row.startswith("#"))


@pytest.mark.parametrize("program", ["demo", "watch", "bench", "run avoid", "send selector"])
def test_a_file_that_cannot_be_written_is_reported_before_anything_moves(
    refused: Told, program: str, tmp_path: Path
) -> None:
    (tmp_path / "run.mcap").touch()
    robot = ["--robot", "tcp://127.0.0.1:9"]
    assert "exists; a recording never replaces a file" in refused(
        *program.split(), *robot, "--record", tmp_path / "run.mcap"
    )


def test_a_log_that_cannot_be_written_is_a_wrong_call(refused: Told, tmp_path: Path) -> None:
    for program in (["run", "avoid", "--for", "1"], ["send", "selector"]):
        assert f"there is no folder '{tmp_path / 'none'}' for the log" in refused(
            *program, "--robot", FAST, "--log", str(tmp_path / "none" / "run.log")
        )


def test_the_states_and_messages_of_a_behaviour_are_notes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "run.mcap"
    assert main(["run", "avoid", "--for", "20", "--robot", FAST, "--record", str(path)]) == 0
    assert ("state", "roaming") in notes(path)
    assert "recording" in capsys.readouterr().err
    assert read_recording(path).path(measured=True)[0].time <= read_recording(path).began
    spoken = tmp_path / "spoken.mcap"
    assert main(["run", "sensors-tour", "--for", "5", "--robot", FAST, "--record", str(spoken)]) == 0
    said = capsys.readouterr().err
    words = [text for kind, text in notes(spoken) if kind == "note"]
    assert words
    assert all(text in said for text in words)


def test_each_robot_of_a_swarm_has_a_file_of_its_own_and_all_share_a_log(tmp_path: Path) -> None:
    robot = "sim://crowd?robots=3&speed=max"
    files = ["--record", str(tmp_path / "run.mcap"), "--log", str(tmp_path / "run.log")]
    assert main(["run", "aggregation", "--for", "2", "--robot", robot, *files]) == 0
    names = sorted(each.name for each in tmp_path.glob("*.mcap"))
    assert names == [f"run-epuck-{number}.mcap" for number in (1, 2, 3)]
    assert [read_recording(tmp_path / name).about["robot"] for name in names] == ["epuck-1", "epuck-2", "epuck-3"]
    assert all(("state", "gathering") in notes(tmp_path / name) for name in names)
    rows = [line for line in (tmp_path / "run.log").read_text().splitlines() if not line.startswith("#")]
    assert {row.split()[1] for row in rows} == {
        "epuck-1",
        "epuck-2",
        "epuck-3",
    }


def test_a_robots_name_becomes_part_of_a_files_name() -> None:
    assert own_name("run.mcap", "sim://x?y=1") == "run-sim---x-y-1.mcap"


def test_raw_bytes_have_no_calls_to_keep(refused: Told, tmp_path: Path) -> None:
    assert find("port-turn-around").name == "port-turn-around"
    assert "there are no calls to log or record" in refused(
        "run", "port-turn-around", "--robot", FAST, "--record", tmp_path / "run.mcap"
    )


def test_a_program_of_ones_own_takes_both_options(tmp_path: Path) -> None:
    async def drive(robot: elib.Epuck) -> str:
        await robot.set_speed(0.1, 0.1)
        return robot.firmware

    options = ["--robot", FAST, "--log", str(tmp_path / "run.log"), "--record", str(tmp_path / "run.mcap")]
    assert elib.run(drive, argv=options) == "asercom-1.2.2"
    assert commands(tmp_path / "run.mcap") == ["set_speed", "stop"]
    assert (tmp_path / "run.log").read_text().count("call") == 2
    with pytest.raises(SystemExit) as ended:
        elib.run(drive, argv=options)
    assert ended.value.code == 2
