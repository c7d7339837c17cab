"""Who waits for what: one queue, one writer, deadlines, and a resync whenever the line is out of sync.

Every call ends exactly once: with its value, a :class:`~elib.errors.ReplyTimeout`, its cancellation, the robot's
refusal or the link's error; at the latest :data:`GRACE` after its deadline. What the session cannot promise stands in
docs/concepts.

There is no task per session: a call is sent where it is made if nothing is before it, and answered where its bytes
arrive. Only a resync is a task, while it lasts.
"""

from __future__ import annotations

import asyncio
import dataclasses
import math
from typing import TypeVar, cast

from elib.errors import ElibError, LinkClosed, LinkError, LinkLost
from elib.protocol.connection import (
    Answer,
    Event,
    Greeting,
    HostConnection,
    Refusal,
    ResyncAnswer,
    State,
)
from elib.protocol.context import Context, Profile
from elib.protocol.image import Image, Mounting
from elib.protocol.table import Request
from elib.protocol.values import Version
from elib.session.calls import Call, CallQueue
from elib.session.channel import Meter
from elib.session.opening import Overheard, recognise_robot
from elib.session.resync import LONGEST_SILENCE_WAIT, PICTURE_SILENCE, Resync
from elib.session.trace import (
    Called,
    Ended,
    Ending,
    Greeted,
    Received,
    Resynced,
    TraceEvent,
    TraceHook,
    Transcript,
    Wrote,
)
from elib.transport.base import Transport
from elib.transport.buffered import buffered

T = TypeVar("T")

OVERTAKING_TIME = 0.05
"""s that a call which halts the robot waits for the answer under way before it is sent past it."""
STOPPING_TIME, STOPPING_TRIPS = 0.4, 4
"""s, and round trips, that the robot has to confirm a stop; the longer of both. A line out of sync takes three."""
LATE = 0.001
"""s by which a timer of a program that runs is rarely late."""
GRACE = 0.15
"""s after its deadline by which every call has ended; pictures add what PICTURE_SILENCE allows."""
WRITE_TIMEOUT = 5.0
"""s after which a link that takes no bytes is lost."""


