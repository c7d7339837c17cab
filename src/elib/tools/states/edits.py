"""Edits of a state machine in the text of its program: each changes only the bytes that it is about.

A program that would not be Python after an edit is not made.
"""

from __future__ import annotations

import ast
import keyword
import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Annotated, TypeVar

from msgspec import Meta, Struct

from elib.base.errors import ArgumentError
from elib.behaviours._run.states import END
from elib.tools.states.text import Arrow, Function, Item, MachineText, Span, StateText, arguments_of, parameters_of
from elib.tools.states.words import SEEN, Condition

Text = Annotated[str, Meta(max_length=2000)]
Edit = TypeVar("Edit", bound=Callable[..., list["Splice"]])
IN_CODE = "it is in code that the picture cannot say"


class Splice(Struct):
    """A text that takes the place of what stands from one position to another."""

    begin: int
    end: int
    text: str


EDITS: dict[str, Callable[..., list[Splice]]] = {}
"""What a hand may do in a picture, by its name."""


def edit(act: Edit) -> Edit:
    """Note a function as an edit: it takes the program and what the hand gave, and returns what changes.

    It raises an ArgumentError, and nothing changes, where the edit cannot be made.
    """
    EDITS[act.__name__] = act
    return act


@edit
def add_state(program: MachineText, name: Text) -> list[Splice]:
    """Add a state that stops the robot when it is entered."""
    name = _new(program, name)
    made = [each for each in program.states.values() if each.node is not None]
    if not made:
        raise ArgumentError("the functions of the states are in another file", hint="add the state there")
    argument = made[-1].argument
    made = [each for each in made if type(each.argument) is type(argument)]  # functions, or methods
    model = next((each for each in made if len(_parameters(each)) > 1), made[0])
    assert model.node is not None
    indent, step = program.indent(model.node), program.step
    head = re.sub(r"(def\s+)\w+", rf"\g<1>{name}", _head(program, model), count=1)
    await_, robot = "await " * isinstance(model.node, ast.AsyncFunctionDef), _robot(model)
    body = [f"{step}{await_}{robot}.stop()"]
    if run := _run(model):
        body = [f"{step}if {run}.entered:", step + body[0]]
    last = max((each.node for each in made if each.node is not None), key=lambda node: program.span(node))
    gap = [""] * (1 if indent else 2)
    lines = [*gap, indent + head, *(indent + line for line in body)]
    named = re.sub(r"\w+$", name, program.source(argument))
    at = program.span(program.call.args[-1])[1]
    splices = [_after(program, last, lines), Splice(at, at, f", {named}")]
    if name not in edited(program, splices).states:
        raise ArgumentError("the call of elib.states is written in an odd way", hint="add it in the text")
    return splices


@edit
def rename_state(program: MachineText, state: Text, name: Text) -> list[Splice]:
    """Give a state another name, in its function and wherever the machine names it."""
    found = _state(program, state)
    if name == state:
        return []
    name = _new(program, name)
    if found.node is None:
        raise ArgumentError(f"{state} is made elsewhere", hint="rename it in the text")
    begin = program.span(found.node)[0]
    definition = re.match(r"(?:async\s+)?def\s+(\w+)", program.raw[begin:].decode())
    assert definition is not None
    before, written = definition[0].removesuffix(definition[1]), definition[1]  # Python reads letters of a kind as one
    at = begin + len(before.encode())
    spans = [(at, at + len(written.encode()))]
    named = _named(program, found)
    if any(isinstance(each, ast.arg) or isinstance(each.ctx, ast.Store) for each in named):
        raise ArgumentError(f"{state} is the name of something else too", hint="rename it in the text")
    _check_texts(program, state, [])
    for each in named:
        end = program.span(each)[1]
        spans.append((end - len(program.source(each).rpartition(".")[2].encode()), end))
    renamed = [Splice(*span, name) for span in spans]
    arrows = [_renamed(program, each, name) for each in program.arrows if each.target == state]
    return renamed + arrows


