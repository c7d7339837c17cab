r"""Ctrl-C and the other signals that end or suspend a program: whatever they do to it, the robot stops.

While a robot is open, or an event loop of elib runs, signals come here, unless the program handles them itself. They
cancel what the main thread waits for: a blocking call, or the main task of an event loop. Ctrl-Z and Ctrl-\ leave the
program no time: the robot is told to stop past its queue.
"""

from __future__ import annotations

import _thread
import asyncio
import atexit
import contextlib
import functools
import math
import os
import queue
import signal
import threading
import time
from collections.abc import AsyncGenerator, Awaitable, Callable
from types import FrameType
from typing import Any

from elib.base.timebase import host, running_loop
from elib.link.session import Channel
from elib.robot.emergency import EmergencyStop, stop_at_once

SHUTDOWN_TIME = 2.0
"""s after a signal in which more signals change nothing: robots are being stopped, and that must not be cut short."""
SUSPENSION_TIME = 0.1
"""s after which a program is suspended even if its event loop is busy and does not suspend it."""
NOTICE_TIME = 0.5
"""s in which an event loop notices a signal, unless something blocks it."""
TERMINATIONS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that end a program: another process ends it, or its terminal is closed."""
SUSPENSIONS = tuple(getattr(signal, name) for name in ("SIGTSTP", "SIGQUIT") if hasattr(signal, name))
"""Ctrl-Z and Ctrl-Backslash."""


def error_of(number: int) -> BaseException:
    """Return the exception that ends a program because of signal *number*."""
    return KeyboardInterrupt() if number == signal.SIGINT else SystemExit(128 + number)


def interrupt_main_thread(number: int) -> None:
    """Let signal *number* come to the main thread, also while a call of the system keeps it."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, number)
    else:
        signal.raise_signal(number)


class Signals:
    """The signal handlers of this process, and the event loops that they end."""

    def __init__(self) -> None:
        self._loops: dict[asyncio.AbstractEventLoop, LoopSignals] = {}
        self._is_suspending = False
        self._before: dict[int, Any] = {}
        """The handlers that were there, by the signals that come here now."""
        self._taken: queue.SimpleQueue[int] = queue.SimpleQueue()  # a signal handler may put into it at any moment
        """Signals that ended something, for :meth:`send`."""

    def signals_of(self, loop: asyncio.AbstractEventLoop) -> LoopSignals:
        """Return what signals do to *loop*."""
        return self._loops.setdefault(loop, LoopSignals(loop))

    def forget(self, loop: asyncio.AbstractEventLoop) -> None:
        """Forget a loop; after the last one, put back the handlers that were there before."""
        self._loops.pop(loop, None)
        if self._loops or threading.current_thread() is not threading.main_thread():
            return
        for number, handler in self._before.items():
            if signal.getsignal(number) in (self._end, self._suspend):
                task = _task_of_runner(handler)
                is_over = task is not None and task.done()
                signal.signal(number, signal.default_int_handler if is_over else handler)
        self._before.clear()

    def install(self) -> None:
        """Handle signals from now on, except those that the program handles itself. Only the main thread can."""
        if threading.current_thread() is not threading.main_thread():
            return
        handlers = dict.fromkeys((signal.SIGINT, *TERMINATIONS), self._end) | dict.fromkeys(SUSPENSIONS, self._suspend)
        for number, handler in handlers.items():
            if number not in self._before and _is_free(number):
                self._before[number] = signal.signal(number, handler)

    def interrupt(self) -> None:
        """End what the program does, as Ctrl-C would, where there are no signals.

        Raises:
            KeyboardInterrupt: It waits for no call that ends by itself.
        """
        self._end(signal.SIGINT, None)

    def send(self, number: int) -> None:
        """Let signal *number* come to the main thread, from another one, and wait until it has, at most 0.5 s."""
        self._taken = queue.SimpleQueue()
        interrupt_main_thread(number)
        with contextlib.suppress(queue.Empty):  # the program handles it itself, or has ended
            self._taken.get(timeout=NOTICE_TIME)

    def _end(self, number: int, frame: FrameType | None) -> None:
        try:
            self._end_calls(number, frame)
        finally:
            self._taken.put(number)

    def _end_calls(self, number: int, frame: FrameType | None) -> None:
        loops = tuple(self._loops.values())
        here = [each for each in loops if each.is_awaited]
        for each in here:
            each.break_out(number)
        if here and all(each.is_shutting_down for each in here):
            return
        # Ctrl-C ends what the main thread waits for; to the loops of other threads the program does what it likes.
        for each in here if number == signal.SIGINT else loops:
            each.end(number)
        if any(each.cancel is not None for each in here):
            return  # the thread that waits there raises the error
        before = self._before.get(number, signal.SIG_DFL)
        if here and _task_of_runner(before) is not None:
            before(number, frame)
        elif number == signal.SIGINT or not here:
            raise error_of(number)

    def _suspend(self, number: int, frame: FrameType | None) -> None:
        """Stop the robots, then suspend or end the program."""
        loop = running_loop()
        goes_on = number != getattr(signal, "SIGQUIT", None)
        if loop is not None and goes_on and not self._is_suspending:
            # Not in the middle of a call: what it sends behind the stop would take the stop's answer for its own.
            self._is_suspending = True
            loop.call_soon_threadsafe(self._suspend_in, loop, number)
            _thread.start_new_thread(self._suspend_anyway, (number,))
            return
        self._suspend_in(None, number)

    def _suspend_in(self, loop: asyncio.AbstractEventLoop | None, number: int) -> None:
        """Stop the robots, those of *loop* by their sessions, then suspend or end the program."""
        is_late = not self._is_suspending or threading.current_thread() is not threading.main_thread()
        if loop is not None and is_late:
            return
        self._is_suspending = False
        stop_at_once(inside=loop)
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)  # a program that is suspended stays in here until it gets SIGCONT
        signal.signal(number, self._suspend)

    def _suspend_anyway(self, number: int) -> None:
        """Suspend a program whose event loop is too busy to do it."""
        time.sleep(SUSPENSION_TIME)
        if self._is_suspending:
            interrupt_main_thread(number)

    def close_all(self) -> None:
        """Stop every robot that is still open when the interpreter ends."""
        for each in tuple(self._loops.values()):
            if each.at_exit is not None:
                with contextlib.suppress(Exception):
                    each.at_exit()
        stop_at_once()  # the event loops of those that are left have ended


