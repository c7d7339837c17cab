"""Run a program of the user as Python does, also where it only defines what drives a robot, and show its errors."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import inspect
import io
import os
import re
import runpy
import signal
import sys
import threading
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from traceback import StackSummary, TracebackException
from types import ModuleType

from elib.base.errors import ArgumentError
from elib.base.exits import DONE, FAILED
from elib.base.files import PACKAGE
from elib.base.plaintext import say
from elib.base.timebase import LoopSpeed, SimulatedLoop, new_loop
from elib.behaviours import Behaviour, play
from elib.robot import runner
from elib.robot.emergency import stop_at_once
from elib.robot.signals import SHUTDOWN_TIME, SIGNALS

_LIBRARY = str(Path(asyncio.__file__).parents[1]) + os.sep  # in a browser, sysconfig has another
OURS = (
    str(PACKAGE) + os.sep,
    "<frozen ",
    "<string>",  # what dataclasses make
    *(_LIBRARY + name for name in ("asyncio", "concurrent", "contextlib", "runpy", "threading")),
)
"""Beginnings of the paths of files that a traceback leaves out: those of elib, and what it calls the program by."""

MAX_INTERRUPTS = 3
"""Interrupts after which a program whose time is over, and which goes on, is ended by force."""


def run_file(
    path: Path,
    arguments: Sequence[str] = (),
    *,
    has_driven: Callable[[], bool],
    play: Callable[[Behaviour, Sequence[str]], object] = lambda behaviour, _: play(behaviour),
) -> None:
    """Run a program as ``python PATH ARGUMENTS`` does. A file that only defines what drives a robot is run too.

    Args:
        path: The file, or the folder of a package, which is run as ``python -m`` does.
        arguments: Its command line.
        has_driven: Return whether the program has opened a robot.
        play: Run the behaviour that the file defines, with the command line.

    Raises:
        ArgumentError: The file defines several behaviours and runs none.
    """
    before = sys.argv[:], sys.path[:], sys.modules["__main__"]
    threads_before = threading.enumerate()
    is_package = path.is_dir()
    sys.argv = [str(path), *arguments]
    sys.path[0:1] = [str(path.resolve().parent if is_package else path.parent.absolute())]
    try:
        if is_package:
            found: Mapping[str, object] = runpy.run_module(path.resolve().name, run_name="__main__", alter_sys=True)
        else:
            main = sys.modules["__main__"] = ModuleType("__main__")
            main.__file__ = str(path.absolute())
            exec(compile(path.read_bytes(), str(path), "exec", dont_inherit=True), vars(main))
            found = vars(main)
        if not has_driven():
            _run_defined(found, arguments, play)
        _wait_for_threads(threads_before)
    finally:
        sys.argv, sys.path[:], sys.modules["__main__"] = before


def _wait_for_threads(before: Collection[threading.Thread]) -> None:
    """Wait for the threads that a program began, as Python does at its end: those of a pool end when its work is done.

    The threads in which an event loop runs its jobs are left out. They end with the loop, and the loops of robots that
    the program left open still go on.
    """

    def left() -> Iterator[threading.Thread]:
        for thread in threading.enumerate():
            if not (thread.daemon or thread in before or thread.name.startswith("asyncio_")):
                yield thread

    while thread := next(left(), None):
        pool = _pool_of(thread)
        if pool is None:
            thread.join()
        else:
            pool.shutdown()


def _pool_of(thread: threading.Thread) -> Executor | None:
    """Return the pool of threads or processes that a thread works for, if there is one."""
    # There is no public way from a thread to its pool: these are the names in pools of threads and of processes.
    pools: Iterator[Executor] = (each for each in gc.get_objects() if issubclass(type(each), Executor))
    for pool in pools:
        if thread in getattr(pool, "_threads", ()) or thread is getattr(pool, "_executor_manager_thread", None):
            return pool
    return None


def _run_defined(
    found: Mapping[str, object], arguments: Sequence[str], play: Callable[[Behaviour, Sequence[str]], object]
) -> None:
    """Run the behaviour that a file defines, or else its ``async def main(robot)``."""
    own = [each for each in found.values() if isinstance(each, Behaviour) and each.function.__module__ == "__main__"]
    main = found.get("main")
    if len(own) == 1:
        play(own[0], arguments)
    elif own:
        names = ", ".join(each.name for each in own)
        raise ArgumentError(
            f"the file defines {len(own)} behaviours, {names}, and runs none",
            hint="end it with the line: elib.play(NAME)",
        )
    elif inspect.iscoroutinefunction(main) and len(inspect.signature(main).parameters) == 1:
        runner.run(main, argv=arguments)


class TimeLimit:
    """Ends a program when its time is over: as Ctrl-C does, then by force.

    Args:
        name: Name of the thread that does it.
    """

    def __init__(self, name: str) -> None:
        self.is_over = False  # whether the time is over
        self.has_ended = threading.Event()  # set when the program has ended by itself or by the interrupt
        self.exit_code = DONE
        self._name = name
        self._lock = threading.Lock()
        self._is_taken = False  # whether the interrupt has reached the program
        self._holds = contextlib.ExitStack()  # until then simulated time stands still, or the program would go on in it

    def expire(self) -> None:
        """End the program because its time is over: called in each of its event loops. Safe to repeat."""
        loop = asyncio.get_running_loop()
        with self._lock:
            if isinstance(loop, SimulatedLoop) and not self._is_taken:
                self._holds.enter_context(loop.hold())
            if not self.is_over:
                self.is_over = True
                threading.Thread(target=self._insist, name=self._name, daemon=True).start()

    def _insist(self) -> None:
        for _ in range(MAX_INTERRUPTS):
            SIGNALS.send(signal.SIGINT)
            with self._lock:
                self._is_taken = True
                self._holds.close()
            if self.has_ended.wait(SHUTDOWN_TIME + 0.5):
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
def interruptible() -> Iterator[None]:
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


def code_of(ending: SystemExit) -> int:
    """Return the exit code of ``sys.exit(...)``, and print its text as Python does."""
    if ending.code is None or isinstance(ending.code, int):
        return ending.code or DONE
    say(str(ending.code))
    return FAILED


def own_traceback(error: BaseException) -> str:
    """Return the traceback of a program, without the frames of elib and of Python."""
    shown = TracebackException.from_exception(error, compact=True)
    if sys.version_info < (3, 12):
        _add_suggestions(shown, error)
    _keep_own_frames(shown)
    return "".join(shown.format()).rstrip()


def _add_suggestions(shown: TracebackException, error: BaseException) -> None:
    """Add "Did you mean: 'proximity'?", which in Python 3.11 only the interpreter's own printing has."""
    if isinstance(error, AttributeError | NameError):
        with contextlib.redirect_stderr(io.StringIO()) as printed:
            sys.__excepthook__(type(error), error, error.__traceback__)
        found = re.findall(r"\. Did you mean: '.*'\?$", printed.getvalue().rstrip())
        shown._str += "".join(found)  # type: ignore[attr-defined]  # noqa: SLF001  # there is no public way
    for each, inner in zip(shown.exceptions or (), getattr(error, "exceptions", ()), strict=False):
        _add_suggestions(each, inner)


