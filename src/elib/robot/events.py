"""``robot.events``: resets, late answers, and the link down and back, as values with a time."""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections import deque
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass

from elib.base.errors import ElibError, LinkClosed, ReplyTimeout
from elib.link.session import (
    Channel,
    Ended,
    Ending,
    Greeted,
    MachineBegan,
    Noted,
    Received,
    Resynced,
    TraceEvent,
    Wrote,
    check_timeout,
    trace,
)
from elib.robot.portal import KeepAlive, Portal

CAPACITY = 256
"""Number of events that are kept; beyond it the oldest one is dropped."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotEvent:
    """The base of all events.

    Attributes:
        time: When the event was noticed, s on the clock of the robot's event loop.
    """

    time: float

    def traced(self) -> Noted | MachineBegan | None:
        """Return what logs and recordings keep of it; None if they see by themselves what happens on the link."""
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class UnexpectedReset(RobotEvent):
    """The robot restarted unasked, or was switched on. It has forgotten what was set."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LateAnswer(RobotEvent):
    """An answer was received after its call was given up, and was dropped: the link is slower than the call's time.

    It is noticed when the next call brings the line into sync.

    Attributes:
        request: The call, as text.
        dropped: Number of bytes that were received too late.
    """

    request: str
    dropped: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkDown(RobotEvent):
    """The link broke, or the robot fell silent.

    Attributes:
        error: The reason, which every waiting call got too.
    """

    error: ElibError


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkBack(RobotEvent):
    """The link works again, and what was set is restored. Only a robot that reconnects has this event.

    Attributes:
        gap: Time without a link, s.
        attempts: How often opening it was tried.
    """

    gap: float
    attempts: int


