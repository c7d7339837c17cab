"""The program of a person: it runs in the worker, and the page is told what it prints, where it is and how it ends."""

from __future__ import annotations

import builtins
import contextlib
import importlib
import io
import linecache
import math
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from msgspec import Struct

from elib.base.errors import ArgumentError, ElibError, Unsupported
from elib.base.exits import DONE, FAILED
from elib.base.plaintext import plain
from elib.base.timebase import move_into
from elib.behaviours._run.program import code_of, loops_at, own_traceback, run_file
from elib.lab.running import MAX_OUTPUT
from elib.panel.server.conversation import Told
from elib.robot.signals import SIGNALS
from elib.robot.substitute import substituted
from elib.studio.debugger import Called, Debugger, Variable
from elib.studio.labs import GoalNews
from elib.studio.place import Place

MAX_AT_ONCE = 20_000
"""Characters that a program may print between two looks at the page; the rest is left out, and said."""
NEWS = 0.1
"""s between two words about a program that runs."""
PATIENCE = 2.0
"""s that a program may compute while its robots' time stands still, until it is told why they do."""

INDENT = "begin each line of a block with as many spaces as its first line"
"""What to try where Python only says that lines do not fit together."""

State = Literal["idle", "running", "paused"]
EMPTY: Mapping[str, str] = MappingProxyType({})
Goals = Callable[[int | None], list[GoalNews]]


def no_goals(code: int | None) -> list[GoalNews]:
    """Return no goals: the program is for no lab."""
    return []


class Mistake(Struct):
    """Why a program ended: name, text and hint of the error, its line in the program, and the whole traceback."""

    kind: str
    message: str
    hint: str
    line: int | None
    trace: str


class Output(Told, tag="output"):
    """What the program has printed."""

    text: str
    is_error: bool = False


class ProgramNews(Told, tag="program"):
    """What the program does."""

    state: State
    name: str
    line: int | None = None  # the line that runs
    time: float = 0.0  # how long its robots have lived, s
    variables: list[Variable] = []  # what the innermost function sees, while the program stands still
    stack: list[Called] = []  # the functions that go on, the innermost first, while it stands still
    mistake: Mistake | None = None  # why it ended, if it was an error
    goals: list[GoalNews] = []  # which goals of its lab hold so far
    states: tuple[str, str] = ("", "")  # the state of its machine, and the one before; empty texts without a machine