@edit
def remove_state(program: MachineText, state: Text) -> list[Splice]:
    """Remove a state with its function, and the arrows that lead to it."""
    found = _state(program, state)
    if len(program.states) == 1:
        raise ArgumentError("a machine has at least one state", hint="rename this one")
    arrows = [each for each in program.arrows if each.target == state and each.source != state]
    for each in arrows:
        if each.item.kind != "arrow":
            raise ArgumentError(f"{each.source} leads here in line {each.name.lineno}: {IN_CODE}", hint="edit the text")
    inside = [found.argument, *(ast.walk(found.node) if found.node else ())]
    for node in _named(program, found):
        if node not in inside:
            raise _named_too(node, state)
    _check_texts(program, state, inside)
    gone = [each.item.node for each in arrows]
    splices = [_without(program, each, gone[:number]) for number, each in enumerate(gone)]
    place = program.call.args.index(found.argument)
    spans = [program.span(each) for each in program.call.args]
    cut = (spans[place - 1][1], spans[place][1]) if place else (spans[0][0], spans[1][0])
    if found.node is not None:
        first = min([found.node.lineno, *(each.lineno for each in found.node.decorator_list)])
        end = program.line((found.node.end_lineno or 0) + 1)
        blank = re.match(rb"(?:[ \t]*(?:\r\n|\n|\r))*", program.raw[end:])
        splices.append(Splice(program.line(first), end + (blank.end() if blank else 0), ""))
    return [*splices, Splice(*cut, "")]


@edit
def set_start(program: MachineText, state: Text) -> list[Splice]:
    """Let the machine begin in another state."""
    argument = program.source(_state(program, state).argument)
    given = next((each for each in program.call.keywords if each.arg == "start"), None)
    if given is not None:
        return [Splice(*program.span(given.value), argument)]
    last = program.span([*program.call.args, *program.call.keywords][-1])[1]
    return [] if program.start == state else [Splice(last, last, f", start={argument}")]


@edit
def add_arrow(program: MachineText, source: Text, target: Text, condition: Condition | Text) -> list[Splice]:
    """Add an arrow behind the other arrows of a state; without a condition it is always taken."""
    state = _state(program, source)
    body = _body(program, state)
    test, look, more = _tested(program, state, condition)
    last = body[-1]
    left = last.value if isinstance(last, ast.Return) else None
    if isinstance(left, ast.Constant) and left.value is not None and not test:
        raise ArgumentError(f"{source} has an arrow that is always taken", hint="give one of them a condition")
    leave = [f'{program.step}return "{target}"'] if test else [f'return "{target}"']
    lines = [*look, *([f"if {test}:"] if test else []), *leave]
    return [*more, _at_end(program, body, [program.indent(last) + line for line in lines])]


@edit
def retarget(program: MachineText, arrow: int, target: Text) -> list[Splice]:
    """Let an arrow lead to another state. Arrows are counted from 0, in the order of states and text."""
    return [_renamed(program, _arrow(program, arrow), target)]


@edit
def set_condition(program: MachineText, arrow: int, condition: Condition | Text, part: int = 0) -> list[Splice]:
    """Give an arrow another condition, or one of those that must all hold; one more if it does not have that *part*.

    Parts are counted from 0. An empty condition takes the part away.
    """
    found = _plain(program, arrow)
    state, node = program.states[found.source], found.item.node
    body = _body(program, state)
    test, look, before = _tested(program, state, condition, node)
    indent = program.indent(node)
    if look:
        before.append(_before(program, node, [indent + line for line in look]))
    parts = program.parts(found.test)
    if parts and (part or len(parts) > 1):
        rest = " ".join(program.source(each) for k, (each, _) in enumerate(parts) if k != part)
        return [*before, *_unneeded(program, found, f"{rest} {test}"), *_part(program, parts, part, test)]
    before += _unneeded(program, found, test)
    begin = program.span(node)[0]
    if found.test is not None and test:
        return [*before, Splice(*program.span(found.test), test)]
    if test:
        return [*before, Splice(begin, begin, f"if {test}:{program.newline}{indent}{program.step}")]
    if isinstance(node, ast.Return):
        if not isinstance(node.value, ast.IfExp):
            return []
        return [*before, Splice(program.span(node.value.body)[1], program.span(node)[1], "")]
    assert isinstance(node, ast.If)
    end = program.span(node.body[0])[0]
    last = body[-1]
    if b"#" in program.raw[begin:end] or not (node is last or isinstance(last, ast.Return)):
        raise ArgumentError("what follows would never be done", hint="edit the text, or make it the last arrow")
    return [*before, Splice(begin, end, "")]


