"""The channel of a robot that reopens its link: new sessions, in which what was set is restored."""

from __future__ import annotations

import asyncio
import copy
import logging
import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from typing import Literal, TypeVar

from elib.base.body import STEPS_PER_REVOLUTION, wrapped
from elib.base.errors import (
    ArgumentError,
    ElibError,
    LinkClosed,
    LinkError,
    LinkLost,
    RemoteProtocolError,
    ReplayDiffers,
    ReplyTimeout,
    Unsupported,
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
    Hooks,
    Reconnected,
    ResetNoticed,
    Session,
    SessionOpened,
    TraceEvent,
)
from elib.robot.odometry import fell_back, fell_back_over_gap, steps_in

T = TypeVar("T")

log = logging.getLogger("elib")

RESTORING_TIME = 1.0
"""s that each command waits at least which restores what was set."""
RESTORING_TRIES = 5
"""How often each of them is tried before the link is opened again: for longer than an e-puck2 takes to restart."""


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
    """

    def __init__(self, url: str, start: Callable[[], Awaitable[Session]], policy: Policy) -> None:
        self._url = url
        self._start = start
        self._policy = policy
        self.hooks = Hooks(self._watch, Ending, Greeted, Ended)  # trace hooks, called with the events of every session
        self.error: ElibError | None = None  # why it ended for good, or None
        self._session: Session
        self._firmware = ""
        self._is_up = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._restoring: asyncio.Task[None] | None = None
        self._streams: tuple[Wanted | None, bool] = (None, False)
        self._has_restarted = False
        """Whether what was restored so far is forgotten again."""
        self._has_lost_steps = False
        """Whether the counters began at 0 again, and were not set since."""
        self.restoring: Request[object] | None = None  # the request that sets again now what was set, or None
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
        """Do not restore the wheel speeds when the link is back: a motion that set them has ended, or a stop is due."""
        self._memory.speed = self._session.context.last_set.speed = (0, 0)

    async def execute(self, request: Request[T], timeout: float) -> T:
        """Send *request* in its turn and return its answer, over a new link if necessary.

        A call that was never sent, one that only reads, and ``stop`` are sent again on a new link. Any other call that
        was under way when the link broke fails, because whether the robot did it is unknown. The same holds for a call
        that was under way when the robot restarted. While what was set is being set again, calls wait, except ``stop``.

        Raises:
            ReplyTimeout: No answer, or no link, in time.
            LinkLost: The link broke under the call, is down and ``during_gap`` is ``fail``, or was given up.
            LinkClosed: The robot was closed.
        """
        deadline = self._loop.time() + timeout
        if request.halts:
            self.forget_speed()  # whatever becomes of it: the program wants the wheels to stand
        while True:
            if self.error is not None or not self._is_up.is_set():
                await self._wait_for_link(request, deadline)
            if self._restoring is not None and not request.is_urgent:
                await self._wait_for_restoring(request, self._restoring, deadline)
                continue
            session = self._session
            call: Call[T] | None = None
            try:
                call = session.submit(request, max(0.0, deadline - self._loop.time()))
                return await session.outcome(call)
            except LinkLost:
                self._on_down(session)
                if call is not None and not math.isnan(call.sent) and not (request.only_reads or request.is_urgent):
                    raise
            except (ReplyTimeout, RemoteProtocolError):
                may_repeat = request.only_reads or request.is_urgent
                if call is None or not call.saw_reset or not may_repeat or self._loop.time() >= deadline:
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
            raise self._unsent(request, f"the link to {self._url} did not come back in time") from None
        self._check_alive(request)

    async def _wait_for_restoring(self, request: Request[T], restoring: asyncio.Task[None], deadline: float) -> None:
        await asyncio.wait({restoring}, timeout=max(0.0, deadline - self._loop.time()))
        if not restoring.done():
            raise self._unsent(request, "the robot restarted, and what was set before was not restored in time")

    def _unsent(self, request: Request[T], reason: str) -> ReplyTimeout:
        self._session.counter.unsent += 1
        return ReplyTimeout(f"{request} was never sent: {reason}", request=str(request))

    def _check_alive(self, request: Request[T]) -> None:
        if self.error is not None:
            raise about(request, self.error)

    def _adopt(self, session: Session) -> None:
        self._session = session
        session.hooks = self.hooks
        sensors, images = self._streams
        session.stream(sensors=sensors, images=images)
        self.hooks.call(self._loop.time(), SessionOpened(session.opening, session.counters))

    def _watch(self, time: float, event: TraceEvent) -> None:
        """Follow the events of the newest session."""
        match event:
            case Ending(error=error) if not isinstance(error, LinkClosed):
                self._on_down(self._session)
            case Greeted():
                self._notice_reset("greeting")
            case Ended(value=value) if (steps := steps_in(value)) is not None:
                self._check_steps(steps)
            case Ended(error=None, request=request):
                if request.name == "set_encoders":  # on purpose: the readings before it do not count
                    self._has_lost_steps = False
                    stamp = self._session.context.stamp
                    self._steps = Steps(*request.numbers, **stamp) if request.numbers else None  # a text without them
                elif request.name == "reset":
                    self._steps = None
                if self._restoring is not None and request is not self.restoring:
                    # The robot took it after its restart: it is newer than what was kept.
                    request.confirmed(replace(self._session.context, last_set=self._memory))
            case _:
                pass

    def _check_steps(self, steps: Steps) -> None:
        """Notice a restart: counters that fell back to about 0 faster than wheels can turn."""
        if self.restoring is not None or self._restoring is not None:
            return
        before, self._steps = self._steps, steps
        if before is None:
            return
        if fell_back(before, steps):
            self._steps = before
            self._notice_reset("encoders")

    def _notice_reset(self, sign: str) -> None:
        """Restore what was set before; a restoration under way begins again."""
        self._has_restarted = self._has_lost_steps = True
        if self._restoring is None and self._is_up.is_set():
            self._keep_memory()  # the context is about to forget it
            self.hooks.call(self._loop.time(), ResetNoticed(sign))
            self._restoring = self._loop.create_task(self._restore_after_reset(), name=f"elib restoring {self._url}")

    def _keep_memory(self) -> None:
        """Keep what is set now, to restore it; but what a restoration has not finished yet stays as it is."""
        if self._restoring is None:
            self._memory = copy.deepcopy(self._session.context.last_set)

    async def _restore_after_reset(self) -> None:
        session = self._session
        try:
            await self._restore(session)
        except LinkError:
            pass  # the link is lost, and is being reopened
        except ElibError as error:
            failed = LinkLost(f"what was set before the robot restarted could not be set again: {error.message}")
            log.warning("%s: %s; the link is opened again to try it once more", self._url, failed.message)
            session.lose(failed)
        finally:
            self._restoring = None

    def _on_down(self, session: Session) -> None:
        if session is not self._session or not self._is_up.is_set() or self.error is not None:
            return
        self._is_up.clear()
        self._keep_memory()
        error = session.error or LinkLost(f"the link to {self._url} is gone")
        if isinstance(error, ReplayDiffers):
            self._give_up(error)  # to open it again would not help
            return
        self.hooks.call(self._loop.time(), Disconnected(error))
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
            except Exception as error:
                lost = LinkLost(
                    f"{self._url} could not be opened again: {error!r}",
                    hint="this is a defect of elib; please report it",
                )
                self._give_up(lost)
                raise
            else:
                self._task = None
                self._is_up.set()
                self.hooks.call(self._loop.time(), Reconnected(self._loop.time() - began, attempts))
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
        self.hooks.call(self._loop.time(), Ending(error))

    def _check_identity(self, session: Session) -> None:
        """Refuse a robot with another firmware: the calls that wait were made for this one."""
        if session.profile.name != self._firmware:
            raise LinkLost(
                f"another robot answers on {self._url}: {session.profile.name}, not {self._firmware}",
                hint="is the address or the port right?",
            )

    async def _restore(self, session: Session) -> None:
        """Set on *session* what was set before: wheels first, lamps after the camera, which switches them off.

        From the beginning if the robot restarts meanwhile.

        Raises:
            LinkError: The link is lost.
            ReplyTimeout, RemoteProtocolError: The robot did not take one of the commands, however often it was sent.
        """

        async def do(name: str, *args: object) -> object:
            request: Request[object] = SPECS[name].request(session.context, *args)
            self.restoring = request
            for left in reversed(range(RESTORING_TRIES)):
                try:
                    return await session.execute(request, max(RESTORING_TIME, session.stopping_time))
                except (ReplyTimeout, RemoteProtocolError):
                    if not left:
                        raise
            raise AssertionError

        self._has_restarted = True
        try:
            while self._has_restarted:
                self._has_restarted = False
                if self._policy.keep_speed:
                    await do("set_speed", *(speed / STEPS_PER_REVOLUTION for speed in self._memory.speed))
                else:
                    await do("stop")
                steps = None if self._steps is None else await do("encoders")
                if self._steps is not None and isinstance(steps, Steps):
                    was_noticed = self._has_lost_steps
                    is_set = tuple(steps) == tuple(self._steps)  # by a try whose answer was lost
                    if (was_noticed and not is_set) or fell_back_over_gap(self._steps, steps):
                        bits = session.profile.counter_bits
                        left, right = (wrapped(new + old, bits) for new, old in zip(steps, self._steps, strict=True))
                        self._steps, self._has_lost_steps = replace(steps, left=left, right=right), False
                        await do("set_encoders", left, right)
                        if not was_noticed:
                            self.hooks.call(self._loop.time(), ResetNoticed("encoders"))
                    else:
                        self._steps = steps
                self._has_lost_steps = self._has_lost_steps and self._has_restarted
                for name, arguments in restoring_calls(self._memory):
                    try:
                        await do(name, *arguments)
                    except (ArgumentError, Unsupported) as error:  # another program set it, or a text command
                        log.warning("%s: %s() is not restored: %s", self._url, name, error.message)
        finally:
            self.restoring = None
