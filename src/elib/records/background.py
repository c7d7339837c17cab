"""A thread that writes batches of items, so that a slow disk or pipe never delays a robot."""

from __future__ import annotations

import atexit
import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

Item = TypeVar("Item")

GATHERED = 0.5
"""s of real time for which items are gathered before they are delivered: they are in the file within a second."""
CLOSING_TIME = 2.0
"""s of real time for which closing waits until the last items are delivered."""
YIELD = 20e-6
"""s of real time for which the thread lets other threads run. Python itself switches threads every 5 ms; a robot's
answer would wait that long while a batch is delivered."""
YIELDED = 0.1
"""s of real time that all pauses of a batch may take together. If the other threads compute all the time, each pause
takes 5 ms."""

log = logging.getLogger("elib")


class Background(Generic[Item]):
    """A thread that delivers the items it is given, in batches, until it is ended. Any thread may use it.

    Args:
        name: Name of what is written, for messages.
        deliver: Called in the thread with a batch and with the number of items that were dropped since the last batch.
        finish: Called in the thread at the end, also after an error.
        most: Number of items that may wait; more are dropped and counted.
        many: Number of items that are delivered at once, without gathering more.
        gathered: s of real time for which items are gathered.

    Attributes:
        name: The name of what is written.
        error: The first error, or None; nothing is delivered after it.
    """

    def __init__(
        self,
        name: str,
        deliver: Callable[[list[Item], int], None],
        finish: Callable[[], None],
        *,
        most: int,
        many: int,
        gathered: float = GATHERED,
    ) -> None:
        self.name = name
        self.error: BaseException | None = None
        self._deliver, self._finish = deliver, finish
        self._most, self._many, self._gathered = most, many, gathered
        self._items: deque[Item] = deque()
        self._dropped = 0
        self._takes = True
        self._is_asleep = self._is_urgent = self._must_end = False
        self._change = threading.Condition()
        self._never = threading.Lock()
        self._never.acquire()
        self._yielded = self._since = 0.0
        self._thread = threading.Thread(target=self._work, name=f"elib writes {name}", daemon=True)
        self._thread.start()
        atexit.register(self.end)

    @property
    def is_closed(self) -> bool:
        """Whether :meth:`end` was called."""
        return self._must_end

    def put(self, item: Item) -> None:
        """Deliver *item* soon. This method never waits."""
        items = self._items
        count = len(items)
        if not self._takes:
            return
        if count >= self._most:
            with self._change:
                self._dropped += 1
            return
        items.append(item)  # atomic in Python: only waking the thread needs the lock
        if self._is_asleep or count == self._many:
            with self._change:
                self._is_urgent |= count == self._many
                self._change.notify_all()

    def hurry(self) -> None:
        """Deliver the waiting items now; do not wait until that is done."""
        with self._change:
            self._is_urgent = True
            self._change.notify_all()

    def yield_gil(self) -> None:
        """Let other threads run for a moment, unless many items wait or the thread must end.

        The function that delivers calls this between items.
        """
        if self._yielded > 0 and not self._must_end and len(self._items) < self._many:
            began = time.perf_counter()
            self._never.acquire(timeout=YIELD)
            self._yielded -= time.perf_counter() - began

    def end(self, timeout: float = CLOSING_TIME) -> bool:
        """Deliver the items that are left, then finish. It is safe to call this again.

        Args:
            timeout: How long to wait for that, s of real time.

        Returns:
            Whether everything was delivered in that time.
        """
        self._takes = False
        with self._change:
            self._must_end = True
            self._change.notify_all()
        atexit.unregister(self.end)
        self._thread.join(timeout)
        return not self._thread.is_alive()

    # -- the thread --

    def _work(self) -> None:
        try:
            while (batch := self._gather()) is not None:
                self._deliver(*batch)
        except Exception as error:
            self._fail(error)
        try:
            self._finish()
        except Exception as error:
            self._fail(error)

    def _fail(self, error: Exception) -> None:
        with self._change:
            self._takes = False
            is_first, self.error = self.error is None, self.error or error
            self._items.clear()
        if is_first:
            log.error("%s could not be written: %s", self.name, error)

    def _gather(self) -> tuple[list[Item], int] | None:
        """Wait for items and return them, with the number of dropped ones; None when there will be no more."""
        items = self._items
        with self._change:
            # This must be set before the items are looked at: a thread that adds one later sees it and wakes us.
            self._is_asleep = True
            since = self._since if items else math.nan
            self._change.wait_for(lambda: items or self._must_end)
            self._is_asleep = False
            # Items that came while the last batch was delivered have waited for that long already.
            waited = 0.0 if math.isnan(since) else time.perf_counter() - since
            self._change.wait_for(lambda: self._is_urgent or self._must_end, max(0.0, self._gathered - waited))
            if not items:
                return None
            dropped, self._dropped = self._dropped, 0
            self._is_urgent = False
        self._yielded = YIELDED
        self._since = time.perf_counter()
        return [items.popleft() for _ in range(len(items))], dropped
