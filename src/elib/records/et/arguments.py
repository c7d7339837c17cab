"""Arguments of a command line, declared as annotated fields of a dataclass: what each is called, and its rule."""

from __future__ import annotations

import re
import typing
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, replace
from typing import Annotated, Any

from elib.base.errors import ArgumentError
from elib.base.rules import REQUIRED, Number, Rule, Several
from elib.records.et.rows import NAMES


@dataclass(frozen=True, slots=True)
class Parameter:
    """How a field is given on the command line. It stands in the field's type, behind ``Annotated``."""

    label: str  # `COLUMN`, `--by COLUMN` for an option, or `WORD...` for all the words that are left
    rule: Rule  # what its value must be
    help: str  # what the argument is
    field: str = ""  # name of the field; set by arguments_of
    default: object = REQUIRED  # value of an argument that is left out; set by arguments_of

    @property
    def option(self) -> str:
        """The name of an option; an empty string for any other argument."""
        return self.label.split()[0] if self.label.startswith("-") else ""

    @property
    def is_required(self) -> bool:
        """Whether the argument must be given."""
        return self.default is REQUIRED


class Words(Rule):
    """Any words."""

    def accept(self, value: object) -> Any:
        """Return *value*."""
        return value


class FileName(Rule):
    """The name of a file; ``-`` is None, which stands for standard input or output."""

    def __str__(self) -> str:
        return "the name of a file"

    def accept(self, value: object) -> str | None:
        """Return the name, or None."""
        if not isinstance(value, str) or not value or "\0" in value:
            raise self.refuse(value)
        return None if value == "-" else value


class ColumnNumber(int):
    """The number of a column."""

    label: str  # what plots call the column: its name, if it was given by name


class _ColumnRule(Rule):
    def __str__(self) -> str:
        return f"a number, counted from 0, or one of {', '.join(NAMES)}"

    def accept(self, value: object) -> ColumnNumber:
        """Return the number of a column that was given by number or by name."""
        name = str(value).lower()
        if name not in NAMES and not re.fullmatch(r"[+-]?[0-9]{1,6}", name):
            raise self.refuse(value)
        column = ColumnNumber(NAMES.get(name, name))
        column.label = name if name in NAMES else f"column {column}"
        return column


PERCENTAGE = Number(0, 100)
Column = Annotated[
    ColumnNumber, Parameter("COLUMN", _ColumnRule(), "A number from 0, or a name; -1 is the last column.")
]
By = Annotated[
    ColumnNumber | None, Parameter("--by COLUMN", _ColumnRule(), "A row of results for each word of this column.")
]
Percentiles = Annotated[
    tuple[float, ...],
    Parameter(
        "--percentiles P,P",
        Several(PERCENTAGE, 1, 100),
        "Which to print; each is a value of the log (the nearest rank).",
    ),
]


def arguments_of(kind: type) -> list[Parameter]:
    """Return the arguments that a dataclass declares, in order."""
    hints = typing.get_type_hints(kind, include_extras=True)
    return [
        replace(argument, field=field.name, default=REQUIRED if field.default is MISSING else field.default)
        for field in fields(kind)
        for argument in getattr(hints[field.name], "__metadata__", ())
        if isinstance(argument, Parameter)
    ]


def values_of(kind: type, options: Mapping[str, str], words: Sequence[str] = (), *, name: str = "") -> dict[str, Any]:
    """Return the values of a dataclass's fields, by name; those that were not given are left out.

    Options of other classes may be among the *options*. The *name* of the action is for messages.
    """
    left = list(words)
    values: dict[str, Any] = {}
    for argument in arguments_of(kind):
        rule, label = argument.rule, (argument.option or argument.label) + (name and f" of {name}")
        if argument.option in options:
            values[argument.field] = rule.require(rule.read(options[argument.option]), label)
        elif argument.label.endswith("..."):
            values[argument.field], left = tuple(rule.require(word, label) for word in left), []
        elif left and not argument.option:
            values[argument.field] = rule.require(rule.read(left.pop(0)), label)
        elif argument.is_required:
            what = argument.help[:1].lower() + argument.help[1:].rstrip(".")
            raise ArgumentError(f"{name} needs {argument.label}: {what}", hint=f"et {name} --help")
    if left:
        raise ArgumentError(f"{name} does not take {left[0]!r}", hint=f"usage: et {usage(kind)}")
    return values


def usage(kind: type) -> str:
    """Return how an action is called, on one line, without the program's name."""
    labels = (each.label if each.is_required else f"[{each.label}]" for each in arguments_of(kind))
    return " ".join([kind.__name__, *labels])
