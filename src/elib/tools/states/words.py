"""Conditions in words and in Python, and what a form needs to know of readings and commands: all from their tables."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from typing import Final, Literal

from msgspec import Struct

from elib.link.protocol.colours import Hue
from elib.link.protocol.commands import SPECS
from elib.link.protocol.distances import Distances
from elib.link.protocol.profiles import rule
from elib.link.protocol.quantities import Quantity
from elib.link.protocol.table import example_of
from elib.link.protocol.values import READING_TYPES, Counts, FieldInfo, Reading, Role, Single, describe, in_words
from elib.robot.actions import Actions

Looks = Mapping[str, str]
Comparison = Literal["<", "<=", ">", ">=", "==", "!=", "seen", "not seen"]
"""How a condition compares a number, or whether a colour is in a picture."""

READINGS: Final[dict[str, type[Reading]]] = {
    "distances": Distances,
    **{name: READING_TYPES[name] for name in ("ground", "ambient_light", "microphones", "selector")},
    **{name: READING_TYPES[name] for name in SPECS if name in READING_TYPES},
}
"""What a condition may compare, the usual first: the class of each reading by the method that returns it."""
PICTURE: Final = "image"
"""The method that returns a picture, in which a condition may look for a colour."""
ACTIONS: Final = (
    *("set_speed", "drive", "turn", "stop"),
    *("set_led", "set_body_led", "set_front_led", "set_rgb_led", "play_sound"),
    *("set_velocity", "go_to"),
)
"""Commands that a form offers; others are for the text."""
TIMES: Final = {".time_in_state": "after {} s in this state", ".time": "{} s after the start"}
"""What a condition may compare of the run, and its words."""
COMPARISONS: Final = {"<": "below", "<=": "at most", ">": "above", ">=": "at least", "==": "is", "!=": "is not"}
SEEN: Final = {"seen": "is seen", "not seen": "is not seen"}
SIGNS: Final[dict[type[ast.cmpop], Comparison]] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
DEGREES: Final = math.degrees(1)
UNITS: Final = {"m": (100, "cm"), "rad": (DEGREES, "degrees"), "m/s": (100, "cm/s"), "rad/s": (DEGREES, "degrees/s")}
"""In what a person is told a number: how many times as much, and the unit."""


class ReadingField(Struct):
    """A number of a reading: its words, how Python reads it from the reading, and its unit as a person is told it.

    Attributes:
        scale: How many of this unit are one of the program's.
    """

    label: str
    path: str
    unit: str
    scale: float


class ReadingForm(Struct):
    """A reading that conditions may compare: its method, its words and its numbers."""

    name: str
    title: str
    fields: list[ReadingField]


class ArgumentForm(Struct):
    """An argument of a command: what it may be, its value in the example, and what it can be chosen from if anything.

    Attributes:
        unit: Its unit as a person is told it.
        scale: How many of this unit are one of the program's.
    """

    name: str
    rule: str
    value: str
    choices: list[str]
    unit: str
    scale: float


class ActionForm(Struct):
    """A command that a state may give: its method, a sentence, and its arguments."""

    name: str
    about: str
    arguments: list[ArgumentForm]


class Forms(Struct):
    """All that the forms of a picture offer."""

    readings: list[ReadingForm]
    actions: list[ActionForm]


class Condition(Struct):
    """A condition as a form gives it.

    Attributes:
        reading: The method that returns what is compared; empty for a time of the run.
        path: How Python reads the number from the reading, like ``.ahead`` or ``[0]``.
        comparison: How it is compared.
        value: With what, in Python: a number in the program's unit, or the path of another number of the reading;
            empty for a colour.
    """

    reading: str
    path: str
    comparison: Comparison
    value: str


def fields_of(reading: str) -> list[ReadingField]:
    """Return the numbers of a reading that a condition may compare, or the colours that it may look for."""
    if reading == PICTURE:
        return [ReadingField(hue.lower(), f'.find("{hue.lower()}")', "", 1.0) for hue in Hue.__members__]
    kind = READINGS[reading]
    found = [_field(info, f".{info.name}") for info in describe(kind, Role.NUMBER)]
    if issubclass(kind, Single):
        return [_field(describe(kind, Role.NUMBER)[0], "", "")]
    if issubclass(kind, Counts):
        (info,) = describe(kind, Role.NUMBER)
        return [_field(info, f"[{number}]", in_words(name)) for number, name in enumerate(info.names)]
    if kind is Distances:
        found[:0] = [_field(describe(kind, Role.NUMBER)[0], f".{name}", name) for name in ("ahead", "nearest")]
    return found


def _field(info: FieldInfo, path: str, label: str | None = None) -> ReadingField:
    scale, unit = UNITS.get(info.unit, (1.0, info.unit))
    return ReadingField(info.words if label is None else label, path, unit, scale)


def forms() -> Forms:
    """Return what the forms of a picture offer."""
    readings = [ReadingForm(name, in_words(name), fields_of(name)) for name in READINGS]
    readings.append(ReadingForm(PICTURE, "camera", fields_of(PICTURE)))
    return Forms([each for each in readings if each.fields], [_action(name) for name in ACTIONS])


def _action(name: str) -> ActionForm:
    """Return the form of a command; the first values are those of its example."""
    spec, method = SPECS.get(name), getattr(Actions, name)
    quantities = {each.name: each.quantity for each in spec.parameters} if spec else {}
    if not spec:  # a map has no form
        quantities = {each: quantity for each, quantity in method.quantities.items() if quantity is not None}
    example = spec.example if spec else example_of(method.__doc__)
    code = "\n".join(line[4:] for line in example.splitlines() if line.startswith((">>> ", "... ")))
    calls = [each for each in ast.walk(ast.parse(code)) if isinstance(each, ast.Call)]
    call = next((each for each in calls if isinstance(each.func, ast.Attribute) and each.func.attr == name), None)
    given = dict(zip(quantities, call.args, strict=False)) if call else {}
    given |= {each.arg: each.value for each in call.keywords if each.arg} if call else {}
    about = method.__doc__.partition("\n")[0]
    values = {each: _number(value) for each, value in given.items()}
    arguments = [_argument(each, quantity, values.get(each, "")) for each, quantity in quantities.items()]
    return ActionForm(name, about, arguments)


def _argument(name: str, quantity: Quantity, value: str) -> ArgumentForm:
    scale, unit = UNITS.get(quantity.unit, (1.0, quantity.unit))
    choices = [repr(each.lower()) for each in quantity.names.__members__] if quantity.names else []
    return ArgumentForm(name, rule(quantity), value, choices, unit, scale)


def _number(value: ast.expr) -> str:
    """Return an argument of an example, without a name of a module that the program may not import."""
    try:
        return repr(ast.literal_eval(value))
    except ValueError:
        return f"{eval(ast.unparse(value), {'math': math}):.2f}"  # of a docstring of elib


def words(test: ast.expr, looks: Looks, source: Callable[[ast.AST], str]) -> str:
    """Return a condition in words; what has none stays as it is in the program."""
    match test:
        case ast.BoolOp(op=op, values=values):
            joint = " and " if isinstance(op, ast.And) else " or "
            said = [(each, words(each, looks, source)) for each in values]
            return joint.join(f"({text})" if isinstance(each, ast.BoolOp) else text for each, text in said)
    found = condition_of(test, looks, source)
    if found is not None:
        return _said(found)
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return f"not {words(test.operand, looks, source)}"
    return source(test)


def _said(condition: Condition) -> str:
    """Return a condition that a form can give in words."""
    if not condition.reading:
        return TIMES[condition.path].format(condition.value)
    fields = {each.path: each for each in fields_of(condition.reading)}
    if condition.comparison in SEEN:
        return f"{fields[condition.path].label} {SEEN[condition.comparison]}"
    field, other = fields[condition.path], fields.get(condition.value)
    try:
        value = f"{float(condition.value) * field.scale:.6g} {field.unit}".strip()
    except ValueError:
        value = condition.value if other is None else other.label
    if condition.reading == "distances" and condition.comparison in ("<", ">") and other is None:
        thing = "something" if condition.comparison == "<" else "nothing"
        return f"{thing} nearer than {value}{field.label.join((' ', '')) if field.label != 'nearest' else ''}"
    parts = (in_words(condition.reading), field.label, COMPARISONS[condition.comparison], value)
    return " ".join(filter(None, parts))


def condition_of(test: ast.expr, looks: Looks, source: Callable[[ast.AST], str]) -> Condition | None:
    """Return a condition as a form gives it; None if no form can."""
    match test:
        case ast.UnaryOp(op=ast.Not(), operand=ast.Call() as call) if (seen := _seen(call, looks)) is not None:
            return Condition(PICTURE, seen, "not seen", "")
        case ast.Call() if (seen := _seen(test, looks)) is not None:
            return Condition(PICTURE, seen, "seen", "")
        case ast.Compare(left=left, ops=[op], comparators=[right]) if (sign := SIGNS.get(type(op))) is not None:
            run, _, path = source(left).rpartition(".")
            if run == "run" and f".{path}" in TIMES and sign in (">", ">="):
                return Condition("", f".{path}", sign, source(right))
            found, other = _read(left, looks, source), _read(right, looks, source)
            if found is not None:
                is_same = other is not None and other[0] == found[0]
                return Condition(*found, sign, other[1] if other is not None and is_same else source(right))
    return None


def _seen(call: ast.Call, looks: Looks) -> str | None:
    """Return the path of the colour that a call looks for in a picture, if a form offers it."""
    match call:
        case ast.Call(func=ast.Attribute(value=ast.Name(id=name), attr="find"), args=[ast.Constant(value=str(colour))]):
            path = f'.find("{colour}")'
            if looks.get(name) == PICTURE and any(each.path == path for each in fields_of(PICTURE)):
                return path
    return None


def _read(node: ast.expr, looks: Looks, source: Callable[[ast.AST], str]) -> tuple[str, str] | None:
    """Return the reading and the path of the number of it that an expression takes, if a form offers it."""
    owner = node if isinstance(node, ast.Name) else getattr(node, "value", None)
    reading = looks.get(owner.id) if isinstance(owner, ast.Name) else None
    if reading not in READINGS or not isinstance(owner, ast.Name):
        return None
    path = source(node)[len(owner.id) :]
    return (reading, path) if any(each.path == path for each in fields_of(reading)) else None
