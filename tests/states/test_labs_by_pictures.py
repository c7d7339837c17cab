"""Three labs are solved by a hand in the picture alone: from the sample of the studio, by edits, without typing."""

from __future__ import annotations

from pathlib import Path

import pytest

from elib.lab import Variant, VariantResult, load_lab, run_variant
from elib.lab.running import PlainProgram
from elib.tools.states.edits import EDITS, edited
from elib.tools.states.text import MachineText
from elib.tools.states.words import Condition
from lanes import short

Edit = tuple[object, ...]

SAMPLE = (Path(__file__).parents[2] / "src/elib/behaviours/samples/states.py").read_text(encoding="utf-8")
"""What "New state machine" opens: two states, which drive, and turn away from what is near."""


def begun(state: str, left: float, right: float) -> list[Edit]:
    """A new state that sets the speeds of the wheels when it begins, in place of its stop."""
    return [
        ("add_state", state),
        ("remove_item", state, 0),
        ("add_action", state, "set_speed", {"left": str(left), "right": str(right)}, True),
    ]


def less(reading: str, one: str, other: str) -> Condition:
    return Condition(reading, one, "<", other)


OLD: list[Edit] = [("remove_state", "turn"), ("remove_state", "drive")]
AHEAD_IS_BRIGHTER = less("ambient_light", ".front_left", ".rear_left")
BEHIND_IS_BRIGHTER = less("ambient_light", ".rear_left", ".front_left")
LEFT_IS_BRIGHTER = less("ambient_light", ".left", ".right")
RIGHT_IS_BRIGHTER = less("ambient_light", ".right", ".left")

BY_PICTURE: dict[str, list[Edit]] = {
    "avoid": [
        ("set_condition", 0, Condition("distances", ".ahead", "<", "0.045")),
        ("set_action", "turn", 0, {"angle": "1.2"}),
    ],
    "follow-the-line": [
        *begun("to_the_left", 0.15, 0.45),
        *begun("to_the_right", 0.45, 0.15),
        *OLD,
        ("add_arrow", "to_the_left", "to_the_right", less("ground", "[2]", "[0]")),
        ("add_arrow", "to_the_right", "to_the_left", less("ground", "[0]", "[2]")),
    ],
    "go-to-the-light": [
        *begun("search", -0.2, 0.2),
        *begun("to_the_left", 0.0, 0.4),
        *begun("to_the_right", 0.4, 0.0),
        *OLD,
        ("add_arrow", "search", "to_the_left", AHEAD_IS_BRIGHTER),
        ("add_arrow", "to_the_left", "end", BEHIND_IS_BRIGHTER),
        ("add_arrow", "to_the_left", "to_the_right", RIGHT_IS_BRIGHTER),
        ("add_arrow", "to_the_right", "end", BEHIND_IS_BRIGHTER),
        ("add_arrow", "to_the_right", "to_the_left", LEFT_IS_BRIGHTER),
    ],
}
"""What the hand does, lab by lab."""

SAID = {
    "avoid": ["something nearer than 4.5 cm ahead", "always"],
    "follow-the-line": ["ground right below left", "ground left below right"],
    "go-to-the-light": [
        "ambient light front left below rear left",
        "ambient light rear left below front left",
        "ambient light right below left",
        "ambient light rear left below front left",
        "ambient light left below right",
    ],
}
"""How the picture then says when its arrows are taken."""

LABS = {name: load_lab(name, hidden=True) for name in BY_PICTURE}
TRIED = [(name, variant.name) for name, lab in LABS.items() for variant in lab.variants]


def drawn(name: str) -> MachineText:
    program = MachineText(SAMPLE)
    for act, *given in BY_PICTURE[name]:
        program = edited(program, EDITS[str(act)](program, *given))
    return program


def tried(name: str, variant: Variant, folder: Path) -> VariantResult:
    path = folder / "drawn.py"
    path.write_bytes(drawn(name).raw)
    return run_variant(LABS[name], variant, lambda link: PlainProgram(path, link), wall=300)


def told(result: VariantResult) -> str:
    goals = "; ".join(f"{each.goal.name}: {each.text}" for each in result.goals)
    return f"{result.ending} {result.why}; {goals}; it printed: {result.output[-500:]}"


@pytest.mark.parametrize("name", BY_PICTURE)
def test_all_that_a_hand_drew_is_said_in_words_and_by_forms(name: str) -> None:
    program = drawn(name)
    assert [each.words for each in program.arrows] == SAID[name]
    assert program.problems == []
    items = [item for state in program.states.values() for item in state.items]
    assert all(item.kind != "code" for item in items)


@pytest.mark.parametrize(
    ("name", "variant"),
    short(TRIED, ("go-to-the-light", "given")),
)
def test_what_a_hand_drew_passes_the_lab(name: str, variant: str, tmp_path: Path) -> None:
    result = tried(name, LABS[name].variant(variant), tmp_path)
    assert result.passed, told(result)
