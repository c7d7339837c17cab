"""What a page shows of a state machine: the drawing, what its forms hold, and edits as changes of the page's text."""

from __future__ import annotations

import ast
from typing import Literal

from msgspec import Struct

from elib.simulator.drawing.shapes import Point
from elib.tools.states.drawing import draw
from elib.tools.states.edits import Splice, edited
from elib.tools.states.text import Item, MachineText, StateText, arguments_of
from elib.tools.states.words import Condition, condition_of


class ItemNews(Struct):
    """A statement of a state: its text, and of a command its name and the arguments as they are written."""

    kind: Literal["action", "look", "arrow", "code"]
    text: str
    line: int
    on_entry: bool
    command: str
    arguments: dict[str, str]


class StateNews(Struct):
    """A state: what it says of itself, where it begins, and its statements; none if it is made elsewhere."""

    name: str
    about: str
    line: int
    items: list[ItemNews]


class PartNews(Struct):
    """A condition of an arrow: in Python, and as a form gives it if one can."""

    test: str
    condition: Condition | None


class ArrowNews(Struct):
    """An arrow: in words when it is taken, the conditions that must all hold, and whether the picture can change it."""

    source: str
    target: str
    words: str
    parts: list[PartNews]
    is_plain: bool
    line: int


class MachineNews(Struct):
    """The state machine of a program: an SVG document, and what it shows."""

    svg: str
    start: str
    states: list[StateNews]
    arrows: list[ArrowNews]
    problems: list[str]


def machine_news(text: str, places: dict[str, Point]) -> MachineNews:
    """Return what a page shows of a program's machine."""
    program = MachineText(text)
    arrows = [
        ArrowNews(
            each.source,
            each.target,
            each.words,
            [
                PartNews(program.source(part), condition_of(part, program.states[each.source].looks, program.source))
                for part, _ in program.parts(each.test)
            ],
            each.item.kind == "arrow",
            each.name.lineno,
        )
        for each in program.arrows
    ]
    states = [_state(program, each) for each in program.states.values()]
    return MachineNews(draw(program, places), program.start, states, arrows, program.problems)


def changes(program: MachineText, splices: list[Splice]) -> list[Splice]:
    """Return splices of bytes as changes of a text whose positions a page counts, in units of UTF-16."""
    edited(program, splices)

    def place(at: int) -> int:
        return len(program.raw[:at].decode().encode("utf-16-le")) // 2

    ordered = sorted(splices, key=lambda each: (each.begin, each.end))
    return [Splice(place(each.begin), place(each.end), each.text) for each in ordered]


def _state(program: MachineText, state: StateText) -> StateNews:
    about = (ast.get_docstring(state.node) or "").partition("\n")[0] if state.node else "made elsewhere"
    line = (state.node or state.argument).lineno
    return StateNews(state.name, about, line, [_item(program, each) for each in state.items])


def _item(program: MachineText, item: Item) -> ItemNews:
    command, arguments = "", {}
    if item.call is not None and isinstance(item.call.func, ast.Attribute):
        command = item.call.func.attr
        arguments = {name: program.source(each) for name, each in arguments_of(item.call).items()}
    return ItemNews(item.kind, program.source(item.node), item.node.lineno, item.on_entry, command, arguments)
