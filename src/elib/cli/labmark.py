"""``elib lab mark``: a class's submissions marked, each isolated from this computer and from the others."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter as Cli
from cyclopts import validators
from rich.console import Console
from rich.table import Table
from rich.text import Text

from elib.cli.arguments import AsJson
from elib.cli.readings import print_json
from elib.cli.terminal import DIM, LiveLine, say
from elib.errors import ArgumentError
from elib.files import write_file
from elib.lab import Lab, find_lab, load_lab
from elib.lab.marking import Mark, mark_all
from elib.lab.marksheet import to_csv, to_html, to_json, to_rows
from elib.lab.sandbox import check_walls
from elib.lab.similar import similar
from elib.lab.submissions import find_submissions

Folder = Annotated[Path, Cli(help="The folder with the submissions: files such as anna.py, or folders with a main.py.")]
LabFolder = Annotated[
    str | None,
    Cli(name="--lab", metavar="FOLDER", help="The lab's folder, or its name (default: above the submissions)."),
]
CsvFile = Annotated[Path | None, Cli(name="--csv", metavar="FILE", help="Also write the table for a spreadsheet.")]
HtmlFile = Annotated[Path | None, Cli(name="--html", metavar="FILE", help="Also write a page with each path.")]
Jobs = Annotated[
    int | None,
    Cli(
        metavar="N",
        help="Submissions that run at once; as many as processors unless given.",
        validator=validators.Number(gte=1),
    ),
]
Unsafe = Annotated[bool, Cli(help="Run the programs with your rights, without bubblewrap.")]


def mark(
    folder: Folder,
    /,
    *,
    lab: LabFolder = None,
    csv: CsvFile = None,
    html: HtmlFile = None,
    jobs: Jobs = None,
    json: AsJson = False,
    unsafe: Unsafe = False,
) -> None:
    """Mark all submissions in a folder; elib.cli.lab has the text of its help page."""
    submissions = find_submissions(folder)
    task = load_lab(lab or find_lab(folder / "submission"), hidden=True)
    for path in (csv, html):
        if path is not None and not path.parent.is_dir():
            raise ArgumentError(f"there is no folder {str(path.parent)!r} for {path.name!r}")
    if unsafe:
        say("warning: the programs run with your rights; they can read and change your files")
    else:
        check_walls()
    line, count = LiveLine(), 0

    def done(mark: Mark) -> None:
        nonlocal count
        count += 1
        line.show([(f"{count} of {len(submissions)} marked: {mark.name}", DIM)])

    try:
        marks = mark_all(task.folder, submissions, jobs=jobs or os.cpu_count() or 1, safe=not unsafe, done=done)
    finally:
        line.clear()
    start = task.folder / "start.py"
    programs = {submission.name: submission.text for submission in submissions}
    by_name = {mark.name: mark for mark in marks}
    for first, second, share in similar(programs, start.read_text() if start.is_file() else ""):
        by_name[first].alike[second] = by_name[second].alike[first] = round(100 * share)
    if csv is not None:
        write_file(csv, to_csv(task, marks).encode())
    if html is not None:
        write_file(html, to_html(task, marks).encode())
    if json:
        print_json(to_json(task, marks))
    else:
        _print(task, marks)


def _print(lab: Lab, marks: list[Mark]) -> None:
    rows = to_rows(lab, marks)
    if not any(mark.alike for mark in marks):
        rows = [row[:-1] for row in rows]
    heading, *rows = rows
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in heading:
        table.add_column(name, overflow="fold", no_wrap=name not in ("remarks", "similar"))
    for row, mark in zip(rows, marks, strict=True):
        table.add_row(*(Text(cell) for cell in row), style="red" if mark.attempts else "")
    Console().print(table)
