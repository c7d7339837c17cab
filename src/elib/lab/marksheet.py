"""Marks as a table for the terminal, as CSV, and as one HTML page with the pictures of the paths."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from html import escape

from elib.base.plaintext import counted, plain
from elib.lab import Lab
from elib.lab.marking import Mark, MarkedRun
from elib.lab.result import ENDING

Marked = Sequence[tuple[Lab, Sequence[Mark]]]
"""Labs, each with the marks of its submissions."""


def to_rows(marked: Marked) -> list[list[str]]:
    """Return the heading and rows: of one lab a row for each mark, of several a row for each student.

    Each row has the name, points, each goal or each lab, remarks, and who is much alike. A student is who handed in
    under the same name, without ``.py``; what is missing has no points.
    """
    return _rows_of(*marked[0]) if len(marked) == 1 else _summed(marked)


def _summed(marked: Marked) -> list[list[str]]:
    labs = [lab.name for lab, _ in marked]
    rows = [["submission", "points", "of", *labs, "remarks", "similar"]]
    by_student = [{_student(mark, marks): mark for mark in marks} for _, marks in marked]
    for student in sorted({name for marks in by_student for name in marks}):
        found = [marks.get(student) for marks in by_student]
        there = [(name, mark) for name, mark in zip(labs, found, strict=True) if mark is not None]
        rows.append(
            [
                student,
                _number(sum(mark.points for _, mark in there)),
                _number(sum(lab.points for lab, _ in marked)),
                *("" if mark is None else _number(mark.points) for mark in found),
                "; ".join(f"{name}: {remark}" for name, mark in there for remark in mark.remarks),
                "; ".join(f"{name}: {_alike(mark)}" for name, mark in there if mark.alike),
            ]
        )
    return [[plain(cell) for cell in row] for row in rows]


def _student(mark: Mark, marks: Sequence[Mark]) -> str:
    """Return who handed in: the name without its ending, unless something else of that name was handed in, too."""
    name = named(mark.name)
    return name if sum(named(each.name) == name for each in marks) == 1 else mark.name


def _alike(mark: Mark) -> str:
    return ", ".join(f"{name} ({share} %)" for name, share in mark.alike.items())


def _rows_of(lab: Lab, marks: Sequence[Mark]) -> list[list[str]]:
    rows = [["submission", "points", "of", *(goal.name for goal in lab.goals), "remarks", "similar"]]
    for mark in marks:
        held = [f"{mark.goals[goal.name]}/{len(lab.variants)}" for goal in lab.goals]
        rows.append([mark.name, _number(mark.points), _number(mark.most), *held, "; ".join(mark.remarks), _alike(mark)])
    return [[plain(cell) for cell in row] for row in rows]


def named(file: str) -> str:
    """Return the name of a file that was handed in, without its ending."""
    return file.removesuffix(".py").removesuffix(ENDING)


def to_csv(rows: Sequence[Sequence[str]]) -> str:
    """Return the rows as CSV for a spreadsheet."""
    out = io.StringIO()
    # A spreadsheet calculates what begins like a formula, and names and remarks come from students.
    csv.writer(out).writerows([[f"'{c}" if c[:1] in tuple("=+-@") else c for c in row] for row in rows])
    return out.getvalue()


def to_html(lab: Lab, marks: Sequence[Mark]) -> str:
    """Return a page that needs nothing beside it: the table, and each run with its picture and what happened."""
    heading, *rows = _rows_of(lab, marks)
    goals = slice(3, 3 + len(lab.goals))
    head = (
        "".join(f"<th>{escape(cell)}</th>" for cell in ("submission", "points", *heading[goals]))
        + '<th class="rest"></th>'
    )
    body = "".join(_row(row, mark, goals) for row, mark in zip(rows, marks, strict=True))
    return PAGE.format(
        title=escape(lab.title),
        summary=escape(_summary(lab, marks)),
        head=head,
        body=body,
        details="\n".join(_details(index, mark) for index, mark in enumerate(marks)),
    )


def to_json(lab: Lab, marks: Sequence[Mark]) -> dict[str, object]:
    """Return the marks as values for JSON; the pictures are left out."""
    return {
        "lab": lab.title,
        "variants": [variant.name for variant in lab.variants],
        "marks": [
            {
                "submission": mark.name,
                "points": round(mark.points, 3),
                "of": mark.most,
                "attempts": [mark.broke] if mark.broke else [],
                "remarks": mark.remarks,
                "similar": mark.alike,
                "runs": [
                    {
                        "variant": run.variant,
                        "remark": run.remark,
                        "goals": {each.goal.name: {"holds": each.holds, "text": each.text} for each in run.goals},
                    }
                    for run in mark.runs
                ],
            }
            for mark in marks
        ],
    }


def _summary(lab: Lab, marks: Sequence[Mark]) -> str:
    full = sum(mark.points == mark.most for mark in marks)
    broke = sum(bool(mark.broke) for mark in marks)
    told = f"{counted(len(marks), 'submission')} in {counted(len(lab.variants), 'variant')}"
    return f"{told}: {full} with all points, {broke} broke the rules of the link."


def _row(row: list[str], mark: Mark, goals: slice) -> str:
    cells = [f'<td><a href="#{escape(_anchor(row[0]))}">{escape(row[0])}</a></td>', f"<td>{row[1]} / {row[2]}</td>"]
    for cell in row[goals]:
        held, _, runs = cell.partition("/")
        kind = "all" if held == runs else "none" if held == "0" else "some"
        cells.append(f'<td class="{kind}">{cell}</td>')
    texts = (row[-2], f"similar: {row[-1]}" if row[-1] else "")
    remarks = "<br>".join(escape(text) for text in texts if text)
    kind = "remarks cheat" if mark.broke else "remarks"
    below = f'<tr class="{kind}"><td colspan="{len(cells) + 1}">{remarks}</td></tr>' if remarks else ""
    return f"<tr>{''.join(cells)}<td></td></tr>{below}\n"


def _details(index: int, mark: Mark) -> str:
    name = plain(mark.name)
    more = ""
    if mark.output:
        last = escape(mark.runs[-1].variant)
        more += f"<details><summary>what it printed in {last}</summary><pre>{escape(mark.output)}</pre></details>"
    if mark.machine:
        more += f'<details><summary>its states</summary><figure class="machine">{mark.machine}</figure></details>'
    return (
        f'<section id="{escape(_anchor(name))}"><h2>{escape(name)}: {_number(mark.points)} of {_number(mark.most)}</h2>'
        f"{''.join(f'<p>{escape(remark)}</p>' for remark in mark.remarks)}"
        f'<div class="runs">{"".join(_figure(run) for run in mark.runs)}</div>{more}</section>'
    )


def _figure(run: MarkedRun) -> str:
    return f"<figure><figcaption>{escape(run.variant)}</figcaption>{run.picture}{told(run)}</figure>"


def told(run: MarkedRun) -> str:
    """Return what happened in a run, in HTML."""
    goals = "".join(
        f'<li class="{"all" if each.holds else "none"}"><b>{escape(each.goal.name)}</b>'
        f" {'holds' if each.holds else 'fails'}: {escape(each.text)}</li>"
        for each in run.goals
    )
    remark = f"<p>{escape(run.remark)}</p>" if run.remark else ""
    return remark + (f"<ul>{goals}</ul>" if goals else "")


def _anchor(name: str) -> str:
    return "s-" + name.replace(" ", "-")


def _number(points: float) -> str:
    return f"{points:.2f}".rstrip("0").rstrip(".")


PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; img-src data:">
<title>{title}</title>
<style>
:root {{ color-scheme: light dark; --line: #8884; --all: #2e7d50; --none: #b02a48; --some: #9a6700; }}
@media (prefers-color-scheme: dark) {{ :root {{ --all: #6cc793; --none: #ff8fa3; --some: #e3b341; }} }}
body {{ font: 16px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 75rem; padding: 0 1rem; }}
.wide {{ overflow-x: auto; }}
table {{ border-collapse: collapse; }}
th, td {{ text-align: left; padding: .3rem .7rem; border-top: 1px solid var(--line); vertical-align: top; }}
th.rest {{ width: 100%; }} .remarks td {{ border: 0; padding-top: 0; overflow-wrap: anywhere; }}
td:nth-child(2) {{ white-space: nowrap; font-variant-numeric: tabular-nums; }}
a {{ color: inherit; }}
.all {{ color: var(--all); }} .none {{ color: var(--none); }} .some {{ color: var(--some); }}
.cheat td {{ color: var(--none); font-weight: 600; }}
section {{ border-top: 1px solid var(--line); margin-top: 2rem; }}
.runs {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(min(16rem, 100%), 1fr)); gap: 1.5rem; }}
figure {{ margin: 0; }} figcaption {{ font-weight: 600; margin-bottom: .3rem; }}
figure svg {{ box-sizing: border-box; width: 100%; height: auto; border-radius: .4rem; border: 1px solid var(--line); }}
.machine svg {{ width: auto; max-width: 100%; background: #fff; }}
@media (max-width: 40rem) {{ table {{ font-size: .85rem; }} th, td {{ padding: .3rem .25rem; }} }}
ul {{ padding-left: 1.1rem; }} li {{ overflow-wrap: anywhere; }}
pre {{ overflow-x: auto; padding: .7rem; border: 1px solid var(--line); border-radius: .4rem; }}
</style></head><body>
<h1>{title}</h1><p>{summary}</p>
<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>
{body}</tbody></table></div>
{details}
</body></html>
"""
