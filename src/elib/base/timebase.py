"""Event loops with a time of their own: simulated, k times real time, or real; :func:`new_loop` makes them.

User code uses plain ``asyncio.sleep`` and ``asyncio.timeout``; the loop decides how long a second is.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import select
import selectors
import sys
import threading
import time
import weakref
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Any, Literal, Self, TypeVar, TypeVarTuple, cast

from elib.base.errors import ArgumentError, SimulationError, SimulationStalled


@dataclass(frozen=True, slots=True)
class Paced:
    """The speed of simulated time that waits for the wall clock."""

    factor: float = 1.0  # seconds of loop time in one second of real time


class LoopMaker(ABC):
    """A time of another kind, for which a URL's scheme brings the event loops itself."""

    @abstractmethod
    def make(self) -> asyncio.AbstractEventLoop:
        """Return a new event loop that keeps this time."""


Speed = Literal["real", "max"] | float
"""How fast time runs: with the wall clock, as fast as the processor allows, or this many times real time."""
LoopSpeed = Speed | Paced | LoopMaker
"""The speed for which a loop is made."""

# Beyond 1000, one scheduling delay of the system (0.1 ms) would be 0.1 s of robot time.
SLOWEST, FASTEST = 0.001, 1000.0

_T = TypeVar("_T")
_Ts = TypeVarTuple("_Ts")


class Host(ABC):
    """What Python runs inside of where that has one thread and no sockets, such as a page in a browser.

    Only it knows how to wait: the page has to go on meanwhile.
    """

    def __init__(self) -> None:
        self.speed = 1.0  # how many times faster than they were made event loops run; infinite for as fast as possible
        # what runs the event loops of robots whose program does not: each has a `call` and a `loop`
        self.portals: weakref.WeakSet[Any] = weakref.WeakSet()

    @abstractmethod
    def wait(self, seconds: float) -> None:
        """Let everything else go on for so long, s of the wall clock; with 0 only if it has not for a while.

        Raises:
            KeyboardInterrupt: The program is to end, and waits in no call of elib that could end by itself.
        """


_host: Host | None = None


def host() -> Host | None:
    """Return what Python runs inside of; None on a computer, which has threads."""
    return _host


def move_into(place: Host | None) -> None:
    """Let all event loops that are made from now on, and all that waits, be in *place*."""
    global _host
    _host = place


@contextlib.contextmanager
def outside(loop: asyncio.AbstractEventLoop | None = None) -> Iterator[None]:
    """Leave the event loop and the task that run in this thread, while the block lasts, so that others can run in it.

    Args:
        loop: The loop that counts as running meanwhile.
    """
    here = asyncio._get_running_loop()
    task = None if here is None else asyncio.current_task(here)
    if here is not None and task is not None:
        asyncio.tasks._leave_task(here, task)
    asyncio._set_running_loop(loop)
    try:
        yield
    finally:
        asyncio._set_running_loop(here)
        if here is not None and task is not None:
            asyncio.tasks._enter_task(here, task)


def new_loop(speed: LoopSpeed) -> asyncio.AbstractEventLoop:
    """Make an event loop whose time runs at *speed*; the caller runs and closes it.

    Args:
        speed: ``"real"``, ``"max"`` (simulated time that jumps), a factor from 0.001 to 1000, ``Paced(factor)``, or
            what makes the loop.

    Raises:
        ArgumentError: *speed* is none of these.
    """
    match speed:
        case LoopMaker():
            return speed.make()
        case _ if _host is not None:
            return HostedLoop(_host, _factor(speed))
        case "max":
            return SimulatedLoop()
        case "real":
            return RealLoop()
        case Paced(factor):
            return PacedLoop(check_factor(factor))
        case _:
            return ScaledLoop(check_factor(speed))


