"""Read TOML files that people wrote, and name every mistake with its file, line, key and cure.

World files, fault scripts and robot profiles are read by it. A :class:`Table` follows from the fields of the class that
it makes (:mod:`elib.base.rules`), so each range is declared in one place.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files

from elib.base.errors import ArgumentError, ElibError, SimulationError
from elib.base.files import read_file
from elib.base.rules import (
    MAX_TEXT,
    REQUIRED,
    Mistake,
    Number,
    Path,
    Rule,
    Several,
    dotted,
    fields_of,
    nearest,
    shown,
)

MAX_FILE = 8_000_000
"""Bytes: a hundred thousand walls, and some seconds of reading."""

MAX_TABLES = 100_000
"""Most tables of one kind: more make a slow world, and are most likely a mistake."""

MAX_PARTS = 8
"""Parts of a dotted key. tomllib's time grows with their square: a line of a megabyte would take it hours."""

# Atomic groups, not possessive repeats of groups: those match too little before Python 3.11.5 (gh-106052).
_STRING_OR_COMMENT = re.compile(
    r'"""(?>(?:[^"\\]++|\\.|"(?!""))*)(?:"{3,5}+|\Z)'
    r"|'''(?>(?:[^']++|'(?!''))*)(?:'{3,5}+|\Z)"
    r'|"(?>(?:[^"\\\n]++|\\[^\n])*)"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+",
    re.DOTALL,
)
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{MAX_PARTS}}}")
_HEADER = re.compile(r"""\s*\[\[?(?:"[^"]*"|'[^']*'|[^\[\]"'=,])+\]\]?\s*(?:#.*)?$""")
_AT = re.compile(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a table."""

    name: str
    rule: Rule  # what its value must be
    fills: tuple[str, ...]  # names of the arguments that its value fills
    defaults: tuple[object, ...] = ()  # values of these arguments if the key is left out; empty if the key is required
    meaning: str = ""  # what it sets; empty if the docstring of what its table makes says that

    @property
    def is_needed(self) -> bool:
        """Whether the key is required."""
        return not self.defaults

    @property
    def default(self) -> str:
        """The value that holds if the key is left out, as the file would write it."""
        return self.rule.otherwise or ", ".join(map(self.rule.written, self.defaults))

    @property
    def example(self) -> str:
        """A good value, as the file writes it."""
        if self.rule.example:
            return self.rule.example
        if self.defaults and self.defaults[0] is not None:
            return self.default
        return f"{(self.rule.low + self.rule.high) / 2:g}" if isinstance(self.rule, Number) else ""

    def read(self, value: object) -> Mapping[str, object]:
        """Return the arguments that *value* gives.

        Raises:
            Mistake: *value* breaks the rule.
        """
        try:
            found = self.rule.accept(value)
        except Mistake as mistake:
            hint = mistake.hint or f"write {self.name} = {self.example}"
            raise Mistake(mistake.what, path=(self.name, *mistake.path), hint=hint) from None
        return dict(zip(self.fills, found if len(self.fills) > 1 else (found,), strict=True))


@dataclass(frozen=True, slots=True)
class Pair:
    """A key of two numbers, such as a place, which fills two fields that have one rule."""

    name: str
    fills: tuple[str, str]  # names of the two fields
    meaning: str  # what it sets
    example: str  # a good value, as the file writes it


def keys_of(taker: Callable[..., object], *pairs: Pair, **rules: Rule) -> tuple[Key, ...]:
    """Return the keys for what a class or function takes: each has the field's name, without ``is_`` in front.

    Args:
        taker: The class or function.
        *pairs: Keys that fill two fields each.
        **rules: The rules of fields that have another rule in a file than in a program.
    """
    paired = {field: each for each in pairs for field in each.fills}
    found: dict[str, Key] = {}
    for field in fields_of(taker):
        rule = rules.get(field.name, field.rule)
        defaults = () if field.default is REQUIRED else (field.default,)
        both = paired.get(field.name)
        if both is None:
            name = field.name.removeprefix("is_")
            found[name] = Key(name, rule, (field.name,), defaults)
        elif both.name not in found:
            assert isinstance(rule, Number)
            several = Several(rule, 2, example=both.example, otherwise=rule.otherwise)
            found[both.name] = Key(both.name, several, both.fills, defaults * 2, both.meaning)
    return tuple(found.values())


@dataclass(frozen=True)
class Table:
    """One table of a file, or several of a kind."""

    name: str
    meaning: str  # what it describes, in a sentence
    makes: Callable[..., object]  # function or class that is called with the values of the keys
    keys: tuple[Key, ...]  # the keys that it may have
    is_array: bool = True  # whether there may be several, written `[[name]]`
    is_required: bool = False  # whether there must be one
    most: int = MAX_TABLES  # largest number of tables in an array

    @cached_property
    def by_name(self) -> Mapping[str, Key]:
        """The keys by name."""
        return {key.name: key for key in self.keys}

    def values(self, table: Mapping[str, object], what: str) -> dict[str, object]:
        """Return the arguments that the keys of *table* fill; *what* names the table in messages.

        Raises:
            Mistake: A key is missing, unknown or wrong.
        """
        given: dict[str, object] = {}
        for name, value in table.items():
            key = self.by_name.get(name)
            if key is None:
                raise unknown(name, self.by_name, what)
            given.update(key.read(value))
        for key in self.keys:
            if key.is_needed and key.name not in table:
                raise Mistake(
                    f"is missing; it must be {key.rule}", path=(key.name,), hint=f"write {key.name} = {key.example}"
                )
        return given

    def read(self, table: Mapping[str, object], what: str) -> object:
        """Return what *table* describes.

        Raises:
            Mistake: A key is missing, unknown or wrong.
            ArgumentError: What it makes refuses the whole.
        """
        return self.makes(**self.values(table, what))


def unknown(name: str, known: Iterable[str], what: str) -> Mistake:
    """Return the error of an unknown key: a misspelt key would otherwise be ignored in silence."""
    return Mistake(f"is not a key of {what}", path=(name,), hint=nearest(name, known))


@dataclass(frozen=True, slots=True)
class Source:
    """The file that tables came from, for messages."""

    filename: str  # name of the file, as the person gave it
    text: str  # the whole file
    what: str  # what the file describes: `a world`

    def read_all(self, document: Mapping[str, object], top: Table, tables: Iterable[Table]) -> dict[str, list[object]]:
        """Return what each table of a document describes, by its name; the name "" is for the keys above all tables.

        Raises:
            SimulationError: A rule is broken; the message names the file, the line and the key.
        """
        known = {table.name: table for table in tables}
        for name in document:
            if name not in known and name not in top.by_name:
                raise self.error((), unknown(name, [*top.by_name, *known], self.what))
        above = {name: value for name, value in document.items() if name in top.by_name}
        return {"": [self.read_one(top, (), above)]} | {
            name: self.read(table, document.get(name)) for name, table in known.items()
        }

    def read(self, table: Table, value: object) -> list[object]:
        """Return what the tables of one name describe, in their order; [] for None.

        Raises:
            SimulationError: A rule is broken.
        """
        name = table.name
        if value is None:
            if table.is_required:
                header = f"[[{name}]]" if table.is_array else f"[{name}]"
                cure = f"write {header}, and below it {table.keys[0].name} = {table.keys[0].example}"
                raise self.error((name,), Mistake("is missing", hint=cure))
            return []
        if not table.is_array:
            if not isinstance(value, dict):
                raise self.error((name,), Mistake(f"is {shown(value)}; it must be a table", hint=f"write [{name}]"))
            return [self.read_one(table, (name,), value)]
        if not isinstance(value, list) or not all(isinstance(each, dict) for each in value):
            cure = f"write [[{name}]], in two brackets, above each of them"
            raise self.error((name,), Mistake("must be an array of tables", hint=cure))
        if len(value) > table.most:
            what = f"is one too many; at most {table.most} are possible"
            raise self.error((name, table.most), Mistake(what, hint="leave some out"))
        return [self.read_one(table, (name, index), each) for index, each in enumerate(value)]

    def read_one(self, table: Table, path: Path, value: Mapping[str, object]) -> object:
        """Return what one table at *path* describes.

        Raises:
            SimulationError: A rule is broken.
        """
        with self.at(*path):
            return table.read(value, self.what)

    @contextlib.contextmanager
    def at(self, *path: str | int) -> Iterator[None]:
        """Let the error of a value at *path* name the file, the line and the key: a SimulationError."""
        try:
            yield
        except ArgumentError as error:
            raise self.error(path, error) from error

    def error(self, path: Path, error: ArgumentError) -> SimulationError:
        """Return *error*, met at *path*, with the file, the line and the key in its message."""
        if isinstance(error, Mistake):
            inside = error.at(*path)
            path, message = inside.path, inside.message
        else:
            message = f"{dotted(path)}: {error.message}" if path else error.message
        line = line_of(self.text, path)
        return SimulationError(f"{self.filename}{f':{line}' if line else ''}: {message}", hint=error.hint)


def read_toml(content: bytes, filename: str, what: str) -> tuple[Source, dict[str, object]]:
    """Return the source of a document and the document itself.

    Args:
        content: TOML in UTF-8; at most :data:`MAX_FILE` bytes.
        filename: For messages.
        what: What the file describes, for messages: ``a world``.

    Raises:
        SimulationError: It is too large or too deep, or not TOML.
    """
    if len(content) > MAX_FILE:
        raise SimulationError(
            f"{filename} is larger than {MAX_FILE // 1_000_000} MB, which is the limit",
            hint="leave something out, or give another file",
        )
    try:
        text = content.decode("utf-8-sig")  # Some Windows editors write a byte order mark in front.
    except UnicodeDecodeError as error:
        number = content.count(b"\n", 0, error.start) + 1
        raise SimulationError(
            f"{filename}:{number}: this is not text in UTF-8: {error.reason} at byte {error.start}",
            hint="save it as UTF-8",
        ) from error
    if _DEEP_KEY.search(_STRING_OR_COMMENT.sub(lambda match: "" if match[0].startswith("#") else "s", text)):
        raise _too_deep(filename)
    try:
        return Source(filename, text, what), tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        match = _AT.fullmatch(str(error))
        reason, line, column = match.groups() if match else (str(error), None, None)
        place = f"{filename}:{line}" if line else filename
        at = f" (column {column})" if column else " (at its end)"
        raise SimulationError(
            f"{place}: this is not TOML: {reason}{at}", hint="https://toml.io has the rules"
        ) from error
    except RecursionError:
        raise _too_deep(filename) from None
    except ValueError as error:  # A decimal number of thousands of digits, which int() refuses.
        raise SimulationError(f"{filename} has a number that is too long", hint="shorten it") from error


def _too_deep(filename: str) -> SimulationError:
    return SimulationError(f"{filename} is nested too deeply", hint="it has tables and keys, no deeper")


def line_of(text: str, path: Sequence[str | int]) -> int | None:
    """Return the line of *text*, from 1, where a table or a key of it is given; None if it is not found.

    It looks at how lines begin and reads no TOML: text in a string of several lines can mislead it.

    Args:
        text: A TOML file.
        path: The table's name, and its number if there are many; then the key, or nothing. What is inside a key's
            value has the key's line. A key that is not found has the line of its table.
    """
    names = [part for part in path if isinstance(part, str)]
    if not names:
        return None
    number = path[1] if len(path) > 1 and isinstance(path[1], int) else 0
    header = re.compile(rf"\s*\[+\s*{_spelled(names[0])}\s*\]")
    wanted = re.compile(rf"\s*{_spelled(names[1])}\s*[.=]") if len(names) > 1 else None
    top = re.compile(rf"\s*{_spelled(names[0])}\s*[.=]")
    found, count, is_above, is_inside = None, -1, True, False
    for line, content in enumerate(text.split("\n"), 1):
        if _HEADER.match(content):
            is_above = is_inside = False
            if header.match(content):
                count += 1
                is_inside = count == number
            if is_inside:
                found = line
                if wanted is None:
                    break
        elif (is_above and top.match(content)) or (is_inside and wanted is not None and wanted.match(content)):
            return line
    return found


def _spelled(name: str) -> str:
    """Return a pattern for *name* as a key: as it is or quoted, with or without escapes."""
    if len(name) > MAX_TEXT:  # A pattern of a megabyte takes long to compile.
        return "(?!)"
    return rf"([\"']?)(?:{re.escape(name)}|{re.escape(json.dumps(name)[1:-1])})\1"


def shipped(folder: str) -> list[str]:
    """Return the names of the TOML files of a folder that comes with elib, in alphabetical order."""
    entries = (entry.name for entry in files("elib").joinpath(folder).iterdir())
    return sorted(name.removesuffix(".toml") for name in entries if name.endswith(".toml"))


def content_of(
    name: str, folder: str, what: str, *, error: Callable[..., ElibError] = ArgumentError
) -> tuple[bytes, str] | None:
    """Return the content of a TOML file, at most :data:`MAX_FILE` bytes and one, and the file's path.

    Args:
        name: A file that comes with elib, or the path of another file: with a slash in it, or ending in ``.toml``.
        folder: Where those are that come with elib.
        what: What it is, for messages: ``world``.
        error: Class of the error.

    Returns:
        None if no such file comes with elib.

    Raises:
        ElibError: The path's file cannot be read; *error* is its class.
    """
    if name.endswith(".toml") or "/" in name or os.sep in name:
        hint = "check its path" if os.path.isabs(name) else f"check its path; it was looked for in {os.getcwd()}"
        return read_file(name, f"the {what}", largest=MAX_FILE, hint=hint, error=error), name
    if name not in shipped(folder):
        return None
    path = files("elib").joinpath(folder, f"{name}.toml")
    return path.read_bytes(), str(path)


def others(name: str, folder: str) -> str:
    """Return a hint for a name that no file of a folder has: the nearest one, and all there are."""
    every = f"choose one of {', '.join(shipped(folder))}"
    near = nearest(name, shipped(folder))
    return f"{every if near == every else f'{near} {every}'}, or give the path of a .toml file"
