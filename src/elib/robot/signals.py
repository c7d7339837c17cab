r"""Ctrl-C and the other signals that end or suspend a program: whatever they do to it, the robot stops.

While a robot is open, or an event loop of ours runs, signals come here, unless the program handles them itself. A
blocking program gets an exception in its main thread, an async one the cancellation of its task, a server its event.
Ctrl-Z and Ctrl-\ leave the program no time: the robot is told to stop past all that waits.
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
import weakref
from collections.abc import AsyncGenerator, Awaitable, Callable, Iterator
from types import FrameType
from typing import TYPE_CHECKING, Any

from elib.errors import Unsupported
from elib.robot.watchdog import BEAT_EVERY, WATCHDOG, is_supported
from elib.robot.watchdog_process import say
from elib.session import Channel, Ending, SessionOpened, TraceEvent
from elib.timebase import running_loop

if TYPE_CHECKING:
    from elib.robot.portal import Portal

EXIT_STOP_TIME = 5.0
"""s that stopping a robot may take at the interpreter's end."""
PARTING_TIME = 2.0
"""s after a signal in which others change nothing: robots are being stopped, and no impatience may cut that short."""
SUSPENSION_TIME = 0.1
"""s after which a program is suspended, also where its event loop does not come to it."""
NOTICE_TIME = 0.5
"""s in which an event loop takes note of a signal, unless something blocks it."""
SUSPENSION, QUIT = getattr(signal, "SIGTSTP", None), getattr(signal, "SIGQUIT", None)
"""Ctrl-Z and Ctrl-Backslash."""
TERMINATIONS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that end a program without asking it: somebody ends it, or closes its terminal."""


def error_of(number: int) -> BaseException:
    """Return what ends a program because of signal *number*."""
    return KeyboardInterrupt() if number == signal.SIGINT else SystemExit(128 + number)


@contextlib.contextmanager
def ending(stop: asyncio.Event) -> Iterator[None]:
    """Let signals set *stop* while the block lasts: they are the usual end of a server, not a failure.

    Args:
        stop: Set by Ctrl-C, SIGTERM or SIGHUP, in the running event loop.
    """
    watch = SIGNALS.signals_of(asyncio.get_running_loop())
    before, watch.end = watch.end, stop.set
    watch.enter()
    try:
        yield
    finally:
        watch.end = before
        watch.leave()


class Signals:
    """The signals of this process, and all that wants to hear of them."""

    def __init__(self) -> None:
        self._portals: weakref.WeakSet[Portal] = weakref.WeakSet()
        self._loops: dict[asyncio.AbstractEventLoop, LoopSignals] = {}
        self._lines: set[Line] = set()
        self._is_suspending = False
        self._before: dict[int, Any] = {}

    # -- who hears --

    def watch(self, portal: Portal) -> None:
        """Let signals end the blocking program that uses *portal*."""
        self._portals.add(portal)
        self.install()

    def forget(self, portal: Portal) -> None:
        """Give the signals back when the last portal and the last loop are gone."""
        self._portals.discard(portal)
        self.give_back()

    def signals_of(self, loop: asyncio.AbstractEventLoop) -> LoopSignals:
        """Return what signals do to *loop*."""
        watch = self._loops.get(loop)
        if watch is None:
            watch = self._loops[loop] = LoopSignals(loop)
        return watch

    def forget_loop(self, watch: LoopSignals) -> None:
        """Give the signals back when the last portal and the last loop are gone."""
        self._loops.pop(watch.loop, None)
        self.give_back()

    def add_line(self, line: Line) -> None:
        """Take note of an open robot."""
        self._lines.add(line)

    def forget_line(self, line: Line) -> None:
        """Take note that a robot is stopped."""
        self._lines.discard(line)

    def stop_at_once(self, loop: asyncio.AbstractEventLoop | None = None) -> None:
        """Tell the robots of *loop*, or all, to stop, past all that waits and without their event loops."""
        for line in tuple(self._lines):
            if loop is None or line.loop is loop:
                line.stop()

    # -- the handlers --

    def install(self) -> None:
        """Handle signals from now on, each unless the program does so itself. Only the main thread can."""
        if threading.current_thread() is not threading.main_thread():
            return
        handlers = dict.fromkeys((signal.SIGINT, *TERMINATIONS), self._handle)
        handlers |= {SUSPENSION: self._suspend, QUIT: self._quit}
        for number, handler in handlers.items():
            if number is not None and number not in self._before and _is_free(number):
                self._before[number] = signal.signal(number, handler)

    def give_back(self) -> None:
        """Put back what was before, when nobody is left who wants to hear."""
        if self._portals or self._loops or threading.current_thread() is not threading.main_thread():
            return
        for number, handler in self._before.items():
            if signal.getsignal(number) in (self._handle, self._suspend, self._quit):
                signal.signal(number, signal.default_int_handler if _is_over(handler) else handler)
        self._before.clear()

    def _handle(self, number: int, frame: FrameType | None) -> None:
        error = error_of(number)
        portals = tuple(self._portals)
        is_noted = [portal.interrupt(error) for portal in portals]
        own = {portal.loop for portal in portals}
        watches = [watch for watch in tuple(self._loops.values()) if watch.loop not in own]
        here = [watch for watch in watches if watch.holds_main_thread]
        for watch in here:
            watch.break_out(error)
        if number == signal.SIGINT:
            watches = here  # who else is there hears of it by the program, which gets the KeyboardInterrupt
        if here and all(watch.is_parting for watch in here):
            return
        for watch in watches:
            watch.tell(number)
        if any(watch.end is not None for watch in here):
            return
        before = self._before.get(number, signal.SIG_DFL)
        if here and callable(before) and _is_a_runners(before):
            before(number, frame)
        elif (number == signal.SIGINT and here) or (not here and not any(is_noted)):
            raise error

    def _suspend(self, number: int, frame: FrameType | None) -> None:
        loop = running_loop()
        if not self._is_suspending and any(line.loop is loop for line in self._lines) and loop is not None:
            # Not in the middle of a call: what it sends behind the stop would take the stop's answer for its own.
            self._is_suspending = True
            loop.call_soon_threadsafe(self._suspend_in, loop, number)
            _thread.start_new_thread(self._suspend_anyway, (number,))
            return
        self.stop_at_once()
        self._stand_still(number)

    def _suspend_in(self, loop: asyncio.AbstractEventLoop, number: int) -> None:
        if self._is_suspending and threading.current_thread() is threading.main_thread():
            for line in tuple(self._lines):
                line.stop_in_turn() if line.loop is loop else line.stop()
            self._stand_still(number)

    def _suspend_anyway(self, number: int) -> None:
        """Suspend a program whose event loop does not come to it."""
        time.sleep(SUSPENSION_TIME)
        if self._is_suspending:
            signal.pthread_kill(threading.main_thread().ident or 0, number)

    def _stand_still(self, number: int) -> None:
        self._is_suspending = False
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)  # the program stands still in here, until somebody lets it go on
        signal.signal(number, self._suspend)

    def _quit(self, number: int, frame: FrameType | None) -> None:
        self.stop_at_once()
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)

    def close_all(self) -> None:
        """At the interpreter's end: let every robot that is still open stop."""
        for portal in tuple(self._portals):
            portal.program_ends = True
            with contextlib.suppress(Exception):
                portal.leave(EXIT_STOP_TIME)
        self.stop_at_once()  # what is left has no event loop any more


