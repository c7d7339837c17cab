"""Edits of the picture of a state machine change the bytes that they are about, on programs as people write them."""

from __future__ import annotations

import ast
import io
import random
import tokenize
from collections import Counter
from itertools import pairwise

import pytest

from elib.base.errors import ArgumentError
from elib.tools.states.edits import EDITS, Splice, edited
from elib.tools.states.text import Arrow, MachineText, StateText
from elib.tools.states.words import Condition
from lanes import short

NAMES = ("drive", "turn", "flee", "größer", "look_around", "stehen", "état", "z9", "μ", "back_up")
CONDITIONS: tuple[Condition | str, ...] = (
    Condition("distances", ".ahead", "<", "0.03"),
    Condition("distances", ".nearest", ">", "0.05"),
    Condition("microphones", "[1]", ">", "300"),
    Condition("selector", "", "==", "3"),
    Condition("ambient_light", ".left", "<", ".right"),
    Condition("", ".time_in_state", ">", "2.5"),
    Condition("image", '.find("red")', "not seen", ""),
    "run.random.random() < 0.1",
    "robot.time > 3 or robot.name",
    "(robot.time > 2) and  ((robot.name))",
    "1 if robot.name else robot.time",
    'robot.name in {"a": "{b}"}',
    "",
)
COMMENTS = ("# why", "# 'turn' is {here}", '# "drive"', "# größer als\u2028zuvor", "#")
COMMANDS = (("set_speed", {"left": "0.4", "right": "0.4"}), ("turn", {"angle": "1.6"}), ("stop", {}))


class Writer:
    """Writes a program of states with odd spacing, comments, strings and line ends."""

    def __init__(self, seed: int) -> None:
        self.draw = random.Random(seed)
        self.newline = self.draw.choice(("\n", "\n", "\r\n"))
        self.indent = self.draw.choice(("    ", "  ", "\t"))
        self.names = self.draw.sample(NAMES, self.draw.randint(1, 5))
        self.is_async = self.draw.random() < 0.8
        self.has_hints = self.draw.random() < 0.3

    def comment(self) -> str:
        return "  " + self.draw.choice(COMMENTS) if self.draw.random() < 0.3 else self.draw.choice(("", "", " ", "\t"))

    def quoted(self, name: str) -> str:
        quote = self.draw.choice("'\"")
        return f"{quote}{name}{quote}"

    def target(self) -> str:
        return self.quoted(self.draw.choice((*self.names, "end")))

    def head(self, name: str, takes: int) -> str:
        parameters = ["robot: elib.Epuck", "run: elib.RunContext"] if self.has_hints else ["robot", "run"]
        word, after = "async def" if self.is_async else "def", " -> str | None" if self.has_hints else ""
        return f"{word} {name}({', '.join(parameters[:takes])}){after}:"

    def state(self, name: str) -> list[str]:
        takes, wait = self.draw.choice((1, 2, 2, 2)), "await " if self.is_async else ""
        if self.draw.random() < 0.1:
            return [f"{self.head(name, takes)} return {self.target()}"]
        body: list[str] = []
        if self.draw.random() < 0.5:
            body.append(f'"""{name} is {{braced}} and "quoted"; return \'{self.draw.choice(self.names)}\'."""')
        if takes > 1 and self.draw.random() < 0.5:
            body += ["if run.entered:" + self.comment(), self.indent + f"{wait}robot.set_speed(0.4,  0.4)"]
        for _ in range(self.draw.randint(0, 3)):
            kinds = (
                [f"{wait}robot.stop()"],
                ['said = f"{robot.name}: {{}}"'],
                ["x = [ 1,", "2 ]" + self.comment()],
                [f"distances = {wait}robot.proximity()", "print(distances)"],
                ["print(selector)"],
                [""],
            )
            body += self.draw.choice(kinds)
        for _ in range(self.draw.randint(0, 3)):
            body += self.arrow(wait) + [""] * self.draw.choice((0, 0, 1))
        body.append(self.draw.choice(("pass", "return None", f"return {self.target()}", "return")) + self.comment())
        return [self.head(name, takes) + self.comment(), *(self.indent + each if each else "" for each in body)]

    def arrow(self, wait: str) -> list[str]:
        match self.draw.randrange(4):
            case 0:
                look = f"near = {wait}robot.distances(){self.comment()}"
                leave = self.indent + f"return {self.target()}{self.comment()}"
                return [look, "if near.ahead<0.04 :" + self.comment(), leave]
            case 1:
                return [f"if robot.time > 9: return {self.target()}{self.comment()}"]
            case 2:
                loop = [f"for _ in range(3):{self.comment()}", self.indent + "if robot.time>3:"]
                return [*loop, 2 * self.indent + f"return {self.target()}"]
        return []

    def program(self) -> str:
        lines = ['"""A program {of} states."""', "", "import elib" + self.comment(), 'LIMITS = {"turn": 3}']
        for name in self.names:
            lines += [""] * self.draw.randint(0, 3) + [self.draw.choice(COMMENTS)] * self.draw.choice((0, 0, 1))
            lines += self.state(name)
        call = ", ".join(self.names) + f", start={self.draw.choice(self.names)}" * (self.draw.random() < 0.2)
        if self.draw.random() < 0.3:
            call = self.newline + "".join(f"    {each},  # first, then{self.newline}" for each in self.names)
        lines += ["", "", f"elib.play(elib.states({call}))"]
        return self.newline.join(lines) + self.draw.choice((self.newline, "", self.newline * 2))