def _factor(speed: LoopSpeed) -> float:
    """Return seconds of loop time in one second of the wall clock; infinite for as fast as possible."""
    if isinstance(speed, Paced):
        speed = speed.factor
    return math.inf if speed == "max" else 1.0 if speed == "real" else check_factor(cast("float", speed))


def running_loop() -> asyncio.AbstractEventLoop | None:
    """Return the event loop that runs in this thread, or None."""
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None


def require_speed(speed: LoopSpeed) -> None:
    """Check that the running event loop runs at *speed*; ``"real"`` means as the loop does.

    Raises:
        SimulationError: The running loop has another speed.
    """
    loop = asyncio.get_running_loop()
    if isinstance(loop, PacedLoop) and loop.factor == _factor(speed):
        return
    if isinstance(speed, Paced):
        speed = "real" if speed.factor == 1.0 else speed.factor
    if speed == "real" or (speed == "max" and isinstance(loop, SimulatedLoop)):
        return
    if isinstance(loop, ScaledLoop) and loop.factor == speed:
        return
    runs = "simulated time" if isinstance(loop, SimulatedLoop) else "real time"
    if isinstance(loop, ScaledLoop):
        runs = f"{loop.factor:g} times real time"
    raise SimulationError(
        f"speed={speed} needs an event loop made for it, but this one runs in {runs}",
        hint="let elib.connect(), elib.run() or the command elib run FILE.py --robot URL make it, or leave speed out",
    )


def require_real_time(what: str) -> None:
    """Refuse *what* on a loop whose time jumps: it would time out before anything outside could answer.

    Raises:
        SimulationError: The running loop is a :class:`SimulatedLoop`.
    """
    if isinstance(asyncio.get_running_loop(), SimulatedLoop):
        raise SimulationError(
            f"{what} works in real time, but this event loop simulates time and never waits for anything outside",
            hint="use speed=real, or let elib.run() or elib.connect() choose the loop",
        )


class Hold:
    """Forbids a :class:`SimulatedLoop` to jump while a thread outside the loop works.

    A thread acquires it before it works, and releases it while it waits. Code that hands a result to a waiting thread
    acquires the hold for it *first*, on the loop's thread, or time could jump before the thread wakes up. Both methods
    may be called from any thread, and twice.
    """

    __slots__ = ("_is_held", "_loop")

    def __init__(self, loop: SimulatedLoop) -> None:
        self._loop = loop
        self._is_held = False

    def acquire(self) -> None:
        """Let no time pass from now on."""
        with self._loop._lock:
            self._loop._holds += not self._is_held
            self._is_held = True

    def release(self) -> None:
        """Let time pass again, unless another hold is acquired."""
        with self._loop._lock:
            self._loop._holds -= self._is_held
            self._is_held = False
        with contextlib.suppress(RuntimeError):  # a closed loop needs no waking
            self._loop.call_soon_threadsafe(_wake_up)

    def __enter__(self) -> Self:
        self.acquire()
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def _wake_up() -> None:
    """Do nothing: being called ends the loop's wait."""


def in_thread(function: Callable[[], _T], name: str) -> Future[_T]:
    """Call a function in a new thread, for which the end of the program does not wait, and return its future."""
    outcome: Future[_T] = Future()
    outcome.set_running_or_notify_cancel()

    def run() -> None:
        try:
            outcome.set_result(function())
        except BaseException as error:
            outcome.set_exception(error)

    threading.Thread(target=run, name=name, daemon=True).start()
    return outcome


class _JobLoop(asyncio.BaseEventLoop):
    """An event loop that takes jobs after the main thread has ended, too, when Python's pools of threads take none."""

    def run_in_executor(self, executor: Executor | None, func: Callable[[*_Ts], _T], *args: *_Ts) -> asyncio.Future[_T]:
        """Run *func* in a thread."""
        try:
            return super().run_in_executor(executor, func, *args)
        except RuntimeError:
            if executor is not None or threading.main_thread().is_alive() or self.is_closed():
                raise
        return asyncio.wrap_future(in_thread(lambda: func(*args), "elib job"), loop=self)


