"""The labs that come with elib: each is complete, its solution passes, and its mistakes fail as they say."""

import ast
import re
import shutil
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from elib.lab import Lab, Variant, VariantResult, load_lab, run_together
from elib.lab.labfile import shipped_labs
from elib.lab.mistakes import wrong_claim
from elib.lab.running import PlainProgram, plain_opponents

NAMES = shipped_labs()
LABS = {name: load_lab(name, hidden=True) for name in NAMES}
GIVEN = {name: len(load_lab(name).variants) for name in NAMES}
SOLVED = [(name, variant.name) for name in NAMES for variant in LABS[name].variants]
MISTAKES = [
    (name, path.name) for name in NAMES for path in sorted((LABS[name].folder / "teacher/mistakes").glob("*.py"))
]
SHORT = ("turn-to-the-post", "stop-before-the-wall", "go-to-the-light")
"""Labs whose solutions take little time."""
CAMERAS = ("asercom-1.2.2", "epuck2", "btcom-2.0", "btcom-1.1.3")
"""Firmwares on which a lab with a camera is tried."""
FAILS = re.compile(r"# fails: ([a-z0-9-]+): (\S.{20,})")


def in_its_lane(*values: object, is_quick: bool) -> object:
    """Return a case as a parameter: what takes seconds is for the long lane."""
    return pytest.param(*values, marks=() if is_quick else pytest.mark.long)


Tried = Callable[[str, str, Variant], VariantResult]


@pytest.fixture
def tried(tmp_path: Path) -> Tried:
    """Return what runs a program of a lab in one variant, from a folder of its own."""

    def run(name: str, program: str, variant: Variant) -> VariantResult:
        copy = tmp_path / "program.py"
        shutil.copyfile(LABS[name].folder / program, copy)
        starts = [lambda link: PlainProgram(copy, link), *plain_opponents(LABS[name])]
        return run_together(LABS[name], variant, starts, wall=300)[0]

    return run


def told(result: VariantResult) -> str:
    """Return what happened, for a person who must find out why."""
    goals = "; ".join(f"{each.goal.name} {'holds' if each.holds else 'fails'}: {each.text}" for each in result.goals)
    return f"{result.variant.name}: {result.ending} {result.why}; {goals}; it printed: {result.output[-500:]}"


def first_line(lab: Lab, program: str) -> re.Match[str]:
    line = (lab.folder / "teacher/mistakes" / program).read_text().splitlines()[0]
    found = FAILS.fullmatch(line)
    assert found is not None, f"{program} begins with {line!r}"
    return found


def test_eighteen_labs_come_with_elib_from_10_cm_to_broken_robots() -> None:
    assert len(NAMES) == 18
    assert (NAMES[0], NAMES[-1]) == ("go-10-cm", "find-the-broken-robot")
    numbers = [tomllib.loads((LABS[name].folder / "lab.toml").read_text())["number"] for name in NAMES]
    assert numbers == list(range(1, 19))


@pytest.mark.parametrize("name", NAMES)
def test_a_lab_is_complete(name: str) -> None:
    folder = LABS[name].folder
    assert {"README.md", "lab.toml", "start.py", "teacher", "world.svg"} <= {path.name for path in folder.iterdir()}
    teacher = {path.name for path in (folder / "teacher").iterdir()}
    assert {"hidden.toml", "mistakes", "solution.py"} <= teacher
    assert len([program for lab, program in MISTAKES if lab == name]) == 3
    variants = LABS[name].variants
    assert len(variants) >= GIVEN[name] + 2
    differ = any(variant.seed is not None for variant in variants)
    assert differ or name == "go-10-cm", "in one variant the robots differ as real ones do"


@pytest.mark.parametrize("name", NAMES)
def test_the_instructions_name_every_goal_and_how_to_check_it(name: str) -> None:
    text = (LABS[name].folder / "README.md").read_text()
    assert text.startswith(f"# {LABS[name].title}\n")
    assert "![" in text
    assert "](world.svg)" in text
    assert "$ elib lab check start.py" in text
    checked = text.partition("\n## How it is checked\n")[2].partition("\n## ")[0]
    assert re.findall(r"^- `([a-z0-9-]+)`:", checked, re.MULTILINE) == [goal.name for goal in LABS[name].goals]


