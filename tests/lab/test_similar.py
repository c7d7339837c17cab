from __future__ import annotations

import re
from itertools import combinations

from elib.base.files import LABS as FOLDER
from elib.base.files import PACKAGE
from elib.lab.similar import known, similar

LABS = PACKAGE / FOLDER
PROGRAM = (LABS / "find-the-red-box/teacher/solution.py").read_text()
OTHER = (LABS / "follow-the-line/teacher/solution.py").read_text()
START = (LABS / "find-the-red-box/start.py").read_text()


def disguised(program: str) -> str:
    """Return a program with other names, numbers, texts, comments and layout."""
    chosen = set(re.findall(r"^(?:async )?def (\w+)|^\s*(\w+) = ", program, re.MULTILINE))
    for number, name in enumerate(sorted({each for pair in chosen for each in pair if each})):
        program = re.sub(rf"(?<![.\w]){name}(?![\w(]*=)\b", f"my_{number}", program)
    program = re.sub(r"\b\d+\.?\d*\b", "7", program)
    program = re.sub(r'""".*?"""', '"""Mine."""', program, flags=re.DOTALL)
    return "# my own work\n" + "\n".join(f"{line}  # {len(line)}" for line in program.splitlines())


def test_a_copy_in_disguise_is_named() -> None:
    ((first, second, share),) = similar({"anna": PROGRAM, "ben": disguised(PROGRAM), "cleo": OTHER}, START)
    assert (first, second) == ("anna", "ben")
    assert share > 0.8


def test_different_programs_are_not() -> None:
    solutions = {lab.name: (lab / "teacher/solution.py").read_text() for lab in LABS.iterdir() if lab.is_dir()}
    # Two labs are solved by the same lines, because the same person wrote them.
    assert [pair[:2] for pair in similar(solutions)] == [("follow-the-wall", "out-of-the-maze")]


def test_a_solution_is_not_much_like_the_mistakes_of_others() -> None:
    named = []
    for lab in (each for each in LABS.iterdir() if each.is_dir()):
        mistakes = {path.stem: path.read_text() for path in (lab / "teacher/mistakes").glob("*.py")}
        solution = (lab / "teacher/solution.py").read_text()
        pairs = similar({"solution": solution, **mistakes}, (lab / "start.py").read_text())
        named += [(lab.name, *pair[:2]) for pair in pairs if "solution" in pair]
    assert {lab for lab, *_ in named} <= {"bad-link"}  # whose mistake is the solution without one line


def test_short_programs_and_what_the_lab_gave_are_not_compared() -> None:
    short = (LABS / "go-10-cm/teacher/solution.py").read_text()
    assert similar({"anna": short, "ben": short}) == []
    assert similar({"anna": PROGRAM, "ben": PROGRAM}, PROGRAM) == []


def test_what_most_of_a_class_has_does_not_count() -> None:
    assert similar({f"{number:02}": PROGRAM for number in range(12)}) == []
    few = {f"{number:02}": PROGRAM if number < 4 else f"x = {number}\n" for number in range(12)}
    assert [pair[:2] for pair in similar(few)] == list(combinations(("00", "01", "02", "03"), 2))


def test_what_is_not_python_is_compared_as_far_as_it_can_be_read() -> None:
    assert similar({"anna": "def f(:\n  '''", "ben": "\0", "cleo": "\xa3" * 1000}) == []


def test_another_name_for_the_robot_hides_nothing() -> None:
    assert "robot" not in known()
    assert {"drive", "connect", "print"} <= known()
