"""The health of a link in numbers: answers, losses and round trips, counted call by call."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

from elib.base.errors import ReplyTimeout
from elib.base.quantiles import quantile
from elib.link.session.calls import Call

WINDOW = 1000
"""Round trips that median and p99 are taken over: the newest ones."""


@dataclass(frozen=True, slots=True)
class LinkStats:
    """The health of a link at one moment. A call that is tried several times counts each time.

    Attributes:
        count: Answers received.
        lost: Calls that were sent and not answered in time.
        refused: Calls that ended in another error after they were sent.
        unsent: Calls whose deadline passed before they could be sent.
        median: Median round trip of the newest answers, s; nan before the first.
        p99: The round trip that 99 % of them do not exceed, s (the nearest rank); nan before the first.
        resyncs: Times the line was out of sync and had to be brought into sync.
        resets: Greetings that the robot sent unasked.
        age: s since the last answer; nan before the first.
        waiting: Calls that wait for their turn now, not sent yet.
        unanswered: Calls that have no outcome yet, those that wait for their turn among them.
    """

    count: int
    lost: int
    refused: int
    unsent: int
    median: float
    p99: float
    resyncs: int
    resets: int
    age: float
    waiting: int = 0
    unanswered: int = 0


class LinkCounter:
    """Counts what happens on a link. A session calls it directly, which costs less than a trace hook.

    Attributes:
        resyncs: Times the line was brought into sync again.
        resets: Greetings that the robot sent unasked.
        unsent: Calls whose deadline passed before they could be sent.
    """

    def __init__(self) -> None:
        self.resyncs = self.resets = self.unsent = 0
        self._count = self._lost = self._refused = 0
        self._trips: deque[float] = deque(maxlen=WINDOW)
        self._last = math.nan

    @property
    def calls(self) -> int:
        """Number of calls that were counted."""
        return self._count + self._lost + self._refused + self.unsent

    def ended(self, call: Call[object], error: BaseException | None, now: float) -> None:
        """Count the outcome of *call* at *now*, s on the loop's clock; a call that was cancelled is not counted."""
        if error is None:
            self._count += 1
            self._last = now
            self._trips.append(now - call.sent)
        elif isinstance(error, asyncio.CancelledError):
            return
        elif math.isnan(call.sent):
            self.unsent += 1
        elif isinstance(error, ReplyTimeout):
            self._lost += 1
        else:
            self._refused += 1

    def read(self, now: float, waiting: int = 0, unanswered: int = 0) -> LinkStats:
        """Return the counts at *now*, s on the loop's clock.

        Args:
            now: The time.
            waiting: Calls that wait for their turn.
            unanswered: Calls that have no outcome yet.
        """
        trips = tuple(self._trips)
        return LinkStats(
            count=self._count,
            lost=self._lost,
            refused=self._refused,
            unsent=self.unsent,
            median=quantile(trips, 0.5),
            p99=quantile(trips, 0.99),
            resyncs=self.resyncs,
            resets=self.resets,
            age=now - self._last,
            waiting=waiting,
            unanswered=unanswered,
        )


def merged(several: Sequence[LinkStats]) -> LinkStats:
    """Return the health of several links as one: counts added up, the slowest round trips, the oldest answer.

    Args:
        several: Statistics of at least one link.
    """
    if len(several) == 1:
        return several[0]
    columns = {field.name: [getattr(each, field.name) for each in several] for field in fields(LinkStats)}
    merge: dict[str, Any] = {name: _largest if name in ("median", "p99", "age") else sum for name in columns}
    return LinkStats(**{name: merge[name](values) for name, values in columns.items()})


def _largest(seconds: Sequence[float]) -> float:
    return max((each for each in seconds if not math.isnan(each)), default=math.nan)