Model = tuple[list[str], list[tuple[str, str, str]]]


def model(program: MachineText) -> Model:
    """The states, and source, target and condition of each arrow."""
    return list(program.states), [(each.source, each.target, each.words) for each in program.arrows]


def comments(program: MachineText) -> set[str]:
    read = io.StringIO(program.raw.decode(), newline="").readline
    return {each.string for each in tokenize.generate_tokens(read) if each.type == tokenize.COMMENT}


def drawn_edit(draw: random.Random, program: MachineText) -> tuple[str, tuple[object, ...]]:
    states = list(program.states)
    state, other, arrow = draw.choice(states), draw.choice([*states, "end"]), draw.randrange(len(program.arrows) or 1)
    command, arguments = draw.choice(COMMANDS)
    name, condition = draw.choice(NAMES), draw.choice(CONDITIONS)
    given: dict[str, tuple[object, ...]] = {
        "add_state": (name,),
        "rename_state": (state, name),
        "remove_state": (state,),
        "set_start": (state,),
        "add_arrow": (state, other, condition),
        "retarget": (arrow, other),
        "set_condition": (arrow, condition, draw.choice((0, 0, 1, 2, 3))),
        "remove_arrow": (arrow,),
        "add_action": (state, command, arguments, draw.random() < 0.5),
        "set_action": (state, draw.randrange(4), {"left": "0.1", "right": "-0.1"}),
        "remove_item": (state, draw.randrange(4)),
    }
    chosen = draw.choice(list(EDITS))
    return chosen, given[chosen]


def expected(before: MachineText, name: str, given: tuple[object, ...]) -> Model | None:
    """What the picture shows after an edit; None where the edit is about more than one of these."""
    states, arrows = model(before)
    match name, given:
        case "add_state", (new,):
            return [*states, str(new)], arrows
        case "rename_state", (old, new):
            change = {str(old): str(new)}
            renamed = [(change.get(a, a), change.get(b, b), words) for a, b, words in arrows]
            return [change.get(each, each) for each in states], renamed
        case "remove_state", (old,):
            return [each for each in states if each != old], [each for each in arrows if old not in each[:2]]
        case "retarget", (int(number), target):
            return states, [(a, str(target), w) if i == number else (a, b, w) for i, (a, b, w) in enumerate(arrows)]
        case "remove_arrow", (int(number),):
            return states, [each for i, each in enumerate(arrows) if i != number]
        case (("add_action" | "set_action" | "set_start"), _):
            return states, arrows
    return None


def conditions(program: MachineText, arrow: int) -> list[str]:
    return [program.raw[begin:end].decode() for _, (begin, end) in program.parts(program.arrows[arrow].test)]


