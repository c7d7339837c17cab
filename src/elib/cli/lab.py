"""``elib lab``: tasks with goals, and a program checked against them."""

from __future__ import annotations

import re
import shutil
import sys
from collections import Counter
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

from cyclopts import App
from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.exits import FAILED
from elib.base.files import reason_of, write_file
from elib.base.plaintext import plain
from elib.base.rules import Number, nearest
from elib.cli.arguments import AsJson, option
from elib.cli.terminal import GREEN, RED, paint, print_json, quoted, say, table
from elib.lab import VariantResult, find_lab, load_lab, run_together
from elib.lab.goal import points
from elib.lab.labfile import shipped_labs
from elib.lab.marker import WALL
from elib.lab.mistakes import also_failed, is_mistake, wrong_claim
from elib.lab.picture import PICTURE, draw_lab
from elib.lab.result import ENDING, read_result
from elib.lab.running import PlainProgram, plain_opponents

TEACHER = "teacher"

app = App(
    name="lab",
    help="""Copy a lab that comes with elib, check a program against its goals, and mark a class.

    A lab is a folder with instructions, worlds and goals. To make one of your own, copy one with --teacher.""",
)

app.command(
    "elib.cli.labmark:mark",
    name="mark",
    help="""Mark all submissions in a folder, or in several.

    Each runs in every variant of the lab, the hidden ones too. It sees neither this computer nor other submissions, and
    it drives its robot in simulated time, so the marks are the same on every run. A program that breaks the rules of
    the link to its robot has no points. Programs that are much alike are named. The folders of several labs make one
    table, a row a student, by the names of files and folders without .py.

    In a game of two programs each plays against the opponent of the lab. With --league every two play against each
    other, each once on either side: 3 points for a game that is won, 1 for one that is drawn.

    In a lab's teacher/mistakes, one that does not fail as its first line says is named, and the exit code is 1.

    For example:
        elib lab mark handed-in --lab square
        elib lab mark handed-in --lab square --csv marks.csv --html marks.html
        elib lab mark handed-in --lab energy-game --league
    """,  # here, because the list of commands shows its first line and does not import the module
)

LabFolder = Annotated[str | None, option("--lab FOLDER", "The lab's folder, or its name (default: above the program).")]


@app.command(name="list")
def list_labs(*, json: AsJson = False) -> None:
    """List the labs that come with elib."""
    labs = [load_lab(name) for name in shipped_labs()]
    if json:
        print_json({"labs": [{"name": lab.name, "title": lab.title, "summary": lab.summary} for lab in labs]})
        return
    print(table([(lab.name, lab.summary) for lab in labs], indent=0))


@app.command
def new(
    name: Annotated[str, Cli(help="A lab that comes with elib; elib lab list lists them.")],
    folder: Annotated[str | None, Cli(help="Where to put it (default: its name).")] = None,
    /,
    *,
    teacher: Annotated[
        bool, option("--teacher", "Copy the solution, the mistakes and the hidden variants as well.")
    ] = False,
) -> None:
    """Copy a lab into a new folder, to work on.

    For example:
        elib lab new out-of-the-maze
        elib lab new square my-lab --teacher
    """
    if name not in shipped_labs():
        raise ArgumentError(f"there is no lab {name!r}", hint=nearest(name, shipped_labs()))
    target = Path(folder or name)
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise ArgumentError(f"{target} is there already", hint="name another folder: elib lab new NAME FOLDER")
    left_out = ["__pycache__"] if teacher else ["__pycache__", TEACHER]
    try:
        shutil.copytree(load_lab(name).folder, target, ignore=shutil.ignore_patterns(*left_out), dirs_exist_ok=True)
    except OSError as error:
        raise ArgumentError(f"{target} cannot be made: {reason_of(error)}", hint="name a folder of your own") from None
    print(f"{target} is ready. Read {target / 'README.md'}, change {target / 'start.py'}, and check it:")
    print(f"elib lab check {quoted(target / 'start.py')}")


@app.command
def draw(folder: Annotated[str, Cli(help="The lab's folder.")] = ".", /) -> None:
    """Draw the world of a lab, with its zones, into world.svg, which its README.md shows.

    For example:
        elib lab draw my-lab
    """
    lab = load_lab(folder)
    path = Path(folder) / PICTURE
    write_file(path, draw_lab(lab).encode())
    print(f"drawn in {path}")


