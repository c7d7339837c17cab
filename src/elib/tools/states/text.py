"""Read the state machine of a program from its text, by the spans of Python's syntax tree.

Nothing is written here: :mod:`edits` says which bytes of the text an edit changes, and all others stay as they are.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Literal

from elib.base.errors import ArgumentError
from elib.behaviours._run.states import END, targets, unreached
from elib.link.protocol.commands import SPECS
from elib.robot.actions import Actions
from elib.tools.states.words import READINGS, Looks, words

Function = ast.FunctionDef | ast.AsyncFunctionDef
Kind = Literal["action", "look", "arrow", "code"]
Span = tuple[int, int]
BOM = "\N{BYTE ORDER MARK}"


@dataclass(frozen=True, slots=True)
class Item:
    """A statement of a state."""

    # `action` is a command to the robot, `look` keeps a reading under a name, `arrow` leaves the state on a condition
    # or always, and `code` is anything else
    kind: Kind
    node: ast.stmt  # the statement
    on_entry: bool = False  # whether it is done only in the first step of the state
    call: ast.Call | None = None  # the command or the reading, of an action or a look

    @property
    def keeps(self) -> str:
        """The name under which a look keeps its reading; empty for others."""
        return self.node.targets[0].id if self.kind == "look" else ""  # type: ignore[attr-defined]  # it assigns to a name


@dataclass(frozen=True, slots=True)
class Arrow:
    """A way from a state to another."""

    source: str  # the state that it leaves
    name: ast.Constant  # the string that names its target
    item: Item  # the statement that it stands in; an arrow can be removed only if that is of the kind `arrow`
    test: ast.expr | None  # the condition; None if there is none, or if it is in code
    words: str  # the condition in words

    @property
    def target(self) -> str:
        """The name of the state that it leads to."""
        return str(self.name.value)


@dataclass(frozen=True, slots=True)
class StateText:
    """A state of the machine."""

    name: str
    argument: ast.expr  # what names it in the call of `elib.states`
    node: Function | None  # its function; None if it is a machine of its own, or defined elsewhere
    items: tuple[Item, ...] = ()  # its statements, without its docstring and without what does nothing
    looks: Looks = field(default_factory=dict)  # the readings that it keeps, by the names under which it keeps them


class MachineText:
    """A program with a state machine: the last call of ``elib.states`` in it."""

    def __init__(self, text: str) -> None:
        self.raw = text.encode()  # the text as bytes; positions count them
        self.newline = next(iter(re.findall(r"\r\n|\n|\r", text)), "\n")  # what ends its lines
        try:
            # Bytes would be read in the coding that a comment names, and these are UTF-8.
            self.tree = ast.parse(text.removeprefix(BOM))  # its syntax tree
        except (RecursionError, MemoryError):
            raise _too_deep() from None
        except (SyntaxError, ValueError) as error:
            line = f"line {error.lineno}: {error.msg}" if isinstance(error, SyntaxError) else str(error)
            raise ArgumentError(f"the program is not Python yet: {line}", hint="mend it in the text") from None
        calls = [each for each in ast.walk(self.tree) if isinstance(each, ast.Call) and each.args]
        calls = [each for each in calls if _name(each.func) == "states"]
        if not calls:
            raise ArgumentError("the program has no states", hint="elib.play(elib.states(drive, turn))")
        self.call = max(calls, key=lambda each: self.span(each))
        if not self.states:
            raise ArgumentError("the states have no names here", hint="name them: elib.states(drive, turn)")

    # -- places --

    @cached_property
    def _starts(self) -> list[int]:
        return [
            len(BOM.encode()) * self.raw.startswith(BOM.encode()),
            *(found.end() for found in re.finditer(rb"\r\n|\n|\r", self.raw)),
        ]

    def line(self, number: int) -> int:
        """Return where a line begins; the end of the text for the line after the last."""
        return self._starts[number - 1] if number <= len(self._starts) else len(self.raw)

    def span(self, node: ast.AST) -> Span:
        """Return where a node begins and ends."""
        return (
            self.line(node.lineno) + node.col_offset,  # type: ignore[attr-defined]  # all that is asked for has them
            self.line(node.end_lineno) + node.end_col_offset,  # type: ignore[attr-defined]
        )

    def source(self, node: ast.AST) -> str:
        """Return the text of a node."""
        begin, end = self.span(node)
        return self.raw[begin:end].decode()

    def parts(self, test: ast.expr | None) -> list[tuple[ast.expr, Span]]:
        """Return the conditions that must all hold, each with where it and its parentheses begin and end."""
        if test is None:
            return []
        begin, end = self.span(test)
        if not (isinstance(test, ast.BoolOp) and isinstance(test.op, ast.And)):
            return [(test, (begin, end))]
        found = []
        for left, right in pairwise(test.values):
            after, before = self.span(left)[1], self.span(right)[0]
            gap = re.sub(rb"#[^\r\n]*", lambda comment: b" " * len(comment[0]), self.raw[after:before])
            word = re.search(rb"\band\b", gap)
            assert word is not None
            found.append((left, (begin, after + len(gap[: word.start()].rstrip(b" \t\r\n\\")))))
            begin = before - len(gap[word.end() :].lstrip(b" \t\r\n\\"))
        return [*found, (test.values[-1], (begin, end))]

    def indent(self, node: ast.AST) -> str:
        """Return what stands before a node on its line, if that is nothing but space; else as many spaces."""
        begin = self.span(node)[0]
        before = self.raw[self.line(node.lineno) : begin].decode()  # type: ignore[attr-defined]
        return before if before.isspace() else " " * len(before)

    @cached_property
    def step(self) -> str:
        """What a line of this program is indented by, within a block."""
        for each in ast.walk(self.tree):
            body = getattr(each, "body", ())
            if isinstance(each, ast.stmt) and isinstance(body, list) and body and body[0].lineno > each.lineno:
                return self.indent(body[0])[len(self.indent(each)) :]
        return "    "

    # -- the machine --

    @cached_property
    def states(self) -> dict[str, StateText]:
        """The states by name, in the order of the call."""
        found = (self._state(each) for each in self.call.args)
        return {each.name: each for each in found if each}

    @property
    def start(self) -> str:
        """The name of the state in which it begins; of the first that has one, where that is not to be told."""
        name = _name(self._first)
        return name if name in self.states else next(iter(self.states))

    @property
    def _first(self) -> ast.expr:
        return next((each.value for each in self.call.keywords if each.arg == "start"), self.call.args[0])

    @cached_property
    def arrows(self) -> list[Arrow]:
        """All arrows, in the order of the states and of the text."""
        try:
            return [arrow for state in self.states.values() for arrow in self._arrows(state)]
        except RecursionError:
            raise _too_deep() from None

    @property
    def problems(self) -> list[str]:
        """What is wrong with the machine, in sentences."""
        leaves = {each.source for each in self.arrows}
        said = [
            f"{each.source} leads to {each.target}, but there is no such state (line {each.name.lineno})"
            for each in self.arrows
            if each.target not in (*self.states, END)
        ]
        open_ones = {
            name
            for name, state in self.states.items()
            if state.node is None or any(target is None for _, target in targets(state.node.body))
        }
        ways = [*((each.source, each.target) for each in self.arrows), *((name, None) for name in open_ones)]
        if _name(self._first) not in self.states:
            said.append(
                f"it begins in {self.source(self._first)}, which is not the name of a state (line {self._first.lineno})"
            )
        lonely = unreached(self.start, self.states, ways)
        for name in self.states:
            said += [f"{name} is never reached: no arrow leads to it"] * (name in lonely)
            said += [f"{name} has no way out"] * (name not in leaves | open_ones and len(self.states) > 1)
        return said

    def _state(self, argument: ast.expr) -> StateText | None:
        name = _name(argument)
        if not name:
            return None
        is_method = isinstance(argument, ast.Attribute)
        node = self._functions.get((name, is_method))
        if node is None:
            return StateText(name, argument, None)
        items = tuple(self._items(node, node.body))
        looks = {item.keeps: item.call.func.attr for item in items if item.keeps}  # type: ignore[union-attr]
        return StateText(name, argument, node, items, looks)

    @cached_property
    def _functions(self) -> dict[tuple[str, bool], Function]:
        """The functions by their names and whether they are methods: the outermost, and of those the last."""
        found: dict[tuple[str, bool], Function] = {}
        for owner in ast.walk(self.tree):
            for each in reversed([*ast.iter_child_nodes(owner)]):
                if isinstance(each, Function):
                    found.setdefault((each.name, isinstance(owner, ast.ClassDef)), each)
        return found

    def _items(self, function: Function, body: list[ast.stmt], on_entry: bool = False) -> Iterator[Item]:
        for node in body:
            match node:
                case ast.Pass() | ast.Return(value=None | ast.Constant(value=None)):
                    pass
                case ast.Expr(value=ast.Constant(value=str())):
                    pass
                case ast.If(test=ast.Attribute(attr="entered"), body=inner, orelse=[]) if not on_entry:
                    yield from self._items(function, inner, on_entry=True)
                case _ if not on_entry and _is_arrow(node):
                    yield Item("arrow", node)
                case ast.Expr(value=value) if (call := self._asked(function, value)) and not _reads(call):
                    yield Item("action", node, on_entry, call)
                case ast.Assign(targets=[ast.Name()], value=value) if (call := self._asked(function, value)) and (
                    _reads(call) and not on_entry
                ):
                    yield Item("look", node, on_entry, call)
                case _:
                    yield Item("code", node, on_entry)

    @staticmethod
    def _asked(function: Function, value: ast.expr) -> ast.Call | None:
        """Return the call of a method of the robot: of the function's first argument, or of the one after ``self``."""
        call = value.value if isinstance(value, ast.Await) else value
        match call:
            case ast.Call(func=ast.Attribute(value=ast.Name(id=owner), attr=name)) if hasattr(Actions, name):
                return call if owner in [each.arg for each in function.args.args[:2]] else None
        return None

    def _arrows(self, state: StateText) -> Iterator[Arrow]:
        rest = "always"
        for item in state.items:
            plain = _is_arrow(item.node) if item.kind == "arrow" else None
            for _, name in targets([item.node]):
                if name is not None:
                    test = plain[1] if plain else None
                    said = words(test, state.looks, self.source) if test else rest if plain else "in code"
                    yield Arrow(state.name, name, item, test, said)
            if item.kind == "code" and any(isinstance(node, ast.Return) for node in ast.walk(item.node)):
                rest = "otherwise"


