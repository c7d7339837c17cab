"""``elib lab mark``: a class's submissions marked, each isolated from this computer and from the others."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.exits import FAILED
from elib.base.files import write_file
from elib.base.rules import Whole
from elib.cli.arguments import AsJson, option
from elib.cli.terminal import LiveLine, grid, print_json, say, table
from elib.lab import Lab, find_lab, load_lab
from elib.lab import league as leagues
from elib.lab.marking import Mark, mark_all, play_all
from elib.lab.marksheet import to_csv, to_html, to_json, to_rows
from elib.lab.mistakes import also_failed, is_mistake, wrong_claim
from elib.lab.sandbox import check_walls
from elib.lab.similar import similar
from elib.lab.submissions import Submission, find_submissions

Folder = Annotated[
    Path,
    Cli(help="The folder with the submissions: files such as anna.py, or folders with a main.py. Several: one table."),
]


def mark(
    *folder: Folder,
    lab: Annotated[
        list[str] | None,
        option("--lab FOLDER", "The lab's folder, or its name (default: above the submissions); once for each folder."),
    ] = None,
    csv: Annotated[Path | None, option("--csv FILE", "Also write the table for a spreadsheet.")] = None,
    html: Annotated[Path | None, option("--html FILE", "Also write a page with each path.")] = None,
    jobs: Annotated[
        int | None,
        Whole(1),
        Cli(metavar="N", help="Submissions that run at once (default: as many as there are processors)."),
    ] = None,
    league: Annotated[bool, Cli(help="Let every two submissions play the game against each other.")] = False,
    json: AsJson = False,
    unsafe: Annotated[bool, Cli(help="Run the programs with your rights, without bubblewrap.")] = False,
) -> None:
    """Mark all submissions in folders; elib.cli.lab has the text of its help page."""
    if not folder:
        raise ArgumentError("elib lab mark needs the folder with the submissions")
    if lab and len(lab) != len(folder):
        raise ArgumentError(f"there are {len(folder)} folders, but {len(lab)} --lab", hint="give one for each folder")
    if html is not None and len(folder) > 1:
        raise ArgumentError("--html makes the page of one lab", hint="mark the folders one by one for their pages")
    if league and len(folder) > 1:
        raise ArgumentError("a league is played by the submissions in one folder", hint="put all into one folder")
    labs: list[str] = lab or [str(find_lab(each / "submission")) for each in folder]
    work = [
        (load_lab(task, hidden=True), each, find_submissions(each)) for task, each in zip(labs, folder, strict=True)
    ]
    task, _, submissions = work[0]
    if league and task.opponent is None:
        raise ArgumentError(f"the lab {task.name} is no game of two programs", hint="leave out --league")
    if league and len(submissions) < 2:
        raise ArgumentError("a league needs two submissions or more")
    for path in (csv, html):
        if path is not None and not path.parent.is_dir():
            raise ArgumentError(f"there is no folder {str(path.parent)!r} for {path.name!r}")
    if unsafe:
        say("warning: the programs run with your rights; they can read and change your files")
    else:
        check_walls()
    line, count = LiveLine(), 0
    games = leagues.pairs(submissions) if league else []
    total = len(games) or sum(len(each) for _, _, each in work)
    at_once, draws = jobs or os.cpu_count() or 1, html is not None

    def done(*marks: Mark) -> None:
        nonlocal count
        count += 1
        line.tell(f"{count} of {total} {'played' if league else 'marked'}: {' and '.join(each.name for each in marks)}")

    line.tell(f"0 of {total} {'played' if league else 'marked'}")
    marked: list[tuple[Lab, list[Mark]]] = []
    played: list[list[Mark]] = []
    wrong: list[str] = []
    try:
        if league:
            played = play_all(
                task.folder, games, jobs=at_once, safe=not unsafe, draws=draws, done=lambda marks: done(*marks)
            )
        for task, each, submissions in () if league else work:
            marks = mark_all(task.folder, submissions, jobs=at_once, safe=not unsafe, draws=draws, done=done)
            _note_similar(task, submissions, marks)
            marked.append((task, marks))
            if is_mistake(task, each / "submission"):
                wrong += _wrong(task, submissions, marks)
    finally:
        line.clear()
    if league:
        table = leagues.standings(played)
        _note_similar(task, submissions, table)
        rows, values = leagues.to_rows(table), leagues.to_json(task, table, played)
        page = partial(leagues.to_html, task, table, played)
    else:
        task, marks = marked[0]
        rows, page = to_rows(marked), partial(to_html, task, marks)
        values = to_json(task, marks) if len(marked) == 1 else {"labs": [to_json(*each) for each in marked]}
    if csv is not None:
        write_file(csv, to_csv(rows).encode())
    if html is not None:
        write_file(html, page().encode())
    if json:
        print_json(values)
    else:
        print_table(rows)
    for text in wrong:
        say(f"error: {text}")
    if wrong:
        raise SystemExit(FAILED)


def _note_similar(
    lab: Lab, submissions: Sequence[Submission], marks: Sequence[Mark] | Sequence[leagues.Standing]
) -> None:
    """Write into the marks which submissions are much alike."""
    start = lab.folder / "start.py"
    programs = {submission.name: submission.text for submission in submissions}
    by_name = {mark.name: mark for mark in marks}
    for first, second, share in similar(programs, start.read_text() if start.is_file() else ""):
        by_name[first].alike[second] = by_name[second].alike[first] = round(100 * share)


def _wrong(lab: Lab, submissions: Sequence[Submission], marks: Sequence[Mark]) -> Iterator[str]:
    """Yield which mistakes of the lab do not fail as they say."""
    for submission, mark in zip(submissions, marks, strict=True):
        text = submission.files.get(submission.main, b"").decode(errors="replace")
        goals = [run.goals for run in mark.runs]
        found, others = wrong_claim(lab, text, goals), also_failed(lab, text, goals)
        if found:
            yield f"{mark.name}: {found}"
        elif others:
            say(f"{mark.name}: it fails as its first line says{others}")


def print_table(table_rows: Sequence[list[str]]) -> None:
    """Print the numbers as a table, and what there is to say of each submission below: it needs the width."""
    heading, *rows = table_rows
    print(grid(heading[:-2], [row[:-2] for row in rows]))
    notes = [(name, note) for name, *_, said, alike in rows for note in (said, alike and f"similar: {alike}") if note]
    if notes:
        print(f"\n{table(notes, indent=0)}")