class Program:
    """Runs one program after another.

    Args:
        nap: Waits so many seconds, while the page is heard.
        tell: Tells the page something.
        folder: Where the programs lie.
        time: How long the robots of the program have lived, s.
        states: The state of its machine, and the one before; empty texts without one.
        moment: What changes while its virtual robots live on; None while it has none open.
    """

    def __init__(
        self,
        nap: Callable[[float], None],
        tell: Callable[[Told], object],
        folder: Path,
        time: Callable[[], float],
        states: Callable[[], tuple[str, str]] = lambda: ("", ""),
        moment: Callable[[], object] = lambda: None,
    ) -> None:
        self.place = Place(nap, self._turned)  # where it runs
        self.debugger = Debugger(self.place, self._say)  # follows it
        self.state: State = "idle"  # what it does
        # returns which goals of its lab hold so far, or in the end, from the exit code of the program
        self.goals: Goals = no_goals
        self._is_late: Callable[[], bool] = lambda: False
        self._tell, self._folder, self._time, self._states, self._moment = tell, folder, time, states, moment
        self._mistake: Mistake | None = None
        self._was_stopped = False
        self._stood: tuple[object, float] = None, 0.0  # a moment, and since when it lasts
        self._name = ""
        self._code: int | None = None
        self._said = -math.inf
        self._out, self._err = _Printed(), _Printed()
        move_into(self.place)

    def take(self, text: str, name: str, imported: Mapping[str, str] = EMPTY) -> Path:
        """Take a program that is to run next, and others that it may import; return its file.

        Raises:
            ArgumentError: A program runs already.
        """
        if self.state != "idle":
            raise ArgumentError("a program runs already", hint="stop it first")
        self.state, self._name, self.debugger.line, self._code = "running", name, None, None
        self._mistake, self._was_stopped = None, False
        self._stood = None, math.inf
        return self._file(text, name, imported)

    def _file(self, text: str, name: str, imported: Mapping[str, str] = EMPTY) -> Path:
        # The next program is not to import an earlier one by accident, nor as it was.
        for old in (*self._folder.glob("*.py"), *self._folder.glob("__pycache__/*")):
            old.unlink()
        for each, module in [*sys.modules.items()]:
            if (getattr(module, "__file__", None) or "").startswith(f"{self._folder}/"):
                del sys.modules[each]
        importlib.invalidate_caches()
        file = self._folder / (Path(name).name or "program.py")
        for each, its in {**imported, file.name: text}.items():
            (self._folder / Path(each).name).write_text(its, encoding="utf-8")
        linecache.checkcache()
        return file

    def run(self, file: Path, robot: str) -> None:
        """Run the program to its end, on another robot than it names if *robot* is a URL."""
        self._say()
        try:
            with (
                contextlib.redirect_stdout(self._out),
                contextlib.redirect_stderr(self._err),
                self._around(file, robot),
            ):
                self._end(lambda: run_file(file, has_driven=lambda: self._time() > 0), file)
        finally:
            self.leave()

    def leave(self) -> None:
        """Note that what ran has ended."""
        self.place.is_ending = False
        self.state = "idle"
        self._flush()
        self._say()

    def printed_by(self, text: str, work: Callable[[Path], BaseException | None], is_late: Callable[[], bool]) -> str:
        """Do *work* with a program as one that runs, and return what was printed meanwhile; only an error is shown.

        While *is_late* returns True, what runs is ended as Ctrl-C does.

        Raises:
            ArgumentError: A person has stopped it.
        """
        file = self._file(text, self._name)
        printed = _Printed(MAX_OUTPUT)
        self._is_late = is_late
        try:
            with (
                contextlib.redirect_stdout(printed),
                contextlib.redirect_stderr(io.StringIO()),
                self._around(file, ""),
            ):
                error = work(file)
        finally:
            self._is_late = lambda: False
            self.place.is_ending = False
        if self._was_stopped:
            raise ArgumentError("the check was stopped")
        if error is not None and self._mistake is None:
            self._show(error, file)
        return printed.take()

    def stop(self) -> None:
        """End the program as Ctrl-C would."""
        if self.state != "idle":
            self.debugger.breakpoints = set()  # on its way out it stands still no more
            self.debugger.go("on")
            self.place.is_ending = self._was_stopped = True

    def pause(self) -> None:
        """Let the program and its robots stand still."""
        self.debugger.hold()

    @contextlib.contextmanager
    def _around(self, file: Path, robot: str) -> Iterator[None]:
        with contextlib.ExitStack() as stay:
            stay.enter_context(_replaced(vars(time), "sleep", self.place.sleep))
            stay.enter_context(_replaced(vars(builtins), "input", _no_input))
            stay.enter_context(loops_at("real"))
            if robot:
                stay.enter_context(substituted([robot], source="the page"))
            stay.callback(SIGNALS.close_all)
            stay.enter_context(self.debugger.following(str(file)))
            yield

    def _end(self, work: Callable[[], object], file: Path) -> None:
        """Do *work*, and note what was wrong in the end."""
        self._code = FAILED
        try:
            work()
            self._code = DONE
        except KeyboardInterrupt:
            print("The program was stopped.", file=sys.stderr)
        except SystemExit as error:
            self._code = code_of(error)
            if self._code:
                self._mistake = Mistake("SystemExit", f"the program ended with exit code {self._code}", "", None, "")
        except BaseException as error:
            self._show(error, file)

    def _show(self, error: BaseException, file: Path) -> None:
        """Print an error, and note it as what ended the program in *file*."""
        trace = own_traceback(error).replace(f"{self._folder}/", "")
        self._err.write(f"{trace}\n")
        self._mistake = mistake_of(error, trace, str(file))

    def _turned(self) -> None:
        """Tell the page what there is to tell, if it has not been told for a while."""
        self.place.is_ending |= self._is_late()
        self._look_at_time()
        self._flush()
        state: State = "paused" if self.place.is_held else "running"
        if self.state not in ("idle", state) or (self.state == "running" and time.perf_counter() - self._said > NEWS):
            self.state = state
            self._say()

    def _look_at_time(self) -> None:
        """Say once why the robots stand still, if the program only computes."""
        (before, since), moment, now = self._stood, self._moment(), time.perf_counter()
        if moment is None or moment != before or self.place.is_held:
            self._stood = moment, now
        elif now - since > PATIENCE:
            self._stood = before, math.inf
            self._err.write(
                f"The robot stands still, because the program waits for nothing (line {self.debugger.line}).\n"
                "What to try: put robot.sleep(0.05) into the loop.\n"
            )

    def _say(self) -> None:
        self._said = time.perf_counter()
        if self.state != "idle" and self.place.is_held:
            self.state = "paused"
        news = ProgramNews(self.state, self._name, self.debugger.line, self._time())
        news.mistake = self._mistake if self.state == "idle" else None
        news.states = self._states()
        news.goals = self.goals(None if self.state != "idle" else self._code)
        if self.state == "paused":
            news.variables, news.stack = self.debugger.variables(), self.debugger.stack()
        self._tell(news)

    def _flush(self) -> None:
        for stream in (self._out, self._err):
            if text := stream.take():
                self._tell(Output(plain(text), stream is self._err))


@contextlib.contextmanager
def _replaced(names: dict[str, Any], name: str, value: object) -> Iterator[None]:
    """Give a name of a module another value while the block lasts."""
    before, names[name] = names[name], value
    try:
        yield
    finally:
        names[name] = before


def _no_input(prompt: object = "") -> str:
    raise Unsupported(
        "input() does not exist in the studio: a page has no line to answer in",
        hint="write the value into the program",
    )


class _Printed(io.TextIOBase):
    """What a program prints, until it is taken; what is more than *most* characters is left out."""

    def __init__(self, most: int = MAX_AT_ONCE) -> None:
        self._most = most
        self._parts: list[str] = []
        self._size = 0

    def writable(self) -> bool:
        return True

    def write(self, text: str) -> int:
        room = self._most - self._size
        self._parts.append(text[:room] if room > 0 else "")
        self._size += len(text)
        return len(text)

    def take(self) -> str:
        """Return what was printed since the last time."""
        lost = self._size - self._most
        text = "".join(self._parts) + (
            f"\n… {lost} more characters were printed at once, and left out\n" if lost > 0 else ""
        )
        self._parts.clear()
        self._size = 0
        return text


def mistake_of(error: BaseException, trace: str, file: str) -> Mistake:
    """Return what is told of the error that ended the program in *file*."""
    lines = [number for frame, number in traceback.walk_tb(error.__traceback__) if frame.f_code.co_filename == file]
    line = lines[-1] if lines else getattr(error, "lineno", None)
    message = error.message if isinstance(error, ElibError) else trace.rpartition("\n")[2].partition(": ")[2]
    hint = error.hint if isinstance(error, ElibError) else INDENT if isinstance(error, IndentationError) else ""
    return Mistake(type(error).__name__, plain(message), plain(hint), line, plain(trace))
