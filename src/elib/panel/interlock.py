"""The interlock between a behaviour and the panel's robot: a person can pause the behaviour.

While it is paused, no command of the behaviour but ``stop`` reaches the robot, and its own sleeps last longer by that
time. The behaviour does not see what the panel tells the robot meanwhile, so a motion that it measures by the
step counters goes on where it was.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import enum
import threading
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from elib.base.errors import ElibError, LinkClosed
from elib.base.timebase import Hold, SimulatedLoop
from elib.link.protocol.styles import Action
from elib.link.protocol.table import Command, Request
from elib.link.session import Called, Channel, Ended, ForwardingChannel, Hooks, TraceEvent, check_timeout
from elib.panel.drivelock import DriveLock
from elib.robot.aio import Epuck
from elib.robot.callbacks import CallbackPool
from elib.robot.link import Link, LinkSettings
from elib.robot.portal import Portal
from elib.robot.reconnect import Policy

T = TypeVar("T")

WHEELS = ("set_speed", "stop")
ENDED = "the behaviour was ended"
RESUMING_TIME = 1.0
"""s within which the robot has to confirm the speed that it had before a pause."""


class Passage(enum.Enum):
    """What passes an interlock."""

    OPEN = "every command passes"
    PAUSED = "stop passes; other commands wait"
    ENDED = "stop passes; other commands end in LinkClosed"


class Interlock(ForwardingChannel):
    """The channel to the robot that a behaviour uses."""

    def __init__(self, channel: Channel, drive: DriveLock) -> None:
        self.hooks = Hooks()
        self.passage = Passage.OPEN  # what passes
        self._session = channel
        self._drive = drive
        self._speed: Request[Any] | None = None
        self._not_paused, self._not_open = asyncio.Event(), asyncio.Event()
        self._not_paused.set()
        channel.hooks.append(self._see)

    # -- the interlock --

    @property
    def is_paused(self) -> bool:
        """Whether the commands of the behaviour wait."""
        return self.passage is Passage.PAUSED

    def pause(self) -> None:
        """Let only ``stop`` pass; other commands wait."""
        if self.passage is Passage.OPEN:
            self.passage = Passage.PAUSED
            self._not_paused.clear()
            self._not_open.set()

    async def resume(self) -> None:
        """Set the wheels as before the pause, then let all commands pass.

        If the robot does not confirm the speed, that is raised, and the behaviour stays paused.
        """
        if self.is_paused and self._speed is not None:
            self._drive.note_move()
            await self._session.execute(self._speed, RESUMING_TIME)
        if self.is_paused:
            self.passage = Passage.OPEN
            self._not_open.clear()
            self._not_paused.set()

    def end(self) -> None:
        """Let only ``stop`` pass from now on: other calls end in LinkClosed. Safe to repeat."""
        if self.passage is not Passage.ENDED:
            self.passage = Passage.ENDED
            self._not_paused.set()
            self._not_open.set()
            self._session.hooks.remove(self._see)

    async def sleep(self, seconds: float) -> None:
        """Wait so many seconds, not counting the time for which the behaviour is paused."""
        loop = asyncio.get_running_loop()
        left = check_timeout(seconds)
        await self._wait()
        while left > 0:
            began = loop.time()
            try:
                async with asyncio.timeout(left):
                    await self._not_open.wait()
            except TimeoutError:
                left = 0.0
            else:
                left -= loop.time() - began
            await self._wait()

    async def _wait(self) -> None:
        while self.is_paused:
            await self._not_paused.wait()
        if self.passage is Passage.ENDED:
            raise LinkClosed(ENDED)

    def _see(self, time: float, event: TraceEvent) -> None:
        if self.is_paused and isinstance(event, Called | Ended) and event.request.name in WHEELS:
            return
        self.hooks.call(time, event)

    # -- the channel --

    @property
    def error(self) -> ElibError | None:
        """Why the channel ended for good, or None."""
        return LinkClosed(ENDED) if self.passage is Passage.ENDED else self._session.error

    def forget_speed(self) -> None:
        """Do nothing: the panel's own robot restores no speed after the link was lost."""

    async def execute(self, request: Request[T], timeout: float) -> T:
        """Send *request* in its turn, and return its answer. ``stop`` always passes."""
        is_stop = request.name == "stop"
        if not is_stop:
            await self._wait()
        is_moving = request.name == "text" or (request.name == "set_speed" and any(request.numbers))
        if request.name in WHEELS:
            self._speed = request if is_moving else None
        if is_moving:
            self._drive.note_move()
        moves = self._drive.move_count
        answer = await self._session.execute(request, timeout)
        # While the behaviour was paused or ended, others may have driven.
        if request.name in WHEELS and not is_moving and not self.is_paused and not (is_stop and self._drive.driver):
            self._drive.note_rest(moves)
        return answer

    async def execute_last(self, request: Request[T], timeout: float) -> T:
        """Send *request* and end the interlock; the panel's link stays open."""
        self.end()
        return await self._session.execute(request, timeout)

    async def close(self) -> None:
        """End the interlock; the panel's link stays open."""
        self.end()

    def send_unqueued(self, data: bytes) -> bool:
        """Send nothing: the panel stops the robot itself."""
        return False


