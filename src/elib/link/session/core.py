"""The session of one link: one queue, one writer, deadlines, and a resync whenever the line is out of sync.

Every call ends exactly once: with its value, a :class:`~elib.ReplyTimeout`, its cancellation, the robot's
refusal or the link's error; at the latest :data:`GRACE` after its deadline. docs/concepts/link.md says what the session
cannot promise.

A session has no task of its own: a call is sent by its caller if no other call is before it, and answered where its
bytes are received. Only a resync is a task, while it lasts.
"""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import math
from collections.abc import Iterator
from typing import TypeVar, cast

from elib.base.errors import ElibError, LinkClosed, LinkError, LinkLost, about
from elib.link.protocol.connection import (
    Answer,
    Event,
    Greeting,
    HostConnection,
    Refusal,
    RequestLost,
    ResyncAnswer,
    State,
)
from elib.link.protocol.context import Profile
from elib.link.protocol.image import Image, Mounting
from elib.link.protocol.table import Request
from elib.link.protocol.values import Steps, Version
from elib.link.protocol.wifi_connection import OutOfStep, Streamed, Wanted, WifiConnection, WifiEvent
from elib.link.session.calls import Call, CallQueue
from elib.link.session.opening import RecordingTransport, recognise_robot
from elib.link.session.resync import (
    MAX_SILENCE_WAIT,
    PAUSE_POLL,
    PICTURE_SILENCE,
    PROBE_TIMES,
    PROBE_TRIPS,
    MarkerWait,
    Resync,
)
from elib.link.session.statistics import LinkCounter
from elib.link.session.trace import (
    Called,
    Ended,
    Ending,
    Greeted,
    Hooks,
    MachineBegan,
    Noted,
    Pushed,
    Received,
    Resynced,
    Transcript,
    Wrote,
)
from elib.link.transport.base import Transport, buffered

T = TypeVar("T")

OVERTAKING_TIME = 0.05
"""s that a call which halts the robot waits for the answer under way; after that it is sent past it."""
GREETING_TIME = 0.03
"""s after a greeting, in which the robot finishes it and reads its buffer. Then the session asks a question, to find
out whether the robot knows the call under way. Less than OVERTAKING_TIME: a stop that overtakes is sent behind it."""
STOPPING_TIME, STOPPING_TRIPS = 0.4, 4
"""s, and round trips, that the robot has to confirm a stop; the longer of both. Out of sync it takes three trips."""
LATE = 0.001
"""s. A timer that is later than this shows that the program was suspended or blocked."""
GRACE = 0.15
"""s after its deadline at which every call has ended; pictures may take PICTURE_SILENCE longer."""
FLUSH_TIME = 0.4
"""s that a stop which was sent past the queue may take to leave before the line is closed."""
AFTER_PAUSE = 1.0
"""s that a call has left when the world of a virtual robot goes on after a pause."""


