"""Results as text, CSV, JSON and Parquet."""

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
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

from elib.errors import ArgumentError, ElibError, Unsupported, install
from elib.et.destination import Sink, opened
from elib.et.rows import Block
from elib.et.table import Cell, Heading, Table, aligned
from elib.files import named, replacing

FORMATS = ("text", "csv", "json", "jsonl", "parquet")
MODEST: dict[str, str | int] = {"memory_limit": "256MB", "threads": 1}
"""What DuckDB is given: its own choice is most of the computer's memory."""
PORTION = 10_000
"""Rows that are formatted at once."""

LOG = (
    Heading("time"),
    Heading("robot", "text"),
    Heading("event", "text"),
    Heading("command", "text"),
    Heading("not_sent", "whole"),
    Heading("not_answered", "whole"),
)
PAIRS = (*LOG[:4], Heading("latency"))
WORDS = re.compile(r"[+-]?[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?")
QUOTED = re.compile(rb'[",\r]')
"""What CSV puts in quotes; decimal commas are among it."""
TYPES = {"text": "VARCHAR", "whole": "BIGINT", "number": "DOUBLE", "any": "VARCHAR"}


def format_of(name: str | None, destination: str | None) -> str:
    """Return the format to write: as asked, or as the file's name says.

    Raises:
        ArgumentError: There is no such format, or it cannot go there.
        Unsupported: DuckDB, which writes it, is not installed.
    """
    suffix = Path(destination).suffix.lower().removeprefix(".") if destination else ""
    asked = name.lower() if name is not None else suffix if suffix in FORMATS else "text"
    if asked not in FORMATS:
        raise ArgumentError(f"--format is {name!r}; it must be one of {', '.join(FORMATS)}")
    if asked == "parquet":
        if destination is None:
            raise ArgumentError("Parquet cannot go to standard output", hint="give it a file: -d FILE.parquet")
        if importlib.util.find_spec("duckdb") is None:
            raise Unsupported("Parquet is written by DuckDB, which is not installed", hint=install("parquet"))
    return asked


class Writer:
    """Writes results in one format.

    Args:
        sink: What takes the bytes.
        form: ``text``, ``csv``, ``json`` or ``jsonl``.
    """

    def __init__(self, sink: Sink, form: str) -> None:
        self._sink = sink
        self._form = form
        self._headings: Sequence[Heading] = ()
        self._is_begun = False
        self._has_rows = False

    @property
    def headings(self) -> Sequence[Heading]:
        """The columns so far."""
        return self._headings or LOG

    def copy(self, block: Block, rows: Sequence[bytes]) -> None:
        """Write some of the rows of *block*.

        Raises:
            RowError: Another format needs the same columns in all rows.
        """
        if self._form == "text":
            if rows:
                self._sink.write(b"\n".join(rows) + b"\n")
        elif block.rows:
            count = block.rows[0].count(b" ") + 1
            self._begin(self._headings or _headings_of(block.rows[0], count))
            width = len(self._headings)
            for place, row in enumerate(block.rows):
                if row.count(b" ") + 1 != width:
                    words = f"the row has {row.count(b' ') + 1} columns, but the first one has {width}"
                    raise block.error(place, f"{words}, and {self._form} needs as many in each")
            self._copy(rows)
        if len(block.rows) < PORTION:
            self._sink.flush()  # a pipe that is fed slowly is followed live

    def write(self, table: Table) -> None:
        """Write a table."""
        if self._form != "text":
            self._begin(table.headings)
            self._rows(table.rows)
        elif table.text == "aligned":
            self._put(aligned(table))
        else:
            if table.text == "rows":
                self._put(f"#{' '.join(heading.name for heading in table.headings)}\n")
            line = " ".join("%.8f" if each.kind == "number" else "%s" for each in table.headings) + "\n"
            for portion in _portions(table.rows):
                self._put("".join([line % tuple(row) for row in portion]))

    def end(self) -> None:
        """Write what stands at the end."""
        if self._form != "text":
            self._begin(LOG)
        if self._form == "json":
            self._put("\n]\n" if self._has_rows else "]\n")

    def _begin(self, headings: Sequence[Heading]) -> None:
        if not self._is_begun:
            self._is_begun, self._headings = True, headings
            if self._form == "csv":
                self._put(_lines([[heading.name for heading in headings]]))
            elif self._form == "json":
                self._put("[")

    def _copy(self, rows: Sequence[bytes]) -> None:
        lines = b"\n".join(rows)
        if self._form != "csv" or not rows or QUOTED.search(lines):
            self._rows(_cells(self._headings, row) for row in rows)
        else:
            self._put(f"{lines.decode('utf-8', 'replace').replace(' ', ',')}\n")

    def _rows(self, rows: Iterable[Sequence[Cell]]) -> None:
        for portion in _portions(rows):
            if self._form == "csv":
                self._put(_lines([[_plain(cell) for cell in row] for row in portion]))
                continue
            records = [json.dumps(self._record(row), ensure_ascii=False) for row in portion]
            if self._form == "jsonl":
                self._put("".join(f"{record}\n" for record in records))
            else:
                self._put((",\n" if self._has_rows else "\n") + ",\n".join(records))
            self._has_rows = True

    def _record(self, row: Sequence[Cell]) -> dict[str, Cell]:
        return {heading.name: _json(heading, cell) for heading, cell in zip(self._headings, row, strict=True)}

    def _put(self, text: str) -> None:
        self._sink.write(text.encode("utf-8", "replace"))


