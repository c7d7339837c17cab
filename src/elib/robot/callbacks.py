"""The threads that run callbacks, where they may block or raise without harm to the event loop."""

from __future__ import annotations

import asyncio
import logging
import queue
import threading
from collections import deque
from collections.abc import Callable

CALLBACK_THREADS = 16
"""Callbacks that may run, or block, at the same time; more of them wait."""

log = logging.getLogger("elib")


def reported(function: Callable[[], None], name: str) -> None:
    """Run a callback; what it raises is logged, and SystemExit too: it would end only a thread."""
    try:
        function()
    except BaseException:
        log.exception("%s raised; the link goes on", name)


class CallbackPool:
    """A few daemon threads for callbacks, so that one that never returns cannot keep the interpreter alive."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[tuple[Callable[[], None], str] | None] = queue.SimpleQueue()
        self._threads: list[threading.Thread] = []
        self._lock = threading.Lock()
        self._busy = 0
        """Callbacks queued or running."""
        self._is_closed = False

    def put(self, function: Callable[[], None], name: str) -> None:
        """Queue one callback."""
        with self._lock:
            if self._is_closed:  # of a call that ended before
                threading.Thread(target=reported, args=(function, name), name="elib callback", daemon=True).start()
                return
            self._busy += 1
            self._queue.put((function, name))
            if len(self._threads) < min(self._busy, CALLBACK_THREADS):
                name = f"elib callback {len(self._threads) + 1}"
                self._threads.append(threading.Thread(target=self._work, name=name, daemon=True))
                self._threads[-1].start()

    def _work(self) -> None:
        while (item := self._queue.get()) is not None:
            function, name = item
            reported(function, name)
            del item, function  # the program may have dropped the objects that they refer to
            with self._lock:
                self._busy -= 1

    def close(self) -> None:
        """End each thread after the callback that it runs."""
        with self._lock:
            self._is_closed = True
            for _ in self._threads:
                self._queue.put(None)


class CallbackQueue(CallbackPool):
    """The same where there is one thread: a callback stops *loop*, and what runs the loop runs the callback then."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self._loop = loop
        self._due: deque[tuple[Callable[[], None], str]] = deque()

    def put(self, function: Callable[[], None], name: str) -> None:
        """Queue one callback."""
        if self._is_closed:
            reported(function, name)
            return
        self._due.append((function, name))
        self._loop.call_soon(self._loop.stop)

    def run(self) -> None:
        """Run all that are due."""
        while self._due:
            reported(*self._due.popleft())
