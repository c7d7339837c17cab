"""Marks of submissions: each is run in every variant of a lab, several at once, and the same on every run."""

from __future__ import annotations

import contextlib
import ctypes
import multiprocessing
import re
import signal
import socket
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from elib.base.errors import ElibError
from elib.lab import GoalResult, Lab, VariantResult, load_lab, run_variant
from elib.lab.goal import MISSED, points
from elib.lab.sandbox import LIMITS, Child, Limits, start
from elib.lab.submissions import Submission
from elib.tools.states.drawing import picture_of

PICTURE_SIZE = 300
"""Pixels of the longer side of a path's picture."""
MAX_ERROR = 120
"""Characters of an error that a remark shows."""
SHOWN_OUTPUT = 10_000
"""Characters of a program's output in a report: the end, with the traceback or the map."""


@dataclass(frozen=True, slots=True)
class MarkedRun:
    """One submission in one variant."""

    variant: str  # its name
    goals: tuple[GoalResult, ...]  # what became of each goal
    remark: str = ""  # how it ended, or an empty string if it ended by itself
    picture: str = ""  # the robots' paths, SVG


@dataclass(slots=True)
class Mark:
    """What a submission is worth."""

    name: str  # the submission's
    points: float  # the sum over the goals: points times share of the variants in which the goal holds
    most: float  # points that can be reached
    goals: dict[str, int] = field(default_factory=dict)  # in how many variants each goal holds, by its name
    # each variant; after a broken rule of the link or an exceeded limit the others are not run
    runs: list[MarkedRun] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)  # what the teacher should know, in words
    broke: str = ""  # how it broke the rules of the link to its robot, or an empty string; it has no points then
    output: str = ""  # the end of what it printed in the last run
    machine: str = ""  # the picture of its states, an SVG document; empty if it has none
    # other submissions that are much alike, with the share in percent
    alike: dict[str, int] = field(default_factory=dict)


def mark_all(
    folder: Path,
    submissions: Sequence[Submission],
    *,
    jobs: int,
    safe: bool = True,
    limits: Limits = LIMITS,
    draws: bool = True,
    done: Callable[[Mark], object] = lambda mark: None,
) -> list[Mark]:
    """Mark submissions, each in a process of its own, and return the marks in the same order."""
    # A process for each job, because a simulation is busy with computing. A fresh one has no threads and no loop.
    context = multiprocessing.get_context("spawn")
    workers = ProcessPoolExecutor(jobs, context, initializer=_end_with_the_marker)
    futures: dict[Future[Mark], int] = {
        workers.submit(mark, folder, submission, safe, limits, draws): index
        for index, submission in enumerate(submissions)
    }
    marks: dict[int, Mark] = {}
    try:
        for future in as_completed(futures):
            marks[futures[future]] = future.result()
            done(marks[futures[future]])
    except BrokenProcessPool:
        raise ElibError("a process of the marker was ended", hint="is there enough memory? try --jobs 1") from None
    finally:
        # After an error or Ctrl-C nothing waits for what still runs. bubblewrap ends with the process that started it.
        if len(marks) < len(submissions):
            for process in multiprocessing.active_children():
                process.kill()
        workers.shutdown(cancel_futures=True)
    return [marks[index] for index in range(len(submissions))]


def _end_with_the_marker() -> None:
    """Let this process die with the one that started it, however that ends; Ctrl-C is for the marker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def mark(folder: Path, submission: Submission, safe: bool = True, limits: Limits = LIMITS, draws: bool = True) -> Mark:
    """Run a submission in all variants, and return its mark, with pictures if they are to be seen."""
    lab = _lab(folder)
    result = Mark(submission.name, 0.0, lab.points, goals={goal.name: 0 for goal in lab.goals})
    if submission.problem:
        result.remarks.append(submission.problem)
        return result
    if draws:
        result.machine = picture_of(submission.files[submission.main].decode(errors="replace"))
    for variant in lab.variants:
        children: list[Child] = []

        def begin(link: socket.socket, children: list[Child] = children) -> Child:
            hidden = (folder, submission.folder)
            children.append(start(submission.files, submission.main, link, limits=limits, hidden=hidden, safe=safe))
            return children[0]

        found = run_variant(lab, variant, begin)
        (child,) = children
        child.kill()
        if not child.began and not child.exceeded:
            raise ElibError(f"{submission.name} could not be started: {child.output.strip() or 'it says nothing'}")
        if not _add(result, found, child, submission, draws):
            break
    missing = len(lab.variants) - len(result.runs)
    if missing:
        result.remarks.append(
            f"{missing} more variants were not run" if missing > 1 else "one more variant was not run"
        )
    if not result.broke:
        result.points = points(lab.goals, result.goals, len(lab.variants))
    return result


def _add(result: Mark, found: VariantResult, child: Child, submission: Submission, draws: bool) -> bool:
    """Add what happened in a variant, and return whether the submission is run in the others too."""
    remark = child.exceeded or found.why
    if found.ending == "failed" and not child.exceeded:
        remark += _last_error(child.output, submission.files)
    elif found.ending == "ended" and not found.opened_robot:
        remark = "it opened no robot"
    name = found.variant.name
    if found.ending == "broke" and not child.exceeded:
        result.broke = found.why
    is_told = bool(child.exceeded) or found.ending in ("failed", "wall", "broke") or not found.opened_robot
    # Some programs are meant to go on until the time is over; it explains something only where a goal fails.
    is_told = is_told or (found.ending == "time" and not all(goal.holds for goal in found.goals))
    text = f"no points: {remark}" if result.broke else remark
    if is_told and not any(text in known for known in result.remarks):
        result.remarks.append(f"{text} ({name})")
    for goal in found.goals:
        result.goals[goal.goal.name] += goal.holds
        begin = f"{goal.goal.name}: "
        is_news = not (goal.holds or goal.text.startswith(MISSED) or any(s.startswith(begin) for s in result.remarks))
        if is_news and not is_told:
            result.remarks.append(f"{begin}{goal.text} ({name})")
    picture = None
    with contextlib.suppress(ValueError):
        picture = found.draw(size=PICTURE_SIZE) if draws else None
    result.runs.append(MarkedRun(name, found.goals, remark, picture or ""))
    result.output = child.output[-SHOWN_OUTPUT:]
    return not (child.exceeded or found.ending in ("broke", "wall"))


def _last_error(output: str, files: Iterable[str]) -> str:
    """Return the error with which a program ended, as the last line of what it printed tells it, if that is one.

    The line of the last of its files that the traceback names comes first. A hint of elib's errors may follow it.
    """
    lines = [line for line in output.rstrip().splitlines() if not line.startswith("hint: ")]
    last = lines[-1] if lines else ""
    frames = re.findall(r'^ *File "(.*)", line (\d+)', output, re.MULTILINE)
    places = [f" in line {line} of {name}" for path, line in frames for name in files if path.endswith(f"/{name}")]
    # An address differs on every run.
    is_error = re.match(r"[A-Za-z_][\w.]*: ", last) and "0x" not in last
    return "".join(places[-1:]) + (f": {last[:MAX_ERROR]}" if is_error else "")


@cache
def _lab(folder: Path) -> Lab:
    return load_lab(folder, hidden=True)
