"""Who waits for what: one queue, one writer, deadlines, and a fence after every doubt.

Every call ends exactly once: with its value, a :class:`~elib.errors.ReplyTimeout`, its cancellation, the robot's
refusal or the link's error; at the latest :data:`GRACE` after its deadline. What the session cannot promise stands in
docs/concepts.
"""

from __future__ import annotations

import asyncio
import math
import numbers
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Generic, TypeVar, cast

from elib.errors import (
    ArgumentError,
    ElibError,
    LinkClosed,
    LinkLost,
    NotAnEpuck,
    ReplyTimeout,
    RobotSilent,
)
from elib.protocol.commands import SPECS
from elib.protocol.connection import Answer, FenceAnswer, Greeting, HostConnection, OutOfQuestions, Refusal, State
from elib.protocol.context import Context
from elib.protocol.image import Image, Mounting
from elib.protocol.profiles import BTCOM_1_1_3, LONGEST_PARAMETERS, Profile, recognise
from elib.protocol.table import Request
from elib.protocol.values import Version
from elib.transport.base import Transport

T = TypeVar("T")

GRACE = 0.15
"""s after its deadline by which every call has ended; pictures add what PICTURE_SILENCE allows."""
PICTURE_SILENCE = 0.1
"""s without a byte that end a picture which is late; the rule of the 2011 library (elib-2011.md, 1.8)."""
LONGEST_SILENCE_WAIT = 2.0
"""s that the line may stay noisy before a fence asks all the same."""
PROBE_TIMEOUT = 1.0
"""s that each probe waits, or longer where the robot is known to be deaf."""
WRITE_TIMEOUT = 5.0
"""s after which a link that takes no bytes is lost."""
FENCE_ROUNDS = 8
"""Fences in a row that are answered and yet leave the line dirty before the link counts as lost."""
DRAIN_TIME = 0.2
"""s that the line is listened to before the robot is asked who it is (protocol.md, 8)."""
OPENING_TIMEOUTS = (1.0, 1.0, 2.0)
"""s that each attempt to recognise the robot waits: one that calibrates or starts is deaf for some seconds."""


# -- what trace hooks see --------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Called:
    """A call entered the queue."""

    request: Request[object]


@dataclass(frozen=True, slots=True)
class Ended:
    """A call ended: with a value, or with an error."""

    request: Request[object]
    value: object
    error: BaseException | None
    waited: float
    """s from the call to its end."""
    round_trip: float
    """s from sending to the end; nan if it was never sent."""


@dataclass(frozen=True, slots=True)
class Wrote:
    """Bytes left for the robot."""

    data: bytes


@dataclass(frozen=True, slots=True)
class Received:
    """Bytes came from the robot."""

    data: bytes


@dataclass(frozen=True, slots=True)
class Fenced:
    """The line was in doubt and is in step again."""

    duration: float


@dataclass(frozen=True, slots=True)
class Greeted:
    """The robot greeted unasked: it was switched on, or it reset itself."""


@dataclass(frozen=True, slots=True)
class Ending:
    """The session ended, for this reason."""

    error: ElibError


TraceEvent = Called | Ended | Wrote | Received | Fenced | Greeted | Ending
TraceHook = Callable[[float, TraceEvent], None]


# -- calls -----------------------------------------------------------------------------------------------------------


@dataclass(slots=True, eq=False)
class Call(Generic[T]):
    """One call on its way to its only outcome."""

    request: Request[T]
    future: asyncio.Future[T]
    called: float
    deadline: float
    sent: float = math.nan
    timer: asyncio.TimerHandle | None = None
    followers: list[Call[T]] = field(default_factory=list)
    """Older calls that this one replaced; they share its outcome."""

    @property
    def is_open(self) -> bool:
        """Whether somebody still waits for the outcome."""
        return not self.future.done() or any(call.is_open for call in self.followers)

    def __iter__(self) -> Iterator[Call[T]]:
        yield self
        for call in self.followers:
            yield from call


def check_timeout(seconds: object) -> float:
    """Return *seconds* if it can bound a wait.

    Raises:
        ArgumentError: It is no number, not finite or negative.
    """
    if isinstance(seconds, bool) or not isinstance(seconds, numbers.Real):
        raise ArgumentError(f"a timeout is a number of seconds, not {seconds!r}")
    if not math.isfinite(seconds) or seconds < 0:
        raise ArgumentError(
            f"a timeout is {seconds} s; it must be finite and not negative", hint="nothing waits for ever"
        )
    return float(seconds)