@edit
def remove_arrow(program: MachineText, arrow: int) -> list[Splice]:
    """Remove an arrow, and the reading that only it needs."""
    found = _plain(program, arrow)
    return [*_unneeded(program, found, ""), _without(program, found.item.node)]


@edit
def add_action(
    program: MachineText, state: Text, command: Text, arguments: dict[str, Text], on_entry: bool
) -> list[Splice]:
    """Add a command to what a state does: in each step, or only when it is entered."""
    found = _state(program, state)
    body, node = _body(program, found), found.node
    await_ = "await " * isinstance(node, ast.AsyncFunctionDef)
    indent, line = program.indent(body[0]), f"{await_}{_robot(found)}.{command}({_given(arguments)})"
    if not on_entry:
        arrows = [each.node for each in found.items if each.kind == "arrow"]
        return [_before(program, arrows[0], [indent + line]) if arrows else _at_end(program, body, [indent + line])]
    if entered := [each.node for each in found.items if each.on_entry]:
        return [_after(program, entered[-1], [program.indent(entered[-1]) + line])]
    assert node is not None
    run, more = _with_run(program, found)
    lines = [f"{indent}if {run}.entered:", f"{indent}{program.step}{line}"]
    documented = ast.get_docstring(node, clean=False) is not None
    is_after = documented and len(body) == 1
    place = (_after if is_after else _before)(program, body[documented and not is_after], lines)
    return [*more, place]


@edit
def set_action(program: MachineText, state: Text, item: int, arguments: dict[str, Text]) -> list[Splice]:
    """Change some arguments of a command of a state. Its statements are counted from 0."""
    call = _item(program, state, item).call
    if call is None:
        raise ArgumentError(f"this cannot be changed here: {IN_CODE}", hint="edit the text")
    there = arguments_of(call)
    if unknown := set(arguments) - set(parameters_of(call)):
        takes = ", ".join(parameters_of(call)) or "nothing"
        raise ArgumentError(
            f"{program.source(call.func)}() has no {', '.join(sorted(unknown))}", hint=f"it takes {takes}"
        )
    if any(name in there and not value for name, value in arguments.items()):
        given = {name: program.source(each) for name, each in there.items()} | arguments
        in_order = {name: given.get(name, "") for name in parameters_of(call)}
        return [Splice(program.span(call.func)[1], program.span(call)[1], f"({_given(in_order)})")]
    last = program.span(call)[1] - 1
    added = [f"{name}={value}" for name, value in arguments.items() if value and name not in there]
    _given(arguments)
    more = [Splice(last, last, ", " * bool(there) + ", ".join(added))] if added else []
    return [Splice(*program.span(there[name]), value) for name, value in arguments.items() if name in there] + more


@edit
def remove_item(program: MachineText, state: Text, item: int) -> list[Splice]:
    """Remove a statement of a state, but no reading that another one needs. They are counted from 0."""
    found = _item(program, state, item)
    if found.kind == "look":
        (name,) = found.node.targets  # type: ignore[attr-defined]  # a look is an assignment to one name
        if named := [each for each in _uses(_state(program, state), name.id) if each is not name]:
            raise ArgumentError(f"line {named[0].lineno} needs {name.id}", hint="change that first")
    return [_without(program, found.node)]


def edited(program: MachineText, splices: list[Splice]) -> MachineText:
    """Return the program after an edit."""
    raw = program.raw
    for each in sorted(splices, key=lambda each: (each.begin, each.end), reverse=True):
        raw = raw[: each.begin] + each.text.encode() + raw[each.end :]
    return MachineText(raw.decode())


