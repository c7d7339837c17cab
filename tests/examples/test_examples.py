"""Every example runs on the simulator as it is, is short, and says in one sentence what it shows."""

import ast
import logging
import re
import runpy
import sys
from pathlib import Path

import pytest

import elib
from lanes import short

EXAMPLES = Path(__file__).parents[2] / "examples"
SHOWS = {
    "01_hello.py": ["asercom-1.2.2 at sim://", "front right", "accelerometer in g: ", "selector at 3"],
    "02_drive.py": ["corner 1 after", "corner 4 after"],
    "03_avoid.py": ["wandered for 10.0 s"],
    "04_camera.py": ["52 x 39 pixels"],
    "05_begin_end.py": ["the sum is 332833500; the picture has 40 columns", "front right"],
    "06_callbacks.py": ["first: front right", "hasty: proximity() did not end within 0.0001 s", "last: front right"],
    "07_failures.py": ["readings", "a wrong call: left is 3 rev/s", "a missing device: distance()"],
    "08_several_robots.py": ["epuck-1: nearest", "epuck-2: nearest", "epuck-3: nearest"],
    "09_tasks.py": ["something is near after"],
    "10_emulated_robot.py": [
        r"selector: b'c,7\r\n'",
        "ring LEDs: [0, 0, 1, 0, 0, 0, 0, 0]",
        r"steps: b'q,500,500\r\n'",
    ],
    "11_reconnecting.py": [
        "no link in time: set_speed(0, 0) was never sent",
        "20 columns",
        "3.0 s: LinkDown",
        "LinkBack",
    ],
    "12_watch.py": ["(something is near)", "pictures"],
    "13_link_faults.py": ["answers lost", "failures met", "passed"],
    "14_swarm.py": ["8 robots, epuck-1 to epuck-8", "they drove", "8 told their battery, 0 did not"],
    "15_motion.py": [
        "corner 4: x 0.0 cm, y 0.0 cm, 0 degrees",
        "home: x 0.0 cm, y 0.0 cm, 0 degrees",
        "it stands still",
    ],
    "16_behaviour.py": ["ended by time after 30.0 s", "driving", "turning"],
    "17_record.py": [
        "asercom-1.2.2 in the world arena",
        "pieces of bytes",
        "s  something is near: turn",
        "it ended at x",
    ],
    "18_replay.py": ["the same again: True", "from further off: True"],
    "19_learn.py": ["generation 20: best", "the best one drove for 20 s"],
}
"""What each prints, in parts."""
WITHOUT_ROBOT = {"10_emulated_robot.py"}
"""Its robot is on the bench: nothing is opened."""
QUICK = {*SHOWS} - {"19_learn.py"}
"""All but the one that compiles, which takes a minute."""


@pytest.fixture
def run(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
):
    def run_example(name: str, *arguments: str) -> str:
        path = EXAMPLES / name
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", [str(path), *arguments])
        runpy.run_path(str(path), run_name="__main__")
        assert [record for record in caplog.records if record.levelno >= logging.ERROR] == []
        said = capsys.readouterr()
        assert [line for line in said.err.splitlines() if not line.startswith("elib: compiling ")] == []
        return said.out

    return run_example


def test_every_example_is_known_here() -> None:
    assert sorted(path.name for path in EXAMPLES.glob("*.py")) == sorted(SHOWS)


@pytest.mark.parametrize("name", short(SHOWS, *QUICK))
def test_an_example_runs_and_shows_what_it_should(name: str, run, tmp_path: Path) -> None:
    printed = run(name)
    for part in SHOWS[name]:
        assert part in printed
    if name == "02_drive.py":
        times = [float(line.split()[3]) for line in printed.splitlines()]
        parts = [after - before for before, after in zip([0.0, *times], times, strict=False)]
        assert max(parts) - min(parts) < 0.2
    if name == "04_camera.py":
        assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", short(sorted({*SHOWS} - WITHOUT_ROBOT), *QUICK))
def test_every_example_opens_the_robot_that_the_command_line_names_and_refuses_what_it_does_not_know(
    name: str, run, capsys: pytest.CaptureFixture[str]
) -> None:
    for arguments in (["sim://nowhere"], ["--robot", "sim://nowhere"]):
        with pytest.raises((elib.LinkNotFound, SystemExit)) as caught:
            run(name, *arguments)
        assert "no world 'nowhere'" in str(caught.value) + capsys.readouterr().err
    with pytest.raises(SystemExit) as caught:
        run(name, "--robott", "sim://?speed=max")
    assert caught.value.code == 2
    assert "did you mean --robot?" in capsys.readouterr().err


def test_every_example_opens_with_one_sentence_fits_a_screen_and_says_what_must_be_installed() -> None:
    extras = {"17_record.py": "record", "18_replay.py": "record", "19_learn.py": "learn"}
    for name in SHOWS:
        source = (EXAMPLES / name).read_text()
        doc = ast.get_docstring(ast.parse(source))
        assert doc, name
        assert doc.endswith("."), name
        assert "\n" not in doc, name
        assert 5 <= len(source.splitlines()) <= 40, name
        assert re.findall(r"the extra ``(\w+)``", doc) == ([extras[name]] if name in extras else []), name
