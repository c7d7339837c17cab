"""Arguments of a command line, declared as annotated fields of a dataclass: what each is called, and how it is read."""

from __future__ import annotations

import math
import re
import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, replace
from typing import Annotated, Any, Generic, TypeVar

from elib.base.errors import ArgumentError
from elib.base.fields import REQUIRED
from elib.records.et.rows import NAMES, NUMBER

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Argument(Generic[T]):
    """How a field is given on the command line. It stands in the field's type, behind ``Annotated``.

    Attributes:
        label: ``COLUMN``, or ``--by COLUMN`` for an option.
        convert: Function that returns the value of a word, or raises a ValueError that says what the word must be.
        help: What the argument is.
        is_many: The argument takes all the words that are left.
        field: Name of the field; set by :func:`arguments_of`.
        default: Value of an argument that is left out; set by :func:`arguments_of`.
    """

    label: str
    convert: Callable[[str], T]
    help: str
    is_many: bool = False
    field: str = ""
    default: object = REQUIRED

    @property
    def option(self) -> str:
        """The name of an option; an empty string for any other argument."""
        return self.label.split()[0] if self.label.startswith("-") else ""

    @property
    def is_required(self) -> bool:
        """Whether the argument must be given."""
        return self.default is REQUIRED and not self.is_many


class ColumnNumber(int):
    """The number of a column.

    Attributes:
        label: What plots call the column: its name, if it was given by name.
    """

    label: str


def to_column(text: str) -> ColumnNumber:
    """Return the number of a column that was given by number or by name."""
    if text.lower() not in NAMES and not re.fullmatch(r"[+-]?[0-9]{1,6}", text):
        raise ValueError(f"it must be a number, counted from 0, or one of {', '.join(NAMES)}")
    name = text.lower() if text.lower() in NAMES else ""
    column = ColumnNumber(NAMES[name] if name else text)
    column.label = name or f"column {column}"
    return column


def to_number(text: str) -> float:
    """Return a finite number."""
    if not NUMBER.fullmatch(text.encode("utf-8", "replace")) or not math.isfinite(float(text)):
        raise ValueError("it must be a number")
    return float(text)


def to_count(least: int, most: int) -> Callable[[str], int]:
    """Return a function that reads a whole number from *least* to *most*."""

    def convert(text: str) -> int:
        if not re.fullmatch(r"[0-9]{1,9}", text) or not least <= int(text) <= most:
            raise ValueError(f"it must be a whole number from {least} to {most}")
        return int(text)

    return convert


def to_percentage(text: str) -> float:
    """Return a percentage from 0 to 100."""
    try:
        value = to_number(text)
    except ValueError:
        value = -1
    if not 0 <= value <= 100:
        raise ValueError("it must be from 0 to 100")
    return value


def to_percentages(text: str) -> tuple[float, ...]:
    """Return percentages that were given with commas between them."""
    return tuple(map(to_percentage, text.split(",")))


Column = Annotated[ColumnNumber, Argument("COLUMN", to_column, "A number from 0, or a name; -1 is the last column.")]
By = Annotated[
    ColumnNumber | None, Argument("--by COLUMN", to_column, "A row of results for each word of this column.")
]
Percentiles = Annotated[
    tuple[float, ...],
    Argument("--percentiles P,P", to_percentages, "Which to print; each is a value of the log (the nearest rank)."),
]


def arguments_of(kind: type) -> list[Argument[Any]]:
    """Return the arguments that a dataclass declares, in order."""
    hints = typing.get_type_hints(kind, include_extras=True)
    return [
        replace(argument, field=field.name, default=REQUIRED if field.default is MISSING else field.default)
        for field in fields(kind)
        for argument in getattr(hints[field.name], "__metadata__", ())
        if isinstance(argument, Argument)
    ]


def values_of(kind: type, options: Mapping[str, str], words: Sequence[str] = (), *, name: str = "") -> dict[str, Any]:
    """Return the values of a dataclass's fields, by name; those that were not given are left out.

    Args:
        kind: The class.
        options: Arguments by name; those of other classes may be among them.
        words: Arguments by place.
        name: Name of the action whose arguments they are, for messages; empty for those of et itself.

    Raises:
        ArgumentError: An argument is missing or wrong, or there is one too many.
    """
    left = list(words)
    values: dict[str, Any] = {}
    for argument in arguments_of(kind):
        if argument.option:
            if argument.option in options:
                values[argument.field] = _converted(argument, options[argument.option], kind, name)
        elif argument.is_many:
            values[argument.field] = tuple(_converted(argument, word, kind, name) for word in left)
            left = []
        elif left:
            values[argument.field] = _converted(argument, left.pop(0), kind, name)
        elif argument.is_required:
            what = argument.help[:1].lower() + argument.help[1:].rstrip(".")
            raise ArgumentError(f"{name} needs {argument.label}: {what}", hint=f"et {name} --help")
    if left:
        raise ArgumentError(f"{name} does not take {left[0]!r}", hint=f"usage: et {usage(kind)}")
    return values


def usage(kind: type) -> str:
    """Return how an action is called, on one line, without the program's name."""
    words = [kind.__name__]
    for argument in arguments_of(kind):
        label = argument.label + ("..." if argument.is_many else "")
        words.append(label if argument.is_required else f"[{label}]")
    return " ".join(words)


def _converted(argument: Argument[T], text: str, kind: type, name: str) -> T:
    try:
        return argument.convert(text)
    except ValueError as error:
        label = argument.option or argument.label
        hint = f"usage: et {usage(kind)}" if name else f"usage: {argument.label}"
        raise ArgumentError(f"{label}{name and f' of {name}'} is {text!r}; {error}", hint=hint) from None
