"""Every program of states in documents and samples has a picture without a problem, and the tutorial's is drawn."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from pages import PAGES, ROOT, name_of, programs
from test_labs_by_pictures import SAMPLE

from elib.tools.states.drawing import draw
from elib.tools.states.edits import EDITS, edited
from elib.tools.states.text import MachineText

WRONG = "except elib.ArgumentError"
"""What a program has that shows an error."""
DRAWN = [
    ("retarget", 0, "turn"),
    ("set_condition", 0, "distances.ahead < 0.02"),
    ("add_state", "state_3"),
    ("rename_state", "state_3", "back_up"),
    ("remove_item", "back_up", 0),
    ("add_action", "back_up", "set_speed", {"left": "0.5", "right": "0.25"}, True),
    ("set_action", "back_up", 0, {"left": "-0.3", "right": "-0.3"}),
    ("retarget", 0, "back_up"),
    ("add_arrow", "back_up", "turn", "run.time_in_state > 1"),
]
"""What the reader of the tutorial does in the picture."""


def texts() -> Iterator[tuple[str, str]]:
    """Yield the programs of states with what they are called, those of a page with the blocks before them."""
    for path in [*(ROOT / "src/elib/behaviours").rglob("*.py"), *(ROOT / "examples").glob("*.py")]:
        text = path.read_text(encoding="utf-8")
        if "elib.states(" in text and path.parent.name != "_run":
            yield path.name, text
    for page in PAGES:
        before: list[str] = []
        for block, _ in programs(page):
            if WRONG not in block.text:
                before = [] if page.parent.name == "cookbook" else before
                before.append(block.text)
                if "elib.states(" in block.text:
                    yield f"{name_of(page)}:{block.line}", "\n".join(before)


TEXTS = dict(texts())


def test_there_are_programs_of_states_in_the_tutorial_the_guide_the_cookbook_and_the_samples() -> None:
    found = {name.partition(":")[0] for name in TEXTS}
    pages = {f"docs/{name}.md" for name in ("tutorial/06-first-states", "guides/states", "cookbook/behaviours")}
    assert {"states.py", *pages} <= found


@pytest.mark.parametrize("name", TEXTS)
def test_a_program_of_states_has_a_picture_without_a_problem(name: str) -> None:
    program = MachineText(TEXTS[name])
    assert program.problems == []
    assert draw(program).startswith("<svg")


def test_the_program_of_the_tutorial_is_what_the_picture_makes() -> None:
    program = MachineText(SAMPLE)
    for act, *given in DRAWN:
        program = edited(program, EDITS[act](program, *given))
    written = next(block.text for block, _ in programs(ROOT / "docs/tutorial/06-first-states.md"))
    begin, end = (program.raw.decode().index(part) for part in ("import elib", "\n\n\nif __name__"))
    assert program.raw.decode()[begin:end] == written.rstrip()