# -- what edits share --


def _state(program: MachineText, name: str) -> StateText:
    if name not in program.states:
        raise ArgumentError(f"there is no state {name!r}", hint=f"there are: {', '.join(program.states)}")
    return program.states[name]


def _arrow(program: MachineText, number: int) -> Arrow:
    if not 0 <= number < len(program.arrows):
        raise ArgumentError(f"there is no arrow {number}", hint=f"there are {len(program.arrows)}")
    return program.arrows[number]


def _plain(program: MachineText, number: int) -> Arrow:
    found = _arrow(program, number)
    if found.item.kind != "arrow":
        raise ArgumentError(f"this arrow cannot be changed here: {IN_CODE}", hint="edit the text")
    return found


def _item(program: MachineText, state: str, number: int) -> Item:
    items = _state(program, state).items
    if not 0 <= number < len(items):
        raise ArgumentError(f"{state} has no statement {number}", hint=f"it has {len(items)}")
    return items[number]


def _new(program: MachineText, name: str) -> str:
    """Return a name for a state as Python reads it."""
    name = unicodedata.normalize("NFKC", name)
    if not name.isidentifier() or keyword.iskeyword(name):
        raise ArgumentError(f"{name!r} is no name of a function", hint="use letters, digits and _, as in look_around")
    named = {each.id for each in ast.walk(program.tree) if isinstance(each, ast.Name)}
    named |= {each.name for each in ast.walk(program.tree) if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef)}
    if name in named or name in program.states or name in (END, "elib"):
        raise ArgumentError(f"{name!r} is the name of something else", hint="choose another")
    return name


def _named(program: MachineText, state: StateText) -> list[ast.Name | ast.arg | ast.Attribute]:
    """Return each place that names the function of a state, but for definitions of functions."""
    name = state.name
    if isinstance(state.argument, ast.Attribute):
        own = state.node.args.args[:1] if state.node else []  # in its class it is a method of `self`
        owners = [program.source(state.argument.value), *(each.arg for each in own)]
        attributes = [each for each in ast.walk(program.tree) if isinstance(each, ast.Attribute) and each.attr == name]
        return [each for each in attributes if program.source(each.value) in owners]
    return [
        each
        for each in ast.walk(program.tree)
        if (isinstance(each, ast.Name) and each.id == name) or (isinstance(each, ast.arg) and each.arg == name)
    ]


def _check_texts(program: MachineText, name: str, inside: list[ast.AST]) -> None:
    """Raise an ArgumentError if more than the arrows names a state by a text, but for what is *inside* of it."""
    known = [*inside, *(each.name for each in program.arrows)]
    for each in ast.walk(program.tree):
        for node in ast.walk(each) if isinstance(each, ast.Return | ast.Compare | ast.MatchValue) else ():
            if isinstance(node, ast.Constant) and node.value == name and node not in known:
                raise _named_too(node, name)


def _named_too(node: ast.expr | ast.arg, name: str) -> ArgumentError:
    return ArgumentError(f"line {node.lineno} names {name} too", hint="change that in the text first")


def _body(program: MachineText, state: StateText) -> list[ast.stmt]:
    if state.node is None:
        raise ArgumentError(f"{state.name} is made elsewhere", hint="edit it there")
    if state.node.body[0].lineno == state.node.lineno:
        raise ArgumentError(f"{state.name} is written on one line", hint="put what it does on lines of its own")
    return state.node.body


def _parameters(state: StateText) -> list[str]:
    names = [each.arg for each in state.node.args.args] if state.node else []
    return names[1:] if isinstance(state.argument, ast.Attribute) else names


def _robot(state: StateText) -> str:
    return next(iter(_parameters(state)), "robot")


def _run(state: StateText) -> str:
    return next(iter(_parameters(state)[1:]), "")