class Session:
    """One connection to one robot. Open it with :meth:`open`; it is not opened again once it is closed or lost."""

    restoring = None
    """A session restores nothing; a channel that reconnects does."""

    def __init__(self, transport: Transport, connection: HostConnection | WifiConnection, version: Version) -> None:
        self.transport = transport  # what carries the bytes
        self.context = connection.context  # profile, origin and memory of what was set
        self.version = version  # the robot's answer to the question for its version
        self.opening: Transcript = ()  # what was written and received to recognise the robot
        self.counters: Steps | None = None  # the step counters as they were read then, if the robot answered
        self.hooks = Hooks()  # trace hooks, called as `hook(time, event)` in the event loop
        self.counter = LinkCounter()  # counts every outcome; all sessions of a reconnecting robot share one
        self._loop = asyncio.get_running_loop()
        self._connection = connection
        self._line = buffered(transport)
        self._queue = CallQueue()
        self._current: Call[object] | None = None
        self._resync_task: asyncio.Task[None] | None = None
        self._resync: Resync | MarkerWait
        if isinstance(connection, WifiConnection):
            self._resync = MarkerWait(connection, self.transport.url, lambda: self._is_paused)
        else:
            self._resync = Resync(connection, self.transport.url, self._put_and_wait, lambda: self._is_paused)
        self._writing: asyncio.Task[None] | None = None
        self._ask_timer: asyncio.TimerHandle | None = None
        self._is_pumping = False
        self._received_out_of_sync = 0
        self._is_closing = False
        self._closing_line: asyncio.Task[None] | None = None
        self.final_command = b""  # sent without waiting when the robot no longer answers but the line still takes bytes
        self._has_unqueued = False
        self.error: ElibError | None = None  # why the session ended, or None while it is open

    @classmethod
    async def open(
        cls, transport: Transport, *, profile: Profile | None = None, mounting: Mounting | None = None
    ) -> Session:
        """Recognise the robot behind *transport* and start a session with it, in the codec of the transport.

        Args:
            transport: An open transport; it is closed again if this fails.
            profile: Use this firmware's profile whatever the robot answers.
            mounting: How this robot's camera is mounted, if the profile is wrong about it.

        Raises:
            RobotSilent: Nothing answered.
            NotAnEpuck: Something answered that is not an e-puck.
            LinkBusy: The other side closed a TCP connection before it sent anything.
            LinkLost: The link broke meanwhile.
            ArgumentError: The profile is that of another kind of link.
        """
        try:
            recorded = RecordingTransport(transport)
            connection, version, counters = await recognise_robot(recorded, profile)
        except BaseException:
            await transport.close()
            raise
        if mounting is not None:
            connection.context.profile = dataclasses.replace(connection.context.profile, mounting=mounting)
        session = cls(transport, connection, version)
        session.opening, session.counters = recorded.opening, counters
        session._resync.record_trip(_opening_trip(recorded.opening, version.time))
        session._line.listen(session._on_bytes, session._on_lost)
        return session

    @property
    def profile(self) -> Profile:
        """The profile of the robot's firmware."""
        return self.context.profile

    @property
    def waiting(self) -> int:
        """Number of calls in the queue, not sent yet."""
        return sum(not call.future.done() for call in self._queue)

    @property
    def unanswered(self) -> int:
        """Number of calls in the queue and under way."""
        return self.waiting + sum(not call.future.done() for call in self._current or ())

    @property
    def requests(self) -> Iterator[Request[object]]:
        """The requests of all calls that have no outcome yet, in the queue and under way."""
        return (call.request for call in (*self._queue, *(self._current or ())) if not call.future.done())

    # -- calls --

    def submit(self, request: Request[T], timeout: float, *, is_last: bool = False) -> Call[T]:
        """Queue *request* and return its call, whose future gets the outcome.

        Args:
            request: What to send.
            timeout: Seconds from now, queueing included.
            is_last: Take it although the session is about to be closed.

        Raises:
            LinkClosed: The session was closed.
            LinkLost: The link broke earlier; the message repeats the first reason.
        """
        if self.error is not None or (self._is_closing and not is_last):
            raise about(request, self.error or self._closed_error)
        now = self._loop.time()
        call = Call(request, self._loop.create_future(), now, now + timeout)
        anonymous = cast("Call[object]", call)
        self.hooks.emit(now, Called, anonymous.request)
        call.timer = self._loop.call_at(call.deadline, self._expire, anonymous)
        if self._connection.state is State.IDLE and self._is_free and not self._is_pumping and not self._queue:
            self._send(anonymous)  # the common case, which need not use the queue
        else:
            self._queue.put(anonymous)
            self._pump()
            if request.halts:
                # If the line is out of sync, at once, before the probe; else the answer under way gets a moment.
                if self._connection.state in (State.OUT_OF_SYNC, State.RESYNCING):
                    self._overtake(anonymous)
                else:
                    self._loop.call_later(OVERTAKING_TIME, self._overtake, anonymous)
        return call

    def _overtake(self, call: Call[object]) -> None:
        """Send a stop that waits at once, past the call on the wire. It is sent again in its turn, and ends then.

        The robot may receive although its answers are lost, and a resync takes seconds.
        """
        if call.is_open and math.isnan(call.sent) and self.error is None:
            data = self._connection.overtaking_bytes(call.request)
            if not data:
                self._loop.call_later(OVERTAKING_TIME, self._overtake, call)
            elif self._send_past(data):
                call.request.sent(self.context)
                call.sent = call.overtook_at = now = self._loop.time()
                self.hooks.emit(now, Wrote, data)

    def _ask_behind(self, call: Call[object] | None) -> None:
        """Ask a question behind *call*, on whose way the robot restarted: was it lost, or is it still answered?

        Again until one of the two is: the question may be lost too, or the robot be busy with the call.
        """
        connection = self._connection
        if call is None or call is not self._current or not isinstance(connection, HostConnection):
            return
        data = connection.ask_behind()
        if self._line.send_nowait(data):
            self.hooks.emit(self._loop.time(), Wrote, data)
        pause = max(PROBE_TIMES[0], PROBE_TRIPS * self._resync.trip, call.request.service)
        self._ask_timer = self._loop.call_later(pause, self._ask_behind, call)

    def _send_past(self, data: bytes) -> bool:
        """Send *data* past all that is under way; return False if the line does not take them at once."""
        if self.error is not None or not self._line.send_nowait(data):
            return False
        self._resync.last_sent = self._loop.time()
        self._connection.overtake(data)
        return True

    @property
    def _is_free(self) -> bool:
        """Whether a request may be handed to the line now."""
        return self._current is None and self._resync_task is None and self._writing is None and self.error is None

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
        return await self.outcome(self.submit(request, timeout))

    async def outcome(self, call: Call[T]) -> T:
        """Return the answer to *call*. If this is cancelled, the call is no longer sent, or its answer is dropped."""
        try:
            return await call.future
        except asyncio.CancelledError:
            if call.future.cancelled() or call.future.cancel():
                self._end(cast("Call[object]", call), None, asyncio.CancelledError())
                self._abandon_unwanted()
            else:
                call.future.exception()  # it ended in the same turn of the loop in which its caller was cancelled
            raise

    async def execute_last(self, request: Request[T], timeout: float) -> T:
        """Send *request* as the last one: calls that wait end in LinkClosed, and no more are taken.

        Raises:
            ReplyTimeout: No complete answer came in time.
            LinkError: The link is closed or lost.
        """
        self._is_closing = True
        for entry in self._queue.clear():
            for call in entry:
                self._fail(call, about(call.request, self._closed_error))
        return await self.outcome(self.submit(request, timeout, is_last=True))

    @property
    def stopping_time(self) -> float:
        """How long the robot may need to confirm a stop, s: some round trips, after what it is busy with.

        Over Wi-Fi the answer may wait behind a late picture.
        """
        busy = self._current.request.service if self._current is not None else 0.0
        settling = self._connection.busy_time if self._connection.state is not State.IDLE else 0.0
        trips = max(STOPPING_TIME, STOPPING_TRIPS * self._resync.trip)
        return max(trips + max(busy, settling), self.context.profile.patience)

    @property
    def _is_paused(self) -> bool:
        """Whether the robot is a virtual one whose world is paused: no answer is late then."""
        return bool(getattr(self.transport, "is_paused", False))

    @property
    def _closed_error(self) -> LinkClosed:
        return LinkClosed(f"the link to {self.transport.url} was closed")

    def _expire(self, call: Call[object]) -> None:
        """End a call whose deadline passed."""
        if self._loop.time() - call.deadline > LATE and not call.future.done():
            # The program was suspended, or something blocked the loop: first take what was received meanwhile.
            call.timer = self._loop.call_later(0, self._expire_now, call)
        else:
            self._expire_now(call)

    def _expire_now(self, call: Call[object]) -> None:
        if call.future.done():
            return
        if self._is_paused and not self._is_closing:
            call.deadline = self._loop.time() + AFTER_PAUSE
            call.timer = self._loop.call_later(PAUSE_POLL, self._expire, call)
            return
        if self._loop.time() + LATE < call.deadline:  # a pause has put it off
            call.timer = self._loop.call_at(call.deadline, self._expire, call)
            return
        if call is self._current and call.request.is_picture and not self._connection.is_stream:
            # A picture that is being received is received to its end: the robot takes no command meanwhile.
            end = min(max(self._resync.last_byte, call.deadline) + PICTURE_SILENCE, call.deadline + MAX_SILENCE_WAIT)
            if self._loop.time() < end:
                call.timer = self._loop.call_at(end, self._expire, call)
                return
        # Calls whose time is over at the same moment end in the order in which they were made, before anything is sent:
        # the order of their timers is random, and a replay could take them in another one.
        now = self._loop.time()
        for each in (*(self._current or ()), *self._queue):
            if each is call or (each.deadline <= now and not each.request.is_picture):
                self._fail(each, each.timeout_error())
        self._abandon_unwanted()

    def _abandon_unwanted(self) -> None:
        """Drop calls that no caller waits for any more, on the wire and in the queue."""
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
        now = self._loop.time()
        self.counter.ended(call, error, now)
        times = call.called, now - call.called, now - call.sent
        self.hooks.emit(now, Ended, call.request, value, error, *times, call.is_replaced, call.overtook_at)

    # -- sending and receiving --

    def _pump(self) -> None:
        """Send the next call if the wire is free."""
        if self._is_pumping:
            return  # an answer came while its request was still being written; the loop below goes on
        self._is_pumping = True
        try:
            while self._is_free:
                if self._connection.state is State.OUT_OF_SYNC:
                    self._queue.drop_unwanted()
                    if self._queue:
                        self._resync_task = self._loop.create_task(
                            self._resynchronise(), name=f"elib resync {self.transport.url}"
                        )
                        self._resync_task.add_done_callback(self._on_task_done)
                    return
                call = self._queue.pop()
                if call is not None:
                    self._send(call)
                    continue
                if data := self._connection.unasked():
                    self._put(data, self._loop.time())
                return
        finally:
            self._is_pumping = False

    def _send(self, call: Call[object]) -> None:
        now = self._loop.time()
        for each in call:
            each.sent = now
        self._current = call
        data = self._connection.send(call.request)
        call.request.sent(self.context)
        self._put(data, now)

    def _put(self, data: bytes, now: float) -> None:
        """Write *data* to the line, at once if it takes them."""
        self._resync.last_sent = now
        self.hooks.emit(now, Wrote, data)
        if not self._line.send_nowait(data) and self.error is None:
            self._writing = self._loop.create_task(self._line.write(data), name=f"elib writing {self.transport.url}")
            self._writing.add_done_callback(self._on_task_done)

    async def _resynchronise(self) -> None:
        began = self._loop.time()
        is_tidying = self._connection.is_tidying
        await self._resync.run(lambda: self._queue.next_name)
        if is_tidying:
            return  # nothing was out of sync: the robot took a change of its stream
        dropped = 0  # of a stream: it goes on, and its packets are right
        if isinstance(self._connection, HostConnection):
            dropped = self._connection.received_bytes - self._received_out_of_sync - self._connection.probe_answer_bytes
        self._received_out_of_sync = self._connection.received_bytes
        self.counter.resyncs += 1
        now = self._loop.time()
        self.hooks.emit(now, Resynced, now - began, dropped)

    async def _put_and_wait(self, data: bytes) -> None:
        """Write a probe and wait until it was taken; no request is sent meanwhile."""
        self.hooks.emit(self._loop.time(), Wrote, data)
        await self._line.write(data)

    def _on_task_done(self, task: asyncio.Task[None]) -> None:
        if task is self._writing:
            self._writing = None
        else:
            self._resync_task = None
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
        self.hooks.emit(now, Received, data)
        connection = self._connection
        connection.receive(data, now)
        while (event := connection.next_event()) is not None:
            self._handle(event, now)
        if self._current is None and (self._queue or connection.is_stream):
            self._pump()

    def _on_lost(self) -> None:
        self._finish(self._line.loss or LinkLost(f"{self.transport.url} is gone"))

    def _handle(self, event: Event | WifiEvent, now: float) -> None:
        match event:
            case Answer(value=value):
                call, self._current = self._current, None
                if call is None:
                    return
                if not call.request.service:
                    self._resync.record_trip(now - call.sent)
                if isinstance(value, Image) and now > call.deadline:
                    for each in call:
                        self._fail(each, each.timeout_error(value))
                    return
                for each in call:
                    self._succeed(each, value)
            case Refusal(error=error):
                call, self._current = self._current, None
                for each in call or ():
                    self._fail(each, about(each.request, error))
            case ResyncAnswer():
                self._resync.answered()
            case Greeting():
                self.counter.resets += 1
                for each in self._current or ():
                    each.saw_reset = True
                if self._ask_timer is not None:
                    self._ask_timer.cancel()
                self._ask_timer = self._loop.call_later(GREETING_TIME, self._ask_behind, self._current)
                self.hooks.emit(now, Greeted)
                self.context.forget()
            case RequestLost():
                call, self._current = self._current, None
                self._received_out_of_sync = self._connection.received_bytes
                for each in call or ():
                    self._fail(each, each.timeout_error())
            case Streamed(value=value):
                self.hooks.emit(now, Pushed, value)
            case OutOfStep(reason=reason):
                self._finish(
                    LinkLost(
                        f"the packets of {self.transport.url} are out of step: {reason}",
                        hint="open a new connection; elib.reconnecting() does that by itself",
                    )
                )

    def stream(self, *, sensors: Wanted | None, images: bool) -> None:
        """Have a robot that streams send what is watched: as :class:`~elib.link.session.Pushed` events.

        Args:
            sensors: Called with the time of each packet, s on the loop's clock; returns if its readings are wanted.
                None if none are.
            images: Whether the robot must send pictures all the time.
        """
        if isinstance(self._connection, WifiConnection):
            self._connection.wants_sensors = sensors
            self.context.streams_images = images
            self._pump()

    # -- closing --

    def _finish(self, error: ElibError) -> None:
        """End the session and all its calls; only the first reason counts."""
        if self.error is not None:
            return
        self.error = error
        self._connection.close()
        entries = self._queue.clear()
        if self._current is not None:
            entries.insert(0, self._current)
            self._current = None
        for entry in entries:
            for call in entry:
                self._fail(call, about(call.request, error))
        for task in (self._resync_task, self._writing):
            if task is not None:
                task.cancel()
        if not isinstance(error, LinkClosed):
            self._release_line()
        self.hooks.emit(self._loop.time(), Ending, error)

    def lose(self, error: LinkLost) -> None:
        """End the session as if the link had broken, for the reason *error*: it is of no use any more."""
        self._finish(error)

    def _release_line(self) -> None:
        """Close the transport; if it is still open, first try to send the final command without waiting."""
        data = self.profile.line_end + self.final_command
        if self._line.is_open and self.final_command and self._line.send_nowait(data):
            self._closing_line = self._loop.create_task(self._line.close())
        else:
            self._line.abort()

    async def close(self) -> None:
        """End the session and free the port; calls that still wait end in LinkClosed. Safe to repeat."""
        tasks = {task for task in (self._resync_task, self._writing) if task is not None}
        self._finish(self._closed_error)
        try:
            if tasks:
                await asyncio.wait(tasks)
            await self._flush()
            await self._line.close()
        except asyncio.CancelledError:
            self._line.abort()  # the port is freed even if closing is cancelled
            raise

    def send_unqueued(self, data: bytes) -> bool:
        """Send *data* past the queue, without waiting; its answer is dropped. Only in the event loop.

        Returns:
            Whether the line took it. :meth:`close` gives it time to leave.
        """
        self._has_unqueued = True
        return self._send_past(self.profile.line_end + data)

    async def _flush(self) -> None:
        """Let what was sent unqueued leave: closing may drop what the line has not carried away yet."""
        if self._has_unqueued:
            with contextlib.suppress(TimeoutError, LinkError):
                async with asyncio.timeout(FLUSH_TIME):
                    await self._line.write(b"")

    def forget_speed(self) -> None:
        """Do nothing: a session restores nothing."""

    def note(self, time: float, event: Noted | MachineBegan) -> None:
        """Tell the trace hooks what a program did at *time*, s on the loop's clock."""
        self.hooks.call(time, event)


def _opening_trip(opening: Transcript, answered: float) -> float:
    """Return how long the robot took to answer with its version, s, from the first question for it."""
    written = [time for time, event in opening if isinstance(event, Wrote)]
    return answered - next(iter(written[1:] or written), answered)  # on a serial line, old lines are ended first