def expected_conditions(before: list[str], part: int, condition: object) -> list[str | None]:
    """The conditions of an arrow after an edit of one of them, each as it is written; None for the new one."""
    return [*before[:part], *[None] * bool(condition), *before[part + 1 :]]


def names_in(state: StateText) -> Counter[tuple[str, bool]]:
    """How often a state uses each name, and how often it gives it a value."""
    assert state.node is not None
    names = [each for each in ast.walk(state.node) if isinstance(each, ast.Name)]
    used = [(each.id, False) for each in names]
    return Counter([*used, *((each.id, True) for each in names if isinstance(each.ctx, ast.Store))])


def is_taken_before(program: MachineText, arrow: Arrow) -> bool:
    """Whether each reading that a condition compares is taken above it."""
    state = program.states[arrow.source]
    begins = {item.node: program.span(item.node)[0] for item in state.items if item.kind == "look"}
    compared = [each for each in ast.walk(arrow.test or ast.Pass()) if isinstance(each, ast.Name)]
    return all(
        each.id not in state.looks
        or any(at < program.span(each)[0] and node.targets[0].id == each.id for node, at in begins.items())  # type: ignore[attr-defined]
        for each in compared
    )


def taken_back(after: bytes, before: bytes, splices: list[Splice]) -> bytes:
    """Return the bytes before: each splice, the last place first, gives back what it replaced."""
    ordered = sorted(splices, key=lambda each: (each.begin, each.end))
    places, moved = [], 0
    for each in ordered:
        places.append(each.begin + moved)
        moved += len(each.text.encode()) - (each.end - each.begin)
    for at, each in reversed(list(zip(places, ordered, strict=True))):
        after = after[:at] + before[each.begin : each.end] + after[at + len(each.text.encode()) :]
    return after


def check(seed: int, edits: int) -> int:
    """Edit a drawn program so many times; return how many edits were made."""
    draw = random.Random(seed)
    program = MachineText(Writer(seed).program())
    first, history = program.raw, []
    for _ in range(edits):
        name, given = drawn_edit(draw, program)
        told = f"seed {seed}: {name}{given} on\n{program.raw.decode()}"
        try:
            splices = EDITS[name](program, *given)
        except ArgumentError:
            continue
        try:
            after = edited(program, splices)
        except ArgumentError as error:
            raise AssertionError(told) from error
        spans = sorted((each.begin, each.end) for each in splices)
        assert all(one[1] <= other[0] for one, other in pairwise(spans)), told
        wanted = expected(program, name, given)
        assert wanted is None or model(after) == wanted, told
        assert name in ("rename_state", "add_state", "remove_state") or list(after.states) == list(program.states), told
        if name not in ("remove_state", "remove_arrow", "remove_item"):
            assert comments(program) <= comments(after), told
        assert all(each.node is not None for each in after.states.values()), told
        if name == "set_condition" and isinstance(given[1], Condition | str) and " and " not in str(given[1]):
            number, condition, part = given
            assert isinstance(number, int)
            assert isinstance(part, int)
            found, wanted_ones = (
                conditions(after, number),
                expected_conditions(conditions(program, number), part, condition),
            )
            assert len(found) == len(wanted_ones), told
            pairs = zip(wanted_ones, found, strict=True)  # what stands alone needs no parentheses
            assert all(one is None or one.strip("()") == other.strip("()") for one, other in pairs), told
        if name in ("add_arrow", "set_condition"):
            used = {state.name: names_in(state) for state in program.states.values()}
            for state in after.states.values():
                given_anew = names_in(state) - used[state.name]
                assert not any(is_set and used[state.name][each, False] for each, is_set in given_anew), told
            assert all(is_taken_before(after, each) for each in after.arrows), told
        assert name != "set_start" or after.start == given[0], told
        assert len(after.arrows) - len(program.arrows) == (name == "add_arrow") or name.startswith("remove"), told
        assert after.raw.count(b"\r\n") == after.raw.count(b"\n") or b"\r" not in first, told
        history.append((program.raw, splices))
        program = after
    for before, splices in reversed(history):
        program = MachineText(taken_back(program.raw, before, splices).decode())
        assert program.raw == before
    assert program.raw == first
    return len(history)