def _head(program: MachineText, state: StateText) -> str:
    """Return a function from its ``def`` to the colon before its body, on one line."""
    assert state.node is not None
    begin, end = program.span(state.node)[0], program.span(state.node.body[0])[0]
    head = program.raw[begin:end]
    signature = state.node.returns or (state.node.args.args[-1] if state.node.args.args else None)
    after = program.span(signature)[1] - begin if signature is not None else 0
    return re.sub(r"\s+", " ", head[: head.index(b":", after) + 1].decode())


def _given(arguments: dict[str, str]) -> str:
    """Return the arguments of a call: by name from the first on that is left out."""
    said, is_named = [], False
    for name, value in arguments.items():
        is_named |= not value
        if value:
            _check_expression(value)
            said.append(f"{name}={value}" if is_named else value)
    return ", ".join(said)


def _check_expression(text: str) -> None:
    try:
        ast.parse(text, mode="eval")
    except (SyntaxError, ValueError):
        raise ArgumentError(f"{text!r} is not Python", hint="write a value, such as 0.5") from None
    if "\n" in text or "\r" in text or "#" in text:
        raise ArgumentError("this must be on one line, without a comment")


def _kept(program: MachineText, state: StateText, reading: str, before: ast.stmt | None) -> tuple[str, bool]:
    """Return the name that is nothing but a reading, taken before a statement, and True; else a new one, and False."""
    names = [each for each in ast.walk(state.node or ast.Pass()) if isinstance(each, ast.Name | ast.arg)]
    written = Counter(each.id for each in names if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store))
    kept = [each for each in state.items if each.keeps and each.call.func.attr == reading]  # type: ignore[union-attr]
    for item in kept:
        is_other = written[item.keeps] > sum(each.keeps == item.keeps for each in kept)
        if not is_other and (before is None or program.span(item.node) < program.span(before)):
            return item.keeps, True
    taken = {each.id if isinstance(each, ast.Name) else each.arg for each in names}
    while reading in taken:
        reading += "_now"
    return reading, False


def _tested(
    program: MachineText, state: StateText, condition: Condition | str, before: ast.stmt | None = None
) -> tuple[str, list[str], list[Splice]]:
    """Return the condition in Python, the line that takes its reading, and the parameter, if they are missing.

    It will stand before a statement of the state, or at its end.
    """
    if isinstance(condition, str):
        test = condition.strip()
        if test:
            _check_expression(test)
        return test, [], []
    is_field, is_colour = condition.value[:1] in (".", "["), condition.comparison in SEEN
    if not is_colour:
        _check_expression("it" * is_field + condition.value)
    if not condition.reading:
        run, more = _with_run(program, state)
        return f"{run}{condition.path} {condition.comparison} {condition.value}", [], more
    name, is_kept = _kept(program, state, condition.reading, before)
    value = name * is_field + condition.value
    await_ = "await " * isinstance(state.node, ast.AsyncFunctionDef)
    look = [] if is_kept else [f"{name} = {await_}{_robot(state)}.{condition.reading}()"]
    if is_colour:
        return f"{'not ' * (condition.comparison == 'not seen')}{name}{condition.path}", look, []
    return f"{name}{condition.path} {condition.comparison} {value}", look, []


def _part(program: MachineText, parts: list[tuple[ast.expr, Span]], part: int, test: str) -> list[Splice]:
    """Return what changes one of the conditions that must all hold, adds one behind them, or takes one away."""
    spans = [span for _, span in parts]
    test = _as_part(test)
    if part >= len(parts):
        begin, end = spans[-1]
        added = f" and {test}" * bool(test)
        if len(parts) > 1 or _as_part(program.source(parts[0][0])) == program.source(parts[0][0]):
            return [Splice(end, end, added)]
        return [Splice(begin, begin, "("), Splice(end, end, f"){added}")]
    if test:
        return [Splice(*spans[part], test)]
    begin, end = (spans[0][0], spans[1][0]) if part == 0 else (spans[part - 1][1], spans[part][1])
    if b"#" in program.raw[begin:end]:
        raise ArgumentError("there is a comment within the condition", hint="edit the text")
    return [Splice(begin, end, "")]


