"""``elib replay``: lines, JSON, the page on a terminal, the picture, and going on in the simulator."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
from pathlib import Path
from urllib.request import urlopen

import pytest
from elib_process import COMMAND, Told

from elib.cli import main
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from shared import PATIENCE, needs_page


@pytest.fixture(name="file", scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("runs") / "run.mcap"

    async def program(robot: Epuck) -> None:
        recorder = robot.record(path)
        recorder.note("driving", kind="state")
        await robot.set_speed(0.3, 0.3)
        for _ in range(4):
            await robot.proximity()
            await robot.sleep(0.5)
        recorder.note("nearly there")

    run_on("sim://square?speed=max", program)
    return str(path)


def test_without_a_terminal_everything_is_printed_at_once(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", file]) == 0
    out, err = capsys.readouterr()
    lines = out.splitlines()
    assert lines[0] == "    0.000 s  state: driving"
    assert lines[1].endswith(" ms")
    assert "set_speed(0.3, 0.3)  ok, " in lines[1]
    assert sum("proximity()" in line for line in lines) == 4
    assert err.startswith("run.mcap: sim://square?speed=max (asercom-1.2.2) in square, 2.")


def test_from_to_and_only_choose(printed: Told, file: str) -> None:
    assert len(printed("replay", file, "--from", "0.4", "--to", "1.1", "--only", "call").splitlines()) == 2
    assert [line.split("  ")[-1] for line in printed("replay", file, "--only", "state,note").splitlines()] == [
        "state: driving",
        "note: nearly there",
    ]


def test_as_json_each_line_is_an_object(printed: Told, file: str) -> None:
    found = [json.loads(line) for line in printed("replay", file, "--json").splitlines()]
    assert [each["kind"] for each in found][:2] == ["state", "call"]
    assert found[1]["speed"] == [0.3, 0.3]
    assert len(found[2]["readings"]["proximity"]) == 8


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--only", "sound"], "--only has 'sound'"),
        (["--from", "3", "--to", "2"], "there is nothing from 3 s to 2 s"),
        (["--from", "nan"], "there is nothing from nan s"),
        (["--for", "3"], "--for needs --fork-at"),
        (["--fork-at", "1", "--json"], "--json chooses lines, but --fork-at prints none"),
        (["--plot", "run.png", "--from", "1"], "--from chooses lines, but --plot prints none"),
        (["--fork-at", "99"], "s long; 99 s is not in it"),
        (["--fork-at", "1", "--behaviour", "sleep"], "sleep"),
        (["--plot", "run.doc"], "cannot become 'run.doc'"),
    ],
)
def test_impossible_options_are_reported(refused: Told, file: str, words: list[str], message: str) -> None:
    assert message in refused("replay", file, *words)


def test_a_file_that_is_not_a_recording_is_reported(refused: Told, tmp_path: Path) -> None:
    assert "cannot be read" in refused("replay", tmp_path / "none.mcap")


def test_the_picture_shows_the_run(file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "run.svg"
    assert main(["replay", file, "--plot", str(picture)]) == 0
    text = picture.read_text()
    assert text.count("<path") > 50
    assert "<image" in text  # the map
    assert "plot " in capsys.readouterr().err


def test_a_fork_drives_on_as_the_robot_did(printed: Told, file: str) -> None:
    lines = printed("replay", file, "--fork-at", "1", "--for", "2").splitlines()
    places = [float(line.split("x ")[1].split(" m")[0]) for line in lines]
    times = [float(line.split()[0]) for line in lines]
    assert times[0] == pytest.approx(1.2, abs=0.02)
    assert times[-1] == pytest.approx(3.2, abs=0.02)
    assert places[-1] - places[0] == pytest.approx(2 * 0.3 * 0.1288, abs=0.003)


def test_a_behaviour_goes_on_from_a_moment(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", file, "--fork-at", "1", "--behaviour", "avoid", "--for", "2"]) == 0
    err = capsys.readouterr().err
    assert "robot time  2.0 s" in err


@needs_page
@pytest.mark.skipif(sys.platform == "win32", reason="needs ptys")
def test_on_a_terminal_the_page_plays_it(file: str) -> None:
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [*COMMAND, "replay", file],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env={**os.environ, "TERM": "xterm", "BROWSER": "true"},
    )
    os.close(theirs)
    seen = b""
    try:
        while not (found := re.search(rb"http://\S+", seen)) or not seen.endswith(b"\n"):
            assert select.select([ours], [], [], PATIENCE)[0], seen.decode()
            seen += os.read(ours, 4096)
        assert seen.startswith(b"run.mcap: sim://square")
        with urlopen(found[0].decode(), timeout=PATIENCE) as page:
            assert b"<title>elib</title>" in page.read()
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0
    finally:
        process.kill()
        process.wait(PATIENCE)
        os.close(ours)
