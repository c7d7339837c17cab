"""Labs in the studio are judged as elib's own marker judges them, in one process and by calls."""

from __future__ import annotations

import contextlib
import io
import linecache
import random
import shutil
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from elib.base.errors import ArgumentError, SimulationError
from elib.base.timebase import Host, move_into
from elib.lab import Lab, VariantResult, load_lab, run_variant
from elib.lab.labfile import shipped_labs
from elib.lab.running import PlainProgram
from elib.simulator.emulator import simulation
from elib.simulator.emulator.simulation import Simulation
from elib.studio.inplace import InPlace
from elib.studio.labs import Labs, Watch

QUICK = ("go-10-cm", "turn-to-the-post")
PROGRAMS = [
    pytest.param(
        name,
        path.relative_to(load_lab(name).folder),
        marks=() if name in QUICK and path.name != "start.py" else pytest.mark.long,
        id=f"{name}-{path.name}",
    )
    for name in shipped_labs()
    for path in [
        load_lab(name).folder / "start.py",
        load_lab(name).folder / "teacher/solution.py",
        *sorted(load_lab(name).folder.glob("teacher/mistakes/*.py")),
    ]
]
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
    """Return what differs between a run in this process and one in a process of its own, in each variant."""
    file = folder / "native.py"
    file.write_text(text)
    found = []
    for variant in lab.variants:
        native = run_variant(lab, variant, lambda link: PlainProgram(file, link), wall=300)
        here = InPlace(lab, variant, 300).result(text, run)
        found += [
            f"{variant.name}: {name}: {getattr(here, name)}, natively {getattr(native, name)}"
            for name in ("goals", "ending", "why", "exit_code", "time", "requests", "output", "paths", "transcript")
            if getattr(here, name) != getattr(native, name)
        ]
    return found


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


@pytest.mark.parametrize(
    "program",
    [
        "with elib.connect() as a, elib.connect() as b:\n    a.drive(0.05)\n    b.drive(-0.05)\n",
        "for _ in range(2):\n    with elib.connect() as robot:\n        robot.drive(0.05)\n",
        "async def main(robot):\n    await robot.drive(0.05)\nelib.run(main)\nelib.run(main)\n",
        "robot = elib.connect()\nrobot.set_speed(0.1, 0.1)\n",
        "with elib.swarm() as robots:\n    robots.set_speed(0.1, 0.1)\n    robots[0].sleep(1)\n",
        "async def main(robot):\n    await robot.drive(0.05)\n",
        "with elib.connect() as robot:\n    print(random.random())\n    raise SystemExit(3)\n",
        "with elib.connect() as robot:\n    1 / 0\n",
        "with elib.connect() as robot:\n    while True:\n        robot.proximity()\n",
        "with elib.connect() as robot:\n    robot.sleep(9)\n",
        "async def main(robot):\n    try:\n        await asyncio.sleep(9)\n    finally:\n        print(1)\nelib.run(main)\n",
        "print('no robot')\n",
        "a, b, c = [elib.connect() for _ in range(3)]\n",
        "this is no program",
    ],
)
def test_other_programs_are_judged_as_the_marker_judges_them(program: str, lab: Lab, run: Run, tmp_path: Path) -> None:
    before = random.getstate()
    text = program if program.startswith("this") else f"import asyncio\nimport random\nimport elib\n{program}"
    assert differences(lab, text, run, tmp_path) == []
    random.setstate(before)
