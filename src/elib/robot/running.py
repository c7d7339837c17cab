"""Run a coroutine on a new event loop to its end, whatever signals come; let signals end a server."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import signal
import threading
from collections.abc import Callable, Coroutine, Iterator
from typing import Any, Generic, TypeVar

from elib.base.timebase import LoopSpeed, new_loop, running_loop
from elib.robot.signals import SHUTDOWN_TIME, SIGNALS, error_of

T = TypeVar("T")

SIGNAL_DELAY = 0.05
"""s that a signal may have to wait at most."""


def run_coroutine(main: Callable[[], Coroutine[Any, Any, T]], speed: LoopSpeed = "real") -> T:
    """Run ``async def main()`` on a new event loop and return its result; errors come as they are.

    Ctrl-C, SIGTERM and SIGHUP cancel it, so that its blocks end and its robots stop; more signals within 2 s change
    nothing. If an event loop already runs in this thread, as in a notebook, a new thread runs the new loop.

    Args:
        main: A coroutine function without parameters.
        speed: How fast the loop's time runs.

    Raises:
        ArgumentError: There is no such speed.
        KeyboardInterrupt: Ctrl-C ended it.
        SystemExit: SIGTERM or SIGHUP ended it.
    """
    run = _Run(main, new_loop(speed))
    return run.here() if running_loop() is None else run.in_a_thread()


@contextlib.contextmanager
def ending(stop: asyncio.Event) -> Iterator[None]:
    """Let signals set *stop* while the block lasts: they are the usual end of a server, not a failure.

    Args:
        stop: Set by Ctrl-C, SIGTERM or SIGHUP, in the running event loop.
    """
    signals = SIGNALS.signals_of(asyncio.get_running_loop())
    before, signals.end = signals.end, stop.set
    signals.enter()
    try:
        yield
    finally:
        signals.end = before
        signals.leave()


class _Run(Generic[T]):
    """One coroutine on one event loop; the thread that makes this object waits for its end."""

    def __init__(self, main: Callable[[], Coroutine[Any, Any, T]], loop: asyncio.AbstractEventLoop) -> None:
        self._main = main
        self._loop = loop
        self._task: asyncio.Task[T] | None = None
        self._is_ended = False
        self._signals = SIGNALS.signals_of(loop)
        self._signals.end = self._end

    def here(self) -> T:
        """Run it on this thread."""
        signals = self._signals
        signals.enter()
        try:
            with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
                result = runner.run(self._whole())
        except asyncio.CancelledError:
            if signals.came is None:
                raise
            raise error_of(signals.came) from None
        finally:
            signals.leave()
        # A signal is the usual end of a server, and a program may catch a Ctrl-C and go on.
        if self._is_ended and signals.came not in (None, signal.SIGINT):
            raise error_of(signals.came)
        return result

    def in_a_thread(self) -> T:
        """Run it on a thread of its own."""
        outcome: concurrent.futures.Future[T] = concurrent.futures.Future()

        def run() -> None:
            try:
                outcome.set_result(self.here())
            except BaseException as error:
                outcome.set_exception(error)

        self._signals.enter()  # here, because only the main thread can install signal handlers
        try:
            threading.Thread(target=run, name="elib run", daemon=True).start()
            # A signal that comes just before a wait without bound is not handled before that ends, in all of Python.
            while not outcome.done():
                concurrent.futures.wait([outcome], SIGNAL_DELAY)
            return outcome.result()
        except BaseException:
            if not outcome.done():  # a signal that the program handles itself, or one that came before the loop ran
                self._loop.call_soon_threadsafe(self._end)
                with contextlib.suppress(BaseException):
                    outcome.result(SHUTDOWN_TIME)
            raise
        finally:
            self._signals.leave()

    async def _whole(self) -> T:
        self._task = asyncio.current_task()
        if self._is_ended:
            raise asyncio.CancelledError
        return await self._main()

    def _end(self) -> None:
        self._is_ended = True
        if self._task is not None:
            self._task.cancel()
