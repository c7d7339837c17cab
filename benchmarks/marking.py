"""How long it takes to mark a class of 100, of whom 30 hand in hostile programs.

Run it with ``.venv/bin/python benchmarks/marking.py``. It needs bubblewrap. The floor: five minutes on two processors,
the right marks, nothing left running and nothing written outside.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "lab"))

from hostile import HONEST, HOSTILE

from elib.base.errors import Unsupported
from elib.lab import load_lab
from elib.lab.marking import mark_all
from elib.lab.sandbox import check_walls
from elib.lab.submissions import find_submissions

CLASS, HOSTILE_ONES = 100, 30
FLOOR = 300.0
"""s for a class on two processors."""
LAB = "go-10-cm"


def main() -> int:
    """Mark a class, and return the exit code."""
    try:
        check_walls()
    except Unsupported as problem:
        print(f"skipped: {problem}")
        return 0
    lab = load_lab(LAB, hidden=True)
    programs = [lab.folder / "teacher" / "solution.py", *sorted((lab.folder / "teacher" / "mistakes").glob("*.py"))]
    with tempfile.TemporaryDirectory(dir="/var/tmp") as place:
        folder = Path(place) / "class"
        folder.mkdir()
        for number in range(CLASS - HOSTILE_ONES):
            program = programs[number % len(programs)]
            shutil.copy(program, folder / f"{program.stem}_{number:02}.py")
        for name, hostile in list(HOSTILE.items())[:HOSTILE_ONES]:
            source = hostile.source.replace("{class}", str(folder)).replace("{lab}", str(lab.folder))
            folder.joinpath(f"hostile_{name}.py").write_text(source)
        before = sorted(os.listdir(folder))
        began = time.monotonic()
        marks = mark_all(lab.folder, find_submissions(folder), jobs=2)
        took = time.monotonic() - began
        written = sorted(os.listdir(folder)) != before
    wrong = []
    for mark in marks:
        name = mark.name.removesuffix(".py")
        if name.startswith("hostile_"):
            hostile = HOSTILE[name.removeprefix("hostile_")]
            gains = mark.points and (hostile.breaks or HONEST not in hostile.source)
            wrong += [name] if gains or bool(mark.broke) != hostile.breaks else []
        else:
            is_right = mark.points == mark.most if name.startswith("solution") else mark.points < mark.most
            wrong += [] if is_right and not mark.broke else [name]
    print(f"{CLASS} submissions, {HOSTILE_ONES} of them hostile, in {len(lab.variants)} variants: {took:.0f} s")
    print(f"load of the machine at the end, by others too: {os.getloadavg()[0]:.1f}")
    print(f"wrong marks: {wrong or 'none'}; written outside: {'yes' if written else 'nothing'}")
    return int(bool(wrong) or written or took > FLOOR)


if __name__ == "__main__":
    raise SystemExit(main())