@contextmanager
def writing(form: str, destination: str | None) -> Iterator[Writer]:
    """Open a destination for results; a file is replaced when the block ends well, else it stays as it was.

    Raises:
        ArgumentError: There can be no such file, or the format cannot hold the results.
    """
    if form != "parquet" or destination is None:
        with opened(destination) as sink:
            writer = Writer(sink, form)
            yield writer
            writer.end()
        return
    with replacing(destination) as path, tempfile.TemporaryDirectory(prefix="et-") as folder:
        rows = Path(folder) / "rows.csv"
        with named(folder), rows.open("wb") as file:
            writer = Writer(file, "csv")
            yield writer
            writer.end()
        _to_parquet(rows, path, destination, writer.headings, folder)


def _to_parquet(rows: Path, path: Path, target: str, headings: Sequence[Heading], folder: str) -> None:
    """Let DuckDB write the rows of a CSV file as Parquet; it needs no more memory for more of them."""
    duckdb: Any = importlib.import_module("duckdb")
    types = ", ".join(f"{_quoted(each.name)}: {_quoted(TYPES[each.kind])}" for each in headings)
    options = "header=true, auto_detect=false, delim=',', quote='\"', escape='\"', nullstr=''"
    query = f"SELECT * FROM read_csv({_quoted(str(rows))}, {options}, columns={{{types}}})"
    with duckdb.connect(":memory:", config={"temp_directory": folder, **MODEST}) as database:
        try:
            database.execute(f"COPY ({query}) TO {_quoted(str(path))} (FORMAT parquet)")
        except duckdb.IOException as error:
            full = os.strerror(errno.ENOSPC)  # DuckDB wraps it in much that helps nobody
            said = full if full in str(error) else str(error).partition("\n")[0]
            raise ElibError(f"{target}: {said}") from None
        except duckdb.Error as error:
            raise ArgumentError(f"the rows do not fit Parquet: {str(error).splitlines()[0]}") from None


def _headings_of(row: bytes, count: int) -> Sequence[Heading]:
    """Return names for the columns of rows: those of a log, of what ``Join`` writes, or numbers."""
    words = row.split(b" ")
    if count == len(LOG) and words[2] in (b"call", b"ok", b"ko"):
        return LOG
    if count == len(PAIRS) and words[2] in (b"ok", b"ko"):
        return PAIRS
    return [Heading(f"column_{place}", "any") for place in range(count)]


def _cells(headings: Sequence[Heading], row: bytes) -> list[Cell]:
    """Return the words of a row; a decimal comma is a point."""
    words = row.decode("utf-8", "replace").split(" ")
    return [
        word.replace(",", ".") if heading.kind in ("number", "whole") else word
        for word, heading in zip(words, headings, strict=True)
    ]


def _json(heading: Heading, cell: Cell) -> Cell:
    if isinstance(cell, str):
        if heading.kind == "text" or not WORDS.fullmatch(cell):
            return cell
        cell = int(cell) if len(cell) < 16 and cell.lstrip("+-").isdecimal() else float(cell)
    return None if isinstance(cell, float) and not math.isfinite(cell) else cell


def _plain(cell: Cell) -> str:
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return ""
    return repr(cell) if isinstance(cell, float) else str(cell)


def _lines(rows: Iterable[Iterable[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _portions(rows: Iterable[Sequence[Cell]]) -> Iterator[list[Sequence[Cell]]]:
    rest = iter(rows)
    while portion := list(islice(rest, PORTION)):
        yield portion


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"


__all__ = ["FORMATS", "Writer", "format_of", "writing"]
