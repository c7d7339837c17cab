"""TOML written by strangers: read without a crash or a hang, and searched for the line of a mistake.

Worlds, fault scripts and robot profiles are read by it.

:mod:`tomllib` says of a document what it means, not where that stands. Only when something is wrong is the text
gone through once more, for the line.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Generator, Iterator, Sequence
from typing import TypeAlias

from elib.errors import SimulationError

LARGEST_FILE = 8_000_000
"""Bytes: a hundred thousand walls, and some seconds of reading."""

MOST_PARTS = 8
"""Parts of a dotted key. tomllib's time grows with their square: a line of a megabyte would take it hours."""

Path: TypeAlias = tuple[str | int, ...]
"""Where a value is: ``("box", 1, "size")``."""

# Atomic groups, not possessive repeats of groups: those match too little before Python 3.11.5 (gh-106052).
_STRINGS = (
    r'"""(?>(?:[^"\\]++|\\.|"(?!""))*)(?:"{3,5}+|\Z)'
    r"|'''(?>(?:[^']++|'(?!''))*)(?:'{3,5}+|\Z)"
    r'|"(?>(?:[^"\\\n]++|\\[^\n])*)"?'
    r"|'[^'\n]*+'?"
)
_STRING_OR_COMMENT = re.compile(rf"{_STRINGS}|#[^\n]*+", re.DOTALL)
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{MOST_PARTS}}}")
_AT = re.compile(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", re.DOTALL)

_BLANK = re.compile(r"(?>(?:[\s,]|#[^\n]*+)*)")
_SPACE = re.compile(r"[ \t]*+")
_KEY_PART = re.compile(rf"[ \t]*+({_STRINGS}|[\w-]++)[ \t]*+(\.?)", re.DOTALL)
_SCALAR = re.compile(rf"{_STRINGS}|[^,\]}}\n#]*+", re.DOTALL)
_BRACKET = re.compile(rf"(?>(?:{_STRINGS}|#[^\n]*+|[^\[\]{{}}\"'#]++)*)([\[\]{{}}])", re.DOTALL)


def read(content: bytes, filename: str) -> tuple[str, dict[str, object]]:
    """Return *content* as text, and what it means.

    Args:
        content: TOML in UTF-8; at most :data:`LARGEST_FILE` bytes.
        filename: For messages.

    Raises:
        SimulationError: It is too large or too deep, or no TOML.
    """
    if len(content) > LARGEST_FILE:
        raise SimulationError(
            f"{filename} is larger than {LARGEST_FILE // 1_000_000} MB, which is the limit",
            hint="leave something out, or give another file",
        )
    try:
        text = content.decode("utf-8-sig")  # Some editors of Windows write a mark in front.
    except UnicodeDecodeError as error:
        number = content.count(b"\n", 0, error.start) + 1
        raise SimulationError(
            f"{filename}:{number}: this is no text in UTF-8: {error.reason} at byte {error.start}",
            hint="save it as UTF-8",
        ) from error
    if _DEEP_KEY.search(_STRING_OR_COMMENT.sub(_placeholder, text)):
        raise _too_deep(filename)
    try:
        return text, tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        what, line, column = _parts(str(error))
        place = f"{filename}:{line}" if line else filename
        at = f" (column {column})" if column else " (at its end)"
        raise SimulationError(f"{place}: this is no TOML: {what}{at}", hint="https://toml.io has the rules") from error
    except RecursionError:
        raise _too_deep(filename) from None
    except ValueError as error:  # A decimal number of thousands of digits, which int() refuses.
        raise SimulationError(f"{filename} has a number that is too long", hint="shorten it") from error


def _placeholder(match: re.Match[str]) -> str:
    return "" if match[0].startswith("#") else "s"


def _parts(text: str) -> tuple[str, str, str]:
    match = _AT.fullmatch(text)
    return (match[1], match[2] or "", match[3] or "") if match else (text, "", "")


def _too_deep(filename: str) -> SimulationError:
    return SimulationError(f"{filename} is nested too deeply", hint="it has tables and keys, no deeper")


def line_of(text: str, path: Sequence[str | int]) -> int | None:
    """Return the line of *text*, from 1, where the value at *path* is given.

    Args:
        text: TOML that :func:`read` has accepted.
        path: Keys and indices. Where the last ones are missing, the line of the table around them is meant.

    Returns:
        None if nothing on the way to *path* is there.
    """
    best, position = 0, -1
    for found, place in _places(text, tuple(path)):
        shared = _shared(found, path)
        if shared > best:
            best, position = shared, place
        if best == len(path):
            break
    return text.count("\n", 0, position) + 1 if best else None


def _shared(one: Path, other: Sequence[str | int]) -> int:
    count = 0
    for a, b in zip(one, other, strict=False):
        if a != b:
            break
        count += 1
    return count


def _places(text: str, wanted: Path) -> Iterator[tuple[Path, int]]:
    """Find tables and keys with the places where they begin; inside values, only what may lead to *wanted*."""
    table: Path = ()
    tables: dict[Path, int] = {}  # How many of each array of tables there were.
    place = _end(_BLANK, text, 0)
    while place < len(text):
        start = place
        if text[place] == "[":
            is_array = text.startswith("[[", place)
            keys, place = _key(text, place + 1 + is_array)
            table = ()
            for key in keys[:-1]:
                table += (key,)
                if table in tables:
                    table += (tables[table] - 1,)
            table += (keys[-1],)
            if is_array:
                tables[table] = tables.get(table, 0) + 1
                table += (tables[table] - 1,)
            yield table, start
            place += 1 + is_array
        else:
            keys, place = _key(text, place)
            yield table + keys, start
            place = yield from _value(text, place + 1, table + keys, wanted)
        place = _end(_BLANK, text, place)


def _value(text: str, place: int, path: Path, wanted: Path) -> Generator[tuple[Path, int], None, int]:
    """Go through the value at *place*; return where it ends."""
    place = _end(_SPACE, text, place)
    if _shared(path, wanted) < len(path) or len(path) >= len(wanted) or text[place] not in "[{":
        return _skip(text, place)
    is_array = text[place] == "["
    place = _end(_BLANK, text, place + 1)
    index = 0
    while text[place] not in "]}":
        start = place
        if is_array:
            inner = (*path, index)
            index += 1
        else:
            keys, place = _key(text, place)
            inner, place = path + keys, place + 1
        yield inner, start
        place = yield from _value(text, place, inner, wanted)
        place = _end(_BLANK, text, place)
    return place + 1


def _skip(text: str, place: int) -> int:
    """Return where the value at *place* ends."""
    if text[place] not in "[{":
        return _end(_SCALAR, text, place)
    depth = 0
    while True:
        match = _BRACKET.match(text, place)
        assert match is not None  # read() has seen the closing one.
        depth += 1 if match[1] in "[{" else -1
        place = match.end()
        if depth == 0:
            return place


def _key(text: str, place: int) -> tuple[Path, int]:
    """Return the parts of the key at *place*, and where it ends."""
    parts: list[str] = []
    while True:
        match = _KEY_PART.match(text, place)
        assert match is not None  # read() has seen it.
        part = match[1]
        parts.append(tomllib.loads(f"key = {part}")["key"] if part[0] in "\"'" else part)
        place = match.end()
        if not match[2]:
            return tuple(parts), place


def _end(pattern: re.Pattern[str], text: str, place: int) -> int:
    match = pattern.match(text, place)
    return match.end() if match else place