@pytest.mark.parametrize("name", NAMES)
def test_the_instructions_show_the_robot_in_the_world_of_the_lab(name: str) -> None:
    folder = LABS[name].folder
    variant = LABS[name].variants[0]
    world = variant.world.removeprefix(f"{folder}/")
    text = (folder / "README.md").read_text()
    first, *others = re.findall(r'--robot "sim://([^?"]*)\?([^"]*)"', text) or [("", "")]
    fault = f"fault={variant.fault}&" if variant.fault else ""
    assert first == (world, f"{fault}view") or name == "go-10-cm"
    assert bool(others) == bool(re.search("slow radio|other robots", text)), "say how to try it"
    assert all(where == world and options.startswith("view&") for where, options in others)


@pytest.mark.parametrize("name", NAMES)
def test_every_world_of_a_lab_is_used(name: str) -> None:
    folder = LABS[name].folder
    used = {Path(variant.world).resolve() for variant in LABS[name].variants}
    assert set(folder.glob("**/worlds/*.toml")) <= used


@pytest.mark.parametrize("name", NAMES)
def test_the_programs_are_short_and_open_the_lab_s_robot(name: str) -> None:
    folder = LABS[name].folder
    for path in [folder / "start.py", *folder.glob("teacher/**/*.py")]:
        text = path.read_text()
        assert len(text.splitlines()) <= 50, path
        assert "sim://" not in text, path
        if path.parent.name != "mistakes":
            assert ast.get_docstring(ast.parse(text)), path


@pytest.mark.parametrize("name", [in_its_lane(name, is_quick=name == "go-10-cm") for name in NAMES])
def test_the_beginning_runs_and_does_not_pass(name: str, tried: Tried) -> None:
    result = tried(name, "start.py", LABS[name].variants[0])
    assert result.ending == "ended", told(result)
    assert not result.passed, told(result)
    assert result.goals[0].goal.points > 0


@pytest.mark.parametrize("name", [in_its_lane(name, is_quick=name == "square") for name in NAMES])
def test_a_robot_that_only_stands_gets_no_points(name: str, tried: Tried, tmp_path: Path) -> None:
    program = tmp_path / "stands.py"
    program.write_text("import elib\n\nwith elib.connect() as robot:\n    robot.sleep(5)\n")
    result = tried(name, str(program), LABS[name].variants[0])
    assert result.ending == "ended"
    assert not any(each.holds for each in result.goals), told(result)


@pytest.mark.long
def test_a_robot_that_stands_on_the_first_feeder_gets_no_points_in_the_energy_game(tried: Tried) -> None:
    for variant in LABS["energy-game"].variants:
        result = tried("energy-game", "teacher/mistakes/stays.py", variant)
        assert not any(each.holds for each in result.goals), told(result)


@pytest.mark.parametrize(
    ("name", "variant"), [in_its_lane(*each, is_quick=each[0] in SHORT and each[1] == "given") for each in SOLVED]
)
def test_the_solution_passes(name: str, variant: str, tried: Tried) -> None:
    result = tried(name, "teacher/solution.py", LABS[name].variant(variant))
    assert result.passed, told(result)


@pytest.mark.parametrize(("robots", "wanted"), [in_its_lane(1, 1, is_quick=True), in_its_lane(4, 4, is_quick=False)])
def test_the_red_box_is_found_by_robots_whose_colours_and_infrared_sensors_differ_as_real_ones_do(
    robots: int, wanted: int, tried: Tried
) -> None:
    lab, failed = LABS["find-the-red-box"], []
    for seed in range(1, robots + 1):
        variant = lab.variants[seed % len(lab.variants)]
        drawn = replace(variant, seed=seed, firmware=CAMERAS[seed % 4])
        result = tried("find-the-red-box", "teacher/solution.py", drawn)
        if not result.passed:
            failed.append(told(result))
    assert robots - len(failed) >= wanted, failed


@pytest.mark.parametrize(
    ("name", "program"), [in_its_lane(*each, is_quick=each[0] == "turn-to-the-post") for each in MISTAKES]
)
def test_a_mistake_fails_the_goal_that_it_names(name: str, program: str, tried: Tried) -> None:
    lab = LABS[name]
    path = f"teacher/mistakes/{program}"
    happened, goals, wrong = [], [], ""
    for variant in lab.variants:
        result = tried(name, path, variant)
        happened.append(told(result))
        goals.append(result.goals)
        wrong = wrong_claim(lab, (lab.folder / path).read_text(), goals)
        if not wrong:
            return
    pytest.fail(f"{wrong}: {happened}")