class LoopSignals:
    """What signals do to one event loop."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.loop = loop
        # the thread that waits for the loop: for its end, or for a call in it. None if no thread does.
        self.waiter: threading.Thread | None = threading.current_thread()
        # ends what it waits for; it then raises the error itself. None if the loop is the program's own: then the tasks
        # that opened its robots are cancelled, and asyncio.run sees to Ctrl-C.
        self.cancel: Callable[[], object] | None = None
        self.came: int | None = None  # the signal that ends it
        self.at_exit: Callable[[], object] | None = None  # called when the interpreter ends, if set
        self._users: list[asyncio.Task[Any] | None] = []
        self._since = -math.inf
        self._is_noticed = True

    def enter(self, task: asyncio.Task[Any] | None = None) -> None:
        """Handle signals for one more user of the loop, such as a robot that *task* opens."""
        self._users.append(task)
        SIGNALS.install()

    def leave(self, task: asyncio.Task[Any] | None = None) -> None:
        """Handle signals for one user fewer."""
        self._users.remove(task)
        if not self._users:
            SIGNALS.forget(self.loop)

    def wait_by(self, cancel: Callable[[], object]) -> None:
        """Let signals call *cancel* in the loop. One that came before there was something to cancel does so now."""
        self.cancel = cancel
        if self.came is not None:
            self.loop.call_soon_threadsafe(cancel)  # after the first step: a task that never ran stops no robot

    def take(self) -> int:
        """Return the signal that came, for the one who waited and raises its error; the next signal is a new one."""
        assert self.came is not None
        came, self.came, self._since, self._is_noticed = self.came, None, -math.inf, True
        return came

    @property
    def is_awaited(self) -> bool:
        """Whether the main thread waits for the loop."""
        is_at_it = self.cancel is not None or self.loop.is_running()
        return is_at_it and self.waiter is threading.main_thread()

    @property
    def is_shutting_down(self) -> bool:
        """Whether a signal came a moment ago, so that robots are being stopped now."""
        return time.monotonic() - self._since < SHUTDOWN_TIME

    @property
    def is_stuck(self) -> bool:
        """Whether something blocks the loop, which has not noticed a signal."""
        return not self._is_noticed and time.monotonic() - self._since >= NOTICE_TIME

    def end(self, number: int) -> None:
        """End what is waited for because of signal *number*, even if something blocks the loop."""
        if self.waiter is None:
            return
        self.came, self._since, self._is_noticed = number, time.monotonic(), False
        with contextlib.suppress(RuntimeError):  # it is closed
            self.loop.call_soon_threadsafe(self._notice, self.cancel or self._cancel_openers)
        # Not a threading.Timer: the code that the signal interrupted may hold its locks.
        if host() is None:
            _thread.start_new_thread(self._insist, (number,))

    def break_out(self, number: int) -> None:
        """Raise the error of signal *number* in the middle of the code that blocks the loop, if there is any."""
        if self.is_stuck:
            self._is_noticed = True
            raise error_of(number)

    def _notice(self, cancel: Callable[[], object]) -> None:
        if not self._is_noticed:
            self._is_noticed = True
            cancel()

    def _cancel_openers(self) -> None:
        if self.came != signal.SIGINT:  # then asyncio itself cancels its main task
            openers = [task for task in self._users if task is not None and not task.done()]
            for task in openers or asyncio.all_tasks(self.loop):
                task.cancel()

    def _insist(self, number: int) -> None:
        """Stop the robots of a loop that does not notice the signal, and raise the error in what blocks it."""
        time.sleep(NOTICE_TIME)
        if self.is_stuck:
            stop_at_once(self.loop)
            if self.is_awaited:
                interrupt_main_thread(number)


class TerminationHandler:
    """SIGTERM and SIGHUP while a robot is open: the task that opened it is cancelled, so its block ends and it stops.

    If all such tasks have ended, because they only opened robots for others, every task of the loop is cancelled. A
    loop that is ended as a whole, as by :func:`elib.run`, does not need this.
    """

    def __init__(self) -> None:
        self._task = asyncio.current_task()
        self._signals = SIGNALS.signals_of(asyncio.get_running_loop())
        self._signals.enter(self._task)
        self._is_over = False
        self._stop: EmergencyStop | None = None
        self._end_of_loop: AsyncGenerator[None, None] | None = None

    @property
    def came(self) -> int | None:
        """The signal whose error the block of the robot raises at its end, or None."""
        is_ours = self._signals.cancel is None and self._signals.came in TERMINATIONS
        return self._signals.came if is_ours else None

    def guard(self, channel: Channel, stop: Callable[[], bytes], *, is_watched: bool) -> None:
        """Let the robot be stopped without its event loop, too; see :class:`EmergencyStop`."""
        self._stop = EmergencyStop(channel, stop, is_watched=is_watched)

    async def close_with_loop(self, close: Callable[[], Awaitable[None]]) -> None:
        """Close the robot by *close* when :func:`asyncio.run` ends and the program has not closed it."""

        async def close_when_loop_ends() -> AsyncGenerator[None, None]:
            try:
                yield
            finally:
                self._end_of_loop = None
                if not self._is_over:
                    await close()

        # asyncio finishes generators that are left over, before it closes its loop.
        self._end_of_loop = close_when_loop_ends()
        await anext(self._end_of_loop)

    async def leave(self) -> None:
        """Put the signal handlers back, unless another robot of the loop needs them. Safe to repeat."""
        if not self._is_over:
            self._is_over = True
            self._signals.leave(self._task)
            if self._stop is not None:
                self._stop.leave()
        if self._end_of_loop is not None:
            await self._end_of_loop.aclose()


def _is_free(number: int) -> bool:
    """Whether the program leaves signal *number* to Python, or to asyncio."""
    handler = signal.getsignal(number)
    if number == signal.SIGINT:
        return handler is signal.default_int_handler or _task_of_runner(handler) is not None
    return handler is signal.SIG_DFL


def _task_of_runner(handler: Any) -> asyncio.Task[Any] | None:
    """Return the main task of :func:`asyncio.run` if *handler* is its own: it cancels that once and then raises."""
    is_its_own = isinstance(handler, functools.partial) and isinstance(
        getattr(handler.func, "__self__", None), asyncio.Runner
    )
    return handler.keywords.get("main_task") if is_its_own else None


SIGNALS = Signals()
atexit.register(SIGNALS.close_all)
