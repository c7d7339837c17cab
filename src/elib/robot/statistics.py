"""How the link has been: counted from the session's own trace."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from elib.errors import ReplyTimeout
from elib.quantiles import quantile
from elib.session import Call, Channel

WINDOW = 1000
"""Round trips that median and p99 are taken over: the newest ones."""


@dataclass(frozen=True, slots=True)
class Statistics:
    """A snapshot of the link's health. A call that is tried several times counts each time.

    Attributes:
        count: Answers received.
        lost: Calls that were sent and not answered in time.
        refused: Calls that ended in another error after they were sent.
        unsent: Calls whose deadline passed before they could be sent.
        median: Median round trip of the newest answers, s; nan before the first.
        p99: The round trip that 99 % of them do not exceed, s (the nearest rank); nan before the first.
        resyncs: Times the line was out of sync and had to be resynchronised.
        resets: Greetings that nobody asked for.
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


class Meter:
    """Counts what a session tells it."""

    def __init__(self) -> None:
        self._trips: deque[float] = deque(maxlen=WINDOW)
        self._count = self._lost = self._refused = self._unsent = self._resyncs = self._resets = 0
        self._last = math.nan

    @property
    def calls(self) -> int:
        """How many were counted."""
        return self._count + self._lost + self._refused + self._unsent

    def ended(self, call: Call[object], error: BaseException | None, now: float) -> None:
        """Count the outcome of one call; one that its caller gave up counts nowhere."""
        if error is None:
            self._count += 1
            self._last = now
            self._trips.append(now - call.sent)
        elif isinstance(error, asyncio.CancelledError):
            return
        elif math.isnan(call.sent):
            self._unsent += 1
        elif isinstance(error, ReplyTimeout):
            self._lost += 1
        else:
            self._refused += 1

    def never_sent(self) -> None:
        """Count a call whose deadline passed while there was no link."""
        self._unsent += 1

    def resynced(self) -> None:
        """Count a line that was out of sync."""
        self._resyncs += 1

    def greeted(self) -> None:
        """Count a greeting that nobody asked for."""
        self._resets += 1

    def read(self, now: float, channel: Channel | None = None) -> Statistics:
        """Return the counts as they stand at *now*, s on the loop's clock; *channel* has the calls under way."""
        trips = tuple(self._trips)
        return Statistics(
            self._count,
            self._lost,
            self._refused,
            self._unsent,
            quantile(trips, 0.5),
            quantile(trips, 0.99),
            self._resyncs,
            self._resets,
            now - self._last,
            0 if channel is None else channel.waiting,
            0 if channel is None else channel.unanswered,
        )


def merged(several: Sequence[Statistics]) -> Statistics:
    """Return the health of several links as one: counts added up, the slowest round trips, the oldest answer.

    Args:
        several: At least one.
    """
    if len(several) == 1:
        return several[0]
    return Statistics(
        count=sum(each.count for each in several),
        lost=sum(each.lost for each in several),
        refused=sum(each.refused for each in several),
        unsent=sum(each.unsent for each in several),
        median=max((each.median for each in several if not math.isnan(each.median)), default=math.nan),
        p99=max((each.p99 for each in several if not math.isnan(each.p99)), default=math.nan),
        resyncs=sum(each.resyncs for each in several),
        resets=sum(each.resets for each in several),
        age=max((each.age for each in several if not math.isnan(each.age)), default=math.nan),
        waiting=sum(each.waiting for each in several),
        unanswered=sum(each.unanswered for each in several),
    )