class Session:
    """One life of a link to one robot. Open it with :meth:`open`; once closed or lost it stays so.

    Attributes:
        transport: What carries the bytes.
        context: Profile, origin and memory of what was set.
        version: The robot's answer to who it is.
        hooks: Trace hooks, called as ``hook(time, event)`` in the event loop; they must be quick, and one that raises
            is removed and reported to the loop.
    """

    def __init__(self, transport: Transport, context: Context, version: Version) -> None:
        self.transport = transport
        self.context = context
        self.version = version
        self.hooks: list[TraceHook] = []
        self._loop = asyncio.get_running_loop()
        self._connection = HostConnection(context, version.text)
        self._waiting: deque[Call[object]] = deque()
        self._current: Call[object] | None = None
        self._settled: asyncio.Future[None] | None = None
        self._work = asyncio.Event()
        self._fence_answered: asyncio.Future[None] | None = None
        self._last_byte = self._loop.time()
        self._error: ElibError | None = None
        self._task: asyncio.Task[None] | None = None

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
            LinkLost: The link broke meanwhile.
        """
        try:
            context, version = await _recognise(transport, profile)
        except BaseException:
            await transport.close()
            raise
        if mounting is not None:
            import dataclasses

            context.profile = dataclasses.replace(context.profile, mounting=mounting)
        session = cls(transport, context, version)
        session._task = session._loop.create_task(session._run(), name=f"elib session {transport.url}")
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
        return sum(not call.future.done() for entry in self._waiting for call in entry)

    @property
    def unanswered(self) -> int:
        """Calls in the queue and under way."""
        current = self._current
        return self.waiting + (sum(not call.future.done() for call in current) if current is not None else 0)

    # -- calls --

    def submit(self, request: Request[T], timeout: float) -> Call[T]:
        """Queue *request*; its outcome will be in the call's future.

        Raises:
            LinkClosed: The session was closed.
            LinkLost: The link broke earlier; the first reason is repeated.
        """
        if self._error is not None:
            raise type(self._error)(f"{request}: {self._error.message}", hint=self._error.hint)
        now = self._loop.time()
        call = Call(request, self._loop.create_future(), now, now + timeout)
        self._trace(Called(cast("Request[object]", request)))
        self._enqueue(cast("Call[object]", call))
        call.timer = self._loop.call_at(call.deadline, self._expire, cast("Call[object]", call))
        return call

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
            self._give_up(cast("Call[object]", call))
            raise

    def _enqueue(self, call: Call[object]) -> None:
        spec = call.request.spec
        place = len(self._waiting)
        if spec is not None and spec.replaces:
            for index in range(len(self._waiting) - 1, -1, -1):
                older = self._waiting[index]
                if older.request.name in spec.replaces:
                    call.followers.insert(0, older)
                    del self._waiting[index]
                    place = index
            # The newer call takes the oldest one's place, or a steady stream of calls would never be served.
        if spec is not None and spec.urgent:
            place = sum(1 for other in self._waiting if other.request.spec is not None and other.request.spec.urgent)
        self._waiting.insert(place, call)
        self._work.set()

    def _expire(self, call: Call[object]) -> None:
        """The deadline passed."""
        if call.future.done():
            return
        current = self._current
        if call is current and call.request.is_picture and self._settled is not None and not self._settled.done():
            # A picture already on its way is received to its end: the robot takes no command meanwhile.
            self._picture_is_late(call)
            return
        self._fail(call, self._timeout_error(call))
        self._forget_if_unwanted(call)

    def _picture_is_late(self, call: Call[object]) -> None:
        if call.future.done():
            return
        end = min(max(self._last_byte, call.deadline) + PICTURE_SILENCE, call.deadline + LONGEST_SILENCE_WAIT)
        if self._loop.time() < end:
            call.timer = self._loop.call_at(end, self._picture_is_late, call)
            return
        self._fail(call, self._timeout_error(call))
        self._forget_if_unwanted(call)

    def _give_up(self, call: Call[object]) -> None:
        """The caller was cancelled."""
        self._end(call, None, asyncio.CancelledError())
        self._forget_if_unwanted(call)

    def _forget_if_unwanted(self, call: Call[object]) -> None:
        """Take a call off the queue, or off the wire, once nobody waits for it."""
        if self._current is not None and not self._current.is_open:
            if self._settled is not None and not self._settled.done():
                self._settled.set_result(None)
            return
        for entry in self._waiting:
            if call in entry and not entry.is_open:
                self._waiting.remove(entry)
                return

    def _timeout_error(self, call: Call[object], image: Image | None = None) -> ReplyTimeout:
        request = str(call.request)
        limit = call.deadline - call.called
        if image is not None:
            happened = "the picture came complete but late; it is in the error's .image"
        elif math.isnan(call.sent):
            happened = "it was never sent: others were before it, or the line was in doubt"
        else:
            happened = "no complete answer came; whether the robot did it is unknown"
        return ReplyTimeout(f"{request} did not end within {limit:g} s: {happened}", request=request, image=image)

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
        self._trace(Ended(call.request, value, error, now - call.called, now - call.sent))

    # -- the two tasks --

    async def _run(self) -> None:
        try:
            async with asyncio.TaskGroup() as group:
                group.create_task(self._read())
                group.create_task(self._write())
        except BaseExceptionGroup as errors:
            first = next(_leaves(errors))
            if isinstance(first, ElibError):
                self._finish(first)
            else:
                self._finish(
                    LinkLost(f"the session failed: {first!r}", hint="this is a defect of elib; please report it")
                )
                if not isinstance(first, Exception):
                    raise
                self._loop.call_exception_handler({"message": "elib session failed", "exception": first})
        except asyncio.CancelledError:
            self._finish(LinkClosed(f"the link to {self.transport.url} was closed"))
            raise
        finally:
            await self.transport.close()

    async def _read(self) -> None:
        while True:
            data = await self.transport.read()
            now = self._last_byte = self._loop.time()
            if self.hooks:
                self._trace(Received(data))
            self._connection.receive(data, now)
            while (event := self._connection.next_event()) is not None:
                self._handle(event)

    def _handle(self, event: Answer | Refusal | FenceAnswer | Greeting) -> None:
        current = self._current
        match event:
            case Answer(value=value) if current is not None:
                late = isinstance(value, Image) and self._loop.time() > current.deadline
                for call in current:
                    if late:
                        self._fail(call, self._timeout_error(call, cast("Image", value)))
                    else:
                        self._succeed(call, value)
                self._settle()
            case Refusal(error=error) if current is not None:
                for call in current:
                    self._fail(call, type(error)(f"{call.request}: {error.message}", hint=error.hint))
                self._settle()
            case FenceAnswer():
                if self._fence_answered is not None and not self._fence_answered.done():
                    self._fence_answered.set_result(None)
            case Greeting():
                self._trace(Greeted())
            case _:
                pass

    def _settle(self) -> None:
        if self._settled is not None and not self._settled.done():
            self._settled.set_result(None)

    async def _write(self) -> None:
        while True:
            while not self._waiting:
                self._work.clear()
                await self._work.wait()
            if self._connection.state is State.ABANDONED:
                await self._fence()
                continue
            call = self._waiting.popleft()
            if not call.is_open:
                continue
            await self._exchange(call)

    async def _exchange(self, call: Call[object]) -> None:
        """Send one request and stay with it until it is answered or nobody waits for it any more."""
        self._current = call
        self._settled = self._loop.create_future()
        for each in call:
            each.sent = self._loop.time()
        await self._put(self._connection.send(call.request))
        await self._settled
        self._current = self._settled = None  # not in a finally: the end of the session still needs them
        if self._connection.state is State.BUSY:
            self._connection.abandon()

    async def _put(self, data: bytes) -> None:
        if self.hooks:
            self._trace(Wrote(data))
        try:
            async with asyncio.timeout(WRITE_TIMEOUT):
                await self.transport.write(data)
        except TimeoutError:
            raise LinkLost(
                f"{self.transport.url} took no bytes for {WRITE_TIMEOUT:g} s",
                hint="is the robot still on and in range?",
            ) from None

    async def _fence(self) -> None:
        """Ask until an answer shows where the line stands; drop everything before it."""
        began = self._loop.time()
        for _ in range(FENCE_ROUNDS):
            if self._connection.needs_silence:
                await self._silence()
            await self._probe()
            if self._connection.state is not State.ABANDONED:
                self._trace(Fenced(self._loop.time() - began))
                return
        raise LinkLost(
            f"{self.transport.url} never becomes quiet: bytes keep coming that nobody asked for",
            hint="does another program use the same port, or is the speed wrong?",
        )

    async def _silence(self) -> None:
        end = self._loop.time() + LONGEST_SILENCE_WAIT
        while (until := min(self._last_byte + PICTURE_SILENCE, end)) > self._loop.time():
            quiet = self._loop.create_future()
            self._loop.call_at(until, quiet.cancel)
            await asyncio.wait([quiet])

    async def _probe(self) -> None:
        patience = max(PROBE_TIMEOUT, self._connection.patience)
        while True:
            self._fence_answered = self._loop.create_future()
            following = self._waiting[0].request.name if self._waiting else ""
            try:
                data = self._connection.fence(avoid=(following,))
            except OutOfQuestions:
                raise LinkLost(
                    f"the robot at {self.transport.url} no longer answers",
                    hint="is it switched on, charged and in range? open a new connection when it is",
                ) from None
            await self._put(data)
            try:
                async with asyncio.timeout(patience):
                    await self._fence_answered
            except TimeoutError:
                continue
            finally:
                self._fence_answered = None
            return

    # -- the end --

    def _finish(self, error: ElibError) -> None:
        """End everything once; the first reason counts."""
        if self._error is not None:
            return
        self._error = error
        self._connection.close()
        entries = ([self._current] if self._current is not None else []) + list(self._waiting)
        self._waiting.clear()
        for entry in entries:
            for call in entry:
                self._fail(call, type(error)(f"{call.request}: {error.message}", hint=error.hint))
        self._trace(Ending(error))

    async def close(self) -> None:
        """End the session and free the port; calls that still wait get LinkClosed. Safe to repeat."""
        self._finish(LinkClosed(f"the link to {self.transport.url} was closed"))
        task = self._task
        if task is not None and task is not asyncio.current_task():
            task.cancel()
            await asyncio.wait([task])
        await self.transport.close()  # the task may never have begun

    async def blurt(self, data: bytes, wait: float) -> None:
        """Send *data* past the queue and wait for the line to take it: a last word when an orderly call has failed."""
        if self._error is None:
            try:
                async with asyncio.timeout(wait):
                    await self.transport.write(bytes(self.profile.longest_parameters + 1) + b"\r" + data)
            except (TimeoutError, ElibError):
                return

    def _trace(self, event: TraceEvent) -> None:
        now = self._loop.time()
        for hook in tuple(self.hooks):
            try:
                hook(now, event)
            except Exception as error:
                self.hooks.remove(hook)
                self._loop.call_exception_handler(
                    {"message": f"a trace hook of elib raised; removed: {hook!r}", "exception": error}
                )


def _leaves(group: BaseExceptionGroup[BaseException]) -> Iterator[BaseException]:
    for error in group.exceptions:
        if isinstance(error, BaseExceptionGroup):
            yield from _leaves(error)
        else:
            yield error


async def _recognise(transport: Transport, profile: Profile | None) -> tuple[Context, Version]:
    """Find out which firmware answers (protocol.md, 8)."""
    loop = asyncio.get_running_loop()
    heard = bytearray()
    await transport.write(bytes(LONGEST_PARAMETERS + 1) + b"\r")
    await _listen(transport, DRAIN_TIME, heard)
    for patience in OPENING_TIMEOUTS:
        context = Context(profile or BTCOM_1_1_3, transport.origin)
        connection = HostConnection(context)
        request = SPECS["version"].request(context)
        await transport.write(connection.send(request))
        end = loop.time() + patience
        while connection.state is State.BUSY and loop.time() < end:
            data = await _listen_once(transport, end)
            heard += data[: 4096 - len(heard)] if len(heard) < 4096 else b""
            connection.receive(data, loop.time())
        event = connection.next_event()
        while event is not None:
            if isinstance(event, Answer) and isinstance(event.value, Version):
                found = profile or recognise(event.value.text)
                context = Context(found, transport.origin, loop.time())
                version = Version(
                    event.value.text, found.name, event.value.hardware, time=loop.time(), origin=transport.origin
                )
                await _settle_line(transport, connection)
                return context, version
            event = connection.next_event()
        # Whatever was wrong, end the line that may be half typed.
        await transport.write(b"\r")
        await _listen(transport, 0.05, heard)
    if not heard:
        raise RobotSilent(
            f"{transport.url} opened, but no robot answered",
            hint="switch the robot on, check the battery and the selector (Bluetooth and serial: position 3), "
            "and that no other robot has this address",
        )
    raise NotAnEpuck(
        f"something answers on {transport.url}, but not as an e-puck does: {bytes(heard[:60])!r}",
        hint="is it the right port, at 115200 baud, with the standard firmware (BTcom, asercom) on the robot?",
    )


async def _settle_line(transport: Transport, connection: HostConnection) -> None:
    """Wait out what still comes behind the first answer, so that the session starts on a quiet line."""
    if connection.state is State.ABANDONED:
        await _listen(transport, PICTURE_SILENCE, bytearray())


async def _listen_once(transport: Transport, end: float) -> bytes:
    try:
        async with asyncio.timeout_at(end):
            return await transport.read()
    except TimeoutError:
        return b""


async def _listen(transport: Transport, seconds: float, heard: bytearray) -> None:
    """Drop what comes for *seconds*, keeping the beginning for an error message."""
    loop = asyncio.get_running_loop()
    end = loop.time() + seconds
    while loop.time() < end:
        data = await _listen_once(transport, end)
        heard += data[: 4096 - len(heard)] if len(heard) < 4096 else b""
