"""Work that is handed to a thread of its own in batches, so that no disk or pipe ever holds a robot up."""

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
"""s of real time for which items are gathered before they are delivered: they stand in the file within a second."""
CLOSING_TIME = 2.0
"""s of real time that closing waits for the last items to be delivered."""
BREATH = 20e-6
"""s of real time for which the thread lets the others run. Python's own hand-over takes 5 ms: as long as that a robot's
answer would lie unread while a batch is delivered."""
BREATHING_TIME = 0.1
"""s of real time that all breaths of a batch take at most: where the others compute without a pause each takes 5 ms."""

log = logging.getLogger("elib")


class Background(Generic[Item]):
    """A thread that delivers what is put, a batch at a time, until it is ended. Any thread may use it.

    Args:
        name: Of what is written, for messages.
        deliver: Called in the thread with a batch, and with how many items were dropped since the last one.
        finish: Called in the thread at the end, whatever happened.
        most: Items that wait at most; more are dropped and counted.
        many: Items that are delivered without gathering more.
        gathered: s of real time for which items are gathered.

    Attributes:
        name: As given.
        error: What went wrong, or None; nothing is delivered after it.
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
        self._breath = self._since = 0.0
        self._thread = threading.Thread(target=self._work, name=f"elib writes {name}", daemon=True)
        self._thread.start()
        atexit.register(self.end)

    @property
    def is_closed(self) -> bool:
        """Whether :meth:`end` was called."""
        return self._must_end

    def put(self, item: Item) -> None:
        """Let *item* be delivered soon. Never waits."""
        items = self._items
        count = len(items)
        if not self._takes:
            return
        if count >= self._most:
            with self._change:
                self._dropped += 1
            return
        items.append(item)  # one step for all threads: the lock is needed to wake the thread only
        if self._is_asleep or count == self._many:
            with self._change:
                self._is_urgent |= count == self._many
                self._change.notify_all()

    def hurry(self) -> None:
        """Let what is there be delivered now, without waiting for it."""
        with self._change:
            self._is_urgent = True
            self._change.notify_all()

    def breathe(self) -> None:
        """Let other threads run for a moment, unless there is much to do or somebody waits for the end.

        For whoever delivers, between items.
        """
        if self._breath > 0 and not self._must_end and len(self._items) < self._many:
            began = time.perf_counter()
            self._never.acquire(timeout=BREATH)
            self._breath -= time.perf_counter() - began

    def end(self, patience: float = CLOSING_TIME) -> bool:
        """Deliver what is left and finish. Safe to repeat.

        Args:
            patience: s of real time to wait for it.

        Returns:
            Whether it is done.
        """
        self._takes = False
        with self._change:
            self._must_end = True
            self._change.notify_all()
        atexit.unregister(self.end)
        self._thread.join(patience)
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
        """Wait for items and return them; None when there will be no more."""
        items = self._items
        with self._change:
            self._is_asleep = True  # before the look at the items: who puts one behind it sees that we sleep
            since = self._since if items else math.nan
            self._change.wait_for(lambda: items or self._must_end)
            self._is_asleep = False
            # What came while the last batch was delivered has waited for that long already.
            waited = 0.0 if math.isnan(since) else time.perf_counter() - since
            self._change.wait_for(lambda: self._is_urgent or self._must_end, max(0.0, self._gathered - waited))
            if not items:
                return None
            dropped, self._dropped = self._dropped, 0
            self._is_urgent = False
        self._breath = BREATHING_TIME
        self._since = time.perf_counter()
        return [items.popleft() for _ in range(len(items))], dropped


__all__ = ["CLOSING_TIME", "GATHERED", "Background"]
