"""Run a coroutine on a new event loop to its end, whatever signals come; let signals end a server."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import signal
from collections.abc import Callable, Coroutine, Iterator
from typing import Any, TypeVar

from elib.base.timebase import LoopSpeed, host, in_thread, new_loop, outside, running_loop
from elib.robot.signals import SHUTDOWN_TIME, SIGNALS, LoopSignals, error_of

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
    signals = SIGNALS.signals_of(new_loop(speed))
    signals.enter()  # here, because only the main thread can install signal handlers
    try:
        if running_loop() is None:
            return _run(main, signals)
        if host() is not None:
            with outside():
                return _run(main, signals)
        return _run_in_a_thread(main, signals)
    finally:
        signals.leave()


@contextlib.contextmanager
def ending(stop: asyncio.Event) -> Iterator[None]:
    """Let signals set *stop* while the block lasts: they are the usual end of a server, not a failure.

    Args:
        stop: Set by Ctrl-C, SIGTERM or SIGHUP, in the running event loop.
    """
    signals = SIGNALS.signals_of(asyncio.get_running_loop())
    before, signals.cancel = signals.cancel, stop.set
    signals.enter()
    try:
        yield
        signals.came = None
    finally:
        signals.cancel = before
        signals.leave()


def _run(main: Callable[[], Coroutine[Any, Any, T]], signals: LoopSignals) -> T:
    async def whole() -> T:
        task = asyncio.current_task()
        assert task is not None
        signals.wait_by(task.cancel)
        return await main()

    try:
        with asyncio.Runner(loop_factory=lambda: signals.loop) as runner:
            result = runner.run(whole())
    except asyncio.CancelledError:
        if signals.came is None:
            raise
        raise error_of(signals.came) from None
    if signals.came not in (None, signal.SIGINT):  # a program may catch a Ctrl-C and go on
        raise error_of(signals.came)
    return result


def _run_in_a_thread(main: Callable[[], Coroutine[Any, Any, T]], signals: LoopSignals) -> T:
    outcome = in_thread(lambda: _run(main, signals), "elib run")
    try:
        # A signal that comes just before a wait without bound is not handled before that ends, in all of Python.
        while not outcome.done():
            concurrent.futures.wait([outcome], SIGNAL_DELAY)
    except BaseException:  # a signal that the program handles itself, or one that came before the loop ran
        signals.end(signal.SIGINT)
        with contextlib.suppress(BaseException):
            outcome.result(SHUTDOWN_TIME)
        raise
    return outcome.result()
