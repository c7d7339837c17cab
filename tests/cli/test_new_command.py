"""``elib new``: samples to start from."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from elib_process import Told, elib, environment

from elib.behaviours import behaviours
from elib.cli import main
from elib.cli.new import samples
from lanes import short
from shared import run

FAST = "sim://arena?speed=max"


PROGRAMS = ["avoid", "explore", "square", "states"]
FROM_BEHAVIOURS = [name for name in behaviours() if name not in PROGRAMS]
QUICK = ("bull", "wall-following", "go-to-light", "port-turn-around", "aggregation")
"""Behaviours of every style; the others go the same way."""


def test_the_list_has_every_sample_with_what_it_does(printed: Told) -> None:
    lines = [line for line in printed("new", "--list").splitlines() if not line.startswith(" ")]
    assert [line.split()[0] for line in lines] == list(samples()) == PROGRAMS + FROM_BEHAVIOURS
    assert "avoid what is near" in lines[0]


def test_the_copy_of_a_behaviour_takes_its_options_and_shows_its_states_as_the_behaviour_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "bull", "my_bull.py"]) == 0
    told = []
    for words in (["bull", "--red", "0.9", "--seed", "3"], ["my_bull.py", "--", "--red", "0.9", "--seed", "3"]):
        capsys.readouterr()
        at = ["--robot", "sim://?speed=max", "--for", "20"]
        assert main(["run", words[0], *at, *words[1:]]) == 0
        told.append(capsys.readouterr())
    assert told[0] == told[1]
    assert "states      waking 0.5 s, searching 1" in told[0].err
    assert "charging" not in told[0].err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--nonsense"], "Unknown option: --nonsense"),
        (["left"], "elib run bull.py -- takes no 'left'\nhint: elib run bull.py -- --help"),
        (["--red", "7"], "red is 7; it must be a number from 0.01 to 0.9"),
        (["--red"], "--red needs a value"),
    ],
)
def test_a_wrong_option_of_a_copy_is_refused(
    words: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "bull"]) == 0
    assert main(["run", "bull.py", "--robot", "tcp://127.0.0.1:9", "--", *words]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("name", short(FROM_BEHAVIOURS, *QUICK))
def test_the_copy_of_a_behaviour_runs_as_it_is(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", name, "mine.py"]) == 0
    assert main(["run", "mine.py", "--robot", "sim://?speed=max", "--for", "1"]) == 0
    assert "robot time" in capsys.readouterr().err


def test_the_line_to_type_for_a_name_with_a_space_can_be_pasted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, printed: Told, refused: Told
) -> None:
    monkeypatch.chdir(tmp_path)
    assert printed("new", "avoid", "my robot.py").endswith("try: elib run 'my robot.py'\n")
    assert "elib new avoid 'my robot.txt.py'" in refused("new", "avoid", "my robot.txt")
    assert "to run the file: elib run 'my robot.py'" in refused("run", "my robot")
    assert main(["new", "bull", "my bull.py"]) == 0
    assert "elib run 'my bull.py' -- --help" in refused("run", "my bull.py", "--robot", "sim://", "--", "left")
    assert printed("lab", "new", "square", "my lab").endswith("elib lab check 'my lab/start.py'\n")
    assert "elib lab check 'my lab/start.py'" in refused("lab", "check", "my lab")
    assert "elib run 'my lab/my_robot.py'" in refused("run", "my lab")


@pytest.mark.parametrize("name", short(PROGRAMS, "square", "states"))
def test_a_sample_runs_as_it_is_by_python_and_by_elib_run(name: str, tmp_path: Path) -> None:
    assert elib("new", name, "my_robot.py", cwd=tmp_path).stdout == "wrote my_robot.py; try: elib run my_robot.py\n"
    assert (tmp_path / "my_robot.py").read_text() == samples()[name]
    python = [sys.executable, "my_robot.py"]
    done = run(python, cwd=tmp_path, env=environment(ELIB_ROBOT=FAST))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout
    done = elib("run", "my_robot.py", "--robot", FAST, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["distance"] > 0.3
    assert summary["robots"][0]["link"]["lost"] == 0


def test_nothing_is_replaced(refused: Told, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "avoid.py").write_text("mine")
    monkeypatch.chdir(tmp_path)
    assert "avoid.py exists already" in refused("new", "avoid")
    assert (tmp_path / "avoid.py").read_text() == "mine"


@pytest.mark.parametrize(
    ("tokens", "message"),
    [
        (["avid"], "did you mean avoid?"),
        (["bul"], "did you mean bull?"),
        ([], "elib new --list lists them"),
        (["avoid", "robot"], "it must end in .py\nhint: elib new avoid robot.py"),
        (["avoid", "nowhere/robot.py"], "does its folder exist?"),
    ],
)
def test_a_wrong_call_says_what_is_meant(
    refused: Told, tokens: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert message in refused("new", *tokens)
    assert list(tmp_path.iterdir()) == []
