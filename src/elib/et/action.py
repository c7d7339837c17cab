"""What an action is: a dataclass whose fields are its arguments, and whose help is read off them.

A new action is a file in :mod:`elib.et.actions` with a class in it; nothing else names it::

    @dataclass
    class Longest(Figure):
        \"\"\"Print the length of the longest row.\"\"\"

        length: int = field(default=0, init=False)

        def add(self, block: Block) -> None:
            self.length = max(self.length, *map(len, block.rows))

        @property
        def figure(self) -> float:
            return self.length
"""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import math
import pkgutil
import re
import typing
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import compress
from typing import Annotated, Any, ClassVar, Generic, TypeVar

from elib.errors import ArgumentError
from elib.et.rows import NAMES, NUMBER, Block
from elib.et.table import Table

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Argument(Generic[T]):
    """How a field is given on the command line.

    Attributes:
        label: ``COLUMN``, or ``--by COLUMN`` if it is an option.
        convert: Makes the value; a ValueError says what it must be.
        help: What it is.
        is_many: All the words that are left.
    """

    label: str
    convert: Callable[[str], T]
    help: str
    is_many: bool = False

    @property
    def option(self) -> str:
        """Its name if it is an option, or an empty string."""
        return self.label.split()[0] if self.label.startswith("-") else ""


@dataclass(frozen=True, slots=True)
class Parameter:
    """A field of an action, and how it is given."""

    field: str
    argument: Argument[Any]
    default: object = dataclasses.MISSING


class ColumnNumber(int):
    """The number of a column.

    Attributes:
        label: What plots call it: its name, if it was given by name.
    """

    label: str


def to_column(text: str) -> ColumnNumber:
    """Return the number of a column that was given by number or name."""
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
    """Return what makes a whole number within limits."""

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
    """Return percentages that were given with commas between."""
    return tuple(map(to_percentage, text.split(",")))


Column = Annotated[ColumnNumber, Argument("COLUMN", to_column, "A number from 0, or a name; -1 is the last column.")]
By = Annotated[
    ColumnNumber | None, Argument("--by COLUMN", to_column, "A row of results for each word of this column.")
]
Percentiles = Annotated[
    tuple[float, ...],
    Argument("--percentiles P,P", to_percentages, "Which to give; each is a value of the log (the nearest rank)."),
]


class Output(typing.Protocol):
    """Where results go, whatever their format."""

    def copy(self, block: Block, rows: Sequence[bytes]) -> None:
        """Write some of the rows of *block*."""
        ...

    def write(self, table: Table) -> None:
        """Write a table; its rows may be made on the way."""
        ...


class Action(ABC):
    """What et can do with rows.

    Attributes:
        is_streaming: Whether results come while rows are read, not only behind the last one.
    """

    is_streaming: ClassVar[bool] = False

    @abstractmethod
    def run(self, blocks: Iterable[Block], output: Output) -> None:
        """Read all rows and write what comes of them.

        Raises:
            RowError: A row is not what the action needs.
        """

    @property
    def notes(self) -> list[str]:
        """What a person should know besides the results."""
        return []


class Filter(Action):
    """Copies some of the rows."""

    is_streaming = True

    @abstractmethod
    def keep(self, block: Block) -> Iterable[bool]:
        """Return for each row of *block* whether it is copied."""

    def run(self, blocks: Iterable[Block], output: Output) -> None:
        """Copy the rows that are to be kept."""
        for block in blocks:
            output.copy(block, list(compress(block.rows, self.keep(block))))


class Figure(Action):
    """Prints one number."""

    @abstractmethod
    def add(self, block: Block) -> None:
        """Take the rows of *block*."""

    @property
    @abstractmethod
    def figure(self) -> float:
        """The number."""

    def run(self, blocks: Iterable[Block], output: Output) -> None:
        """Print the number with 8 decimals."""
        for block in blocks:
            self.add(block)
        output.write(Table.of_figure(type(self).__name__.lower(), self.figure))


class Summary(Action):
    """Prints a table when all rows are read."""

    @abstractmethod
    def add(self, block: Block) -> None:
        """Take the rows of *block*."""

    @abstractmethod
    def table(self) -> Table:
        """Return what was found out."""

    def run(self, blocks: Iterable[Block], output: Output) -> None:
        """Print the table."""
        for block in blocks:
            self.add(block)
        output.write(self.table())


class Plotted(ABC):
    """An action whose results can be drawn too."""

    @abstractmethod
    def draw(self, axes: Any) -> None:
        """Draw on Matplotlib *axes*, after the run."""


def actions() -> dict[str, type[Action]]:
    """Return all actions by name, in order of their files' names."""
    from elib.et import actions as package

    found: dict[str, type[Action]] = {}
    for module in sorted(pkgutil.iter_modules(package.__path__), key=lambda each: each.name):
        found |= {kind.__name__: kind for kind in _actions_in(f"{package.__name__}.{module.name}")}
    return found


def _actions_in(module: str) -> Iterator[type[Action]]:
    for name, kind in vars(importlib.import_module(module)).items():
        is_own = isinstance(kind, type) and issubclass(kind, Action) and kind.__module__ == module
        if is_own and not name.startswith("_") and not inspect.isabstract(kind):
            yield kind


def parameters(kind: type[Action]) -> list[Parameter]:
    """Return what an action is given, in order."""
    hints = typing.get_type_hints(kind, include_extras=True)
    found = []
    for field in dataclasses.fields(typing.cast("Any", kind)):
        if field.init:
            argument = next(each for each in hints[field.name].__metadata__ if isinstance(each, Argument))
            found.append(Parameter(field.name, argument, field.default))
    return found


def make(kind: type[Action], words: Sequence[str], options: dict[str, str]) -> Action:
    """Return an action with its arguments.

    Args:
        kind: Its class.
        words: Arguments by place.
        options: Arguments by name.

    Raises:
        ArgumentError: One is missing, wrong or too much.
    """
    left = list(words)
    values: dict[str, object] = {}
    for each in parameters(kind):
        argument = each.argument
        if argument.option:
            if argument.option in options:
                values[each.field] = _converted(kind, argument, options[argument.option])
        elif argument.is_many:
            values[each.field] = tuple(_converted(kind, argument, word) for word in left)
            left = []
        elif left:
            values[each.field] = _converted(kind, argument, left.pop(0))
        elif each.default is dataclasses.MISSING:
            raise ArgumentError(
                f"{kind.__name__} needs {argument.label}: {argument.help[:1].lower()}{argument.help[1:].rstrip('.')}",
                hint=f"et {kind.__name__} --help",
            )
    if left:
        raise ArgumentError(f"{kind.__name__} takes no {left[0]!r}", hint=f"usage: et {usage(kind)}")
    return typing.cast("Callable[..., Action]", kind)(**values)


def usage(kind: type[Action]) -> str:
    """Return how an action is called, on a line, without the program's name."""
    words = [kind.__name__]
    for each in parameters(kind):
        label = each.argument.label + ("..." if each.argument.is_many else "")
        is_needed = each.default is dataclasses.MISSING and not each.argument.is_many
        words.append(label if is_needed else f"[{label}]")
    return " ".join(words)


def summary(kind: type[Action]) -> str:
    """Return the first line of what an action says about itself."""
    return (inspect.getdoc(kind) or "").partition("\n")[0]


def _converted(kind: type[Action], argument: Argument[T], text: str) -> T:
    try:
        return argument.convert(text)
    except ValueError as error:
        label = argument.option or argument.label
        raise ArgumentError(
            f"{label} of {kind.__name__} is {text!r}; {error}", hint=f"usage: et {usage(kind)}"
        ) from None
