"""Ctrl-C and the signals that end a program: they must end its blocks, so that the robot stops."""

from __future__ import annotations

import asyncio
import atexit
import contextlib
import signal
import threading
import weakref
from collections.abc import Iterable, Iterator
from types import FrameType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from elib.robot.portal import Portal

LAST_WILL_TIME = 5.0
"""s that stopping a robot may take at the interpreter's end."""
TERMINATIONS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that end a program without asking it: somebody ends it, or closes its terminal."""


@contextlib.contextmanager
def ending(stop: asyncio.Event, numbers: Iterable[signal.Signals]) -> Iterator[None]:
    """Let signals set *stop* while the block lasts: they are the usual end of a server, not a failure.

    Args:
        stop: Set by each of them, in the running event loop.
        numbers: Which.
    """
    loop = asyncio.get_running_loop()
    handled = []
    for number in numbers:
        with contextlib.suppress(NotImplementedError):  # Windows: there Ctrl-C ends the runner
            loop.add_signal_handler(number, stop.set)
            handled.append(number)
    try:
        yield
    finally:
        for number in handled:
            loop.remove_signal_handler(number)


class Signals:
    """SIGINT, SIGTERM and SIGHUP while portals are open: an exception in the main thread, so ``with`` blocks end."""

    def __init__(self) -> None:
        self._portals: weakref.WeakSet[Portal] = weakref.WeakSet()
        self._before: dict[signal.Signals, Any] = {}

    def watch(self, portal: Portal) -> None:
        """Handle signals from now on, unless the program does so itself."""
        if not self._before and threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, *TERMINATIONS):
                default = signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
                if signal.getsignal(number) is default:
                    self._before[number] = signal.signal(number, self._handle)
        self._portals.add(portal)

    def forget(self, portal: Portal) -> None:
        """Give the signals back when the last portal closes."""
        self._portals.discard(portal)
        if not self._portals and threading.current_thread() is threading.main_thread():
            for number, handler in self._before.items():
                if signal.getsignal(number) == self._handle:
                    signal.signal(number, handler)
            self._before.clear()

    def _handle(self, number: int, frame: FrameType | None) -> None:
        error: BaseException = KeyboardInterrupt() if number == signal.SIGINT else SystemExit(128 + number)
        if not any(portal.interrupt(error) for portal in tuple(self._portals)):
            raise error

    def close_all(self) -> None:
        """At the interpreter's end: let every robot that is still open stop."""
        for portal in tuple(self._portals):
            if portal.last_will is not None:
                with contextlib.suppress(Exception):
                    portal.wait(portal.start(portal.last_will()), LAST_WILL_TIME)
            portal.close()


SIGNALS = Signals()
atexit.register(SIGNALS.close_all)


class Termination:
    """SIGTERM and SIGHUP while a robot is open: the task that opened it is cancelled, so its block ends and it stops.

    Where that task has ended, since others opened the robot for it, every task of the loop is cancelled.
    """

    def __init__(self) -> None:
        self.came: int | None = None
        self._task = asyncio.current_task()
        self._loop = asyncio.get_running_loop()
        watch = _WATCHES.get(self._loop)
        if watch is None:
            watch = _WATCHES[self._loop] = SignalWatch()
        self._watch = watch
        watch.add(self)

    def tell(self, number: int) -> None:
        """Let the robot's program end because of signal *number*."""
        self.came = number
        if self._task is not None and not self._task.done():
            self._task.cancel()
        else:
            for task in asyncio.all_tasks(self._loop):
                task.cancel()

    def leave(self) -> None:
        """Give the signals back, if no other robot of the loop needs them."""
        self._watch.discard(self)


class SignalWatch:
    """The signals of one event loop, and the open robots that want to hear of them."""

    def __init__(self) -> None:
        self._open: list[Termination] = []
        self._loop = asyncio.get_running_loop()
        self._numbers: list[int] = []

    def add(self, termination: Termination) -> None:
        """Listen for *termination* too."""
        self._open.append(termination)
        if self._numbers or threading.current_thread() is not threading.main_thread():
            return
        for number in TERMINATIONS:
            if signal.getsignal(number) is signal.SIG_DFL:  # else somebody else decides what it means
                with contextlib.suppress(NotImplementedError):  # Windows
                    self._loop.add_signal_handler(number, self._tell_all, number)
                    self._numbers.append(number)

    def discard(self, termination: Termination) -> None:
        """Listen for *termination* no longer."""
        with contextlib.suppress(ValueError):
            self._open.remove(termination)
        while self._numbers and not self._open:
            self._loop.remove_signal_handler(self._numbers.pop())

    def _tell_all(self, number: int) -> None:
        for termination in tuple(self._open):
            termination.tell(number)


_WATCHES: weakref.WeakKeyDictionary[asyncio.AbstractEventLoop, SignalWatch] = weakref.WeakKeyDictionary()