class Session:
    """One life of a link to one robot. Open it with :meth:`open`; once closed or lost it stays so.

    Attributes:
        transport: What carries the bytes.
        context: Profile, origin and memory of what was set.
        version: The robot's answer to who it is.
        opening: What was written and received to find that out.
        hooks: Trace hooks, called as ``hook(time, event)`` in the event loop; they must be quick, and one that raises
            is removed and reported to the loop.
        meter: Counts every outcome, if set.
        last_words: What is sent blindly when the robot falls silent while the line still takes bytes, such as a stop.
    """

    def __init__(self, transport: Transport, context: Context, version: Version) -> None:
        self.transport = transport
        self.context = context
        self.version = version
        self.opening: Transcript = ()
        self.hooks: list[TraceHook] = []
        self.meter: Meter | None = None
        self._loop = asyncio.get_running_loop()
        self._connection = HostConnection(context, version.text)
        self._line = buffered(transport)
        self._queue = CallQueue()
        self._current: Call[object] | None = None
        self._resync_task: asyncio.Task[None] | None = None
        self._resync = Resync(self._connection, self.transport.url, self._put_and_wait)
        self._writing: asyncio.Task[None] | None = None
        self._is_pumping = False
        self._received_out_of_sync = 0
        self._is_closing = False
        self._parting: asyncio.Task[None] | None = None
        self.last_words = b""
        self._error: ElibError | None = None

    @classmethod
    async def open(
        cls, transport: Transport, *, profile: Profile | None = None, mounting: Mounting | None = None
    ) -> Session:
        """Recognise the robot behind *transport* and start a session with it.

        Args:
            transport: An open transport; it is closed again if this fails.
            profile: Use this firmware's profile whatever the robot answers.
            mounting: How this robot's camera sits, where the profile's guess is wrong.

        Raises:
            RobotSilent: Nothing answered.
            NotAnEpuck: Something answered that is no e-puck.
            LinkBusy: The other side of a TCP connection closed it before it said anything.
            LinkLost: The link broke meanwhile.
        """
        try:
            overheard = Overheard(transport)
            context, version, may_answer_again = await recognise_robot(overheard, profile)
        except BaseException:
            await transport.close()
            raise
        if mounting is not None:
            context.profile = dataclasses.replace(context.profile, mounting=mounting)
        session = cls(transport, context, version)
        session.opening = overheard.opening
        session._resync.took(_opening_trip(overheard.opening))
        if may_answer_again:
            session._connection.lose_sync(b"V\r")
        session._line.listen(session._on_bytes, session._on_lost)
        return session

    @property
    def profile(self) -> Profile:
        """The firmware spoken to."""
        return self.context.profile

    @property
    def error(self) -> ElibError | None:
        """Why the session ended, or None while it lives."""
        return self._error

    @property
    def waiting(self) -> int:
        """Calls in the queue, not sent yet."""
        return sum(not call.future.done() for call in self._queue)

    @property
    def unanswered(self) -> int:
        """Calls in the queue and under way."""
        return self.waiting + sum(not call.future.done() for call in self._current or ())

    # -- calls --

    def submit(self, request: Request[T], timeout: float) -> Call[T]:
        """Queue *request*; its outcome will be in the call's future.

        Args:
            request: What to send.
            timeout: Seconds from now, queueing included.

        Raises:
            LinkClosed: The session was closed.
            LinkLost: The link broke earlier; the first reason is repeated.
        """
        if self._error is not None or self._is_closing:
            raise _about(str(request), self._error or self._closed_error)
        return self._accept(request, timeout)

    def _accept(self, request: Request[T], timeout: float) -> Call[T]:
        now = self._loop.time()
        call = Call(request, self._loop.create_future(), now, now + timeout)
        anonymous = cast("Call[object]", call)
        if self.hooks:
            self._trace(Called(anonymous.request))
        call.timer = self._loop.call_at(call.deadline, self._expire, anonymous)
        if self._is_free and not self._queue and self._connection.state is State.IDLE:
            self._send(anonymous)  # the common case, without the detour through the queue
        else:
            self._queue.put(anonymous)
            self._pump()
            if request.halts:
                # On a line out of sync at once, before the probe; else the answer under way is given a moment.
                if self._connection.state in (State.OUT_OF_SYNC, State.RESYNCING):
                    self._overtake(anonymous)
                else:
                    self._loop.call_later(OVERTAKING_TIME, self._overtake, anonymous)
        return call

    def _overtake(self, call: Call[object]) -> None:
        """Send a call that halts the robot and still waits, past all that is under way; it goes out again in its turn.

        The robot may hear although its answers are lost, and a line out of sync takes seconds to be resynchronised.
        """
        if call.is_open and math.isnan(call.sent):
            # Without the zeros of a probe: while the robot is busy, its receive ring has to hold this and the probe.
            data = b"\r" + (call.request.data if call.request.make is None else call.request.make())
            if self._send_past(data):
                call.sent = self._loop.time()
                if self.hooks:
                    self._trace(Wrote(data))

    def _send_past(self, data: bytes) -> bool:
        """Send *data* past all that is under way; return False if the line does not take them at once."""
        if self._error is not None or not self._line.send_nowait(data):
            return False
        self._connection.overtake(data)
        return True

    @property
    def _is_free(self) -> bool:
        """Whether a request may be handed to the line now."""
        return (
            self._current is None
            and self._resync_task is None
            and self._writing is None
            and self._error is None
            and not self._is_pumping
        )

    async def execute(self, request: Request[T], timeout: float) -> T:
        """Send *request* in its turn and return its answer.

        Args:
            request: What to send.
            timeout: Seconds from now, queueing included.

        Raises:
            ReplyTimeout: No complete answer came in time.
            CommandRejected: The robot does not know the command.
            RemoteProtocolError: The answer is malformed.
            LinkError: The link is closed or lost.
        """
        call = self.submit(request, timeout)
        try:
            return await call.future
        except asyncio.CancelledError:
            self.give_up(call)
            raise

    def give_up(self, call: Call[T] | None) -> None:
        """Take note that the caller of *call* was cancelled: it is not sent any more, or its answer is dropped."""
        if call is None:
            return
        if call.future.cancelled() or call.future.cancel():
            self._end(cast("Call[object]", call), None, asyncio.CancelledError())
            self._abandon_unwanted()
        else:
            call.future.exception()  # it ended on the very turn of the loop on which its caller was cancelled

    async def farewell(self, request: Request[T], timeout: float) -> T:
        """Send *request* as the very last: what waits ends in LinkClosed, and nothing is taken any more.

        Raises:
            ReplyTimeout: No complete answer came in time.
            LinkError: The link is closed or lost.
        """
        if self._error is not None:
            raise _about(str(request), self._error)
        self._is_closing = True
        for entry in self._queue.clear():
            for call in entry:
                self._fail(call, _about(str(call.request), self._closed_error))
        last = self._accept(request, timeout)
        try:
            return await last.future
        except asyncio.CancelledError:
            self.give_up(last)
            raise

    @property
    def stopping_time(self) -> float:
        """How long the robot may need to confirm a stop, s: some round trips, behind what it is busy with."""
        busy = self._current.request.service if self._current is not None else 0.0
        settling = self._connection.patience if self._connection.state is not State.IDLE else 0.0
        return max(STOPPING_TIME, STOPPING_TRIPS * self._resync.trip) + max(busy, settling)

    @property
    def _closed_error(self) -> LinkClosed:
        return LinkClosed(f"the link to {self.transport.url} was closed")

    def _expire(self, call: Call[object]) -> None:
        """The deadline passed."""
        if self._loop.time() - call.deadline > LATE and not call.future.done():
            # The program was suspended, or something blocked the loop: what came meanwhile comes first.
            call.timer = self._loop.call_later(0, self._expire_now, call)
        else:
            self._expire_now(call)

    def _expire_now(self, call: Call[object]) -> None:
        if call.future.done():
            return
        if call is self._current and call.request.is_picture:
            # A picture already on its way is received to its end: the robot takes no command meanwhile.
            end = min(
                max(self._resync.last_byte, call.deadline) + PICTURE_SILENCE, call.deadline + LONGEST_SILENCE_WAIT
            )
            if self._loop.time() < end:
                call.timer = self._loop.call_at(end, self._expire, call)
                return
        # Calls whose time is over at the same moment end in the order in which they were made, before anything is sent:
        # the order of their timers is chance, and a replay could take them in another one.
        now = self._loop.time()
        for each in (*(self._current or ()), *self._queue):
            if each is call or (each.deadline <= now and not each.request.is_picture):
                self._fail(each, each.timeout_error())
        self._abandon_unwanted()

    def _abandon_unwanted(self) -> None:
        """Take calls off the wire and off the queue that nobody waits for any more."""
        self._queue.drop_unwanted()
        current = self._current
        if current is not None and not current.is_open and self._connection.state is State.BUSY:
            self._current = None
            self._connection.abandon()
            self._received_out_of_sync = self._connection.received_bytes
            self._pump()

    def _fail(self, call: Call[object], error: ElibError) -> None:
        if not call.future.done():
            call.future.set_exception(error)
            self._end(call, None, error)

    def _succeed(self, call: Call[object], value: object) -> None:
        if not call.future.done():
            call.future.set_result(value)
            self._end(call, value, None)

    def _end(self, call: Call[object], value: object, error: BaseException | None) -> None:
        if call.timer is not None:
            call.timer.cancel()
        if self.meter is not None:
            self.meter.ended(call, error, self._loop.time())
        if self.hooks:
            now = self._loop.time()
            self._trace(Ended(call.request, value, error, now - call.called, now - call.sent))

    # -- the wire: the one place that writes --

    def _pump(self) -> None:
        """Send the next call if the wire is free."""
        if self._is_pumping:
            return  # an answer came while its request was still being handed over; the loop below goes on
        self._is_pumping = True
        try:
            while self._current is None and self._resync_task is None and self._writing is None and self._error is None:
                if self._connection.state is State.OUT_OF_SYNC:
                    self._queue.drop_unwanted()
                    if self._queue:
                        self._resync_task = self._loop.create_task(
                            self._resynchronise(), name=f"elib resync {self.transport.url}"
                        )
                        self._resync_task.add_done_callback(self._on_resync_done)
                    return
                call = self._queue.pop()
                if call is None:
                    return
                self._send(call)
        finally:
            self._is_pumping = False

    def _send(self, call: Call[object]) -> None:
        call.sent = now = self._loop.time()
        for older in call.followers:
            for each in older:
                each.sent = now
        self._current = call
        self._put(self._connection.send(call.request))

    def _put(self, data: bytes) -> None:
        """Hand *data* to the line, at once if it takes them."""
        if self.hooks:
            self._trace(Wrote(data))
        if not self._line.send_nowait(data) and self._error is None:
            self._writing = self._loop.create_task(self._write(data), name=f"elib writing {self.transport.url}")
            self._writing.add_done_callback(self._on_written)

    async def _resynchronise(self) -> None:
        began = self._loop.time()
        await self._resync.run(lambda: self._queue.next_name)
        dropped = self._connection.received_bytes - self._received_out_of_sync - self._connection.probe_answer_bytes
        self._received_out_of_sync = self._connection.received_bytes
        if self.meter is not None:
            self.meter.resynced()
        if self.hooks:
            self._trace(Resynced(self._loop.time() - began, dropped))

    async def _put_and_wait(self, data: bytes) -> None:
        """Write a probe; no request is sent meanwhile."""
        if self.hooks:
            self._trace(Wrote(data))
        await self._write(data)

    async def _write(self, data: bytes) -> None:
        try:
            async with asyncio.timeout(WRITE_TIMEOUT):
                await self._line.write(data)
        except TimeoutError:
            raise LinkLost(
                f"{self.transport.url} took no bytes for {WRITE_TIMEOUT:g} s",
                hint="is the robot still on and in range?",
            ) from None

    def _on_written(self, task: asyncio.Task[None]) -> None:
        self._writing = None
        self._settle_task(task)

    def _on_resync_done(self, task: asyncio.Task[None]) -> None:
        self._resync_task = None
        self._settle_task(task)

    def _settle_task(self, task: asyncio.Task[None]) -> None:
        if task.cancelled():
            return
        error = task.exception()
        if error is None:
            self._pump()
        elif isinstance(error, ElibError):
            self._finish(error)
        else:
            self._finish(LinkLost(f"the session failed: {error!r}", hint="this is a defect of elib; please report it"))
            self._loop.call_exception_handler({"message": "elib session failed", "exception": error})

    def _on_bytes(self, data: bytes) -> None:
        now = self._resync.last_byte = self._loop.time()
        if self.hooks:
            self._trace(Received(data))
        connection = self._connection
        connection.receive(data, now)
        while (event := connection.next_event()) is not None:
            self._handle(event)
        if self._current is None:
            self._pump()

    def _on_lost(self) -> None:
        self._finish(self._line.loss or LinkLost(f"{self.transport.url} is gone"))

    def _handle(self, event: Event) -> None:
        match event:
            case Answer(value=value):
                call, self._current = self._current, None
                if call is None:
                    return
                if not call.request.service:
                    self._resync.took(self._loop.time() - call.sent)
                if isinstance(value, Image) and self._loop.time() > call.deadline:
                    for each in call:
                        self._fail(each, each.timeout_error(value))
                    return
                self._succeed(call, value)
                for older in call.followers:
                    for each in older:
                        self._succeed(each, value)
            case Refusal(error=error):
                call, self._current = self._current, None
                for each in call or ():
                    self._fail(each, _about(str(each.request), error))
            case ResyncAnswer():
                self._resync.answered()
            case Greeting():
                if self.meter is not None:
                    self.meter.greeted()
                if self.hooks:
                    self._trace(Greeted())
                self.context.forget()

    # -- the end --

    def _finish(self, error: ElibError) -> None:
        """End everything once; the first reason counts."""
        if self._error is not None:
            return
        self._error = error
        self._connection.close()
        entries = self._queue.clear()
        if self._current is not None:
            entries.insert(0, self._current)
            self._current = None
        for entry in entries:
            for call in entry:
                self._fail(call, _about(str(call.request), error))
        for task in (self._resync_task, self._writing):
            if task is not None:
                task.cancel()
        if not isinstance(error, LinkClosed):
            self._part_from_the_line()
        if self.hooks:
            self._trace(Ending(error))

    def _part_from_the_line(self) -> None:
        """Let go of a line that is lost, or whose robot no longer answers but may still hear."""
        if self._line.is_open and self.last_words and self._line.send_nowait(self.profile.line_end + self.last_words):
            self._parting = self._loop.create_task(self._line.close())
        else:
            self._line.abort()

    async def close(self) -> None:
        """End the session and free the port; calls that still wait get LinkClosed. Safe to repeat."""
        tasks = {task for task in (self._resync_task, self._writing) if task is not None}
        self._finish(self._closed_error)
        try:
            if tasks:
                await asyncio.wait(tasks)
            await self._line.close()
        except asyncio.CancelledError:
            self._line.abort()  # in a hurry: the port is freed all the same
            raise

    def interject(self, data: bytes) -> None:
        """Send *data* past the queue, without waiting; its answer is dropped. Only in the event loop."""
        self._send_past(self.profile.line_end + data)

    async def blurt(self, data: bytes, wait: float) -> None:
        """Send *data* past the queue, in at most *wait* seconds: a last word when an orderly call has failed."""
        if self._error is None:
            try:
                async with asyncio.timeout(wait):
                    await self._line.write(self.profile.line_end + data)
            except (TimeoutError, LinkError):
                return

    def _trace(self, event: TraceEvent) -> None:
        now = self._loop.time()
        for hook in tuple(self.hooks):
            try:
                hook(now, event)
            except Exception as error:
                self.hooks.remove(hook)
                message = f"a trace hook of elib raised; removed: {hook!r}"
                self._loop.call_exception_handler({"message": message, "exception": error})


def _opening_trip(opening: Transcript) -> float:
    """Return how long the robot took to say who it is, s."""
    asked = trip = 0.0
    for time, event in opening:
        if isinstance(event, Wrote):
            asked, trip = time, 0.0
        else:
            trip = trip or time - asked
    return trip


def _about(request: str, error: ElibError) -> ElibError:
    """Return *error* as it concerns one request."""
    return type(error)(f"{request}: {error.message}", hint=error.hint)
