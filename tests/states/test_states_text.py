"""What is read in a program with states: conditions in words, problems, the picture, positions for a page."""

from __future__ import annotations

import ast
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pytest

import elib
from elib.base.errors import ArgumentError
from elib.cli import main
from elib.tools.states.drawing import MAX_PARTS, draw, layout, picture_of
from elib.tools.states.edits import EDITS, edited
from elib.tools.states.picture import changes, machine_news
from elib.tools.states.text import MachineText
from elib.tools.states.words import ACTIONS, Condition, forms

SAMPLE = Path(__file__).parents[2] / "src/elib/behaviours/samples/states.py"
HEAD = """import elib

async def drive(robot, run):
    near = await robot.distances()
    light = await robot.ambient_light()
    ground = await robot.ground()
    picture = await robot.image()
    selector = await robot.selector()
    sound = await robot.microphones()
"""
TAIL = """        return "turn"

async def turn(robot):
    return "drive"

elib.play(elib.states(drive, turn))
"""


@pytest.mark.parametrize(
    ("test", "words"),
    [
        ("near.ahead < 0.03", "something nearer than 3 cm ahead"),
        ("near.nearest > 0.055", "nothing nearer than 5.5 cm"),
        ("near.rear_left <= 0.02", "distances rear left at most 2 cm"),
        ("run.time_in_state > 2", "after 2 s in this state"),
        ("run.time_in_state >= WAIT", "after WAIT s in this state"),
        ("run.time > 20", "20 s after the start"),
        ("light.left < light.right", "ambient light left below right"),
        ("ground[1] < 500", "ground centre below 500 counts"),
        ("selector == 3", "selector is 3"),
        ("sound[0] > LOUD", "microphones right above LOUD"),
        ('picture.find("red")', "red is seen"),
        ('not picture.find("red") and near.ahead < 0.03', "red is not seen and something nearer than 3 cm ahead"),
        ("near.ahead < 0.03 or selector != 1", "something nearer than 3 cm ahead or selector is not 1"),
        ("max(near) > 3", "max(near) > 3"),
        ("0.03 > near.ahead", "0.03 > near.ahead"),
        ("other.ahead < 0.03", "other.ahead < 0.03"),
    ],
)
def test_a_condition_is_told_in_words_if_a_form_knows_them(test: str, words: str) -> None:
    program = MachineText(f"{HEAD}    if {test}:\n{TAIL}")
    assert [each.words for each in program.arrows] == [words, "always"]


def test_what_is_wrong_with_a_machine_is_told() -> None:
    text = HEAD + "    if near.ahead < 0.03:\n" + TAIL.replace('return "drive"', 'return "driv"')
    assert MachineText(text).problems == ["turn leads to driv, but there is no such state (line 14)"]
    text = HEAD + "    if near.ahead < 0.03:\n" + TAIL.replace('return "drive"', "pass")
    assert MachineText(text).problems == ["turn has no way out"]
    text = (
        HEAD
        + "    if near.ahead < 0.03:\n"
        + TAIL.replace("states(drive", "states(turn, drive").replace(", turn)", ")")
    )
    assert MachineText(text).problems == []
    text = HEAD + "    if near.ahead < 0.03:\n" + TAIL.replace('        return "turn"', "        pass")
    assert MachineText(text).problems == ["drive has no way out", "turn is never reached: no arrow leads to it"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("def a(:\n", "the program is not Python yet: line 1"),
        ("x = 1\n", "the program has no states"),
        ("\0", "is not Python"),
    ],
)
def test_a_program_without_a_machine_says_so(text: str, words: str) -> None:
    with pytest.raises(ArgumentError, match=words):
        MachineText(text)


