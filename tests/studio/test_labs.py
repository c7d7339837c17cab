"""Labs in the studio are judged as elib's own marker judges them, in one process and by calls."""

from __future__ import annotations

import contextlib
import io
import linecache
import random
import re
import shutil
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import elib
from elib.base.errors import ArgumentError, SimulationError
from elib.base.timebase import Host, move_into
from elib.lab import Lab, labfile, load_lab, run_variant
from elib.lab.labfile import shipped_labs
from elib.lab.result import read_result
from elib.lab.running import PlainProgram
from elib.simulator.emulator import simulation
from elib.simulator.emulator.simulation import Simulation
from elib.studio import inplace
from elib.studio import labs as module
from elib.studio.inplace import InPlace
from elib.studio.labs import Labs, Watch

QUICK = ("go-10-cm", "turn-to-the-post")
PROGRAMS = [
    pytest.param(
        name,
        path.relative_to(load_lab(name).folder),
        marks=() if name in QUICK else pytest.mark.long,
        id=f"{name}-{path.name}",
    )
    for name in shipped_labs()
    for path in random.Random(name).sample(sorted(load_lab(name).folder.glob("teacher/**/*.py")), 1 + (name in QUICK))
]
"""One of the solution and the mistakes of each lab, which is drawn; two of a quick one."""
Run = Callable[[str, Callable[[Path], object], Callable[[], bool]], str]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """Return what runs a program in this process."""

    def run(text: str, work: Callable[[Path], object], is_over: Callable[[], bool]) -> str:
        file = tmp_path / "here.py"
        file.write_text(text)
        linecache.checkcache(str(file))
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            work(file)
        return printed.getvalue()

    return run


def differences(lab: Lab, text: str, run: Run, folder: Path) -> list[str]:
    """Return what differs between a run in this process and one in a process of its own, in a variant drawn by it."""
    file = folder / "native.py"
    file.write_text(text)
    variant = random.Random(text).choice(lab.variants)
    native = run_variant(lab, variant, lambda link: PlainProgram(file, link), wall=300)
    here = InPlace(lab, variant, 300).result(text, run)
    return [
        f"{variant.name}: {name}: {getattr(here, name)}, natively {getattr(native, name)}"
        for name in ("goals", "ending", "why", "exit_code", "time", "requests", "output", "paths", "transcript")
        if getattr(here, name) != getattr(native, name)
    ]


@pytest.mark.parametrize(("name", "program"), PROGRAMS)
def test_programs_of_labs_are_judged_as_the_marker_judges_them(
    name: str, program: Path, run: Run, tmp_path: Path
) -> None:
    lab = load_lab(name, hidden=True)
    assert differences(lab, (lab.folder / program).read_text(), run, tmp_path) == []


LAB = """
title = "A lab"
summary = "A task."
time = 4
[[goal]]
name = "ends"
kind = "survives"
[[goal]]
name = "asks"
kind = "requests"
most = 20
[[goal]]
name = "stands"
kind = "stands"
[[goal]]
name = "apart"
kind = "spread"
least = 0.2
[[variant]]
name = "given"
world = "world.toml"
"""
WORLD = "[arena]\nsize = [1.0, 0.6]\n" + "".join(f"[[robot]]\nposition = [{x}, 0.3]\n" for x in (0.3, 0.7))


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    folder = tmp_path / "two"
    folder.mkdir()
    (folder / "lab.toml").write_text(LAB)
    (folder / "world.toml").write_text(WORLD)
    return load_lab(folder)


