"""The channel of a robot that reopens its link: new sessions, in which what was set is restored."""

from __future__ import annotations

import asyncio
import copy
import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Literal, TypeVar

from elib.base.body import STEPS_PER_REVOLUTION, wrapped
from elib.base.errors import (
    ElibError,
    LinkClosed,
    LinkError,
    LinkLost,
    RemoteProtocolError,
    ReplayDiffers,
    ReplyTimeout,
    about,
)
from elib.link.protocol.actuators import restoring_calls
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import LastSet
from elib.link.protocol.table import Request
from elib.link.protocol.values import Steps
from elib.link.protocol.wifi_connection import Wanted
from elib.link.session import (
    Call,
    Disconnected,
    Ended,
    Ending,
    ForwardingChannel,
    Greeted,
    Reconnected,
    ResetNoticed,
    Session,
    SessionOpened,
    TraceEvent,
    TraceHook,
    call_hooks,
)
from elib.robot.odometry import fell_back, fell_back_over_gap, steps_in

T = TypeVar("T")

RESTORING_TIME = 1.0
"""s that each command waits which restores what was set."""


@dataclass(frozen=True, slots=True)
class Policy:
    """How a robot reopens a link that is lost. :func:`elib.reconnecting` describes each setting."""

    during_gap: Literal["wait", "fail"] = "wait"
    keep_speed: bool = False
    first_delay: float = 0.25
    longest_delay: float = 4.0
    give_up_after: float = 60.0