class SimulatedLoop(_JobLoop, asyncio.SelectorEventLoop):
    """An event loop in simulated time: when nothing is ready it jumps exactly to the next timer.

    Time starts at 0.0 s and stands still while code runs, so a slow program gives the same result as a fast
    one. It does not jump while an executor job runs (``asyncio.to_thread``), while a :class:`Hold` is
    acquired, or while :attr:`may_jump` returns False. When every task
    waits, no timer is set and nothing outside can wake it, running the loop raises
    :class:`~elib.SimulationStalled`.
    """

    _scheduled: list[asyncio.TimerHandle]  # asyncio's own heap of timers
    _clock_resolution: float

    def __init__(self) -> None:
        # called before each jump, if set. When its answer has become True, the loop asks again within HELD_PERIOD, or
        # at once if it is woken by `call_soon_threadsafe`.
        self.may_jump: Callable[[], bool] | None = None
        self.turned = time.monotonic()  # when it last began a turn, s of the wall clock
        self._now = 0.0
        self._holds = 0
        self._jobs = 0
        self._lock = threading.Lock()
        self._files = self._selector()
        super().__init__(self._files)
        self._own_files = len(self._files.get_map())
        self._set_time(0.0)

    def _selector(self) -> _JumpingSelector:
        return _JumpingSelector(self)

    def time(self) -> float:
        """Return the simulated time, s since the loop was made."""
        return self._now

    def hold(self) -> Hold:
        """Return a new hold, not yet acquired; ``with loop.hold():`` acquires it."""
        return Hold(self)

    def run_in_executor(self, executor: Executor | None, func: Callable[[*_Ts], _T], *args: *_Ts) -> asyncio.Future[_T]:
        """Run *func* in a thread; no time passes until its result was delivered."""
        job = super().run_in_executor(executor, func, *args)
        self._jobs += 1
        job.add_done_callback(self._job_is_done)
        return job

    async def shutdown_default_executor(self, timeout: float | None = None) -> None:
        """Wait for the threads of the default executor, as long as they take.

        Args:
            timeout: Ignored: it could never expire, because no simulated time passes here.
        """
        with self.hold():
            await super().shutdown_default_executor()

    def _job_is_done(self, _: asyncio.Future[_T]) -> None:
        self._jobs -= 1

    def _set_time(self, now: float) -> None:
        self._now = now
        # asyncio runs timers before `now + resolution`; one unit in the last place makes that exactly `now`.
        self._clock_resolution = math.ulp(now)

    def _is_held(self) -> bool:
        return self._holds > 0 or self._jobs > 0 or (self.may_jump is not None and not self.may_jump())

    def _wait(self) -> float:
        """Return how long to wait for events from outside before the next jump, s of the wall clock."""
        return 0.0

    def _jump(self) -> bool:
        """Go to the next timer; return False if there is none but a file may still wake the loop."""
        if self._scheduled:
            self._set_time(self._scheduled[0].when())
            return True
        if len(self._files.get_map()) > self._own_files:
            return False
        raise SimulationStalled(
            f"simulated time stands still at {self._now:.6g} s: every task waits and no timer is set\n"
            + _waiting(self),
            hint="put a timeout around what may never happen; real threads and sockets need speed=real",
        )


class PacedLoop(SimulatedLoop):
    """A :class:`SimulatedLoop` that jumps to a timer only when the wall clock has reached it.

    Programs on it take as long as in real time, and yet give the same result each time: neither computing nor a system
    that is late takes any of its time.

    Args:
        factor: Seconds of loop time in one second of the wall clock, 0.001 to 1000.
    """

    def __init__(self, factor: float = 1.0) -> None:
        self.factor = factor
        self._due = -math.inf
        super().__init__()
        self._due = self._wall

    @property
    def _wall(self) -> float:
        return asyncio.SelectorEventLoop.time(self)

    @property
    def _rate(self) -> float:
        return self.factor

    def _wait(self) -> float:
        if not self._scheduled:
            return 0.0
        return self._due + (self._scheduled[0].when() - self._now) / self._rate - self._wall

    def _set_time(self, now: float) -> None:
        self._due = max(self._due + (now - self._now) / self._rate, self._wall - CATCHING_UP)
        super()._set_time(now)