@pytest.mark.parametrize("lot", short(range(5), 0))
def test_an_edit_changes_only_what_it_is_about_and_can_be_taken_back(lot: int) -> None:
    done = sum(check(seed, edits=90) for seed in range(20 * lot, 20 * lot + 20))
    assert done > 500


TWO_ARROWS = """import elib
speed = 0.3

def drive(robot, run):
    robot.set_speed(speed, speed)
    if run.time > 3:
        return "turn"
    if run.time > 9:
        return "end"

def turn(robot, run):
    distances = robot.proximity()
    print(distances)
    return "drive"

elib.play(elib.states(drive, turn))
"""


def changed(text: str, name: str, *given: object) -> str:
    program = MachineText(text)
    return edited(program, EDITS[name](program, *given)).raw.decode()


def test_a_condition_whose_reading_is_taken_below_it_takes_it_again() -> None:
    near = Condition("distances", ".ahead", "<", "0.04")
    text = changed(changed(TWO_ARROWS, "set_condition", 1, near), "set_condition", 0, near)
    assert '    distances_now = robot.distances()\n    if distances_now.ahead < 0.04:\n        return "turn"' in text
    assert '    distances = robot.distances()\n    if distances.ahead < 0.04:\n        return "end"' in text
    again = changed(text, "add_arrow", "drive", "turn", near)
    assert again.count("robot.distances()") == 2


def test_a_reading_for_a_condition_gets_a_name_that_the_state_uses_for_nothing_else() -> None:
    text = changed(TWO_ARROWS, "set_condition", 0, Condition("speed", ".left", ">", "0.1"))
    assert "    speed_now = robot.speed()\n    if speed_now.left > 0.1:" in text
    text = changed(TWO_ARROWS, "set_condition", 2, Condition("distances", ".ahead", "<", ".left"))
    assert "    distances_now = robot.distances()\n    if distances_now.ahead < distances_now.left:" in text
    mixed = TWO_ARROWS.replace("print(distances)", "distances = robot.distances()\n    distances = 3")
    text = changed(mixed, "set_condition", 2, Condition("distances", ".ahead", "<", "0.04"))
    assert "    distances_now = robot.distances()\n    if distances_now.ahead < 0.04:" in text


INNER = """import elib

def search(robot, run):
    if run.time > 10:
        return "rest"

def rest(robot, run):
    if run.time_in_state > 3:
        return "end"

explore = elib.states(search, name="explore")
elib.play(elib.states(explore, rest))
"""
HELPED = """import elib

def decide(near):
    return "turn" if near else "drive"

def drive(robot):
    return decide(robot.distances().ahead < 0.04)

def turn(robot):
    return "drive"

elib.play(elib.states(drive, turn))
"""
LOOKS_BACK = """import elib

def drive(robot, run):
    if run.previous_state == "turn":
        robot.stop()

def turn(robot):
    return "drive"

elib.play(elib.states(drive, turn))
"""
MATCHED = LOOKS_BACK.replace('if run.previous_state == "turn":', 'match run.previous_state:\n      case "turn":')


@pytest.mark.parametrize(
    ("text", "state", "line"), [(INNER, "rest", 5), (HELPED, "turn", 4), (LOOKS_BACK, "turn", 4), (MATCHED, "turn", 5)]
)
def test_a_state_that_more_than_arrows_name_is_neither_renamed_nor_removed(text: str, state: str, line: int) -> None:
    for name, more in (("rename_state", ("other",)), ("remove_state", ())):
        with pytest.raises(ArgumentError, match=f"line {line} names {state} too"):
            changed(text, name, state, *more)


METHODS = """import elib

class Bull:
    def drive(self, robot):
        robot.turn(1.6)
        return "turn"

    def turn(self, robot):
        self.turn
        return "turn"

    def machine(self):
        return elib.states(self.drive, self.turn, start=self.turn, exits={self.turn: print})
"""


