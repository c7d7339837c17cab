"""Write results as text, CSV, JSON or Parquet, to standard output or to a file that is replaced only as a whole."""

from __future__ import annotations

import csv
import errno
import importlib
import importlib.util
import io
import json
import math
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import IO, Any

from elib.base.errors import ArgumentError, ElibError, Unsupported
from elib.base.extras import install
from elib.base.files import named, reason_of, replacing
from elib.base.plaintext import plain
from elib.records.et.rows import Block
from elib.records.et.table import Cell, Header, Table, aligned

FORMATS = ("text", "csv", "json", "jsonl", "parquet")
DUCKDB_LIMITS: dict[str, str | int] = {"memory_limit": "256MB", "threads": 1}
"""Limits for DuckDB, which would otherwise take most of the computer's memory."""
BATCH = 10_000
"""Rows that are formatted together."""

LOG = (
    Header("time"),
    Header("robot", "text"),
    Header("event", "text"),
    Header("command", "text"),
    Header("not_sent", "whole"),
    Header("not_answered", "whole"),
)
PAIRS = (*LOG[:4], Header("latency"))
JSON_NUMBER = re.compile(r"[+-]?[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?")
NEEDS_QUOTES = re.compile(rb'[",\r]')
"""Characters that need quotes in CSV; a decimal comma is one of them."""
TYPES = {"text": "VARCHAR", "whole": "BIGINT", "number": "DOUBLE", "truth": "BOOLEAN", "any": "VARCHAR"}


def format_of(name: str | None, destination: str | None) -> str:
    """Return the format to write: the one with this name, or the one that the file's ending names."""
    suffix = Path(destination or "").suffix.lower().removeprefix(".")
    asked = name or (suffix if suffix in FORMATS else "text")
    if asked == "parquet":
        if destination is None:
            raise ArgumentError("Parquet cannot go to standard output", hint="give it a file: -d FILE.parquet")
        if importlib.util.find_spec("duckdb") is None:
            raise Unsupported("Parquet is written by DuckDB, which is not installed", hint=install("parquet"))
    return asked


class StandardOutput:
    """Standard output for bytes, even if a program has put a text stream in its place."""

    def write(self, data: bytes, /) -> None:
        """Write *data*: to a file or pipe unchanged, to a terminal without control characters, which it would obey."""
        if sys.stdout.isatty():
            sys.stdout.write(plain(data.decode("utf-8", "replace")))
        elif isinstance(sys.stdout, io.TextIOWrapper):
            sys.stdout.flush()
            sys.stdout.buffer.write(data)
        else:
            sys.stdout.write(data.decode("utf-8", "replace"))

    def flush(self) -> None:
        """Pass on what was written."""
        sys.stdout.flush()


ByteStream = IO[bytes] | StandardOutput


@contextmanager
def opened(target: str | None) -> Iterator[ByteStream]:
    """Open an output for bytes: standard output, or a file that is replaced at the end."""
    if target is None:
        yield StandardOutput()
        sys.stdout.flush()
    else:
        with replacing(target) as path, path.open("wb") as file:
            yield file


class Writer:
    """Writer of results in one format."""

    def __init__(self, stream: ByteStream, format_name: str) -> None:
        self._stream = stream
        self._format = format_name
        self._headers: Sequence[Header] = ()
        self._is_begun = False
        self._before = "\n"

    @property
    def headers(self) -> Sequence[Header]:
        """The columns of the rows that were written."""
        return self._headers or LOG

    def copy(self, block: Block, rows: Sequence[bytes]) -> None:
        """Write some of the rows of *block*."""
        if self._format == "text":
            if rows:
                self._stream.write(b"\n".join(rows) + b"\n")
        elif block.rows:
            count = block.rows[0].count(b" ") + 1
            self._begin(self._headers or _headers_of(block.rows[0], count))
            width = len(self._headers)
            for place, row in enumerate(block.rows):
                if row.count(b" ") + 1 != width:
                    words = f"the row has {row.count(b' ') + 1} columns, but the first one has {width}"
                    raise block.error(place, f"{words}, and {self._format} needs as many in each")
            self._copy(rows)
        if len(block.rows) < BATCH:
            self._stream.flush()  # so that the rows of a slow pipe come out at once

    def write(self, table: Table) -> None:
        """Write a table."""
        if self._format != "text":
            self._begin(table.headers)
            self._rows(table.rows)
        elif table.text == "aligned":
            self._put(aligned(table))
        else:
            if table.text == "rows":
                self._put(f"#{' '.join(header.name for header in table.headers)}\n")
            line = " ".join("%.8f" if each.kind == "number" else "%s" for each in table.headers) + "\n"
            for batch in _batches(table.rows):
                self._put("".join([line % tuple(row) for row in batch]))

    def end(self) -> None:
        """Write the end of the format, and the column names if there were no rows."""
        if self._format != "text":
            self._begin(LOG)
        if self._format == "json":
            self._put("]\n" if self._before == "\n" else "\n]\n")

    def _begin(self, headers: Sequence[Header]) -> None:
        if not self._is_begun:
            self._is_begun, self._headers = True, headers
            if self._format == "csv":
                self._put(_lines([[header.name for header in headers]]))
            elif self._format == "json":
                self._put("[")

    def _copy(self, rows: Sequence[bytes]) -> None:
        lines = b"\n".join(rows)
        if self._format != "csv" or not rows or NEEDS_QUOTES.search(lines):
            self._rows(_cells(self._headers, row) for row in rows)
        else:
            self._put(f"{lines.decode('utf-8', 'replace').replace(' ', ',')}\n")

    def _rows(self, rows: Iterable[Sequence[Cell]]) -> None:
        for batch in _batches(rows):
            if self._format == "csv":
                self._put(_lines([[_plain(cell) for cell in row] for row in batch]))
                continue
            named = [{at.name: _json(at, cell) for at, cell in zip(self._headers, row, strict=True)} for row in batch]
            records = [json.dumps(row, ensure_ascii=False) for row in named]
            if self._format == "jsonl":
                self._put("".join(f"{record}\n" for record in records))
            else:
                self._put(self._before + ",\n".join(records))
                self._before = ",\n"

    def _put(self, text: str) -> None:
        self._stream.write(text.encode("utf-8", "replace"))


