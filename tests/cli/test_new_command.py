"""``elib new``: samples to start from."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from elib_process import Told, elib, environment

from elib.cli.new import samples
from shared import run

FAST = "sim://arena?speed=max"


def test_the_list_has_every_sample_with_what_it_does(printed: Told) -> None:
    lines = printed("new", "--list").splitlines()
    assert [line.split()[0] for line in lines] == list(samples()) == ["avoid", "explore", "square"]
    assert "avoid what is near" in lines[0]


@pytest.mark.parametrize("name", samples())
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