def _as_part(test: str) -> str:
    """Return a condition as it stands beside others that must hold, too."""
    node = ast.parse(test, mode="eval").body if test else None
    is_loose = isinstance(node, ast.IfExp | ast.Lambda) or (
        isinstance(node, ast.BoolOp) and isinstance(node.op, ast.Or)
    )
    return f"({test})" if is_loose else test


def _with_run(program: MachineText, state: StateText) -> tuple[str, list[Splice]]:
    """Return the name under which a state takes the run, and what makes it a parameter if it is none."""
    if run := _run(state):
        return run, []
    assert state.node is not None
    at = program.span(state.node.args.args[-1])[1]
    return "run", [Splice(at, at, ", run")]


def _unneeded(program: MachineText, arrow: Arrow, test: str) -> list[Splice]:
    """Return what takes away the readings that only the condition of an arrow needs, if *test* does not need them."""
    state = program.states[arrow.source]
    here = [each for each in ast.walk(arrow.test) if isinstance(each, ast.Name)] if arrow.test else []
    splices = []
    for item in state.items if state.node else ():
        name = item.keeps
        if name not in [each.id for each in here] or re.search(rf"\b{name}\b", test):
            continue
        named = _uses(state, name)
        rest = program.raw[program.span(item.node)[1] : program.line((item.node.end_lineno or 0) + 1)]
        if len(named) == 1 + sum(each.id == name for each in here) and not rest.strip():
            splices.append(_without(program, item.node))
    return splices if state.node and len(splices) + 1 < len(state.node.body) else []


def _uses(state: StateText, name: str) -> list[ast.Name | ast.Global | ast.Nonlocal]:
    """Return each place of a state that is about a variable, also what says that other functions see it."""
    return [
        each
        for each in ast.walk(state.node or ast.Pass())
        if (isinstance(each, ast.Name) and each.id == name)
        or (isinstance(each, ast.Global | ast.Nonlocal) and name in each.names)
    ]


def _renamed(program: MachineText, arrow: Arrow, name: str) -> Splice:
    begin, end = program.span(arrow.name)
    quote = program.raw[begin : begin + 1].decode()
    quote = quote if quote in "'\"" and program.raw[begin : begin + 3] != quote.encode() * 3 else '"'
    return Splice(begin, end, f"{quote}{name}{quote}")


def _before(program: MachineText, node: ast.stmt, lines: list[str]) -> Splice:
    at = program.line(node.lineno)
    return Splice(at, at, "".join(line + program.newline for line in lines))


def _after(program: MachineText, node: ast.stmt, lines: list[str]) -> Splice:
    at = program.line((node.end_lineno or 0) + 1)
    begins = "" if program.raw[:at].endswith((b"\n", b"\r")) else program.newline
    return Splice(at, at, begins + "".join(line + program.newline for line in lines))


def _at_end(program: MachineText, body: list[ast.stmt], lines: list[str]) -> Splice:
    """Put lines at the end of a state, in place of a ``pass``, or before its last return."""
    if isinstance(body[-1], ast.Return):
        return _before(program, body[-1], lines)
    if isinstance(body[-1], ast.Pass):
        return Splice(*program.span(body[-1]), program.newline.join(lines).lstrip())
    return _after(program, body[-1], lines)


def _without(program: MachineText, node: ast.stmt, gone: Sequence[ast.stmt] = ()) -> Splice:
    """Return the splice that takes a statement away, with its lines; what would be empty gets ``pass``.

    The statements in *gone* are taken away, too.
    """
    begin, end = program.span(node)
    first, last = program.line(node.lineno), program.line((node.end_lineno or 0) + 1)
    alone = not program.raw[first:begin].strip() and re.fullmatch(rb"\s*(#.*)?\s*", program.raw[end:last])
    if not alone:
        raise ArgumentError("it shares its line with something else", hint="edit the text")
    blocks = (each for each in ast.walk(program.tree) if isinstance(each, Function | ast.If))
    owner = next(each for each in blocks if node in each.body)
    if any(each is not node and each not in gone for each in owner.body):
        return Splice(first, last, "")
    if isinstance(owner, ast.If):
        return _without(program, owner)
    return Splice(begin, end, "pass")