class Reconnector(ForwardingChannel):
    """The channel of a reconnecting robot: it makes a new session whenever the last one is lost.

    Args:
        url: Names the link in messages.
        start: Opens a new session.
        policy: How to behave.

    Attributes:
        hooks: Trace hooks, called with the events of every session.
        error: Why it ended for good, or None.
        is_restoring: Whether what was set is being set again now.
    """

    def __init__(self, url: str, start: Callable[[], Awaitable[Session]], policy: Policy) -> None:
        self._url = url
        self._start = start
        self._policy = policy
        self.hooks: list[TraceHook] = []
        self.error: ElibError | None = None
        self._session: Session
        self._firmware = ""
        self._is_up = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._restoring: asyncio.Task[None] | None = None
        self.is_restoring = False
        self._streams: tuple[Wanted | None, bool] = (None, False)
        self._memory = LastSet()
        self._steps: Steps | None = None
        self._loop = asyncio.get_running_loop()

    async def open(self) -> Reconnector:
        """Open the first session. It is tried only once, and its errors are raised."""
        self._adopt(await self._start())
        self._firmware = self._session.profile.name
        self._is_up.set()
        return self

    # -- what a robot needs of its session --

    def forget_speed(self) -> None:
        """Do not restore the wheel speeds when the link is back: the motion that set them has ended."""
        self._memory.speed = (0, 0)

    async def execute(self, request: Request[T], timeout: float) -> T:
        """Send *request* in its turn and return its answer, over a new link if necessary.

        A call that was never sent, one that only reads, and ``stop`` are sent again on a new link. Any other call that
        was under way when the link broke fails, because whether the robot did it is unknown.

        Raises:
            ReplyTimeout: No answer, or no link, in time.
            LinkLost: The link broke under the call, is down and ``during_gap`` is ``fail``, or was given up.
            LinkClosed: The robot was closed.
        """
        deadline = self._loop.time() + timeout
        while True:
            if self.error is not None or not self._is_up.is_set():
                await self._wait_for_link(request, deadline)
            session = self._session
            call: Call[T] | None = None
            try:
                call = session.submit(request, max(0.0, deadline - self._loop.time()))
                return await call.future
            except asyncio.CancelledError:
                session.give_up(call)
                raise
            except LinkLost:
                self._on_down(session)
                if call is not None and not math.isnan(call.sent) and not (request.only_reads or request.is_urgent):
                    raise

    async def execute_last(self, request: Request[T], timeout: float) -> T:
        """Send *request* as the last one; calls that wait for a link end, and no more are taken."""
        self.error = LinkClosed(f"the link to {self._url} was closed")
        if not self._is_up.is_set():
            self._is_up.set()
            raise LinkLost(f"{request}: the link to {self._url} is down")
        return await self._session.execute_last(request, timeout)

    async def close(self) -> None:
        """End for good and free the port. Safe to repeat."""
        if self.error is None:
            self.error = LinkClosed(f"the link to {self._url} was closed")
        tasks = {task for task in (self._task, self._restoring) if task is not None and not task.done()}
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks)
        self._is_up.set()
        await self._session.close()

    def stream(self, *, sensors: Wanted | None, images: bool) -> None:
        """Have a robot that streams send what is watched, on every new link too."""
        self._streams = (sensors, images)
        self._session.stream(sensors=sensors, images=images)

    def send_unqueued(self, data: bytes) -> bool:
        """Send *data* past the queue, if there is a link; its answer is dropped. Return whether the line took it."""
        return self._session.send_unqueued(data)

    # -- reopening --

    async def _wait_for_link(self, request: Request[T], deadline: float) -> None:
        self._check_alive(request)
        if self._policy.during_gap == "fail":
            raise LinkLost(f"{request}: the link to {self._url} is down; it is being opened again")
        try:
            async with asyncio.timeout_at(deadline):
                await self._is_up.wait()
        except TimeoutError:
            self._session.counter.unsent += 1
            message = f"{request} was never sent: the link to {self._url} did not come back in time"
            raise ReplyTimeout(message, request=str(request)) from None
        self._check_alive(request)

    def _check_alive(self, request: Request[T]) -> None:
        if self.error is not None:
            raise about(request, self.error)

    def _adopt(self, session: Session) -> None:
        self._session = session
        session.hooks.append(self._watch)
        sensors, images = self._streams
        session.stream(sensors=sensors, images=images)
        self._emit(self._loop.time(), SessionOpened(session.opening, session.counters))

    def _watch(self, time: float, event: TraceEvent) -> None:
        """Follow the events of the newest session, and pass them on."""
        self._emit(time, event)
        match event:
            case Ending(error=error) if not isinstance(error, LinkClosed):
                self._on_down(self._session)
            case Greeted() if self._is_up.is_set():
                # The context is about to forget what was set before, which must be restored.
                self._memory = copy.deepcopy(self._session.context.last_set)
                self._notice_reset("greeting")
            case Ended(value=value) if (steps := steps_in(value)) is not None:
                self._check_steps(steps)
            case Ended(error=None, request=request) if request.name in ("set_encoders", "reset"):
                self._steps = None  # set on purpose: the next reading must not be compared
            case _:
                pass

    def _emit(self, time: float, event: TraceEvent) -> None:
        call_hooks(self.hooks, time, event)

    def _check_steps(self, steps: Steps) -> None:
        """Notice a restart: counters that fell back to about 0 faster than wheels can turn."""
        if self.is_restoring:
            return
        before, self._steps = self._steps, steps
        if before is None:
            return
        if fell_back(before, steps):
            self._memory = copy.deepcopy(self._session.context.last_set)
            self._steps = before
            self._notice_reset("encoders")

    def _notice_reset(self, sign: str) -> None:
        if self._restoring is None:
            self._emit(self._loop.time(), ResetNoticed(sign))
            self._restoring = self._loop.create_task(self._restore_after_reset(), name=f"elib restoring {self._url}")

    async def _restore_after_reset(self) -> None:
        try:
            await self._restore(self._session, was_reset=True)
        except ElibError:
            return  # the link is lost again, and is being reopened
        finally:
            self._restoring = None

    def _on_down(self, session: Session) -> None:
        if session is not self._session or not self._is_up.is_set() or self.error is not None:
            return
        self._is_up.clear()
        self._memory = copy.deepcopy(session.context.last_set)
        error = session.error or LinkLost(f"the link to {self._url} is gone")
        if isinstance(error, ReplayDiffers):
            self._give_up(error)  # to open it again would not help
            return
        self._emit(self._loop.time(), Disconnected(error))
        self._task = self._loop.create_task(self._reopen(error), name=f"elib reconnecting {self._url}")

    async def _reopen(self, reason: ElibError) -> None:
        policy = self._policy
        began = self._loop.time()
        end = began + policy.give_up_after
        delay, attempts = policy.first_delay, 0
        await self._session.close()
        while True:
            attempts += 1
            try:
                async with asyncio.timeout_at(end):
                    session = await self._start()
                    self._adopt(session)
                    self._check_identity(session)
                    await self._restore(session)
            except (LinkError, RemoteProtocolError, ReplyTimeout, TimeoutError) as error:
                reason = error if isinstance(error, ElibError) else reason
                await self._session.close()
            else:
                self._task = None
                self._is_up.set()
                self._emit(self._loop.time(), Reconnected(self._loop.time() - began, attempts))
                return
            if self._loop.time() + delay >= end:
                self._task = None
                lost = LinkLost(
                    f"{self._url} did not come back within {policy.give_up_after:g} s: {reason.message}",
                    hint=reason.hint,
                )
                self._give_up(lost)
                return
            await asyncio.sleep(delay)
            delay = min(2 * delay, policy.longest_delay)

    def _give_up(self, error: ElibError) -> None:
        """End for good; calls that wait for a link get *error*."""
        self.error = error
        self._is_up.set()
        self._emit(self._loop.time(), Ending(error))

    def _check_identity(self, session: Session) -> None:
        """Refuse a robot with another firmware: the calls that wait were made for this one."""
        if session.profile.name != self._firmware:
            raise LinkLost(
                f"another robot answers on {self._url}: {session.profile.name}, not {self._firmware}",
                hint="is the address or the port right?",
            )

    async def _restore(self, session: Session, *, was_reset: bool = False) -> None:
        """Set on *session* what was set before: wheels first, lamps after the camera, which switches them off."""
        memory = copy.deepcopy(self._memory)

        async def do(name: str, *args: object) -> object:
            request: Request[object] = SPECS[name].request(session.context, *args)
            return await session.execute(request, RESTORING_TIME)

        self.is_restoring = True
        try:
            if self._policy.keep_speed:
                await do("set_speed", *(speed / STEPS_PER_REVOLUTION for speed in memory.speed))
            else:
                await do("stop")
            if self._steps is not None:
                steps = await do("encoders")
                assert isinstance(steps, Steps)
                if was_reset or fell_back_over_gap(self._steps, steps):
                    bits = session.profile.counter_bits
                    left, right = (wrapped(new + old, bits) for new, old in zip(steps, self._steps, strict=True))
                    await do("set_encoders", left, right)
                    if not was_reset:
                        self._emit(self._loop.time(), ResetNoticed("encoders"))
            for name, arguments in restoring_calls(memory):
                await do(name, *arguments)
        finally:
            self.is_restoring = False
            self._steps = None