class HostedLoop(PacedLoop):
    """A :class:`PacedLoop` for a place with one thread and no sockets: only its own timers and the host wake it.

    Args:
        place: Where it runs.
        factor: Seconds of loop time in one second of the wall clock, 0.001 to 1000, or infinite.
    """

    _ready: deque[asyncio.Handle]

    def __init__(self, place: Host, factor: float = 1.0) -> None:
        self.place = place
        super().__init__(factor)

    def run_in_executor(self, executor: Executor | None, func: Callable[[*_Ts], _T], *args: *_Ts) -> asyncio.Future[_T]:
        """Run *func* now: there is no other thread."""
        job: asyncio.Future[_T] = self.create_future()
        try:
            job.set_result(func(*args))
        except Exception as error:
            job.set_exception(error)
        return job

    def _selector(self) -> _JumpingSelector:
        return _HostedSelector(self)

    @property
    def _rate(self) -> float:
        return self.factor * self.place.speed

    def _creep(self) -> None:
        """Let time pass as the wall clock does, short of the next timer, for those who look at the world meanwhile."""
        passed = (self._wall - self._due) * self._rate
        if self._scheduled and 0 < passed < self._scheduled[0].when() - self._now:
            self._set_time(self._now + passed)

    # No other thread can wake it, so it needs no pair of sockets for that.
    def _make_self_pipe(self) -> None: ...

    def _close_self_pipe(self) -> None: ...

    def _write_to_self(self) -> None: ...


if sys.platform == "win32":
    _NativeLoop = asyncio.ProactorEventLoop  # serial ports work on no other loop there
else:

    class _NativeLoop(asyncio.SelectorEventLoop):
        def __init__(self) -> None:
            super().__init__(_PreciseSelector())


class RealLoop(_JobLoop, _NativeLoop):
    """An event loop in real time, which begins at 0.0 s as simulated time does."""

    def __init__(self) -> None:
        super().__init__()
        self._start = super().time()

    def time(self) -> float:
        """Return the time, s since the loop was made."""
        return super().time() - self._start


class ScaledLoop(_JobLoop, asyncio.SelectorEventLoop):
    """An event loop whose time runs *factor* times real time; files and sockets work as usual.

    Args:
        factor: Seconds of loop time in one second of the wall clock, 0.001 to 1000.
    """

    def __init__(self, factor: float) -> None:
        self.factor = factor
        super().__init__(_PreciseSelector(self.factor))
        self._start = super().time()

    def time(self) -> float:
        """Return the scaled time, s since the loop was made."""
        return (super().time() - self._start) * self.factor


def parse_speed(speed: str | float) -> Speed:
    """Return *speed* as ``"real"``, ``"max"`` or a factor.

    Raises:
        ArgumentError: *speed* is none of these, or the factor is not from 0.001 to 1000.
    """
    if speed == "real":
        return "real"
    if speed == "max":
        return "max"
    return check_factor(speed)


def check_factor(factor: str | float) -> float:
    """Return *factor* as a number of times real time.

    Raises:
        ArgumentError: *factor* is not a number from 0.001 to 1000.
    """
    try:
        number = float(factor)
    except (TypeError, ValueError):
        number = math.nan
    if not SLOWEST <= number <= FASTEST:
        raise ArgumentError(
            f"speed is {factor!r}; it must be 'real', 'max' or a factor from {SLOWEST:g} to {FASTEST:g}",
            hint="speed=max is as fast as this computer can",
        )
    return number