OTHERS = [
    "with elib.connect() as a, elib.connect() as b:\n    a.drive(0.05)\n    b.drive(-0.05)\n",
    "async def main(robot):\n    await robot.drive(0.05)\nelib.run(main)\nelib.run(main)\n",
    "with elib.connect() as robot:\n    1 / 0\n",
    "with elib.connect() as robot:\n    while True:\n        robot.sleep(1)\n",
    "this is no program",
    *(
        pytest.param(each, marks=pytest.mark.long)
        for each in (
            "for _ in range(2):\n    with elib.connect() as robot:\n        robot.drive(0.05)\n",
            "robot = elib.connect()\nrobot.set_speed(0.1, 0.1)\n",
            "with elib.swarm() as robots:\n    robots.set_speed(0.1, 0.1)\n    robots[0].sleep(1)\n",
            "async def main(robot):\n    await robot.drive(0.05)\n",
            "with elib.connect() as robot:\n    print(random.random())\n    raise SystemExit(3)\n",
            "with elib.connect() as robot:\n    while True:\n        robot.proximity()\n",
            "with elib.connect() as robot:\n    robot.sleep(9)\n",
            "async def main(robot):\n    while True: await asyncio.sleep(1)\nelib.run(main)\n",
            "async def main(robot):\n    try: await asyncio.sleep(9)\n    finally: print(1)\nelib.run(main)\n",
            "print('no robot')\n",
            "a, b, c = [elib.connect() for _ in range(3)]\n",
        )
    ),
]


@pytest.mark.parametrize("program", OTHERS)
def test_other_programs_are_judged_as_the_marker_judges_them(program: str, lab: Lab, run: Run, tmp_path: Path) -> None:
    before = random.getstate()
    text = program if program.startswith("this") else f"import asyncio\nimport random\nimport elib\n{program}"
    assert differences(lab, text, run, tmp_path) == []
    random.setstate(before)


class Clock:
    """A wall clock that stands until a file is there, and then is far ahead."""

    def __init__(self, file: Path) -> None:
        self._file = file

    def perf_counter(self) -> float:
        return 1e6 if self._file.exists() else 0.0


STUBBORN = """
import elib, pathlib
with elib.connect() as robot:
    for turn in range(1000):
        pathlib.Path("{file}").touch()
        try: robot.sleep(1)
        except elib.ElibError: pass
"""


def test_a_program_that_catches_every_error_is_to_be_ended(
    lab: Lab, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inplace, "time", Clock(tmp_path / "late"))
    other = STUBBORN.format(file=tmp_path / "other")
    assert InPlace(lab, lab.variants[0]).result(other, run).ending == "time"
    late = InPlace(lab, lab.variants[0]).result(STUBBORN.format(file=tmp_path / "late"), run)
    assert (late.ending, late.why) == ("wall", "it was not done after 60 s of the wall clock")
    assert late.time < 1.0  # the robot's time stood still
    assert not any(each.holds for each in late.goals)


class Page(Host):
    """Where a program has one thread, and waits by the page."""

    waits = 0

    def wait(self, seconds: float) -> None:
        self.waits += 1


@pytest.fixture
def page() -> Iterator[Page]:
    place = Page()
    move_into(place)
    yield place
    move_into(None)


def test_a_check_is_the_same_where_there_is_one_thread(page: Page, run: Run) -> None:
    lab = load_lab("go-10-cm")
    text = (lab.folder / "teacher/solution.py").read_text()
    there = InPlace(lab, lab.variants[0]).result(text, run)
    assert page.waits
    move_into(None)
    here = InPlace(lab, lab.variants[0]).result(text, run)
    assert (there.goals, there.ending, there.transcript) == (here.goals, here.ending, here.transcript)


def test_the_page_is_told_of_every_lab(tmp_path: Path) -> None:
    told = Labs(tmp_path).all()
    assert [each.name for each in told] == shipped_labs()
    assert all(each.text.startswith(f"# {each.title}\n") and "import elib" in each.start for each in told)
    assert [(goal.name, goal.points) for goal in told[0].goals] == [("go-10-cm", 3.0), ("stop", 1.0), ("end", 1.0)]
    with pytest.raises(ArgumentError, match="no lab 'go-11-cm'"):
        Labs(tmp_path).lab("go-11-cm")


def test_a_lab_that_cannot_run_says_what_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    monkeypatch.setitem(labfile.EXTRAS, "vision", "elib_has_no_such_package")
    told = {each.name: each.missing for each in Labs(tmp_path).all() if each.missing}
    assert [name for name, missing in told.items() if "NumPy" in missing] == ["find-the-red-box", "map-the-maze"]
    assert "the extra vision" in told.pop("home-by-tags")
    assert len(told) == 2