@app.command
def check(
    program: Annotated[str, Cli(help="The program, a .py file, or the -result.json of a check in a browser.")],
    /,
    *,
    lab: LabFolder = None,
    variant: Annotated[str | None, option("--variant NAME", "Only this variant.")] = None,
    wall: Annotated[
        float, Number(1, 3600, "s"), option("--wall S", "Seconds by the clock on the wall that a variant may take.")
    ] = WALL,
    json: AsJson = False,
) -> None:
    """Run a program in the worlds of its lab, and say which goals hold.

    The path of the robot is drawn into a picture beside the program. The exit code is 0 if all goals hold. A program in
    the lab's teacher/mistakes runs in the hidden variants too, and the exit code is 0 if it fails as its first line
    says. The program in a result file runs in them too; what else the file says is only compared.

    For example:
        elib lab check out-of-the-maze/start.py
        elib lab check square/start.py --json
    """
    path = Path(program)
    if path.is_dir():
        first = path / "start.py"
        hint = (
            f"name the program in it: elib lab check {quoted(first)}" if first.is_file() else "name the program in it"
        )
        raise ArgumentError(f"{program} is a folder", hint=hint)
    if not path.is_file():
        raise ArgumentError(f"there is no program {program}", hint="name a .py file, such as start.py")
    claimed = read_result(path) if path.name.endswith(ENDING) else None
    if claimed is None and path.suffix != ".py":
        raise ArgumentError(f"{program} is not a program: its name does not end in .py")
    home = claimed.lab if claimed is not None and claimed.lab in shipped_labs() else None
    found = load_lab(lab or home or find_lab(path), hidden=claimed is not None)
    is_wrong = is_mistake(found, path)
    if is_wrong:
        found = load_lab(found.folder, hidden=True)
    chosen = found.variants if variant is None else (found.variant(variant),)
    shown = sys.stderr if json else sys.stdout

    def show(text: bytes) -> None:
        print(text.decode("utf-8", "replace"), end="", file=shown, flush=True)

    results, pictures = [], []
    for each in chosen:
        if not json:
            print(found.title if len(found.variants) == 1 else f"{found.title}: {each.name}", flush=True)
        with claimed.unpacked() if claimed else nullcontext(path) as file:
            starts = [lambda link: PlainProgram(file, link, shows=show), *plain_opponents(found)]
            results.append(run_together(found, each, starts, wall=wall)[0])
        if results[-1].output[-1:] not in ("", "\n"):
            print(file=shown)
        ending = "" if len(found.variants) == 1 else "-" + re.sub(r"\W+", "-", each.name)
        pictures.append(path.with_name(f"{path.stem}{ending}.png"))
        results[-1].draw(pictures[-1])
        if not json:
            _print(results[-1], pictures[-1])
    passed = all(result.passed for result in results)
    held = Counter(each.goal.name for result in results for each in result.goals if each.holds)
    reached = points(found.goals, held, len(results))
    if json:
        print_json(
            {
                "lab": found.name,
                "program": str(path),
                "passed": passed,
                "points": reached,
                "of": found.points,
                "variants": [
                    {**summary(result), "picture": str(picture)}
                    for result, picture in zip(results, pictures, strict=True)
                ],
            }
        )
    else:
        print(f"{reached:.3g} of {found.points:g} points" + (", all goals hold" if passed else ""))
    if claimed is not None and (doubt := claimed.doubt(found, results)):
        say(f"What {path.name} says was not believed: {doubt}.")
    if is_wrong:
        told = found, path.read_text("utf-8", "replace"), [result.goals for result in results]
        wrong = wrong_claim(*told)
        say(f"{path.name}: {wrong or f'it fails as its first line says{also_failed(*told)}'}")
        passed = not wrong
    if not passed:
        raise SystemExit(FAILED)


def summary(result: VariantResult) -> dict[str, object]:
    """Return a result in types that JSON has."""
    return {
        "variant": result.variant.name,
        "passed": result.passed,
        "ending": result.ending,
        "why": result.why,
        "exit_code": result.exit_code,
        "time": result.time,
        "goals": [
            {
                "name": each.goal.name,
                "about": each.goal.sentence,
                "points": each.goal.points,
                "holds": each.holds,
                "text": each.text,
            }
            for each in result.goals
        ],
    }


def _print(result: VariantResult, picture: Path) -> None:
    if result.ending == "time":
        say(f"The program was ended after {result.time:g} s of robot time, which is all that the lab gives.")
    elif result.why:
        say(f"The program did not end well: {result.why}.")
    elif not result.opened_robot:
        say("The program did not open a robot. Is there an elib.connect() in it, and does it run?")
    for each in result.goals:
        mark = paint("yes", GREEN, sys.stdout) if each.holds else paint("no ", RED, sys.stdout)
        print(f"  {mark}  {each.goal.sentence}")
        worth = f"{each.goal.points:g} {'point' if each.goal.points == 1 else 'points'}"
        print(f"       {plain(each.text)} ({worth if each.holds else f'0 of {worth}'})")
    print(f"  {'path and map' if result.patches else 'path'} in {picture}\n", flush=True)
