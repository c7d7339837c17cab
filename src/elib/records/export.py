"""The tables of a recording as CSV or Parquet, a file for each."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from elib.base.errors import ArgumentError
from elib.base.files import reason_of
from elib.records.et.formats import Writer, writing
from elib.records.et.table import Header, Table
from elib.records.mcapreader import Health
from elib.records.reader import Recording
from elib.records.tables import FIXED, Tabulator, topics_of
from elib.records.topics import PICTURES, READINGS

NO_FOLDERS = (".csv", ".parquet", ".txt", ".tsv", ".json", ".jsonl", ".xlsx", ".mcap", ".log")
"""Endings that no folder has: such a name is a mistake, unless it ends as the format does."""


@dataclass(slots=True)
class Exported:
    """What was written."""

    rows: Counter[Path] = field(default_factory=Counter)  # number of rows by file
    pictures: int = 0  # number of pictures, which are not in the tables
    misfits: int = 0  # number of readings that were left out
    health: Health = field(default_factory=Health)  # state of the recording


def export(
    recording: Recording, target: Path, format_name: str, tables: Sequence[str] = (), *, replace: bool = False
) -> Exported:
    """Write tables of a recording, a file for each; all of them are written, or none.

    Args:
        recording: The recording; it is read once and never held in memory.
        target: A folder, which is made if it does not exist; or a file if *tables* has one name.
        format_name: ``csv`` or ``parquet``.
        tables: Which tables; all that have rows if none are given.
        replace: Replace files that exist.
    """
    ending = f".{format_name}"
    is_file = target.suffix.lower() == ending
    if is_file and len(tables) != 1:
        raise ArgumentError(
            f"{str(target)!r} is one file, and a recording has several tables",
            hint="name a folder for all of them, or one table: elib record export FILE proximity ...",
        )
    if not is_file and target.suffix.lower() in NO_FOLDERS and not target.is_dir():
        raise ArgumentError(
            f"{str(target)!r} has the name of a file, but a {format_name} file ends in {ending}",
            hint=f"name a folder for all tables, or a file for one: {str(target.with_suffix(ending))!r}",
        )
    done = Exported()
    tabulator = Tabulator(recording.about)
    writers: dict[str, Writer] = {}
    with contextlib.ExitStack() as stack:
        for name, rows in tabulator.batches(_messages(recording, tables, done)):
            path = target if is_file else target / (name + ending)
            if name not in writers:
                _make_room(path, replace=replace)
                writers[name] = stack.enter_context(writing(format_name, str(path)))
            headers = [Header(column, kind) for column, kind in tabulator.columns[name].items()]
            writers[name].write(Table(headers, rows))
            done.rows[path] += len(rows)
        done.misfits = tabulator.misfits
        missing = [name for name in tables if name not in writers]
        if missing or not writers:
            there = recording.table_names()
            none = "has no rows" if done.health.is_whole else "was cut off or damaged before its first whole chunk"
            raise ArgumentError(
                f"{recording.name} {f'has no table {missing[0]!r} with rows' if there else none}",
                hint=f"it has {', '.join(there)}" if there else "elib record info FILE shows what it has",
            )
    return done


def _messages(recording: Recording, tables: Sequence[str], done: Exported) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the messages that the tables are made of, and note in *done* what else there is."""
    topics = topics_of(tables) if tables else [READINGS.name, PICTURES.name, *topics_of(FIXED)]
    for entry in recording.entries(*topics, health=done.health):
        done.pictures += entry.topic == PICTURES.name
        yield entry.topic, entry.data


def _make_room(path: Path, *, replace: bool) -> None:
    try:
        path.parent.mkdir(exist_ok=True)
        exists = path.exists()
    except OSError as error:
        raise ArgumentError(
            f"the folder {str(path.parent)!r} cannot be made: {reason_of(error)}",
            hint="name a folder in one that exists, and not a file",
        ) from None
    if exists and not replace:
        raise ArgumentError(f"{str(path)!r} exists", hint="choose another name, or add --replace")
