"""How long it takes to mark a class of 100, of whom 30 hand in hostile programs.

It needs bubblewrap. The floor: five minutes on two processors, the right marks, nothing left running and nothing
written outside. It ends with exit code 1 if one of them fails.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from pathlib import Path

from harness import Tables, quick, run, use_tests

use_tests("lab")

from hostile import HONEST, HOSTILE  # noqa: E402

from elib.base.errors import Unsupported  # noqa: E402
from elib.lab import load_lab  # noqa: E402
from elib.lab.marking import mark_all  # noqa: E402
from elib.lab.sandbox import check_walls  # noqa: E402
from elib.lab.submissions import find_submissions  # noqa: E402

FLOOR = 300.0
"""s for a class on two processors."""
LAB = "go-10-cm"


@quick(honest=2, hostile=2)
def measure(*, honest: int = 70, hostile: int = 30) -> Tables:
    """Mark a class.

    Args:
        honest: Submissions that are not hostile.
        hostile: Submissions that are.
    """
    try:
        check_walls()
    except Unsupported as problem:
        print(f"skipped: {problem}")
        return
    lab = load_lab(LAB, hidden=True)
    programs = [lab.folder / "teacher" / "solution.py", *sorted((lab.folder / "teacher" / "mistakes").glob("*.py"))]
    with tempfile.TemporaryDirectory(dir="/var/tmp") as place:
        folder = Path(place) / "class"
        folder.mkdir()
        for number in range(honest):
            program = programs[number % len(programs)]
            shutil.copy(program, folder / f"{program.stem}_{number:02}.py")
        for name, attack in list(HOSTILE.items())[:hostile]:
            source = attack.source.replace("{class}", str(folder)).replace("{lab}", str(lab.folder))
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
            attack = HOSTILE[name.removeprefix("hostile_")]
            gains = mark.points and (attack.breaks or HONEST not in attack.source)
            wrong += [name] if gains or bool(mark.broke) != attack.breaks else []
        else:
            is_right = mark.points == mark.most if name.startswith("solution") else mark.points < mark.most
            wrong += [] if is_right and not mark.broke else [name]
    title = f"{honest + hostile} submissions, {hostile} of them hostile, in {len(lab.variants)} variants"
    yield (
        title,
        {
            "s": {"figure": took, "goal": f"{FLOOR:g}"},
            "load of the machine at the end, by others too": {"figure": os.getloadavg()[0]},
            "wrong marks": {"figure": ", ".join(wrong) or "none"},
            "written outside": {"figure": "something" if written else "nothing"},
        },
    )
    if wrong or written or took > FLOOR:
        raise SystemExit(1)


if __name__ == "__main__":
    run(__doc__, measure)