def test_a_report_names_hidden_variants_and_has_the_file_to_hand_in(tmp_path: Path, run: Run) -> None:
    labs, lab = Labs(tmp_path), load_lab("go-10-cm")
    report = labs.check("go-10-cm", (lab.folder / "teacher/solution.py").read_text(), run)
    assert (report.points, report.most) == (lab.points, lab.points)
    assert [each.is_hidden for each in report.variants] == [False, True, True]
    assert all(each.passed and each.ending == "ended" for each in report.variants)
    file = tmp_path / "anna-result.json"
    file.write_text(report.file)
    result = read_result(file)
    assert result.lab == "go-10-cm"
    assert all(all(goals.values()) for goals in result.verdicts.values())


def test_a_program_that_runs_in_a_lab_shows_which_goals_hold_so_far(tmp_path: Path) -> None:
    labs = Labs(tmp_path)
    watched: list[Watch] = []
    held: list[list[bool]] = []

    def began(begun: Simulation) -> None:
        watched.append(labs.watch("go-10-cm", begun))
        held.append([goal.holds for goal in watched[0].goals(None)])

    simulation.on_begin.append(began)
    try:
        with elib.connect(f"{labs.robot('go-10-cm')}?speed=max") as robot:
            robot.drive(0.1)
            robot.sleep(0.5)
    finally:
        simulation.on_begin.remove(began)
    watched[0]._due = 0.0
    assert held == [[False, False, False]]
    assert [(goal.name, goal.holds) for goal in watched[0].goals(None)] == [
        ("go-10-cm", True),
        ("stop", True),
        ("end", False),
    ]


def zipped(folder: Path, **more: bytes) -> bytes:
    """Return a folder as a zip file."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(folder.rglob("*")):
            archive.write(path, path.relative_to(folder.parent))
        for name, data in more.items():
            archive.writestr(name, data)
    return content.getvalue()


def test_a_zipped_lab_is_the_same_as_its_folder(tmp_path: Path, run: Run) -> None:
    ours = tmp_path / "ours"
    shutil.copytree(load_lab("go-10-cm").folder, ours)
    labs = Labs(tmp_path)
    told = labs.open(zipped(ours))
    assert (told.name, told.text) == ("ours", (ours / "README.md").read_text())
    assert labs.all()[-1] == told
    text = (ours / "teacher/solution.py").read_text()
    assert labs.check("ours", text, run).variants == labs.check("go-10-cm", text, run).variants


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (lambda ours: b"no zip", "not a zip file"),
        (lambda ours: zipped(ours)[:900], "not a zip file"),
        (lambda ours: zipped(ours, **{"../evil.toml": b""}), "outside of its folder: '../evil.toml'"),
        (lambda ours: zipped(ours, **{"/evil.toml": b""}), "outside of its folder"),
        (lambda ours: zipped(ours, **{"ours/lab.toml/evil.toml": b""}), "cannot be unpacked"),
        (lambda ours: zipped(ours, **{f"ours/{number}": b"" for number in range(201)}), "at most 200 files"),
        (lambda ours: zipped(ours, zeros=bytes(17 << 20)), "and 16 MB"),
        (lambda ours: zipped(ours / "teacher"), "no lab.toml"),
    ],
)
def test_a_zip_file_that_is_no_lab_is_refused(content: Callable[[Path], bytes], why: str, tmp_path: Path) -> None:
    ours, opened = tmp_path / "ours", tmp_path / "opened"
    shutil.copytree(load_lab("go-10-cm").folder, ours)
    opened.mkdir()
    labs = Labs(opened)
    with pytest.raises(ArgumentError, match=re.escape(why)):
        labs.open(content(ours))
    assert [each.name for each in labs.all()] == shipped_labs()
    assert not list(tmp_path.rglob("evil.toml"))


def test_a_zipped_lab_with_a_mistake_is_refused_with_its_line(tmp_path: Path) -> None:
    ours = tmp_path / "ours"
    shutil.copytree(load_lab("go-10-cm").folder, ours)
    (ours / "lab.toml").write_text("title = 7\n")
    with pytest.raises(SimulationError, match=r"lab\.toml"):
        Labs(tmp_path).open(zipped(ours))
