"""``elib demo``: a run, a picture, a summary."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import pytest
from elib_process import Told, elib, started
from PIL import Image as Pillow

from elib.base.errors import ArgumentError
from elib.cli import main
from elib.cli.demo import PICTURE, command_name, what_next, with_seed


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_it_draws_the_true_path_and_sums_up_on_one_screen(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--for", "20"]) == 0
    out, err = capsys.readouterr()
    lines = (err + out).splitlines()
    assert len(lines) <= 24
    assert all(len(line) <= 80 for line in lines)
    assert lines[0] == "avoid on sim://?speed=max for 20 s; Ctrl-C stops it"
    driven = re.search(r"distance +([\d.]+) m, by the simulated world", err)
    assert driven is not None
    assert 1.0 < float(driven[1]) < 20 * 0.6 * 0.1288
    assert "contacts" not in err
    assert "0 answers lost" in err
    assert "elib-demo.png" in out
    assert all(step in out for step in ("elib simulate", "elib send", "--robot serial:///dev/rfcomm0"))
    assert "\x1b" not in out + err
    with Pillow.open(here / PICTURE) as picture:
        assert picture.format == "PNG"
        assert min(picture.size) >= 600
        assert len(picture.convert("RGB").getcolors(1 << 24)) > 20


def test_the_same_seed_gives_the_same_run_and_another_seed_another(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pictures, told = [], []
    for seed in ("5", "5", "6"):
        assert main(["demo", "--for", "3", "--seed", seed]) == 0
        pictures.append((here / PICTURE).read_bytes())
        told.append(capsys.readouterr().err)
    assert pictures[0] == pictures[1] != pictures[2]
    assert told[0] == told[1]


@pytest.mark.long
def test_a_robot_without_a_world_is_followed_by_what_its_wheels_were_told(here: Path) -> None:
    with started("simulate", "--tcp", "0", "--speed", "10") as server:
        url = server.out.line().split()[1]
        done = elib("demo", "--robot", url, "--for", "2", cwd=here)
        assert server.end() == 0
    assert done.returncode == 0, done.stderr
    assert "as the wheels were told" in done.stderr
    assert (here / PICTURE).exists()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_picture_that_cannot_be_written_is_a_failure_after_the_summary(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    here.chmod(0o500)
    assert main(["demo", "--for", "2"]) == 2
    err = capsys.readouterr().err
    assert "distance" in err
    assert "\nerror: " in err


def test_a_picture_whose_name_is_taken_by_a_folder_is_a_failure_after_the_summary(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / PICTURE).mkdir()
    assert main(["demo", "--for", "2"]) == 2
    err = capsys.readouterr().err
    assert "distance" in err
    assert err.splitlines()[-1] == "error: 'elib-demo.png' is a directory; the output needs a file"


@pytest.mark.parametrize(
    ("tokens", "code", "message"),
    [
        (["--for", "-1"], 2, "--for is -1.0 s"),
        (["--seed", "-1"], 2, "seed is -1; it must be a whole number from 0"),
        (["--seed", "one"], 2, "--seed"),
        (["--seed", "1", "--robot", "tcp://127.0.0.1:9"], 2, "is not a simulation"),
        (["--robot", "tcp://127.0.0.1:9"], 1, "127.0.0.1:9"),
    ],
)
def test_a_demo_that_cannot_run_says_why_and_draws_nothing(
    refused: Told, tokens: list[str], code: int, message: str, here: Path
) -> None:
    assert message in refused("demo", *tokens, code=code)
    assert not (here / PICTURE).exists()


def test_a_seed_goes_into_the_url_and_replaces_the_one_that_is_there() -> None:
    assert with_seed("sim://?speed=max", None) == "sim://?speed=max"
    assert with_seed("sim://square?speed=max&seed=1", 7) == "sim://square?speed=max&seed=7"
    with pytest.raises(ArgumentError):
        with_seed("serial:///dev/rfcomm0", 1)


def test_what_comes_next_can_be_pasted_as_it_stands(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    programs = here / ".venv/bin"
    programs.mkdir(parents=True)
    (programs / "elib").touch(0o755)
    monkeypatch.setattr(sys, "argv", [".venv/bin/elib", "demo"])
    monkeypatch.setenv("PATH", "/nowhere")
    assert command_name() == ".venv/bin/elib"
    assert what_next()[0][0] == ".venv/bin/elib send proximity"  # an elib that is in no environment
    (programs / "activate").touch()
    assert [typed for typed, _ in what_next()][:2] == [". .venv/bin/activate", ".venv/bin/elib send proximity"]
    monkeypatch.setenv("PATH", str(programs))
    assert command_name() == "elib"
    assert what_next()[0][0] == "elib send proximity"
    other = here / "other"
    other.mkdir()
    (other / "elib").touch(0o755)
    monkeypatch.setenv("PATH", str(other))
    assert command_name() == ".venv/bin/elib"
    monkeypatch.setattr(sys, "argv", ["/my robots/.venv/bin/elib", "demo"])
    assert command_name() == "'/my robots/.venv/bin/elib'"
    monkeypatch.setattr(sys, "argv", ["/there/elib/__main__.py", "demo"])
    assert command_name() == f"{sys.executable} -m elib"
