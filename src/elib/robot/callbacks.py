"""Where callbacks run: off the event loop, where they may block or raise."""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Callable

CALLBACK_THREADS = 16
"""Callbacks that may run, or block, at once; more wait for their turn."""

log = logging.getLogger("elib")


class CallbackPool:
    """A few daemon threads for callbacks: one that never returns cannot keep the interpreter alive."""

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._queue: queue.SimpleQueue[tuple[Callable[[], None], str] | None] = queue.SimpleQueue()
        self._threads: list[threading.Thread] = []
        self._idle = 0
        self._lock = threading.Lock()
        self.busy = 0
        """Callbacks queued or running."""
        self.idents: set[int] = set()

    def put(self, function: Callable[[], None], name: str) -> None:
        """Queue one callback."""
        with self._lock:
            self.busy += 1
            self._queue.put((function, name))
            if self._idle < self._queue.qsize() and len(self._threads) < CALLBACK_THREADS:
                thread = threading.Thread(
                    target=self._work, name=f"elib callback {len(self._threads) + 1}", daemon=True
                )
                self._threads.append(thread)
                thread.start()

    def _work(self) -> None:
        me = threading.get_ident()
        self.idents.add(me)
        while True:
            self._idle += 1
            item = self._queue.get()
            self._idle -= 1
            if item is None:
                return
            function, name = item
            try:
                function()
            except Exception:
                log.exception("%s raised; the link goes on", name)
            finally:
                with self._lock:
                    self.busy -= 1
                self._wake()

    def close(self) -> None:
        """Let the threads end when they have finished what they do."""
        for _ in self._threads:
            self._queue.put(None)
