"""``elib lab``: list, new and check."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from elib_process import COMMAND, Told

from elib.cli import main
from elib.lab import load_lab
from elib.lab.result import digest_of
from shared import PATIENCE

GOOD = "import elib\nprint('off we go')\nwith elib.connect() as robot:\n    robot.drive(0.1)\n"
BAD = "import elib\n\ndef go():\n    raise ValueError('no way')\n\ngo()\n"
DEFINED = "async def main(robot):\n    await robot.drive(0.1)\n"
BEHAVIOUR = "import elib\n\n@elib.behaviour\nasync def go(robot: elib.Epuck) -> None:\n    await robot.drive(0.1)\n"


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    assert main(["lab", "new", "go-10-cm", str(tmp_path / "mine")]) == 0
    return tmp_path / "mine"


def check(lab: Path, program: str, *options: str) -> int:
    (lab / "mine.py").write_text(program)
    return exit_of(["lab", "check", str(lab / "mine.py"), *options])


def exit_of(line: list[str]) -> int:
    try:
        return main(line)
    except SystemExit as ending:
        return int(ending.code or 0)


def test_the_labs_are_listed(printed: Told) -> None:
    assert "go-10-cm" in printed("lab", "list")
    assert "go-10-cm" in [each["name"] for each in json.loads(printed("lab", "list", "--json"))["labs"]]


def test_a_new_lab_has_all_but_the_teachers_part(printed: Told, refused: Told, lab: Path) -> None:
    assert {"README.md", "lab.toml", "start.py", "worlds"} <= {each.name for each in lab.iterdir()}
    assert not (lab / "teacher").exists()
    assert "is there already" in refused("lab", "new", "go-10-cm", lab)
    assert f"elib lab check {lab.parent / 'ours' / 'start.py'}" in printed(
        "lab", "new", "go-10-cm", str(lab.parent / "ours"), "--teacher"
    )
    assert (lab.parent / "ours" / "teacher" / "solution.py").is_file()
    assert "did you mean go-10-cm?" in refused("lab", "new", "go-11-cm")


def test_a_check_names_each_goal_and_what_happened(lab: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert check(lab, GOOD) == 0
    told = capsys.readouterr().out
    assert "off we go" in told
    assert "ended 0.100 m ahead" in told
    assert "5 of 5 points, all goals hold" in told
    assert (lab / "mine.png").read_bytes().startswith(b"\x89PNG")


def test_the_first_program_fails_and_the_exit_code_says_so(lab: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_of(["lab", "check", str(lab / "start.py")]) == 1
    assert "no   The robot ends 10 cm ahead" in capsys.readouterr().out


def test_a_goal_that_fails_gives_none_of_its_points(lab: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert check(lab, GOOD) == 0
    told = capsys.readouterr().out
    assert told.startswith("Go 10 cm\n")  # a name only where there is more than one variant
    assert "its wheels stand (1 point)" in told
    assert check(lab, GOOD.replace("0.1", "0.2")) == 1
    told = capsys.readouterr().out
    assert "(0 of 3 points)" in told
    assert "(0 of 1 point)" in told


@pytest.mark.parametrize("program", ["def main(robot):\n    robot.drive(0.1)\n", "print('hello')\n"])
def test_a_program_that_opens_no_robot_is_told_so(lab: Path, program: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert check(lab, program) == 1
    assert "The program did not open a robot" in capsys.readouterr().err
    assert check(lab, GOOD) == 0
    assert "did not open" not in capsys.readouterr().err


def test_a_program_that_fails_shows_its_own_lines(lab: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert check(lab, BAD) == 1
    error = capfd.readouterr().err
    assert "line 4, in go" in error
    assert "ValueError: no way" in error
    assert "runpy" not in error
    assert "elib/lab" not in error


@pytest.mark.parametrize("program", [DEFINED, BEHAVIOUR])
def test_a_program_that_only_defines_what_drives_is_run(
    lab: Path, program: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert check(lab, program) == 0, capsys.readouterr().out


def test_a_program_goes_on_when_nobody_reads_any_more_what_it_prints(lab: Path) -> None:
    (lab / "mine.py").write_text(
        "import os, time\nwhile not os.path.exists('closed'):\n    time.sleep(0.01)\n"
        f"{GOOD}print('there')\nopen('done', 'w').close()\n"
    )
    process = subprocess.Popen(
        [*COMMAND, "lab", "check", str(lab / "mine.py")], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    assert process.stdout.readline()
    process.stdout.close()
    (lab / "closed").touch()
    _, complaint = process.communicate(timeout=PATIENCE)
    assert complaint == b""
    assert (lab / "done").exists()


def test_a_check_as_json(lab: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert check(lab, GOOD, "--json") == 0
    told = capsys.readouterr()
    found = json.loads(told.out)
    assert (found["passed"], found["points"], found["of"]) == (True, 5, 5)
    assert [each["name"] for each in found["variants"][0]["goals"]] == ["go-10-cm", "stop", "end"]
    assert "off we go" in told.err


def test_what_is_wrong_with_the_line_is_said_before_anything_runs(
    lab: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for options, message in (
        (["--variant", "empty flor"], "did you mean empty floor?"),
        (["--lab", "nowhere"], "there is no lab 'nowhere'"),
        (["--lab", "sqare"], "did you mean square?"),
        (["--wall", "0"], "--wall is 0"),
    ):
        assert check(lab, GOOD, *options) == 2, options
        assert message in capsys.readouterr().err
    for name, message in (
        ("nothing.py", "there is no program"),
        ("README.md", "does not end in .py"),
        ("", f"is a folder\nhint: name the program in it: elib lab check {lab / 'start.py'}"),
        ("worlds", "is a folder"),
    ):
        assert exit_of(["lab", "check", str(lab / name)]) == 2
        assert message in capsys.readouterr().err
    assert not list(lab.glob("*.png"))


def test_a_program_that_opens_a_second_robot_is_told_what_to_do(lab: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert check(lab, "import elib\none = elib.connect()\nother = elib.connect()\n") == 1
    error = capfd.readouterr().err
    assert "the program opens one more robot, but the lab names only one" in error
    assert "hint: open a robot once" in error
    assert "lockstep" not in error


def test_goals_begin_a_line_also_after_words_without_an_end(lab: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert check(lab, f"{GOOD}print('done', end='')\n") == 0
    assert "done\n  yes" in capsys.readouterr().out


def test_a_folder_that_cannot_be_made_is_named(refused: Told, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert "square cannot be made: " in refused("lab", "new", "square", str(tmp_path / "file" / "square"))


def test_the_list_of_commands_says_what_each_does(printed: Told) -> None:
    assert "mark   Mark all submissions in a folder" in printed("lab", "--help")


def test_another_lab_can_be_named(lab: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (lab.parent / "elsewhere.py").write_text(GOOD)
    assert exit_of(["lab", "check", str(lab.parent / "elsewhere.py")]) == 2
    assert "--lab" in capsys.readouterr().err
    assert exit_of(["lab", "check", str(lab.parent / "elsewhere.py"), "--lab", "go-10-cm"]) == 0


def test_the_picture_of_a_lab_is_drawn_again_with_its_zones(lab: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lab", "new", "out-of-the-maze", str(lab.parent / "maze")]) == 0
    picture = lab.parent / "maze" / "world.svg"
    before = picture.read_text()
    assert main(["lab", "draw", str(lab.parent / "maze")]) == 0
    assert f"drawn in {picture}" in capsys.readouterr().out
    assert picture.read_text().rstrip() == before.rstrip()
    text = (lab.parent / "maze" / "lab.toml").read_text()
    (lab.parent / "maze" / "lab.toml").write_text(text.replace("[0.7, 0.1]", "[0.1, 0.1]"))
    assert main(["lab", "draw", str(lab.parent / "maze")]) == 0
    assert picture.read_text().rstrip() != before.rstrip()
    assert main(["lab", "draw", str(lab.parent / "none")]) == 2


def result(program: str, *, digest: str = "", claims: bool = True) -> str:
    """Return the file of a check in a browser, which says that all goals hold, or that none does."""
    lab = load_lab("go-10-cm", hidden=True)
    verdicts = {variant.name: {goal.name: claims for goal in lab.goals} for variant in lab.variants}
    return json.dumps({"lab": lab.name, "digest": digest or digest_of(lab), "program": program, "verdicts": verdicts})


@pytest.mark.parametrize(
    ("program", "digest", "claims", "code", "says"),
    [
        (GOOD, "", True, 0, ""),
        (BAD, "", True, 1, "was not believed: the check found something else."),
        pytest.param(GOOD, "", False, 0, "was not believed: the check found something else.", marks=pytest.mark.long),
        (BAD, "0", True, 1, "was not believed: it is of a lab of this name with other goals or worlds."),
    ],
)
def test_a_result_of_the_browser_is_judged_anew(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    program: str,
    digest: str,
    claims: bool,
    code: int,
    says: str,
) -> None:
    file = tmp_path / "anna-result.json"
    file.write_text(result(program, digest=digest, claims=claims))
    assert exit_of(["lab", "check", str(file)]) == code
    told = capfd.readouterr()
    assert "Go 10 cm: another firmware" in told.out  # a hidden variant
    assert f"{5 if code == 0 else 0} of 5 points" in told.out
    assert says in told.err
    assert ("was not believed" in told.err) == bool(says)
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".json", ".png", ".png", ".png"]


@pytest.mark.parametrize(
    "content", [b"", b"{}", b'{"lab": 7}', b"[" * 100_000, b'{"x": ' + b"[" * 100_000, b'{"lab": "\xff"}'], ids=range(6)
)
def test_what_is_no_result_is_refused(tmp_path: Path, refused: Told, content: bytes) -> None:
    file = tmp_path / "anna-result.json"
    file.write_bytes(content)
    assert "is not the result of a check" in refused("lab", "check", file)