def test_a_method_that_is_a_state_is_renamed_wherever_it_is_named_and_not_removed_before() -> None:
    after = changed(METHODS, "rename_state", "turn", "spin")
    assert after == METHODS.replace("def turn", "def spin").replace("self.turn", "self.spin").replace(
        '"turn"', '"spin"'
    )
    outside = METHODS.partition("    def machine")[0] + "bull = Bull()\nelib.states(bull.drive, bull.turn)\n"
    after = changed(outside, "rename_state", "turn", "spin")
    assert after.endswith("elib.states(bull.drive, bull.spin)\n")
    assert "self.spin" in after
    with pytest.raises(ArgumentError, match="line 13 names turn too"):
        changed(METHODS, "remove_state", "turn")
    assert "turn" not in changed(outside, "remove_state", "turn").replace("robot.turn", "")


@pytest.mark.parametrize(
    "call", ["drive, helper.turn", "drive, make('x')", "drive, *more", "helper.turn, drive, start=drive"]
)
def test_a_new_state_is_named_as_those_of_this_file_whatever_else_the_machine_has(call: str) -> None:
    text = f"import elib\n\ndef drive(robot):\n    robot.stop()\n\nelib.states({call})\n"
    after = changed(text, "add_state", "rest")
    arguments, keyword, start = call.partition(", start")
    assert f"elib.states({arguments}, rest{keyword}{start})" in after
    assert "rest" in MachineText(after).states


def test_a_new_state_of_functions_and_methods_is_as_the_last_of_them() -> None:
    text = METHODS.partition("    def machine")[0] + "def go(robot, run):\n    pass\n\n"
    after = changed(f"{text}bull = Bull()\nelib.states(go, bull.drive)\n", "add_state", "rest")
    assert "\n    def rest(self, robot):\n" in after
    assert after.endswith("elib.states(go, bull.drive, bull.rest)\n")
    with pytest.raises(ArgumentError, match="add it in the text"):
        changed(f"{text}elib.states(go, (go))\n", "add_state", "rest")


def test_an_edit_goes_to_the_last_function_of_a_name_as_python_does() -> None:
    text = TWO_ARROWS.replace("def turn(robot, run):", "def turn(robot, run):\n    pass\n\ndef turn(robot, run):")
    assert changed(text, "add_action", "turn", "stop", {}, False).count("robot.stop()\n    return") == 1
    assert MachineText(text).arrows[-1].target == "drive"


def test_an_arrow_is_removed_from_a_program_with_lambdas_and_conditional_expressions() -> None:
    states = TWO_ARROWS.replace("\n", "\n    ")
    text = f"fast = lambda: 0.3\nslow = 0.3 if fast() else 0.2\ndef main():\n    {states}"
    after = text.replace('        if run.time > 9:\n            return "end"\n', "")
    assert changed(text, "remove_arrow", 1) == after != text


@pytest.mark.parametrize("word", ["global", "nonlocal"])
def test_a_reading_that_other_functions_see_is_not_removed(word: str) -> None:
    states = f"""
def drive(robot):
    {word} seen
    seen = robot.distances()
    if seen.ahead < 0.04:
        return "turn"

def turn(robot):
    print(seen)

elib.states(drive, turn)
"""
    text = "def main():\n    seen = 0" + states.replace("\n", "\n    ")
    assert "seen = robot.distances()" in changed(text, "remove_arrow", 0)
    assert "seen = robot.distances()" in changed(text, "set_condition", 0, "robot.time > 3")
    with pytest.raises(ArgumentError, match="needs seen"):
        changed(changed(text, "remove_arrow", 0), "remove_item", "drive", 1)


def test_a_state_that_only_leads_to_one_that_is_removed_does_nothing() -> None:
    text = TWO_ARROWS.replace("    robot.set_speed(speed, speed)\n", "").replace('"end"', '"turn"')
    after = changed(text, "remove_state", "turn")
    assert after.partition("def drive(robot, run):\n")[2] == "    pass\n\nelib.play(elib.states(drive))\n"
