from __future__ import annotations

import csv
import json
import os
import pty
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from hostile import HONEST, HOSTILE, runs
from labs_for_tests import WORLD

from elib.base.errors import ArgumentError
from elib.cli import main
from elib.cli.labmark import print_table
from elib.lab import load_lab
from elib.lab.goal import MISSED, GoalResult
from elib.lab.marking import Mark, mark, mark_all
from elib.lab.marksheet import to_html, to_rows
from elib.lab.mistakes import also_failed, wrong_claim
from elib.lab.sandbox import LIMITS, Limits, family
from elib.lab.submissions import find_submissions
from lanes import short
from shared import PATIENCE, run, wait_until

isolated = pytest.mark.usefixtures("walls")

LAB = """
title = "Ten <b>centimetres"
summary = "Drive 10 cm."
time = 5

[[goal]]
name = "ahead"
kind = "moved"
ahead = 0.1
points = 3

[[goal]]
name = "end"
kind = "survives"
needs = ["ahead"]

[[variant]]
name = "given"
world = "world.toml"
"""
HIDDEN = '[[variant]]\nname = "hidden"\nworld = "../world.toml"\nfirmware = "epuck2"\n'
LITTLE = Limits(cpu=2, memory=400 << 20)
"""What hostile programs may use, so that they are ended soon."""


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    folder = tmp_path / "lab"
    (folder / "teacher").mkdir(parents=True)
    (folder / "lab.toml").write_text(LAB)
    (folder / "world.toml").write_text(WORLD)
    (folder / "teacher" / "hidden.toml").write_text(HIDDEN)
    (folder / "teacher" / "solution.py").write_text(HONEST)
    return folder


@pytest.fixture
def school(tmp_path: Path) -> Path:
    folder = tmp_path / "class"
    folder.mkdir()
    (folder / "honest.py").write_text(HONEST)
    return folder


def mark_one(lab: Path, school: Path, name: str, source: str, limits: Limits = LIMITS) -> Mark:
    source = source.replace("{lab}", str(lab)).replace("{class}", str(school))
    (school / f"{name}.py").write_text(source)
    (found,) = [each for each in find_submissions(school) if each.name == f"{name}.py"]
    return mark(lab, found, limits=limits)


FIRST = ("reads_the_solution", "forges_messages")
"""What the quick lane tries: files and the link."""


@isolated
@pytest.mark.parametrize("name", short(HOSTILE, *FIRST))
def test_a_hostile_program_gains_nothing(lab: Path, school: Path, name: str) -> None:
    hostile = HOSTILE[name]
    before = sorted(os.listdir(school))
    found = mark_one(lab, school, name, hostile.source, LITTLE)
    assert sorted(os.listdir(school)) == sorted([*before, f"{name}.py"])
    assert sorted(os.listdir(lab)) == ["lab.toml", "teacher", "world.toml"]
    if hostile.said is not None:
        assert re.search(hostile.said, "; ".join(found.remarks)), found
    if hostile.shows is not None:
        assert re.search(hostile.shows, found.output), found
    assert bool(found.broke) == hostile.breaks, found
    if hostile.breaks or HONEST not in hostile.source:
        assert found.points == 0, found


@isolated
def test_honest_work_has_its_points_in_every_variant(lab: Path, school: Path) -> None:
    found = mark_one(lab, school, "anna", HONEST)
    assert (found.points, found.goals) == (4, {"ahead": 2, "end": 2})
    assert [run.variant for run in found.runs] == ["given", "hidden"]
    assert (found.remarks, found.broke) == ([], "")
    assert all("<svg" in run.picture for run in found.runs)


def test_a_forged_result_is_marked_by_what_its_program_does(lab: Path, school: Path) -> None:
    claims = {
        "lab": "lab",
        "digest": "",
        "verdicts": {each: {"ahead": True, "end": True} for each in ("given", "hidden")},
    }
    (school / "anna-result.json").write_text(json.dumps(claims | {"program": HONEST}))
    (school / "eve-result.json").write_text(json.dumps(claims | {"program": "import elib\n"}))
    (school / "max-result.json").write_text('{"points": 4}')
    (school / "data.json").write_text("{}")
    found = {each.name: mark(lab, each, safe=False) for each in find_submissions(school)}
    assert {name: each.points for name, each in found.items()} == {
        "anna-result.json": 4,
        "eve-result.json": 0,
        "honest.py": 4,
        "max-result.json": 0,
    }
    assert "is not the result of a check" in "; ".join(found["max-result.json"].remarks)