class Events:
    """The events of a link, old and new: ``async for event in robot.events: ...``.

    Events are kept from the first use of ``robot.events`` on. An iteration begins with the oldest event that is kept,
    and ends when the robot is closed or its link is down for good. Several iterations may run at the same time.
    """

    def __init__(self) -> None:
        self._kept: deque[RobotEvent] = deque(maxlen=CAPACITY)
        self._count = 0
        self._arrived = asyncio.Event()
        self._late_answers = LateAnswerDetector()
        self._is_over = False
        self._channel: Channel | None = None

    @property
    def recent(self) -> tuple[RobotEvent, ...]:
        """The newest events, at most 256, oldest first."""
        return tuple(self._kept)

    @property
    def dropped(self) -> int:
        """Number of events that were dropped for newer ones."""
        return self._count - len(self._kept)

    def __aiter__(self) -> AsyncIterator[RobotEvent]:
        return EventReader(self, math.inf)

    def within(self, seconds: float) -> AsyncIterator[RobotEvent]:
        """Return an iteration that ends when nothing has happened for this long, s; 0 takes what has happened.

        Raises:
            ArgumentError: *seconds* is not a number from 0 to 3600.
        """
        return EventReader(self, check_timeout(seconds))

    async def until(self, number: int, timeout: float) -> None:
        """Wait until event *number*, counted from 0, has happened or will never happen; *timeout* s, or infinity."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(None if math.isinf(timeout) else timeout):
                while number >= self._count and not self._is_over:
                    await self._arrived.wait()

    def kept(self, number: int) -> tuple[int, RobotEvent] | None:
        """Return event *number*, or the oldest one after it that is kept, with its number; None if there is none."""
        if number >= self._count:
            return None
        number = max(number, self.dropped)
        return number, self._kept[number - self.dropped]

    # -- recording events --

    def follow(self, channel: Channel) -> None:
        """Keep the events of *channel* from now on. Safe to repeat."""
        if self._channel is not channel:
            self._channel = channel
            kinds = [Greeted, trace.ResetNoticed, trace.Disconnected, trace.Reconnected, Ending]
            if channel.context.profile.codec == "serial":
                # Over Wi-Fi bytes come all the time, and the packets behind a marker that returns late are right.
                kinds += [Ended, Received, Wrote, Resynced]
            channel.hooks.append(self._note, *kinds)
            if channel.error is not None:
                self.close()

    def add(self, event: RobotEvent) -> None:
        """Add an event. Call it in the event loop."""
        self._kept.append(event)
        self._count += 1
        self._wake()
        if self._channel is not None and (traced := event.traced()) is not None:
            self._channel.note(event.time, traced)

    def close(self) -> None:
        """End every iteration after the events that it has not read yet."""
        self._is_over = True
        self._wake()

    def _wake(self) -> None:
        self._arrived.set()
        self._arrived = asyncio.Event()

    def _note(self, time: float, event: TraceEvent) -> None:
        match event:
            case Greeted() | trace.ResetNoticed(sign="encoders"):  # the other sign is a greeting, an event of its own
                self.add(UnexpectedReset(time=time))
            case trace.Disconnected(error=error):
                self.add(LinkDown(time=time, error=error))
            case trace.Reconnected(gap=gap, attempts=attempts):
                self.add(LinkBack(time=time, gap=gap, attempts=attempts))
            case Ending(error=error):
                self._late_answers = LateAnswerDetector()
                # A reconnecting robot does not have an error of its own while it tries to reopen the link.
                if self._channel is not None and self._channel.error is not None:
                    if not isinstance(error, LinkClosed):
                        self.add(LinkDown(time=time, error=error))
                    self.close()
            case _:
                late = self._late_answers.observe(event)
                if late is not None:
                    self.add(LateAnswer(time=time, request=late[0], dropped=late[1]))


class EventReader:
    """One iteration over the events."""

    def __init__(self, events: Events, timeout: float) -> None:
        self._events = events
        self._timeout = timeout
        self._next = events.dropped
        self.dropped = 0  # number of events that this iteration missed because it was slow

    def __aiter__(self) -> EventReader:
        return self

    async def __anext__(self) -> RobotEvent:
        event = await self.take()
        if event is None:
            raise StopAsyncIteration
        return event

    async def take(self) -> RobotEvent | None:
        """Wait for the next event; None at the end."""
        await self._events.until(self._next, self._timeout)
        return self.kept()

    def kept(self) -> RobotEvent | None:
        """Return the next event if it has happened; else None."""
        found = self._events.kept(self._next)
        if found is None:
            return None
        number, event = found
        self.dropped += number - self._next
        self._next = number + 1
        return event


class LateAnswerDetector:
    """Follows a line from a call that is given up to the resync, and finds what was received too late in between."""

    def __init__(self) -> None:
        self._request = ""
        self._heard = bytearray()
        self._probe = self._asked = b""

    def observe(self, event: TraceEvent) -> tuple[str, int] | None:
        """Return the call and the number of bytes that were received too late, when a resync shows it; else None."""
        match event:
            case Ended(error=ReplyTimeout() | asyncio.CancelledError()) if not math.isnan(event.round_trip):
                self._request = str(event.request)
                self._heard.clear()
            case Ended() | Greeted():
                # A call that another one replaced may be cancelled while that one is answered as usual. A robot that
                # has restarted answers nothing from before.
                self._request = ""
            case Received() if self._request:
                self._heard += event.data
            case Wrote(data=data) if data[:1] in (b"\0", b"\r"):  # past the call: a probe, or a stop that does not wait
                self._probe = data[-2:-1].lower() + b","
                self._asked += data.lstrip(b"\0\r")[:1].lower()
            case Resynced():
                # The bytes received last are the answer to the probe.
                lines = self._heard[: max(0, self._heard.lower().rfind(self._probe))].splitlines(keepends=True)
                late = b"".join(each for each in lines if each[:1].lower() not in self._asked).strip(b"\r\n")
                request, self._request, self._asked = self._request, "", b""
                if late and request:
                    return request, len(late)
            case _:
                pass
        return None


class BlockingEvents:
    """The events of a link, for blocking code: ``for event in robot.events.within(5): ...``.

    A plain iteration waits for the next event without a limit; it ends when the robot is closed or lost.
    """

    def __init__(self, events: Events, portal: Portal, keep_alive: KeepAlive | None) -> None:
        self._keep_alive = keep_alive
        self._events = events
        self._portal = portal

    @property
    def recent(self) -> tuple[RobotEvent, ...]:
        """The newest events, at most 256, oldest first."""
        return self._events.recent

    @property
    def dropped(self) -> int:
        """Number of events that were dropped for newer ones."""
        return self._events.dropped

    def __iter__(self) -> Iterator[RobotEvent]:
        return self._iterate(EventReader(self._events, math.inf))

    def within(self, seconds: float) -> Iterator[RobotEvent]:
        """Return an iteration that ends when nothing has happened for this long, s; 0 takes what has happened.

        Raises:
            ArgumentError: *seconds* is not a number from 0 to 3600.
        """
        return self._iterate(EventReader(self._events, check_timeout(seconds)))

    def add(self, event: RobotEvent) -> None:
        """Add an event of the program's own, from any thread."""
        with contextlib.suppress(RuntimeError):  # the loop has ended, and with it all iterations
            self._portal.loop.call_soon_threadsafe(self._events.add, event)

    def _iterate(self, reader: EventReader) -> Iterator[RobotEvent]:
        while True:
            try:
                event = self._portal.call(reader.take())
            except LinkClosed:  # the robot was closed meanwhile, and with it the loop that waits
                event = reader.kept()
            if event is None:
                return
            yield event
