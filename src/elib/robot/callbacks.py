"""The threads that run callbacks, where they may block or raise without harm to the event loop."""

from __future__ import annotations

import logging
import math
import queue
import threading
import time
from collections.abc import Callable, Collection

CALLBACK_THREADS = 16
"""Callbacks that may run, or block, at the same time; more of them wait."""

CALLBACK_HOLDING_TIME = 5.0
"""s of real time for which simulated time stands still while a callback runs. After that it goes on: the callback waits
for something else, perhaps for the program that waits for the robot."""

log = logging.getLogger("elib")


class CallbackPool:
    """A few daemon threads for callbacks, so that one that never returns cannot keep the interpreter alive."""

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._queue: queue.SimpleQueue[tuple[Callable[[], None], str] | None] = queue.SimpleQueue()
        self._threads: list[threading.Thread] = []
        self._lock = threading.Lock()
        self._busy = 0
        """Callbacks queued or running."""
        self._running: dict[threading.Thread, tuple[str, float]] = {}
        """The callback that each thread runs, and when it began or last returned from a call of the robot."""

    def put(self, function: Callable[[], None], name: str) -> None:
        """Queue one callback."""
        with self._lock:
            self._busy += 1
            self._queue.put((function, name))
            if len(self._threads) < min(self._busy, CALLBACK_THREADS):
                thread = threading.Thread(
                    target=self._work, name=f"elib callback {len(self._threads) + 1}", daemon=True
                )
                thread.start()
                self._threads.append(thread)

    def resume(self, thread: threading.Thread) -> bool:
        """Record that the callback in *thread* goes on after a call; return False if there is none."""
        with self._lock:  # the callback may end at this moment, and must not be recorded as one that runs
            if thread not in self._running:
                return False
            self._running[thread] = (self._running[thread][0], time.monotonic())
            return True

    def is_at_work(self, waiting: Collection[threading.Thread]) -> bool:
        """Return whether simulated time must stand still, because a callback works or is about to.

        Args:
            waiting: Threads that wait for the robot. A callback in one of them does not count as working.
        """
        if not self._busy:
            return False
        running = dict(self._running)
        if len(running) < min(self._busy, CALLBACK_THREADS):
            return True
        return any(
            self._is_holding(thread, name, since) for thread, (name, since) in running.items() if thread not in waiting
        )

    def _is_holding(self, thread: threading.Thread, name: str, since: float) -> bool:
        if time.monotonic() - since < CALLBACK_HOLDING_TIME:
            return True
        with self._lock:
            is_news = since > -math.inf and thread in self._running
            if is_news:
                self._running[thread] = (name, -math.inf)
        if is_news:
            log.warning("%s has not returned for %g s; simulated time goes on without it", name, CALLBACK_HOLDING_TIME)
        return False

    def _work(self) -> None:
        me = threading.current_thread()
        while (item := self._queue.get()) is not None:
            function, name = item
            self._running[me] = (name, time.monotonic())
            try:
                function()
            except BaseException:  # SystemExit too: it would end only this thread, and with it the callbacks that wait
                log.exception("%s raised; the link goes on", name)
            finally:
                del item, function  # the program may have dropped the objects that they refer to
                with self._lock:
                    del self._running[me]
                    self._busy -= 1
                self._wake()

    def close(self) -> None:
        """End each thread after the callback that it runs."""
        for _ in self._threads:
            self._queue.put(None)