@pytest.mark.parametrize(
    ("call", "given"),
    [
        ("drive, turn, start='turn'", "'turn'"),
        ("drive, turn, start=tu", "tu"),
        ("drive, turn, start=ALL[0]", "ALL[0]"),
        ("*some, drive, turn", "*some"),
        ("make('x'), drive, turn", "make('x')"),
    ],
)
def test_a_machine_whose_beginning_is_not_to_be_told_is_drawn_from_its_first_state(call: str, given: str) -> None:
    text = HEAD + "    if near.ahead < 0.03:\n" + TAIL.replace("states(drive, turn)", f"states({call})")
    assert 'data-state="turn"' in picture_of(text)
    found = machine_news(text, {})
    assert (found.start, found.problems) == (
        "drive",
        [f"it begins in {given}, which is not the name of a state (line 16)"],
    )


def test_states_without_names_are_refused_and_have_no_picture() -> None:
    text = HEAD + "    if near.ahead < 0.03:\n" + TAIL.replace("states(drive, turn)", "states(*ALL)")
    assert picture_of(text) == ""
    with pytest.raises(ArgumentError, match="the states have no names here"):
        machine_news(text, {})


def test_a_long_sum_is_drawn_and_a_program_that_is_nested_too_deeply_is_refused() -> None:
    text = HEAD + "    if near.ahead < 0.03:\n" + TAIL
    assert picture_of(text.replace("    if", f"    x = {'+'.join('1' * 1200)}\n    if")) == picture_of(text)
    nested = text.replace('return "drive"', "return " + '"drive" if robot else ' * 1200 + "None")
    assert picture_of(nested) == ""
    with pytest.raises(ArgumentError, match="nested too deeply"):
        machine_news(nested, {})


def machine_of(count: int) -> str:
    names = [f"state_{number}" for number in range(count)]
    return "".join(f"def {name}(robot):\n    pass\n" for name in names) + f"elib.states({', '.join(names)})"


