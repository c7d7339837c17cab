r"""Ctrl-C and the other signals that end or suspend a program: whatever they do to it, the robot stops.

While a robot is open, or an event loop of elib runs, signals come here, unless the program handles them itself. A
blocking program gets an exception in its main thread, an async one the cancellation of its task, a server its event.
Ctrl-Z and Ctrl-\ leave the program no time: the robot is told to stop past its queue.
"""

from __future__ import annotations

import _thread
import asyncio
import atexit
import contextlib
import functools
import os
import signal
import threading
import time
from collections.abc import AsyncGenerator, Awaitable, Callable
from types import FrameType
from typing import Any

from elib.link.session import Channel
from elib.robot.emergency import EmergencyStop, stop_at_once

SHUTDOWN_TIME = 2.0
"""s after a signal in which more signals change nothing: robots are being stopped, and that must not be cut short."""
NOTICE_TIME = 0.5
"""s in which an event loop notices a signal, unless something blocks it."""
SUSPENSION, QUIT = getattr(signal, "SIGTSTP", None), getattr(signal, "SIGQUIT", None)
"""Ctrl-Z and Ctrl-Backslash."""
TERMINATIONS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that end a program: another process ends it, or its terminal is closed."""


def error_of(number: int) -> BaseException:
    """Return the exception that ends a program because of signal *number*."""
    return KeyboardInterrupt() if number == signal.SIGINT else SystemExit(128 + number)


class Signals:
    """The signal handlers of this process, and the event loops that they end."""

    def __init__(self) -> None:
        self._loops: dict[asyncio.AbstractEventLoop, LoopSignals] = {}
        self._before: dict[int, Any] = {}

    def signals_of(self, loop: asyncio.AbstractEventLoop) -> LoopSignals:
        """Return what signals do to *loop*."""
        signals = self._loops.get(loop)
        if signals is None:
            signals = self._loops[loop] = LoopSignals(loop)
        return signals

    def forget(self, signals: LoopSignals) -> None:
        """Forget a loop; after the last one, put back the handlers that were there before."""
        self._loops.pop(signals.loop, None)
        if self._loops or threading.current_thread() is not threading.main_thread():
            return
        for number, handler in self._before.items():
            if signal.getsignal(number) in (self._handle, self._suspend, self._quit):
                signal.signal(number, signal.default_int_handler if _is_over(handler) else handler)
        self._before.clear()

    def install(self) -> None:
        """Handle signals from now on, except those that the program handles itself. Only the main thread can."""
        if threading.current_thread() is not threading.main_thread():
            return
        handlers = dict.fromkeys((signal.SIGINT, *TERMINATIONS), self._handle)
        handlers |= {SUSPENSION: self._suspend, QUIT: self._quit}
        for number, handler in handlers.items():
            if number is not None and number not in self._before and _is_free(number):
                self._before[number] = signal.signal(number, handler)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        error = error_of(number)
        loops = tuple(self._loops.values())
        is_noted = [each.interrupt(error) for each in loops if each.interrupt is not None]
        ended = [each for each in loops if each.interrupt is None]
        here = [each for each in ended if each.holds_main_thread]
        for each in here:
            each.break_out(error)
        if number == signal.SIGINT:
            ended = here  # loops of other threads are ended by the program, which gets the KeyboardInterrupt
        if here and all(each.is_shutting_down for each in here):
            return
        for each in ended:
            each.on_signal(number)
        if any(each.end is not None for each in here):
            return
        before = self._before.get(number, signal.SIG_DFL)
        if here and callable(before) and _is_runner_handler(before):
            before(number, frame)
        elif (number == signal.SIGINT and here) or (not here and not any(is_noted)):
            raise error

    def _suspend(self, number: int, frame: FrameType | None) -> None:
        """Stop the robots, then suspend the program. What its link reads behind that is answered by a resync."""
        stop_at_once()
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)  # the program is suspended in here, until it gets SIGCONT
        signal.signal(number, self._suspend)

    def _quit(self, number: int, frame: FrameType | None) -> None:
        stop_at_once()
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)

    def close_all(self) -> None:
        """Stop every robot that is still open when the interpreter ends."""
        for each in tuple(self._loops.values()):
            if each.at_exit is not None:
                with contextlib.suppress(Exception):
                    each.at_exit()
        stop_at_once()  # the event loops of those that are left have ended


class LoopSignals:
    """The effect of signals on one event loop.

    Attributes:
        loop: The loop.
        waiter: The thread that waits for the loop's end: the one that runs it, unless :func:`run_coroutine` says so.
        end: Ends what the loop is there for; None if only the handlers of its robots know that.
        interrupt: Ends the blocking call in which the main thread waits for this loop, and returns whether it waits.
            Only a portal sets it, and then nothing else here is used.
        at_exit: Called when the interpreter ends, if set.
        came: The signal that ended the loop.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.loop = loop
        self.waiter = threading.current_thread()
        self.end: Callable[[], object] | None = None
        self.interrupt: Callable[[BaseException], bool] | None = None
        self.at_exit: Callable[[], object] | None = None
        self.came: int | None = None
        self._holders = 0
        self._open: list[TerminationHandler] = []
        self._signalled = -SHUTDOWN_TIME
        self._is_noted = True
        self._is_stuck = False

    @property
    def holds_main_thread(self) -> bool:
        """Whether the loop runs, and the main thread waits for its end."""
        return self.waiter is threading.main_thread() and self.loop.is_running()

    @property
    def is_shutting_down(self) -> bool:
        """Whether a signal came a moment ago, so that robots are being stopped now."""
        return time.monotonic() - self._signalled < SHUTDOWN_TIME

    def enter(self) -> None:
        """Handle signals for one more user of the loop."""
        self._holders += 1
        SIGNALS.install()

    def leave(self) -> None:
        """Handle signals for one user fewer."""
        self._holders -= 1
        if not self._holders:
            SIGNALS.forget(self)

    def add(self, handler: TerminationHandler) -> None:
        """Call *handler* too."""
        self._open.append(handler)
        self.enter()

    def discard(self, handler: TerminationHandler) -> None:
        """Call *handler* no longer."""
        if handler in self._open:
            self._open.remove(handler)
            self.leave()

    def on_signal(self, number: int) -> None:
        """End the loop because of signal *number*, even if something blocks it. Any thread may call this."""
        self.came = number
        self._signalled = time.monotonic()
        self._is_noted = False
        with contextlib.suppress(RuntimeError):  # it is closed
            self.loop.call_soon_threadsafe(self._end_loop)
        # Not a threading.Timer: the code that the signal interrupted may hold its locks.
        _thread.start_new_thread(self._check_noticed, ())

    def break_out(self, error: BaseException) -> None:
        """Raise *error* in the middle of the code that blocks the loop, if there is any."""
        if self._is_stuck:
            self._is_stuck = False
            self._is_noted = True
            raise error

    def _end_loop(self) -> None:
        if self._is_noted:
            return
        self._is_noted = True
        if self.end is not None:
            self.end()
        elif self.came != signal.SIGINT:  # then asyncio itself cancels its main task
            for handler in tuple(self._open):
                handler.on_signal()

    def _check_noticed(self) -> None:
        time.sleep(NOTICE_TIME)
        if self._is_noted or self.came is None:
            return
        stop_at_once(self.loop)
        if not self.holds_main_thread:
            return
        self._is_stuck = True
        if hasattr(signal, "pthread_kill"):
            signal.pthread_kill(threading.main_thread().ident or 0, self.came)


