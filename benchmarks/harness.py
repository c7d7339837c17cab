"""What the benchmarks share: command lines, processes and their load, turns, and tables.

A benchmark is a function, or several. Its parameters are its options. It yields tables: a title, and the figures of
each row by the names of their columns. All benchmarks take two more options: ``--json`` prints the figures as one line
of JSON too, last, and ``--quick`` makes a run of some seconds, which shows that all works; its figures say little.
"""

from __future__ import annotations

import contextlib
import inspect
import json
import math
import os
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeAlias, TypeVar

from cyclopts import App, Parameter

T = TypeVar("T")
Cell: TypeAlias = float | str
Table: TypeAlias = Mapping[str, Mapping[str, Cell]]
Tables: TypeAlias = Iterator[tuple[str, Table]]

ROOT = Path(__file__).resolve().parents[1]
PATIENCE = 120.0
"""s within which a program prints its first lines, and then ends when it is told to."""


# -- the command line --------------------------------------------------------------------------------------------------


def quick(**values: object) -> Callable[[T], T]:
    """Give a benchmark the values of its options for ``--quick``."""

    def decorate(work: T) -> T:
        work.quick = values  # type: ignore[attr-defined]
        return work

    return decorate


def run(about: str | None, *works: Callable[..., Tables]) -> None:
    """Run a benchmark, or the one that the command line names, and show its tables."""
    app = App(help=about, version_flags=[])
    for work in works:
        (app.default if len(works) == 1 else app.command)(work)

    @app.meta.default
    def start(
        *words: Annotated[str, Parameter(show=False, allow_leading_hyphen=True)],
        is_json: Annotated[bool, Parameter("--json", negative="", help="Print all figures as JSON too, last.")] = False,
        is_quick: Annotated[bool, Parameter("--quick", negative="", help="Only show that all works.")] = False,
    ) -> None:
        work, given, _ = app.parse_args(words)
        if is_quick:
            given.arguments.update({key: value for key, value in work.quick.items() if key not in given.arguments})
        figures: dict[str, Table] = {}
        for title, table in work(*given.args, **given.kwargs):
            figures[title] = table
            show(title, table)
        if is_json:
            print(json.dumps(figures))

    app.meta()


def show(title: str, table: Table) -> None:
    """Print a table."""
    columns = list(dict.fromkeys(name for row in table.values() for name in row))
    rows = [[title, *columns]]
    rows += [[f"  {name}", *(short(row.get(each, "")) for each in columns)] for name, row in table.items()]
    first, *others = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for name, *cells in rows:
        print(f"{name:{first}}", *(f"{cell:>{width}}" for cell, width in zip(cells, others, strict=True)), sep="  ")
    sys.stdout.flush()


def short(cell: Cell) -> str:
    """Return a figure with about three digits."""
    return cell if isinstance(cell, str) else f"{cell:,.0f}" if abs(cell) >= 100 else f"{cell:.3g}"


def use_tests(*folders: str) -> None:
    """Let a benchmark import what the tests of these folders import."""
    sys.path[:0] = [str(ROOT), str(ROOT / "tests"), *(str(ROOT / "tests" / name) for name in folders)]


# -- processes ---------------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def started(
    *command: str, lines: int = 1, patience: float = PATIENCE, **options: Any
) -> Iterator[tuple[subprocess.Popen[str], list[str]]]:
    """Run a program until the block ends; give it, and the first lines that it prints.

    *options* are those of ``subprocess.Popen``.
    """
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **options)
    assert process.stdout is not None
    try:
        late = threading.Timer(patience, process.kill)
        late.start()
        first = [process.stdout.readline().strip() for _ in range(lines)]
        late.cancel()
        if not all(first):
            sys.exit(f"{' '.join(command)}\nended, or printed nothing in {patience:g} s")
        yield process, first
    finally:
        with process:  # it closes the pipes
            process.terminate()
            process.wait(PATIENCE)


@contextlib.contextmanager
def simulated(*options: str, robots: int = 1, python: str = sys.executable) -> Iterator[tuple[int, list[str]]]:
    """Serve virtual robots by ``elib simulate``; give the number of its process, and the URLs."""
    command = (python, "-m", "elib", "simulate", "--robots", str(robots), *options)
    with started(*command, lines=robots) as (process, first):
        yield process.pid, [line.split()[1] for line in first]


def calling(function: Callable[..., object], *words: str, python: str = sys.executable) -> list[str]:
    """Return the command of a process that calls a function of a benchmark with some words."""
    file = Path(inspect.getfile(function)).resolve()
    program = (
        f"import sys; sys.path.insert(0, {str(file.parent)!r}); import {file.stem}; "
        f"{file.stem}.{function.__name__}(*sys.argv[1:])"
    )
    return [python, "-c", program, *words]


def python_in(checkout: Path) -> str:
    """Return the Python of another checkout of elib: that of its ``.venv``, or else this one."""
    own = checkout.resolve() / ".venv/bin/python"
    return str(own) if own.exists() else sys.executable


@dataclass
class Load:
    """What a process took of one core.

    Attributes:
        share: Of the time that it worked.
        delayed: Of the time that it was ready and had no core: what the machine's other work cost it.
    """

    share: float = math.nan
    delayed: float = math.nan


@contextlib.contextmanager
def load(pid: int | None = None) -> Iterator[Load]:
    """Measure a process, or this one, until the block ends."""
    found, began, used, waited = Load(), time.perf_counter(), _used(pid), _waited(pid)
    yield found
    took = time.perf_counter() - began
    found.share, found.delayed = (_used(pid) - used) / took, (_waited(pid) - waited) / took


def _used(pid: int | None) -> float:
    """Return the CPU time of a process so far, s."""
    if pid is None:
        return time.process_time()
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _waited(pid: int | None) -> float:
    with contextlib.suppress(OSError):
        return int(Path(f"/proc/{pid or os.getpid()}/schedstat").read_text().split()[1]) / 1e9
    return math.nan


# -- turns -------------------------------------------------------------------------------------------------------------


def in_turns(works: Mapping[str, Callable[[], T]], rounds: int) -> dict[str, list[T]]:
    """Let all work in turns, once for nothing and then so many rounds; return what each call returned.

    The pace of a shared machine changes by the minute: in turns its other work falls on all alike.
    """
    found: dict[str, list[T]] = {name: [] for name in works}
    for work in works.values():
        work()  # It is compiled, and in the caches.
    for number in range(rounds):
        for name, work in list(works.items())[:: -1 if number % 2 else 1]:
            found[name].append(work())
    return found


def ratio(ours: Sequence[float], others: Sequence[float]) -> float:
    """Return the median of the ratios of each round."""
    return statistics.median(one / other for one, other in zip(ours, others, strict=False))


def trip(call: Callable[[], object], count: int) -> float:
    """Return the median time of a call, s."""
    took = []
    for _ in range(count):
        began = time.perf_counter()
        call()
        took.append(time.perf_counter() - began)
    return statistics.median(took)