KEEPS = """
import elib
print(elib.find())
with elib.connect("sim://corridor?view") as robot:
    robot.record("run.mcap")
    robot.log("run.log")
    robot.drive(0.10)
"""
BEHAVES = """
from elib import Epuck
from elib.behaviours import behaviour, play
@behaviour
async def go(robot: Epuck): await robot.drive(0.10)
play(go, seconds=10)
"""


@isolated
@pytest.mark.long
@pytest.mark.parametrize("source", [KEEPS, BEHAVES])
def test_what_elib_does_for_an_honest_program_works(lab: Path, school: Path, source: str) -> None:
    found = mark_one(lab, school, "anna", source)
    assert (found.points, found.remarks) == (4, []), found.output


@isolated
def test_a_broken_program_is_explained(lab: Path, school: Path) -> None:
    found = mark_one(lab, school, "ben", HONEST + "robot.drve(1)\n")
    assert found.points == 3
    assert found.remarks == [
        "it ended with exit code 1 in line 5 of ben.py: AttributeError: 'BlockingEpuck' object has no attribute 'drve'"
        ". Did you mean: 'drive'? (given)"
    ]
    assert "AttributeError" in found.output


def test_a_goal_that_fails_is_a_remark_and_one_that_only_needs_it_says_that_it_does(lab: Path, school: Path) -> None:
    (school / "honest.py").write_text("import elib\nwith elib.connect() as robot:\n    robot.drive(0.05)\n")
    (submission,) = find_submissions(school)
    remark, *others = mark(lab, submission, safe=False).remarks
    assert re.fullmatch(r"ahead: ended 0\.0\d\d m ahead .* of its start \(given\)", remark)
    assert others == ["end counts only together with ahead"]


@isolated
def test_a_file_elsewhere_is_not_there_and_the_remark_says_so(lab: Path, school: Path) -> None:
    found = mark_one(lab, school, "dora", HONEST + "open('/home/dora/data.csv')\n")
    assert found.points == 3
    assert found.remarks == [
        "it ended with exit code 1 in line 5 of dora.py: FileNotFoundError: [Errno 2] No such file or directory: "
        "'/home/dora/data.csv' (given)"
    ]


@isolated
@pytest.mark.long
def test_an_error_of_elib_is_told_by_itself_and_not_by_its_hint(lab: Path, school: Path) -> None:
    found = mark_one(lab, school, "ben", HONEST + "    robot.drive(40)\n")
    assert found.remarks == [
        "it ended with exit code 1 in line 5 of ben.py: elib.ArgumentError: distance is 40 m; it must be a number "
        "from -5 to 5 m (given)"
    ]
    assert "did you mean 0.4 (40 cm)" in found.output


@isolated
@pytest.mark.long
def test_a_program_without_a_robot_is_explained(lab: Path, school: Path) -> None:
    assert mark_one(lab, school, "ben", "def main(robot): ...\n").remarks == ["it opened no robot (given)"]


@isolated
@pytest.mark.long
def test_a_program_that_never_ends_is_explained(lab: Path, school: Path) -> None:
    endless = "import elib\nwith elib.connect() as robot:\n    while True:\n        robot.proximity()\n"
    assert "it was not done after 5 s of robot time (given)" in mark_one(lab, school, "ben", endless).remarks