class TerminationHandler:
    """SIGTERM and SIGHUP while a robot is open: the task that opened it is cancelled, so its block ends and it stops.

    If that task has ended, because it only opened the robot for others, every task of the loop is cancelled. A loop
    that is ended as a whole, as by :func:`elib.run`, does not need this.
    """

    def __init__(self) -> None:
        self.came: int | None = None
        self._task = asyncio.current_task()
        self._loop = asyncio.get_running_loop()
        self._signals = SIGNALS.signals_of(self._loop)
        self._signals.add(self)
        self._stop: EmergencyStop | None = None
        self._end_of_loop: AsyncGenerator[None, None] | None = None

    def guard(self, channel: Channel, stop: Callable[[], bytes], *, is_watched: bool) -> None:
        """Let the robot be stopped without its event loop, too; see :class:`EmergencyStop`."""
        self._stop = EmergencyStop(channel, stop, is_watched=is_watched)

    async def close_with_loop(self, close: Callable[[], Awaitable[None]]) -> None:
        """Close the robot by *close* when :func:`asyncio.run` ends and the program has not closed it."""

        async def wait() -> AsyncGenerator[None, None]:
            try:
                yield
            finally:
                self._end_of_loop = None
                if self._stop is not None:
                    await close()

        # asyncio finishes generators that are left over, before it closes its loop.
        self._end_of_loop = wait()
        await anext(self._end_of_loop)

    def on_signal(self) -> None:
        """End the robot's program."""
        self.came = self._signals.came
        if self._task is not None and not self._task.done():
            self._task.cancel()
        else:
            for task in asyncio.all_tasks(self._loop):
                task.cancel()

    async def leave(self) -> None:
        """Put the signal handlers back, unless another robot of the loop needs them."""
        self._signals.discard(self)
        if self._stop is not None:
            self._stop.leave()
            self._stop = None
        if self._end_of_loop is not None:
            await self._end_of_loop.aclose()


def _is_free(number: int) -> bool:
    """Whether the program leaves signal *number* to Python, or to asyncio."""
    handler = signal.getsignal(number)
    if number == signal.SIGINT:
        return handler is signal.default_int_handler or _is_runner_handler(handler)
    return handler is signal.SIG_DFL


def _is_runner_handler(handler: object) -> bool:
    """Whether *handler* is that of :func:`asyncio.run`, which cancels the main task once and then raises."""
    return isinstance(handler, functools.partial) and isinstance(
        getattr(handler.func, "__self__", None), asyncio.Runner
    )


def _is_over(handler: Any) -> bool:
    """Whether *handler* belongs to an :func:`asyncio.run` that has ended meanwhile."""
    return _is_runner_handler(handler) and all(
        task.done() for task in handler.keywords.values() if isinstance(task, asyncio.Task)
    )


SIGNALS = Signals()
atexit.register(SIGNALS.close_all)