def test_the_work_to_read_a_program_grows_as_its_states_do_and_one_with_too_many_is_not_drawn(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen, walk = [0], ast.walk
    monkeypatch.setattr(ast, "walk", lambda node: [seen.append(1) or each for each in walk(node)])
    work = []
    for count in (20, 40):
        seen.clear()
        assert len(MachineText(machine_of(count)).states) == count
        work.append(len(seen))
    assert work[1] < 3 * work[0]
    assert picture_of(machine_of(MAX_PARTS)) != picture_of(machine_of(MAX_PARTS + 1)) == ""


@pytest.mark.parametrize("first", ["\ufeff", "# -*- coding: latin-1 -*-\n", "\ufeff# coding: latin-1\n"])
def test_places_are_right_whatever_coding_the_first_line_names(first: str) -> None:
    program = MachineText(f"{first}def dröhnen(r): 'ä'; return 'é'\ndef é(r): pass\nelib.states(dröhnen, é)")
    after = edited(program, EDITS["rename_state"](program, "é", "z")).raw.decode()
    assert after == f"{first}def dröhnen(r): 'ä'; return 'z'\ndef z(r): pass\nelib.states(dröhnen, z)"


def test_every_reading_and_command_of_the_tables_has_a_form() -> None:
    found = forms()
    assert {"distances", "proximity", "selector", "ground", "distance"} <= {each.name for each in found.readings}
    assert {"drive", "turn", "set_speed", "set_led", "play_sound"} <= {each.name for each in found.actions}
    for each in found.actions:
        program = MachineText(SAMPLE.read_text())
        given = {argument.name: argument.value for argument in each.arguments}
        changes(program, EDITS["add_action"](program, "drive", each.name, given, True))


def test_every_action_of_the_forms_runs_with_its_first_values() -> None:
    program = MachineText("def go(robot):\n    return 'end'\n\nmachine = elib.states(go)\n")
    for each in forms().actions:
        given = {argument.name: argument.value for argument in each.arguments}
        program = edited(program, EDITS["add_action"](program, "go", each.name, given, False))
    names: dict[str, Any] = {"elib": elib}
    exec(program.raw, names)
    assert program.raw.count(b"robot.") == len(ACTIONS)
    assert elib.play(names["machine"], "sim://?firmware=epuck2&speed=max", seconds=60).reason == "done"


def test_methods_of_a_class_and_machines_are_states() -> None:
    text = '''
import elib

class Bull:
    def looking(self, robot):
        """Look round."""
        return "charging" if robot.time > 3 else None

    def charging(self, robot):
        return "looking"

bull = Bull()
roam = elib.states(bull.looking, bull.charging, name="roam")

def rest(robot):
    return "roam"

elib.play(elib.states(roam, rest))
'''
    program = MachineText(text)
    assert list(program.states) == ["roam", "rest"]
    assert program.states["roam"].node is None
    inner = MachineText(text.replace("elib.play(elib.states(roam, rest))", ""))
    assert [(each.source, each.target) for each in inner.arrows] == [("looking", "charging"), ("charging", "looking")]
    added = changes(inner, EDITS["add_state"](inner, "backing"))
    assert "    def backing(self, robot):" in added[0].text
    assert added[1].text == ", bull.backing"


def test_the_picture_is_xml_with_all_states_and_arrows_apart_from_each_other() -> None:
    names = [f"state_{i}" for i in range(9)]
    text = "import elib\n"
    for i, name in enumerate(names):
        text += f'def {name}(robot):\n    if robot.name == "<&>":\n        return "{names[(i * 4 + 1) % 9]}"\n'
        text += f'    return "{names[i - 1]}"\n'
    program = MachineText(f"{text}elib.play(elib.states({', '.join(names)}))")
    root = ElementTree.fromstring(draw(program))
    assert {each.get("data-state") for each in root.iter() if each.get("data-state")} == set(names)
    assert len([each for each in root.iter() if each.get("data-arrow")]) == len(program.arrows)
    boxes = list(layout(program, {"state_3": (900.0, 40.0)}).values())
    assert any((box.x, box.y) == (900, 40) for box in boxes)
    boxes = list(layout(program).values())
    assert not any(one.shared(other) for one in boxes for other in boxes if one is not other)


def test_a_condition_on_time_gives_a_state_the_run_that_it_does_not_take() -> None:
    program = MachineText(HEAD + "    if near.ahead < 0.03:\n" + TAIL)
    condition = Condition("", ".time_in_state", ">", "2")
    after = edited(program, EDITS["set_condition"](program, 1, condition))
    assert "async def turn(robot, run):\n    if run.time_in_state > 2:\n        return" in after.raw.decode()


def test_positions_for_a_page_count_as_its_strings_do() -> None:
    text = '"""🤖 größer"""\n' + SAMPLE.read_text()
    program = MachineText(text)
    for each in changes(program, EDITS["rename_state"](program, "drive", "roll")):
        units = text.encode("utf-16-le")
        assert units[2 * each.begin : 2 * each.end].decode("utf-16-le").strip('"') == "drive"
    assert machine_news(text, {}).states[0].about == "Drive straight on."


def test_elib_states_shows_a_machine_and_draws_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "machine.svg"
    assert main(["states", str(SAMPLE), "--draw", str(picture)]) == 0
    assert (
        "drive  (begins here)\n  something nearer than 4 cm ahead: turn\nturn\n  always: drive\n"
        in capsys.readouterr().out
    )
    assert "<svg" in picture.read_text()
    wrong = tmp_path / "wrong.py"
    wrong.write_text(SAMPLE.read_text().replace('"turn"', '"trun"'))
    with pytest.raises(SystemExit, match="1"):
        main(["states", str(wrong)])
    assert "wrong: drive leads to trun, but there is no such state (line 12)" in capsys.readouterr().out
    wrong.write_bytes(b"\xff\xfe")
    assert main(["states", str(wrong)]) == 2
    assert "is not a text in UTF-8" in capsys.readouterr().err