class ProxiedRobot(Epuck):
    """The robot that a behaviour gets: the panel's robot with its own odometry, events and records."""

    def __init__(self, robot: Epuck, interlock: Interlock) -> None:
        link = Link(robot.url, robot.name, LinkSettings(keep_moving=True, policy=Policy()))
        link.session, link.loop = interlock, asyncio.get_running_loop()
        link.counter = robot._link.counter  # noqa: SLF001  # calls of both count on the same link
        link.motion.follow(interlock)
        super().__init__(link)
        self._interlock = interlock

    def _call(
        self, operation: Command[Any, Any] | Action[Any, Any], args: tuple[Any, ...], kwargs: dict[str, Any]
    ) -> Any:
        if operation.name == "sleep":
            return self._interlock.sleep(*args, **kwargs)
        return super()._call(operation, args, kwargs)


class Bridge(Portal):
    """A portal into the panel's running event loop, for a behaviour in the blocking style.

    In simulated time, which tests use, the clock stands still while a thread of the behaviour works.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        # The base class would make and run a loop and take signals: here the panel's program does all that.
        self.loop = loop
        self.is_closed = False
        self.before_close = None
        self._pool = CallbackPool()
        self._thread_ident = threading.get_ident()
        self._local = threading.local()

    def hold(self) -> Hold | None:
        """Return a hold on simulated time, acquired; None in real time."""
        if not isinstance(self.loop, SimulatedLoop):
            return None
        hold = self.loop.hold()
        hold.acquire()
        return hold

    def run(self, function: Callable[[], None], hold: Hold | None) -> None:
        """Run *function* on this thread, which owns *hold* and releases it at the end."""
        self._local.hold = hold
        try:
            function()
        finally:
            self._local.hold = None
            if hold is not None:
                hold.release()

    def call(self, coroutine: Coroutine[Any, Any, T], *, is_last: bool = False) -> T:
        """Run *coroutine* in the loop and return its result."""
        if threading.get_ident() == self._thread_ident:
            coroutine.close()
            raise RuntimeError("a blocking call in the panel's own event loop would wait for ever")
        hold: Hold | None = getattr(self._local, "hold", None)
        future = self.begin(coroutine if hold is None else _released(hold, coroutine))
        try:
            return future.result()
        except concurrent.futures.CancelledError:
            raise LinkClosed("the call was cancelled") from None

    def begin(self, coroutine: Coroutine[Any, Any, T]) -> concurrent.futures.Future[T]:
        """Let *coroutine* run in the loop and return its future at once."""
        if self.is_closed:
            coroutine.close()
            raise LinkClosed("the behaviour was ended")
        return asyncio.run_coroutine_threadsafe(coroutine, self.loop)

    def later(self, function: Callable[[], None], name: str) -> None:
        """Run *function* on another thread; it may block or raise without harm to the link."""
        hold = self.hold()
        self._pool.put(lambda: self.run(function, hold), name)

    def leave(self) -> None:
        """Let the behaviour close its robot, then take no more calls."""
        if not self.is_closed:
            try:
                if self.before_close is not None:
                    self.call(self.before_close())
            finally:
                self.close()

    def close(self) -> None:
        """Take no more calls."""
        self.is_closed = True
        self._pool.close()


async def _released(hold: Hold, coroutine: Coroutine[Any, Any, T]) -> T:
    """Let time pass while a thread waits for *coroutine*; both changes are made on the loop's own thread."""
    hold.release()
    try:
        return await coroutine
    finally:
        coroutine.close()
        hold.acquire()