@isolated
@pytest.mark.long
def test_the_marks_are_the_same_on_every_run_and_with_any_number_of_jobs(lab: Path, school: Path) -> None:
    (school / "ben.py").write_text(HONEST + "print({'a', 'b', 'c'})\nraise SystemExit(4)\n")
    (school / "cleo").mkdir()
    (school / "cleo" / "main.py").write_text("import steps\n" + HONEST.replace("0.10", "steps.FAR"))
    (school / "cleo" / "steps.py").write_text("FAR = 0.1\n")
    submissions = find_submissions(school)
    assert [each.name for each in submissions] == ["ben.py", "cleo", "honest.py"]
    first = mark_all(lab, submissions, jobs=1)
    assert [each.points for each in first] == [3, 4, 4]
    assert mark_all(lab, submissions, jobs=3) == first


def test_what_is_a_submission(school: Path, tmp_path: Path) -> None:
    (tmp_path / "solution.py").write_text("SECRET = 1")
    (school / "copied.py").symlink_to(tmp_path / "solution.py")
    (school / "linked").symlink_to(tmp_path)
    for name, files in {
        "many": ("a.py", "b.py"),
        "one": ("robot.py", "notes.txt"),
        "_drafts": ("main.py",),
        "texts": ("a.txt",),
        "nested": ("nested.py", "other.py"),
    }.items():
        (school / name).mkdir()
        for file in files:
            (school / name / file).write_text("")
    (school / "one" / "leak.txt").symlink_to("/etc/passwd")
    found = {each.name: each for each in find_submissions(school)}
    assert list(found) == ["copied.py", "honest.py", "linked", "many", "nested", "one"]
    assert found["copied.py"].problem == found["linked"].problem == "it is a link, not a file"
    assert "several programs" in found["many"].problem
    assert found["nested"].main == "nested.py"
    assert (found["one"].main, sorted(found["one"].files)) == ("robot.py", ["notes.txt", "robot.py"])
    with pytest.raises(ArgumentError, match="no submissions"):
        find_submissions(school / "texts")


def command(*words: object) -> list[str]:
    return [sys.executable, "-m", "elib", "lab", "mark", *map(str, words)]


@isolated
@pytest.mark.long
def test_the_command_writes_a_table_a_spreadsheet_and_a_page(lab: Path, school: Path, tmp_path: Path) -> None:
    (school / "=evil<script>.py").write_text(HOSTILE["forges_messages"].source)
    (school / "copy.py").write_text(HONEST)
    words = (school, "--lab", lab, "--csv", tmp_path / "m.csv", "--html", tmp_path / "m.html", "--jobs", 2)
    done = run(command(*words))
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[0].split()[:5] == ["submission", "points", "of", "ahead", "end"]
    rows = list(csv.DictReader((tmp_path / "m.csv").read_text().splitlines()))
    assert [(row["submission"], row["points"]) for row in rows] == [
        ("'=evil<script>.py", "0"),
        ("copy.py", "4"),
        ("honest.py", "4"),
    ]
    assert "no points: it broke the link's rules" in rows[0]["remarks"]
    page = (tmp_path / "m.html").read_text()
    assert page.count("<svg") == 5
    assert "<script" not in page
    assert "Ten &lt;b&gt;centimetres" in page
    assert not re.search(r"(?:src|href)=\"(?!#|data:)", page)
    marks = json.loads(run(command(*words[:3], "--json")).stdout)
    assert [each["points"] for each in marks["marks"]] == [0, 4, 4]
    assert marks["variants"] == ["given", "hidden"]


MACHINE = """import elib


def ahead(robot, run):
    if run.entered:
        robot.set_speed(0.2, 0.2)
    if run.time_in_state > 4:
        return "end"  # </svg><script>


elib.play(elib.states(ahead))
"""


@isolated
@pytest.mark.parametrize(
    ("text", "drawn"),
    [(MACHINE, "ahead"), (MACHINE.replace("(ahead)", "(*[ahead])"), ""), ("x = " + "-" * 50_000 + "1", "")],
)
def test_the_page_of_marks_shows_the_states_of_a_program_that_has_some(
    lab: Path, school: Path, text: str, drawn: str
) -> None:
    (school / "honest.py").write_text(text)
    (submission,) = find_submissions(school)
    marked = mark(lab, submission)
    assert (f'data-state="{drawn}"' in marked.machine) == bool(drawn)
    page = to_html(load_lab(lab, hidden=True), [marked])
    assert ("its states" in page) == bool(drawn)
    assert "<script" not in page