SELECTABLE = 1024
"""``select`` can wait only for files below this number."""
COARSE = 0.02
"""s. A longer wait may end a millisecond late, and takes one system call less."""
MAX_WAIT = 0.5
"""s that a loop waits at once: a signal that comes right before a wait is handled only after it, in all of Python."""
HELD_PERIOD = 0.05
"""s between two looks of a simulated loop at whether time may move again, unless it is woken."""
LOOK_TIME = 0.02
"""s for which a :class:`HostedLoop` waits at once, so that a page sees its world move."""
CATCHING_UP = 0.1
"""s that a :class:`PacedLoop` that is late can catch up. A longer delay, as in a debugger, is not caught up."""


class _PreciseSelector(selectors.DefaultSelector):
    """A selector whose waits are exact to the microsecond.

    ``epoll`` rounds a wait up to whole milliseconds: 12 bytes of the robot's line, or 0.1 s of a loop that runs 100
    times faster. ``select`` on the poller's own descriptor does not.
    """

    def __init__(self, factor: float = 1.0) -> None:
        super().__init__()
        self._factor = factor

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        timeout = MAX_WAIT if timeout is None else min(timeout / self._factor, MAX_WAIT)
        is_exact = timeout > 0 and (timeout < COARSE or self._factor > 1)
        if is_exact and hasattr(self, "fileno") and self.fileno() < SELECTABLE:
            select.select([self.fileno()], [], [], timeout)
            timeout = 0
        return super().select(timeout)


_look = selectors.DefaultSelector.select
"""Looks for events, without a wait or for a time that need not be exact."""


class _JumpingSelector(_PreciseSelector):
    """A selector that makes the time of its loop jump to the next timer instead of waiting for it."""

    def __init__(self, loop: SimulatedLoop) -> None:
        super().__init__()
        self._loop = loop

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        try:
            ready = _look(self, 0)
            if ready or (timeout is not None and timeout <= 0):
                return ready
            if self._loop._is_held():
                return _look(self, HELD_PERIOD)
            # A thread that released its hold after the first select may have handed something in before: take that
            # first.
            wait = self._loop._wait()
            ready = super().select(wait) if wait > 0.0 else _look(self, 0)
            if not ready and wait <= MAX_WAIT and not self._loop._jump():
                return _look(self, MAX_WAIT)
            return ready
        finally:
            self._loop.turned = time.monotonic()


class _HostedSelector(_JumpingSelector):
    """The same where only the host can wait."""

    _loop: HostedLoop

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        loop = self._loop
        loop.turned = time.monotonic()
        if timeout is not None and timeout <= 0:
            loop.place.wait(0.0)
            return []
        wait = loop._wait()
        while wait > LOOK_TIME and not loop._ready:
            loop.place.wait(LOOK_TIME)
            loop._creep()
            wait = loop._wait()
        if not loop._ready:
            loop.place.wait(max(0.0, wait))
        if loop._ready:  # the host has handed in something meanwhile
            loop._creep()
        else:
            loop._jump()
        return []


def _waiting(loop: asyncio.AbstractEventLoop) -> str:
    """Name the waiting tasks and where each one waits, a line each."""
    tasks = sorted(asyncio.all_tasks(loop), key=lambda task: task.get_name())
    return "\n".join(f"  {task.get_name()} waits in {_place(task)}" for task in tasks) or "  there is no task"


def _place(task: asyncio.Task[object]) -> str:
    """Follow the chain of awaits: the caller's own function first, what it waits for last."""
    awaited: object = task.get_coro()
    places: list[str] = []
    while (frame := getattr(awaited, "cr_frame", None)) is not None:
        file = frame.f_code.co_filename.replace("\\", "/").rpartition("/")[2]
        places.append(f"{frame.f_code.co_qualname} ({file}:{frame.f_lineno})")
        awaited = getattr(awaited, "cr_await", None)
    return " > ".join(places) or "unknown"
