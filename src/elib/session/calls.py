"""Calls on their way to their only outcome, and the order in which they are sent."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Iterator
from typing import Generic, TypeVar

from elib.errors import ReplyTimeout
from elib.protocol.image import Image
from elib.protocol.table import Request

T = TypeVar("T")


class Call(Generic[T]):
    """One call.

    Attributes:
        request: What is asked.
        future: Gets the outcome.
        called: When the call was made, s on the loop's clock.
        deadline: When it ends at the latest.
        sent: When its bytes left; nan before.
        timer: Ends it at its deadline.
        followers: Older calls that this one replaced; they share its outcome.
    """

    __slots__ = ("called", "deadline", "followers", "future", "request", "sent", "timer")

    def __init__(self, request: Request[T], future: asyncio.Future[T], called: float, deadline: float) -> None:
        self.request = request
        self.future = future
        self.called = called
        self.deadline = deadline
        self.sent = math.nan
        self.timer: asyncio.TimerHandle | None = None
        self.followers: list[Call[T]] = []

    @property
    def is_open(self) -> bool:
        """Whether somebody still waits for the outcome."""
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
        else:
            happened = "no complete answer came; whether the robot did it is unknown"
        limit = self.deadline - self.called
        return ReplyTimeout(f"{request} did not end within {limit:.3g} s: {happened}", request=request, image=image)


class CallQueue:
    """The calls that wait to be sent: first in, first out, but for urgent ones and those that replace others."""

    def __init__(self) -> None:
        self._waiting: deque[Call[object]] = deque()

    def __bool__(self) -> bool:
        return bool(self._waiting)

    def __iter__(self) -> Iterator[Call[object]]:
        """Every call, replaced ones too."""
        for entry in tuple(self._waiting):  # another thread may ask while calls come and go
            yield from entry

    def put(self, call: Call[object]) -> None:
        """Add *call* where it belongs."""
        spec = call.request.spec
        if spec is None or not (spec.replaces or spec.urgent):
            self._waiting.append(call)
            return
        place = len(self._waiting)
        for index in range(len(self._waiting) - 1, -1, -1):
            older = self._waiting[index]
            if older.request.spec is not None and older.request.name in spec.replaces:
                # Flat, or a thousand replaced calls would be a thousand levels deep.
                call.followers[:0] = [each for each in older if not each.future.done()]
                older.followers = []
                del self._waiting[index]
                place = index
            elif older.request.wheels and not spec.urgent:
                break  # a newer speed must not be driven before what moves or stops the wheels
        # The newer call takes the oldest one's place, or a steady stream of calls would never be served.
        if spec.urgent:
            place = sum(1 for other in self._waiting if other.request.spec is not None and other.request.spec.urgent)
        self._waiting.insert(place, call)

    def pop(self) -> Call[object] | None:
        """Take the next call somebody still waits for; None if there is none."""
        while self._waiting:
            call = self._waiting.popleft()
            if call.is_open:
                return call
        return None

    @property
    def next_name(self) -> str:
        """Name of the row that will be sent next, or an empty string."""
        return self._waiting[0].request.name if self._waiting else ""

    def drop_unwanted(self) -> None:
        """Take out what nobody waits for any more."""
        while self._waiting and not self._waiting[0].is_open:
            self._waiting.popleft()

    def clear(self) -> list[Call[object]]:
        """Take everything out and return it."""
        entries = list(self._waiting)
        self._waiting.clear()
        return entries