def is_own(error: BaseException) -> bool:
    """Return whether *error* is one of the program: a line of it is in the traceback, or cannot be read."""
    return isinstance(error, SyntaxError) or _keep_own_frames(TracebackException.from_exception(error, compact=True))


def _keep_own_frames(shown: TracebackException) -> bool:
    """Leave the frames of the program in a traceback, and return whether there are any."""
    own = [frame for frame in shown.stack if not frame.filename.startswith(OURS)]
    shown.stack = StackSummary.from_list(own)
    for name in ("__cause__", "__context__"):
        other = getattr(shown, name)
        if other is not None and not _keep_own_frames(other):
            setattr(shown, name, None)
    for other in shown.exceptions or ():
        _keep_own_frames(other)
    return bool(own)


@contextlib.contextmanager
def loops_at(speed: LoopSpeed) -> Iterator[None]:
    """Let ``asyncio.run`` make event loops at the speed of a robot, while the block lasts, in the whole process."""
    before = asyncio.get_event_loop_policy()
    asyncio.set_event_loop_policy(_Policy(speed))
    try:
        yield
    finally:
        asyncio.set_event_loop_policy(before)


class _Policy(asyncio.DefaultEventLoopPolicy):
    def __init__(self, speed: LoopSpeed) -> None:
        super().__init__()
        self._speed = speed

    def new_event_loop(self) -> asyncio.AbstractEventLoop:
        return new_loop(self._speed)
