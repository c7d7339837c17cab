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
from functools import cache, partial
from pathlib import Path

from elib.base.errors import ElibError
from elib.lab import GoalResult, Lab, VariantResult, load_lab, run_together
from elib.lab.goal import MISSED, points
from elib.lab.sandbox import LIMITS, Child, Limits, start
from elib.lab.submissions import Submission, read_submission
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
    # its points in each variant, for a game; -1 where it failed or was not run
    reached: list[float] = field(default_factory=list)
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
    opponents = opponents_of(_lab(folder))
    runs = [(each, *opponents) for each in submissions]
    played = play_all(folder, runs, jobs=jobs, safe=safe, limits=limits, draws=draws, done=lambda marks: done(marks[0]))
    return [marks[0] for marks in played]


def play_all(
    folder: Path,
    games: Sequence[Sequence[Submission]],
    *,
    jobs: int,
    safe: bool = True,
    limits: Limits = LIMITS,
    draws: bool = True,
    done: Callable[[list[Mark]], object] = lambda marks: None,
) -> list[list[Mark]]:
    """Run the programs of each game together, or one alone; return the marks of each in the same order."""
    # A process for each job, because a simulation is busy with computing. A fresh one has no threads and no loop.
    context = multiprocessing.get_context("spawn")
    workers = ProcessPoolExecutor(jobs, context, initializer=_end_with_the_marker)
    futures: dict[Future[list[Mark]], int] = {
        workers.submit(play, folder, players, safe, limits, draws): index for index, players in enumerate(games)
    }
    marks: dict[int, list[Mark]] = {}
    try:
        for future in as_completed(futures):
            marks[futures[future]] = future.result()
            done(marks[futures[future]])
    except BrokenProcessPool:
        raise ElibError("a process of the marker was ended", hint="is there enough memory? try --jobs 1") from None
    finally:
        # After an error or Ctrl-C nothing waits for what still runs. bubblewrap ends with the process that started it.
        if len(marks) < len(games):
            for process in multiprocessing.active_children():
                process.kill()
        workers.shutdown(cancel_futures=True)
    return [marks[index] for index in range(len(games))]


def _end_with_the_marker() -> None:
    """Let this process die with the one that started it, however that ends; Ctrl-C is for the marker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def mark(folder: Path, submission: Submission, safe: bool = True, limits: Limits = LIMITS, draws: bool = True) -> Mark:
    """Run a submission in all variants, and return its mark, with pictures if they are to be seen."""
    return play(folder, [submission, *opponents_of(_lab(folder))], safe, limits, draws)[0]


def opponents_of(lab: Lab) -> list[Submission]:
    """Return the program that a submission plays against in a game outside a league; nothing in other labs."""
    return [] if lab.opponent is None else [read_submission(lab.opponent)]


def play(
    folder: Path, players: Sequence[Submission], safe: bool = True, limits: Limits = LIMITS, draws: bool = True
) -> list[Mark]:
    """Run the two programs of a game, or a single one, in all variants, and return the mark of each."""
    lab = _lab(folder)
    goals = [goal.name for goal in lab.goals]
    # In a league one of the two fails the goals of every round, so only the page says why.
    is_game, is_league = len(players) > 1, list(players[1:]) not in ([], opponents_of(lab))
    results = [Mark(each.name, 0.0, lab.points, goals=dict.fromkeys(goals, 0)) for each in players]
    if any(each.problem for each in players):
        for result, submission in zip(results, players, strict=True):
            result.remarks += [submission.problem] if submission.problem else []
            result.reached = [-1.0 if submission.problem else 0.0] * len(lab.variants)
        return results
    if draws:
        results[0].machine = picture_of(players[0].files[players[0].main].decode(errors="replace"))
    for variant in lab.variants:
        children: list[Child] = []

        def begin(submission: Submission, link: socket.socket, children: list[Child] = children) -> Child:
            hidden = (folder, submission.folder)
            children.append(start(submission.files, submission.main, link, limits=limits, hidden=hidden, safe=safe))
            return children[-1]

        found = run_together(lab, variant, [partial(begin, each) for each in players])
        for each, child in zip(players, children, strict=True):
            child.kill()
            if not child.began and not child.exceeded:
                raise ElibError(f"{each.name} could not be started: {child.output.strip() or 'it says nothing'}")
        # In a game both have the same picture.
        added = [
            _add(result, each, child, player, draws and not place, is_game=is_game, is_league=is_league)
            for place, (result, each, child, player) in enumerate(zip(results, found, children, players, strict=True))
        ]
        if not all(added):
            break
    for result in results:
        missing = len(lab.variants) - len(result.runs)
        result.reached += result.reached[-1:] * missing
        if missing and result.reached[-1] < 0:
            result.remarks.append(
                f"{missing} more variants were not run" if missing > 1 else "one more variant was not run"
            )
        if not result.broke:
            result.points = points(lab.goals, result.goals, len(lab.variants))
    return results


def _add(
    result: Mark,
    found: VariantResult,
    child: Child,
    submission: Submission,
    draws: bool,
    is_game: bool,
    is_league: bool,
) -> bool:
    """Add what happened in a variant, and return whether the submission is run in the others too."""
    remark = child.exceeded or found.why
    if found.ending == "failed" and not child.exceeded:
        remark += _last_error(child.output, submission.files)
    elif found.ending == "ended" and not found.opened_robot:
        remark = "it opened no robot"
    name = found.variant.name
    if found.ending == "broke" and not child.exceeded:
        result.broke = found.why
    is_told = failed = bool(child.exceeded) or found.ending in ("failed", "wall", "broke") or not found.opened_robot
    result.reached.append(-1.0 if failed else sum(each.goal.points for each in found.goals if each.holds))
    # Some programs are meant to go on until the time is over; it explains something only where a goal fails.
    is_told = is_told or (not is_game and found.ending == "time" and not all(goal.holds for goal in found.goals))
    text = f"no points: {remark}" if result.broke else remark
    if is_told and not any(text in known for known in result.remarks):
        result.remarks.append(f"{text} ({name})")
    for goal in found.goals:
        result.goals[goal.goal.name] += goal.holds
        needs = f"{goal.goal.name} counts only together with {' and '.join(goal.goal.needs)}"
        if goal.text.startswith(MISSED) and not (goal.holds or is_league or failed) and needs not in result.remarks:
            result.remarks.append(needs)
        begin = f"{goal.goal.name}: "
        is_news = not (goal.holds or goal.text.startswith(MISSED) or any(s.startswith(begin) for s in result.remarks))
        if is_news and not (is_told or is_league):
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
