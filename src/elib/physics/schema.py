"""Reading a TOML table key by key, so that every mistake is named with its file, its key and a cure."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from types import TracebackType
from typing import Self

from elib.errors import ArgumentError, SimulationError


class Table:
    """One table of a file.

    As a context manager it turns what a value's own class says about it into an error that names the file
    and the table, and refuses keys nobody asked for: a misspelt key would otherwise be ignored in silence.
    """

    def __init__(self, filename: str, where: str, values: Mapping[str, object]) -> None:
        """Wrap *values*.

        Args:
            filename: For messages.
            where: Path of the table in the file, such as ``box[0]``; empty for the whole file.
            values: Keys and values as :mod:`tomllib` reads them.
        """
        self._filename = filename
        self._where = where
        self._values = values
        self._known: list[str] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if isinstance(error, ArgumentError):
            place = f"{self._filename}: {self._where}" if self._where else self._filename
            raise SimulationError(f"{place}: {error.message}", hint=error.hint) from error
        if error is None:
            self._refuse_unknown_keys()

    def table(self, key: str, *, required: bool = False) -> Table:
        """Return the table under *key*; an empty one if it is missing and not required."""
        value = self._get(key, None if required else {}, "a table")
        if not isinstance(value, Mapping):
            raise self._mistake(key, "must be a table", f"write [{key}] on a line of its own")
        return Table(self._filename, self._path(key), value)

    def tables(self, key: str) -> list[Table]:
        """Return the tables of an array, in the order of the file."""
        value = self._get(key, [], "an array of tables")
        if not isinstance(value, list) or not all(isinstance(entry, Mapping) for entry in value):
            raise self._mistake(key, "must be an array of tables", f"write [[{key}]] above each of them")
        return [Table(self._filename, f"{self._path(key)}[{i}]", entry) for i, entry in enumerate(value)]

    def number(self, key: str, default: float | None = None) -> float:
        """Return a number; required if there is no *default*."""
        value = self._get(key, default, "a number")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self._mistake(key, f"is {value!r}; it must be a number", f"write for example {key} = 0.5")
        return float(value)

    def integer(self, key: str, default: int | None = None) -> int:
        """Return a whole number; required if there is no *default*."""
        value = self._get(key, default, "a whole number")
        if isinstance(value, bool) or not isinstance(value, int):
            raise self._mistake(key, f"is {value!r}; it must be a whole number", f"write {key} = 1")
        return value

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text; required if there is no *default*."""
        value = self._get(key, default, "a text")
        if not isinstance(value, str):
            raise self._mistake(key, f"is {value!r}; it must be a text", f'write it in quotes: {key} = "..."')
        return value

    def flag(self, key: str, default: bool | None = None) -> bool:
        """Return true or false; required if there is no *default*."""
        value = self._get(key, default, "true or false")
        if not isinstance(value, bool):
            raise self._mistake(key, f"is {value!r}; it must be true or false", f"write {key} = true")
        return value

    def pair(self, key: str) -> tuple[float, float]:
        """Return two required numbers."""
        value = self._get(key, None, "two numbers")
        if (
            not isinstance(value, list)
            or len(value) != 2
            or any(isinstance(part, bool) or not isinstance(part, int | float) for part in value)
        ):
            raise self._mistake(key, f"is {value!r}; it must be two numbers", f"write {key} = [0.5, 0.5]")
        return float(value[0]), float(value[1])

    def _get(self, key: str, default: object, kind: str) -> object:
        self._known.append(key)
        value = self._values.get(key, default)
        if value is None:
            raise self._mistake(key, "is missing", f"give it {kind}")
        return value

    def _refuse_unknown_keys(self) -> None:
        for key in self._values:
            if key not in self._known:
                close = difflib.get_close_matches(key, self._known, n=1)
                known = f"the keys here are {', '.join(self._known)}"
                raise self._mistake(key, "is not a key of a world", f"did you mean {close[0]}?" if close else known)

    def _path(self, key: str) -> str:
        return f"{self._where}.{key}" if self._where else key

    def _mistake(self, key: str, what: str, cure: str) -> SimulationError:
        return SimulationError(f"{self._filename}: {self._path(key)} {what}", hint=cure)