def _too_deep() -> ArgumentError:
    return ArgumentError("the program is nested too deeply to be read", hint="write it in shorter steps")


def parameters_of(call: ast.Call) -> list[str]:
    """Return the names of what a method of the robot takes."""
    assert isinstance(call.func, ast.Attribute)
    return [each for each in inspect.signature(getattr(Actions, call.func.attr)).parameters if each != "self"]


def arguments_of(call: ast.Call) -> dict[str, ast.expr]:
    """Return the arguments of a call of a method of the robot by their names."""
    named = {each.arg: each.value for each in call.keywords if each.arg}
    return {**dict(zip(parameters_of(call), call.args, strict=False)), **named}


def _is_arrow(node: ast.stmt) -> tuple[ast.Return, ast.expr | None] | None:
    """Return the return, and its condition if there is one, of a statement that does nothing but leave the state."""
    match node:
        case ast.If(test=test, body=[ast.Return(value=ast.Constant(value=str())) as found], orelse=[]):
            return found, test
        case ast.Return(value=ast.IfExp(test=test, body=ast.Constant(value=str()), orelse=ast.Constant(value=None))):
            return node, test
        case ast.Return(value=ast.Constant(value=str())):
            return node, None
    return None


def _reads(call: ast.Call) -> bool:
    name = call.func.attr if isinstance(call.func, ast.Attribute) else ""
    return name in READINGS or (name in SPECS and SPECS[name].is_reading)


def _name(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""
