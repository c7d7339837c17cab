"""Calls that have no outcome yet, and the queue that puts them in order."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Iterator
from typing import Generic, TypeVar

from elib.base.errors import ReplyTimeout
from elib.link.protocol.image import Image
from elib.link.protocol.table import Request

T = TypeVar("T")


class Call(Generic[T]):
    """One call. Its times are in s on the loop's clock.

    Attributes:
        sent: When its bytes were sent; nan before that.
        overtook_at: When they were sent past what was under way; nan if they were not.
        saw_reset: Whether the robot has restarted since the bytes were sent.
        is_replaced: Whether it is such an older call itself: its bytes are never sent.
    """

    __slots__ = (
        "called",
        "deadline",
        "followers",
        "future",
        "is_replaced",
        "overtook_at",
        "request",
        "saw_reset",
        "sent",
        "timer",
    )

    def __init__(self, request: Request[T], future: asyncio.Future[T], called: float, deadline: float) -> None:
        self.request = request  # what is asked
        self.future = future  # gets the outcome
        self.called = called  # when the call was made
        self.deadline = deadline  # when it ends at the latest
        self.sent = self.overtook_at = math.nan
        self.timer: asyncio.TimerHandle | None = None  # ends the call at its deadline
        self.followers: list[Call[T]] = []  # older calls that this one replaced; they share its outcome
        self.saw_reset = self.is_replaced = False

    @property
    def is_open(self) -> bool:
        """Whether a caller still waits for the outcome."""
        return not self.future.done() or (bool(self.followers) and any(call.is_open for call in self.followers))

    def __iter__(self) -> Iterator[Call[T]]:
        yield self
        for call in self.followers:
            yield from call

    def timeout_error(self, image: Image | None = None) -> ReplyTimeout:
        """Return the error of a call that did not end in time."""
        request = str(self.request)
        if image is not None:
            happened = "the picture came complete but late; it is in the error's .image"
        elif math.isnan(self.sent):
            happened = "it was never sent: others were before it, or the line was out of sync"
        elif self.saw_reset:
            message = f"{request} was not answered: the robot was reset meanwhile, and whether it did this is unknown"
            return ReplyTimeout(message, request=request)
        else:
            happened = "no complete answer came; whether the robot did it is unknown"
        limit = self.deadline - self.called
        return ReplyTimeout(f"{request} did not end within {limit:.3g} s: {happened}", request=request, image=image)


class CallQueue:
    """The calls that wait to be sent: first in, first out, except for urgent ones and those that replace others."""

    def __init__(self) -> None:
        self._waiting: deque[Call[object]] = deque()

    def __bool__(self) -> bool:
        return bool(self._waiting)

    def __iter__(self) -> Iterator[Call[object]]:
        """Yield every call, those that were replaced too."""
        for entry in tuple(self._waiting):  # another thread may ask while this one changes the queue
            yield from entry

    def put(self, call: Call[object]) -> None:
        """Add *call* at its place in the order."""
        spec = call.request.spec
        if spec is None or not (spec.replaces or spec.urgent):
            self._waiting.append(call)
            return
        place = len(self._waiting)
        for index in range(len(self._waiting) - 1, -1, -1):
            older = self._waiting[index]
            if older.request.spec is not None and older.request.name in spec.replaces:
                # A flat list: a chain of a thousand replaced calls would be a thousand levels deep.
                call.followers[:0] = [each for each in older if not each.future.done()]
                for each in call.followers:
                    each.is_replaced = True
                older.followers = []
                del self._waiting[index]
                place = index
            elif older.request.wheels and not spec.urgent:
                break  # a newer speed must not be sent before what moves or stops the wheels
        # The newer call takes the place of the oldest one, or a steady stream of calls would never be sent.
        if spec.urgent:
            place = sum(1 for other in self._waiting if other.request.spec is not None and other.request.spec.urgent)
        self._waiting.insert(place, call)

    def pop(self) -> Call[object] | None:
        """Remove and return the next call that a caller still waits for; None if there is none."""
        while self._waiting:
            call = self._waiting.popleft()
            if call.is_open:
                return call
        return None

    @property
    def next_name(self) -> str:
        """Name of the command that will be sent next, or an empty string."""
        return self._waiting[0].request.name if self._waiting else ""

    def drop_unwanted(self) -> None:
        """Remove calls at the front whose callers have given them up."""
        while self._waiting and not self._waiting[0].is_open:
            self._waiting.popleft()

    def clear(self) -> list[Call[object]]:
        """Remove all calls and return them."""
        entries = list(self._waiting)
        self._waiting.clear()
        return entries
