"""``elib run FILE``: run a program of yours, or the best controller of a study, on the robot that you name.

It keeps, draws and sums up what the robot did.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Any

from elib.behaviours import Behaviour, RunContext, RunMessage, behaviours, play
from elib.cli.arguments import check_duration
from elib.cli.program import is_package
from elib.cli.readings import print_json
from elib.cli.report import ENDINGS, drive_rows, link_rows
from elib.cli.terminal import say, table
from elib.errors import ArgumentError, ElibError
from elib.exits import DONE, FAILED, INTERRUPTED, complain
from elib.extras import check_web
from elib.program import is_own, loops_at, own_traceback, run_file
from elib.recording.log import Log
from elib.recording.recorder import Recorder
from elib.robot.aio import Epuck, on_open
from elib.robot.emergency import stop_at_once
from elib.robot.link import Record
from elib.robot.signals import SHUTDOWN_TIME, SIGNALS
from elib.robot.substitute import choose_robots, substituted, viewed
from elib.robot.watchdog import is_supported
from elib.runner import NOTHING, Records
from elib.session.statistics import LinkStats, merged
from elib.transport import speed_of
from elib.view.drive import RobotReport, draw_drive
from elib.view.report import check_report

MOST_INTERRUPTS = 3
"""Interrupts after which a program whose time is over, and which goes on, is ended by force."""
LINK_FIGURES = ("count", "lost", "refused", "unsent", "median", "p99", "resyncs", "resets")
"""What the summary says of a link: fields of its LinkStats."""


def run_program(
    file: str,
    arguments: Sequence[str] = (),
    *,
    robots: Sequence[str] = (),
    seconds: float | None = None,
    view: bool = False,
    plot: str | None = None,
    records: Records = NOTHING,
    json: bool = False,
) -> int:
    """Run a program and print a summary; return the exit code.

    Args:
        file: Path of the program, or of a champion: ``best.toml``.
        arguments: Its command line; a champion has none.
        robots: URLs of the robots that take the place of its own; empty leaves them.
        seconds: Robot time after which it ends as by Ctrl-C; None for no limit.
        view: Show the worlds of virtual robots live in the browser.
        plot: File for the plot, or None.
        records: Log and recording. Each robot after the first has a recording of its own.
        json: Print the summary as JSON on stdout, and what the program prints on stderr.

    Raises:
        ArgumentError: The command line is wrong; the program did not run.
        Unsupported: What the plot, the recording or the view needs is not installed; the program did not run.
        ElibError: The plot, the log or the recording could not be written.
    """
    path = find_program(file)
    check_duration(seconds)
    records.check()
    if plot is not None:
        check_report(plot)
    if view:
        check_web()
    run = ProgramRun(records, seconds)
    with contextlib.ExitStack() as stack:
        if path.suffix == ".toml":
            champion = stack.enter_context(_champion(path, arguments, is_named=bool(robots)))
            work = partial(run.drive, champion)
        else:
            work = partial(run.execute, path, arguments)
        if view:
            stack.enter_context(viewed())
        if robots:
            stack.enter_context(substituted(robots, source="elib run --robot"))
            stack.enter_context(loops_at(speed_of(choose_robots(())[0])))
        stack.enter_context(on_open(run.begin))
        if json:
            stack.enter_context(contextlib.redirect_stdout(sys.stderr))
        code = run.end_with(work)
    unwritten = run.finish()
    if plot is not None and run.robots:
        try:
            draw_drive(plot, path.name, run.robots, seconds=run.time)
        except ElibError as error:  # the summary comes first
            unwritten = unwritten or error
    run.exit_code = code if unwritten is None else FAILED
    if json:
        print_json(run.to_json(path, code, plot))
    else:
        rows = run.rows()
        if plot is not None:
            rows.append(("plot", plot if run.robots else "none: no robot was opened"))
        say(table(rows, indent=0))
    if unwritten is not None:
        raise unwritten
    return code


def find_program(name: str) -> Path:
    """Return the path of a program.

    Raises:
        ArgumentError: There is no such file; the message says where it was looked for, and which names are near.
    """
    path = Path(name)
    if path.is_file() or is_package(name):
        return path
    if path.is_dir():
        raise ArgumentError(f"{name} is a folder", hint=f"name a program in it: elib run {path / 'my_robot.py'}")
    folder = path.parent
    if not folder.is_dir():
        raise ArgumentError(f"there is no file {name}: there is no folder {folder}", hint="look for it with: ls")
    kind = ".toml" if path.suffix == ".toml" else ".py"
    there = sorted(each.name for each in folder.iterdir() if each.suffix == kind)
    near = get_close_matches(path.stem, [Path(each).stem for each in there], 1)
    sample = path.stem.lower().replace("_", "-")
    if near:
        hint = f"did you mean {folder / near[0]}{kind}?"
    elif kind == ".toml":
        hint = "elib evolve TASK writes the best controller that it finds into its folder, as best.toml"
    elif sample in behaviours():
        hint = f"elib run {sample} runs the behaviour that comes with elib"
    elif there:
        hint = f"the programs there are: {', '.join(there[:8])}{' ...' if len(there) > 8 else ''}"
    else:
        hint = f"there is no program in that folder; elib new avoid {name} makes one to start from"
    raise ArgumentError(f"there is no file {path.name} in {folder.absolute()}", hint=hint)


def _champion(path: Path, arguments: Sequence[str], *, is_named: bool) -> AbstractContextManager[Behaviour]:
    """Return a context that yields the controller of a file as a behaviour.

    Args:
        path: The file.
        arguments: Must be empty.
        is_named: Whether robots were named. Otherwise they are virtual, in the world of the task.

    Raises:
        ArgumentError: There are arguments, or the file cannot be read.
        SimulationError: The file breaks a rule.
    """
    from elib.learn.champion import load_champion  # programs do without it

    if arguments:
        raise ArgumentError(f"{path.name} takes no arguments, but there is {arguments[0]!r}", hint="leave out --")
    champion = load_champion(path)
    try:
        champion.find_task()
    except ArgumentError:
        if not is_named:
            raise
        return contextlib.nullcontext(champion.behaviour())  # the file of its task is on another computer
    return champion.in_its_world()


class ProgramRun:
    """One run of a program: the robots that it opens, and how it ends.

    Args:
        records: Log and recording.
        seconds: Robot time after which it ends, or None.

    Attributes:
        robots: What each robot did, in the order of opening; a robot that was opened twice is there twice.
        seconds: As given.
        reason: Why it ended, as in the summary of a behaviour.
        exit_code: The exit code of the process.
    """

    def __init__(self, records: Records, seconds: float | None) -> None:
        self.robots: list[RobotReport] = []
        self.seconds = seconds
        self.reason = "done"
        self.exit_code = DONE
        self._records = records
        self._files: list[Log | Recorder] = []
        self._statistics: list[LinkStats] = []
        self._opened: list[float] = []
        self._is_limited = False
        self._has_ended = threading.Event()

    @property
    def time(self) -> float:
        """Robot time from the opening of the first robot to the end of the last one, s."""
        return max((robot.time for robot in self.robots), default=0.0)

    def begin(self, robot: Epuck) -> list[Record]:
        """Follow a robot that was opened just now; a hook of :func:`on_open`."""
        number = len(self.robots) + 1
        record = self._records.record
        if record is not None and number > 1:
            path = Path(record)
            record = str(path.with_name(f"{path.stem}-{number}{path.suffix}"))
        records = replace(self._records, record=record)
        records.check()
        self._files += records.begin(robot)
        # A robot that is opened after the others were closed goes on at the time at which they ended.
        offset = max((each.time for each in self.robots if not each.is_closed), default=self.time)
        report = RobotReport(robot, robot.time - offset)
        self.robots.append(report)
        self._opened.append(offset)
        if self.seconds is not None and not self._is_limited:
            asyncio.get_running_loop().call_later(max(0.0, self.seconds - offset), self._expire)
        return [report]

    def end_with(self, work: Callable[[], None]) -> int:
        """Do the work of the program and stop its robots; return its exit code. Its errors are printed."""
        code = DONE
        with _interruptible():
            try:
                try:
                    work()
                finally:
                    SIGNALS.close_all()  # before the summary, as Python does it at its end
                    with contextlib.suppress(OSError, ValueError):  # Python says it at its end
                        sys.stdout.flush()
            except SystemExit as ending:
                code = _code_of(ending)
                self.reason = "interrupt" if code > 128 else "error" if code else "done"
            except KeyboardInterrupt:
                code, self.reason = INTERRUPTED, "interrupt"
            except BaseException as error:
                code, self.reason = FAILED, "error"
                if isinstance(error, ElibError) and not is_own(error):
                    code = complain(error)
                else:
                    say(own_traceback(error))
            self._has_ended.set()
        if self._is_limited and self.reason == "interrupt":
            code, self.reason = DONE, "time"
        return code

    def execute(self, path: Path, arguments: Sequence[str]) -> None:
        """Run the program."""
        run_file(path, arguments, has_driven=lambda: bool(self.robots), play=self._play)

    def drive(self, champion: Behaviour) -> None:
        """Run the best controller of a study, and print what it tells the user."""

        def listen(context: RunContext, robots: tuple[Epuck, ...]) -> None:
            context.listeners.append(lambda event: say(event.text) if isinstance(event, RunMessage) else None)

        self._play(champion, watch=listen, watchdog=is_supported())

    def finish(self) -> ElibError | None:
        """Finish the files, and return the error of the first that could not be written."""
        failure: ElibError | None = None
        for each in self._files:
            try:
                each.close()
            except ElibError as error:
                failure = failure or error
        for robot in self.robots:
            robot.close()
        self._statistics = [robot.robot.statistics for robot in self.robots]
        return failure

    def rows(self) -> list[tuple[str, str]]:
        """Return the summary as label and text."""
        if not self.robots:
            return [("robots", "none was opened")]
        rows = [("robot time", f"{self.time:.1f} s, {ENDINGS.get(self.reason, self.reason)}")]
        if len(self.robots) > 1:
            rows.append(("robots", f"{len(self.robots)} opened"))
        rows += drive_rows(self.robots)
        rows += link_rows(merged(self._statistics))
        if self._records.log is not None:
            rows.append(("log", self._records.log))
        rows += [("recording", str(each.path)) for each in self._files if isinstance(each, Recorder)]
        return rows

    def to_json(self, path: Path, code: int, plot: str | None) -> dict[str, object]:
        """Return the summary for other programs."""
        return {
            "program": str(path),
            "outcome": self.reason,
            "exit_code": code,
            "seconds": self.time,
            "distance": math.fsum(robot.distance for robot in self.robots),
            "robots": [
                {
                    "name": each.robot.name,
                    "url": each.robot.url,
                    "firmware": each.robot.firmware,
                    "opened": opened,
                    "seconds": each.time - opened,
                    "distance": each.distance,
                    "path": "world" if each.world is not None else "wheels",
                    "contacts": None if each.world is None else each.contacts,
                    "contact_seconds": None if each.world is None else each.contact_time,
                    "link": {name: getattr(statistics, name) for name in LINK_FIGURES},
                }
                for each, opened, statistics in zip(self.robots, self._opened, self._statistics, strict=True)
            ],
            "log": self._records.log,
            "recordings": [str(each.path) for each in self._files if isinstance(each, Recorder)],
            "plot": plot if self.robots else None,
        }

    def _play(self, behaviour: Behaviour, **more: Any) -> None:
        seconds, self.seconds = self.seconds, None  # a behaviour ends by itself when its time is over
        self.reason = play(behaviour, seconds=seconds, **more).reason

    def _expire(self) -> None:
        """End the program because its time is over, as Ctrl-C does."""
        if not self._is_limited:
            self._is_limited = True
            threading.Thread(target=self._insist, name="elib run --for", daemon=True).start()

    def _insist(self) -> None:
        for _ in range(MOST_INTERRUPTS):
            _interrupt_main_thread()
            if self._has_ended.wait(SHUTDOWN_TIME + 0.5):
                return self._end_threads()
        say("error: the program catches every Ctrl-C and goes on; it is ended now\nhint: write except Exception:")
        stop_at_once()
        os._exit(FAILED)

    def _end_threads(self) -> None:
        """End the process although threads of the program go on: Ctrl-C ends only the main thread."""
        threading.main_thread().join()
        for thread in threading.enumerate():
            if not thread.daemon and thread is not threading.main_thread():
                thread.join(SHUTDOWN_TIME)
                if thread.is_alive():
                    say(f"{thread.name} goes on after the time of the program, and is ended now")
                    with contextlib.suppress(OSError, ValueError):
                        sys.stdout.flush()
                    os._exit(self.exit_code)


@contextlib.contextmanager
def _interruptible() -> Iterator[None]:
    """Let Ctrl-C end the block also where it runs in the background of a shell, which ignores it."""
    is_ignored = (
        threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    )
    if is_ignored:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        if is_ignored:
            signal.signal(signal.SIGINT, signal.SIG_IGN)


def _interrupt_main_thread() -> None:
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        signal.raise_signal(signal.SIGINT)


def _code_of(ending: SystemExit) -> int:
    """Return the exit code of ``sys.exit(...)``, and print its text as Python does."""
    if ending.code is None or isinstance(ending.code, int):
        return ending.code or DONE
    say(str(ending.code))
    return FAILED