@isolated
@pytest.mark.long
@pytest.mark.parametrize("ended", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_nothing_is_left_when_the_marker_is_ended(lab: Path, school: Path, ended: signal.Signals) -> None:
    for name in ("endless", "endless_too"):
        (school / f"{name}.py").write_text("import threading\nthreading.Event().wait()\n")
    (school / "honest.py").unlink()
    process = subprocess.Popen(
        command(school, "--lab", lab, "--jobs", 2), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    everybody = wait_until(lambda: workers_and_programs(process.pid))
    process.send_signal(ended)
    process.wait(PATIENCE)
    wait_until(lambda: not any(map(runs, everybody)))


def workers_and_programs(marker: int) -> list[int]:
    """Return all processes of a marker with two jobs, as soon as both programs run."""
    everybody = list(family(marker))
    commands = [command_of(each) for each in everybody]
    # Each worker has bubblewrap and the program; the trial of bubblewrap before has no worker.
    workers, programs = (sum(name in each for each in commands) for name in ("spawn_main", "confined"))
    return everybody if workers == 2 and programs >= 4 else []


def command_of(process: int) -> str:
    try:
        return Path(f"/proc/{process}/cmdline").read_text().replace("\0", " ")
    except OSError:
        return ""


def test_unsafe_says_so_and_needs_no_bubblewrap(lab: Path, school: Path) -> None:
    table, page = lab.parent / "marks.csv", lab.parent / "marks.html"
    done = run(command(school, "--lab", lab, "--unsafe", "--jobs", 1, "--csv", table, "--html", page))
    assert done.returncode == 0, done.stderr
    assert "with your rights" in done.stderr
    assert re.search(r"honest.py +4 +4", done.stdout)
    assert [(row["submission"], row["points"]) for row in csv.DictReader(table.read_text().splitlines())] == [
        ("honest.py", "4")
    ]
    assert page.read_text().count("<svg") == 2


def test_several_labs_make_one_table_with_a_row_for_each_student(
    lab: Path, school: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other, second = tmp_path / "other", tmp_path / "second"
    shutil.copytree(lab, other)
    second.mkdir()
    (school / "anna.py").write_text("import elib\nelib.connect().close()\n")
    (second / "honest").mkdir()
    (second / "honest" / "main.py").write_text(HONEST)
    (second / "ben.py").write_text(HONEST)
    table = tmp_path / "marks.csv"
    words = (school, second, "--lab", lab, "--lab", other, "--unsafe", "--jobs", 1, "--csv", table)
    done = run(command(*words))
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[0].split()[:5] == ["submission", "points", "of", "lab", "other"]
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert [(row["submission"], row["points"], row["of"], row["lab"], row["other"]) for row in rows] == [
        ("anna", "0", "8", "0", ""),
        ("ben", "4", "8", "", "4"),
        ("honest", "8", "8", "4", "4"),
    ]
    for words, said in (
        ((), "needs the folder with the submissions"),
        ((school, second, "--lab", lab), "there are 2 folders, but 1 --lab"),
        ((school, second, "--lab", lab, "--lab", other, "--html", table), "the page of one lab"),
    ):
        assert main(["lab", "mark", *map(str, words)]) == 2
        assert said in capsys.readouterr().err


def test_a_terminal_is_told_from_the_beginning_how_many_are_marked(lab: Path, school: Path) -> None:
    (school / "honest.py").write_text("")
    ours, theirs = pty.openpty()
    try:
        words = command(school, "--lab", lab, "--unsafe", "--jobs", 1)
        env = {**os.environ, "TERM": "xterm"}
        subprocess.run(words, stdout=subprocess.DEVNULL, stderr=theirs, timeout=PATIENCE, check=True, env=env)
        told = os.read(ours, 65536).decode()
    finally:
        os.close(ours)
        os.close(theirs)
    assert told.index("0 of 1 marked") < told.index("1 of 1 marked: honest.py")


def test_the_table_breaks_no_word_of_a_remark_where_there_is_no_terminal(
    lab: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    remark = "it ended with exit code 1 in line 4 of ben.py: elib.ArgumentError: distance is 40 m (given)"
    goals = {"ahead": 0, "end": 0}
    print_table(to_rows([(load_lab(lab), [Mark("ben.py", 0, 4, goals, remarks=[remark], alike={"honest.py": 94})])]))
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= 80
    assert remark in " ".join(shown.split())
    assert "similar: honest.py (94 %)" in shown


def test_the_page_says_what_failed_in_which_variant_and_in_which_one_it_printed(lab: Path, school: Path) -> None:
    (school / "honest.py").write_text(HONEST.replace("0.10", "0.05") + "print('done')\nstop\n")
    (submission,) = find_submissions(school)
    page = to_html(load_lab(lab, hidden=True), [mark(lab, submission, safe=False)])
    assert "what it printed in hidden" in page
    assert re.search(r'<tr class="remarks"><td colspan="5">it ended .* in line 6 of honest.py: NameError', page)
    assert "1 submission in 2 variants: 0 with all points" in page


MISTAKES = {
    "right.py": ("# fails: ahead: it does not drive", ""),
    "end.py": (
        "# fails: end: it does not drive",
        "it should fail end, but end fails only where another goal fails: ahead",
    ),
    "ahed.py": (
        "# fails: ahed: it does not drive",
        "it should fail ahed, but there is no such goal: did you mean ahead?",
    ),
    "none.py": ("import os", "its first line does not say what fails: # fails: GOAL: reason"),
}


def test_a_mistake_that_does_not_fail_as_its_first_line_says_is_named(lab: Path) -> None:
    mistakes = lab / "teacher" / "mistakes"
    mistakes.mkdir()
    for name, (first, _) in MISTAKES.items():
        (mistakes / name).write_text(f"{first}\nimport elib\n\nwith elib.connect() as robot:\n    robot.sleep(1)\n")
    done = run(command(mistakes, "--unsafe", "--jobs", 1))
    assert done.returncode == 1
    for name, (_, wrong) in MISTAKES.items():
        assert (f"{name}: {wrong}" in done.stderr) == bool(wrong), done.stderr


@pytest.mark.parametrize("name", short(["right.py", *list(MISTAKES)[1:]], "right.py"))
def test_a_mistake_that_is_checked_alone_says_whether_it_fails_as_its_first_line_says(lab: Path, name: str) -> None:
    first, wrong = MISTAKES[name]
    mistakes = lab / "teacher" / "mistakes"
    mistakes.mkdir()
    (mistakes / name).write_text(f"{first}\nimport elib\n\nwith elib.connect() as robot:\n    robot.sleep(1)\n")
    done = run([sys.executable, "-m", "elib", "lab", "check", str(mistakes / name)])
    assert done.returncode == bool(wrong), done.stderr
    assert f"{name}: {wrong or 'it fails as its first line says'}" in done.stderr


def test_a_mistake_that_fails_goals_which_its_first_line_does_not_name_says_so(lab: Path) -> None:
    found, goals = load_lab(lab), load_lab(lab).goals
    assert len(goals) > 1
    text = f"# fails: {goals[0].name}: it stands\n"
    runs = [[GoalResult(goal, False, "it stands") for goal in goals]]
    assert wrong_claim(found, text, runs) == ""
    assert also_failed(found, text, runs) == f", and also {' and '.join(goal.name for goal in goals[1:])}"
    runs = [[GoalResult(goal, False, "it stands" if goal is goals[0] else f"{MISSED}...") for goal in goals]]
    assert also_failed(found, text, runs) == ""


def test_a_mistake_that_passes_is_named(lab: Path) -> None:
    mistakes = lab / "teacher" / "mistakes"
    mistakes.mkdir()
    (mistakes / "solves.py").write_text(f"# fails: ahead: it does not drive\n{HONEST}")
    done = run(command(mistakes, "--unsafe", "--jobs", 1))
    assert done.returncode == 1
    assert "error: solves.py: it should fail ahead, but ahead holds: all goals hold" in done.stderr