@contextmanager
def writing(format_name: str, destination: str | None) -> Iterator[Writer]:
    """Open a destination for results. A file is replaced only if the block ends without an error."""
    if format_name != "parquet" or destination is None:
        with opened(destination) as stream:
            writer = Writer(stream, format_name)
            yield writer
            writer.end()
        return
    with replacing(destination) as path, tempfile.TemporaryDirectory(prefix="et-") as folder:
        rows = Path(folder) / "rows.csv"
        with named(folder), rows.open("wb") as file:
            writer = Writer(file, "csv")
            yield writer
            writer.end()
        written = rows.with_suffix(".parquet")  # DuckDB takes no path that is not UTF-8
        _to_parquet(rows, written, destination, writer.headers, folder)
        shutil.copyfile(written, path)


def write_table(path: Path, table: Table) -> None:
    """Write a table into a file, in the format that its ending names; an existing file is replaced."""
    try:
        with writing(path.suffix.removeprefix("."), str(path)) as writer:
            writer.write(table)
    except OSError as error:
        raise ElibError(f"{path} cannot be written: {reason_of(error)}", hint="is there room on the disk?") from None


def _to_parquet(rows: Path, path: Path, target: str, headers: Sequence[Header], folder: str) -> None:
    """Let DuckDB write the rows of a CSV file as Parquet, in constant memory."""
    duckdb: Any = importlib.import_module("duckdb")
    types = ", ".join(f"{_quoted(each.name)}: {_quoted(TYPES[each.kind])}" for each in headers)
    options = "header=true, auto_detect=false, delim=',', quote='\"', escape='\"', nullstr=''"
    query = f"SELECT * FROM read_csv({_quoted(str(rows))}, {options}, columns={{{types}}})"
    with duckdb.connect(":memory:", config={"temp_directory": folder, **DUCKDB_LIMITS}) as database:
        try:
            database.execute(f"COPY ({query}) TO {_quoted(str(path))} (FORMAT parquet)")
        except duckdb.IOException as error:
            full = os.strerror(errno.ENOSPC)  # DuckDB wraps it in a long text that does not help
            said = full if full in str(error) else str(error).partition("\n")[0]
            raise ElibError(f"{target}: {said}") from None
        except duckdb.Error as error:
            raise ArgumentError(f"the rows do not fit Parquet: {str(error).splitlines()[0]}") from None


def _headers_of(row: bytes, count: int) -> Sequence[Header]:
    """Return headers for rows: those of a log, those of ``Join``, or numbered ones."""
    words = row.split(b" ")
    if count == len(LOG) and words[2] in (b"call", b"ok", b"ko"):
        return LOG
    if count == len(PAIRS) and words[2] in (b"ok", b"ko"):
        return PAIRS
    return [Header(f"column_{place}", "any") for place in range(count)]


def _cells(headers: Sequence[Header], row: bytes) -> list[Cell]:
    """Return the words of a row; a decimal comma becomes a point."""
    words = row.decode("utf-8", "replace").split(" ")
    return [
        word.replace(",", ".") if header.kind in ("number", "whole") else word
        for word, header in zip(words, headers, strict=True)
    ]


def _json(header: Header, cell: Cell) -> Cell:
    if isinstance(cell, str):
        if header.kind == "text" or not JSON_NUMBER.fullmatch(cell):
            return cell
        cell = int(cell) if len(cell) < 16 and cell.lstrip("+-").isdecimal() else float(cell)
    return None if isinstance(cell, float) and not math.isfinite(cell) else cell


def _plain(cell: Cell) -> str:
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return ""
    return repr(cell) if isinstance(cell, float) else str(cell)


class _Lines(list[str]):
    """Lines as ``csv`` writes them, one at a time."""

    write = list.append


def _lines(rows: Iterable[Iterable[str]]) -> str:
    lines = _Lines()
    # Python before 3.13 puts quotes around "\r" only if it stands in the line end.
    csv.writer(lines, lineterminator="\r\n").writerows(rows)
    return "".join([f"{line[:-2]}\n" for line in lines])


def _batches(rows: Iterable[Sequence[Cell]]) -> Iterator[list[Sequence[Cell]]]:
    rest = iter(rows)
    while batch := list(islice(rest, BATCH)):
        yield batch


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"
