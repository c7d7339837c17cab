"""Work that is handed to a thread of its own in batches, so that no disk or pipe ever holds a robot up."""

from __future__ import annotations

import atexit
import logging
import threading
from collections.abc import Callable
from typing import Generic, TypeVar

Item = TypeVar("Item")

GATHERED = 0.5
"""s of real time for which items are gathered before they are delivered: they stand in the file within a second."""
CLOSING_TIME = 2.0
"""s of real time that closing waits for the last items to be delivered."""

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
        self._items: list[Item] = []
        self._dropped = 0
        self._is_urgent = self._must_end = False
        self._change = threading.Condition()
        self._thread = threading.Thread(target=self._work, name=f"elib writes {name}", daemon=True)
        self._thread.start()
        atexit.register(self.end)

    @property
    def is_closed(self) -> bool:
        """Whether :meth:`end` was called."""
        return self._must_end

    def put(self, item: Item) -> None:
        """Let *item* be delivered soon. Never waits."""
        with self._change:
            if self._must_end or self.error is not None:
                return
            if len(self._items) >= self._most:
                self._dropped += 1
                return
            self._items.append(item)
            if len(self._items) in (1, self._many):
                self._is_urgent |= len(self._items) == self._many
                self._change.notify_all()

    def hurry(self) -> None:
        """Let what is there be delivered now, without waiting for it."""
        with self._change:
            self._is_urgent = True
            self._change.notify_all()

    def end(self, patience: float = CLOSING_TIME) -> bool:
        """Deliver what is left and finish. Safe to repeat.

        Args:
            patience: s of real time to wait for it.

        Returns:
            Whether it is done.
        """
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
            is_first, self.error = self.error is None, self.error or error
            self._items.clear()
        if is_first:
            log.error("%s could not be written: %s", self.name, error)

    def _gather(self) -> tuple[list[Item], int] | None:
        """Wait for items and return them; None when there will be no more."""
        with self._change:
            self._change.wait_for(lambda: self._items or self._must_end)
            self._change.wait_for(lambda: self._is_urgent or self._must_end, self._gathered)
            if not self._items:
                return None
            batch, self._items = self._items, []
            dropped, self._dropped = self._dropped, 0
            self._is_urgent = False
            return batch, dropped


__all__ = ["CLOSING_TIME", "GATHERED", "Background"]
