"""A thread that writes batches of items, so that a slow disk or pipe never delays a robot.

It is a plain thread: while it writes a batch, an answer may wait for 5 ms, after which Python switches threads. Pauses
between items, so that answers wait less, gained nothing: proximity() on a pty at 115,200 baud kept 0.98 of its rate
while recorded without them and 0.92 with them, unpaced 0.56 and 0.44; the slowest hundredth waited 9.5 and 8.4 ms.
"""

from __future__ import annotations

import atexit
import logging
import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from elib.base.timebase import host

Item = TypeVar("Item")

GATHERED = 0.5
"""s of real time for which items are gathered before they are delivered: they are in the file within a second."""
CLOSING_TIME = 2.0
"""s of real time for which closing waits until the last items are delivered."""

log = logging.getLogger("elib")


class Background(Generic[Item]):
    """A thread that delivers the items it is given, in batches, until it is ended. Any thread may use it.

    Where Python has one thread, who puts an item delivers the batch that is full.

    Args:
        name: Name of what is written, for messages.
        deliver: Called in the thread with a batch and with the number of items that were dropped since the last batch.
        finish: Called in the thread at the end, also after an error.
        most: Number of items that may wait; more are dropped and counted.
        many: Number of items that are delivered at once, without gathering more.
        gathered: s of real time for which items are gathered.
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
        self.name = name  # the name of what is written
        self.error: BaseException | None = None  # the first error, or None; nothing is delivered after it
        self._deliver, self._finish = deliver, finish
        self._most, self._many, self._gathered = most, many, gathered
        self._items: deque[Item] = deque()
        self._dropped = 0
        self._takes = True
        self._must_end = False
        self._lock = threading.Lock()
        self._hurry = threading.Event()
        self._thread: threading.Thread | None = None
        if host() is None:
            self._thread = threading.Thread(target=self._work, name=f"elib writes {name}", daemon=True)
            self._thread.start()
        atexit.register(self.end)

    @property
    def is_closed(self) -> bool:
        """Whether :meth:`end` was called."""
        return self._must_end

    def put(self, item: Item) -> None:
        """Deliver *item* soon. This method never waits."""
        count = len(self._items)
        if not self._takes:
            return
        if count >= self._most:
            with self._lock:
                self._dropped += 1
            return
        self._items.append(item)  # atomic in Python, so it needs no lock
        if count == self._many:
            self.hurry()

    def hurry(self) -> None:
        """Deliver the waiting items now; do not wait until that is done, if there is a thread to do it."""
        self._hurry.set()
        if self._thread is None:
            self._try(self._deliver_all)

    def end(self, timeout: float = CLOSING_TIME) -> bool:
        """Deliver the items that are left, then finish. It is safe to call this again.

        Args:
            timeout: How long to wait for that, s of real time.

        Returns:
            Whether everything was delivered in that time.
        """
        self._takes = False
        self._must_end = True
        self._hurry.set()
        atexit.unregister(self.end)
        if self._thread is None:
            self._work()
            return True
        self._thread.join(timeout)
        return not self._thread.is_alive()

    # -- the thread --

    def _work(self) -> None:
        self._try(self._deliver_until_the_end)
        self._try(self._finish)

    def _deliver_until_the_end(self) -> None:
        while not self._must_end:
            self._hurry.wait(self._gathered)
            self._hurry.clear()
            self._deliver_all()
        self._deliver_all()  # what came while the last batch was delivered

    def _try(self, work: Callable[[], None]) -> None:
        try:
            work()
        except Exception as error:
            self._fail(error)

    def _deliver_all(self) -> None:
        batch = [self._items.popleft() for _ in range(len(self._items))]
        if batch:
            with self._lock:
                dropped, self._dropped = self._dropped, 0
            self._deliver(batch, dropped)

    def _fail(self, error: Exception) -> None:
        self._takes = False
        self._items.clear()
        if self.error is None:
            self.error = error
            log.error("%s could not be written: %s", self.name, error)