SIGNALS = Signals()
atexit.register(SIGNALS.close_all)


class LoopSignals:
    """What signals do to one event loop.

    Attributes:
        loop: The loop.
        waiter: The thread that waits for the loop's end: the one that runs it, unless :func:`run_coroutine` says so.
        end: Ends what the loop is there for; None where that is known only to those who opened robots.
        came: The signal that ended it.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.loop = loop
        self.waiter = threading.current_thread()
        self.end: Callable[[], object] | None = None
        self.came: int | None = None
        self._holders = 0
        self._open: list[TerminationHandler] = []
        self._told = -PARTING_TIME
        self._is_noted = True
        self._is_stuck = False

    @property
    def holds_main_thread(self) -> bool:
        """Whether the loop runs, and the main thread waits for its end."""
        return self.waiter is threading.main_thread() and self.loop.is_running()

    @property
    def is_parting(self) -> bool:
        """Whether a signal came a moment ago, so that robots are being stopped now."""
        return time.monotonic() - self._told < PARTING_TIME

    def enter(self) -> None:
        """Take note that one more wants to hear."""
        self._holders += 1
        SIGNALS.install()

    def leave(self) -> None:
        """Take note that one less wants to hear."""
        self._holders -= 1
        if not self._holders:
            SIGNALS.forget_loop(self)

    def add(self, termination: TerminationHandler) -> None:
        """Tell *termination* too."""
        self._open.append(termination)
        self.enter()

    def discard(self, termination: TerminationHandler) -> None:
        """Tell *termination* no longer."""
        if termination in self._open:
            self._open.remove(termination)
            self.leave()

    def tell(self, number: int) -> None:
        """Let the loop end because of signal *number*, also where something blocks it. Any thread may."""
        self.came = number
        self._told = time.monotonic()
        self._is_noted = False
        with contextlib.suppress(RuntimeError):  # it is closed
            self.loop.call_soon_threadsafe(self._take_note)
        # Not a threading.Timer: what the signal interrupted may hold its locks.
        _thread.start_new_thread(self._look_after, ())

    def break_out(self, error: BaseException) -> None:
        """Raise *error* in the middle of what blocks the loop, if something does."""
        if self._is_stuck:
            self._is_stuck = False
            self._is_noted = True
            raise error

    def _take_note(self) -> None:
        if self._is_noted:
            return
        self._is_noted = True
        if self.end is not None:
            self.end()
        elif self.came != signal.SIGINT:  # asyncio itself cancels its main task then
            for termination in tuple(self._open):
                termination.tell()

    def _look_after(self) -> None:
        time.sleep(NOTICE_TIME)
        if self._is_noted or self.came is None:
            return
        SIGNALS.stop_at_once(self.loop)
        if not self.holds_main_thread:
            return
        self._is_stuck = True
        if hasattr(signal, "pthread_kill"):
            signal.pthread_kill(threading.main_thread().ident or 0, self.came)


class Line:
    """One open robot, as those see it who must stop it without its event loop. Made in that loop.

    Args:
        channel: Its session, or what makes sessions for it.
        stop: Returns what stops it now.
        is_watched: The watchdog stops it too when this program freezes.
    """

    def __init__(self, channel: Channel, stop: Callable[[], bytes], *, is_watched: bool) -> None:
        self.loop = asyncio.get_running_loop()
        self._channel = channel
        self._stop = stop
        self._beats = is_watched
        self._key: int | None = None
        self._timer: asyncio.TimerHandle | None = None
        if is_watched:
            self._guard()
            channel.hooks.append(self._follow)
        elif is_supported() and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
            # Nobody takes SIGTERM, as when another thread than the main one opened the robot: the program just dies.
            with contextlib.suppress(Unsupported):  # nobody asked for it
                self._guard()
            channel.hooks.append(self._follow)
        SIGNALS.add_line(self)

    def stop(self) -> None:
        """Tell the robot to stop. Any thread may, and a signal's handler."""
        number = self._number
        if number is not None:
            say(number, self._words())

    def stop_in_turn(self) -> None:
        """Tell the robot to stop past all that waits, in its event loop: no call takes the answer for its own."""
        self._channel.send_unqueued(self._stop())

    def leave(self) -> None:
        """Take note that the robot was stopped, or is lost. Safe to repeat."""
        SIGNALS.forget_line(self)
        self._release()

    def _words(self) -> bytes:
        """Return what stops it behind whatever it has half received."""
        return self._channel.profile.line_end + self._stop()

    @property
    def _number(self) -> int | None:
        fileno = getattr(self._channel.transport, "fileno", None)
        return None if fileno is None else fileno()

    def _follow(self, time: float, event: TraceEvent) -> None:
        """Let go of a line before it is closed, and take hold of the next."""
        if isinstance(event, Ending):
            self._release()
        elif isinstance(event, SessionOpened):
            self._release()
            self._guard()

    def _guard(self) -> None:
        number = self._number
        if number is not None:
            self._key = WATCHDOG.guard(number, self._words(), beats=self._beats)
            if self._beats:
                self._beat()

    def _beat(self) -> None:
        if self._key is not None:
            WATCHDOG.beat(self._key)
            self._timer = self.loop.call_later(BEAT_EVERY, self._beat)

    def _release(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        if self._key is not None:
            WATCHDOG.release(self._key)
            self._key = None


class TerminationHandler:
    """SIGTERM and SIGHUP while a robot is open: the task that opened it is cancelled, so its block ends and it stops.

    Where that task has ended, since others opened the robot for it, every task of the loop is cancelled. A loop that
    is ended as a whole, as by :func:`elib.run`, needs none of this.
    """

    def __init__(self) -> None:
        self.came: int | None = None
        self._task = asyncio.current_task()
        self._loop = asyncio.get_running_loop()
        self._watch = SIGNALS.signals_of(self._loop)
        self._watch.add(self)
        self._line: Line | None = None
        self._end_of_loop: AsyncGenerator[None, None] | None = None

    def guard(self, channel: Channel, stop: Callable[[], bytes], *, is_watched: bool) -> None:
        """Let the robot be stopped too where its event loop cannot do it; see :class:`Line`."""
        self._line = Line(channel, stop, is_watched=is_watched)

    async def close_with_loop(self, close: Callable[[], Awaitable[None]]) -> None:
        """Close the robot by *close* when :func:`asyncio.run` ends and nobody has closed it."""

        async def wait() -> AsyncGenerator[None, None]:
            try:
                yield
            finally:
                self._end_of_loop = None
                if self._line is not None:
                    await close()

        # asyncio finishes generators that are left over, before it closes its loop.
        self._end_of_loop = wait()
        await anext(self._end_of_loop)

    def tell(self) -> None:
        """Let the robot's program end."""
        self.came = self._watch.came
        if self._task is not None and not self._task.done():
            self._task.cancel()
        else:
            for task in asyncio.all_tasks(self._loop):
                task.cancel()

    async def leave(self) -> None:
        """Give the signals back, if no other robot of the loop needs them."""
        self._watch.discard(self)
        if self._line is not None:
            self._line.leave()
            self._line = None
        if self._end_of_loop is not None:
            await self._end_of_loop.aclose()


def _is_free(number: int) -> bool:
    """Whether the program leaves what signal *number* does to Python, or to asyncio."""
    handler = signal.getsignal(number)
    if number == signal.SIGINT:
        return handler is signal.default_int_handler or _is_a_runners(handler)
    return handler is signal.SIG_DFL


def _is_a_runners(handler: object) -> bool:
    """Whether *handler* is that of :func:`asyncio.run`, which cancels the main task once and then raises."""
    return isinstance(handler, functools.partial) and isinstance(
        getattr(handler.func, "__self__", None), asyncio.Runner
    )


def _is_over(handler: Any) -> bool:
    """Whether *handler* belongs to an :func:`asyncio.run` that has ended meanwhile."""
    return _is_a_runners(handler) and all(
        task.done() for task in handler.keywords.values() if isinstance(task, asyncio.Task)
    )
