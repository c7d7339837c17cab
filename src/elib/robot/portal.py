"""From ordinary threads into the event loop: the ground under the blocking, begin and callback faces.

A thread of the portal's own runs the loop, and lends it to a thread that calls, for as long as that waits. In simulated
time the loop runs on the caller's thread alone, so time moves only while the caller waits; when a second thread calls,
or where a loop already runs (a notebook), the portal's thread takes over, and time jumps only while every caller waits.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import logging
import threading
import time
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from elib.errors import ElibError, LinkClosed, LinkLost, SimulationStalled
from elib.robot.callbacks import CALLBACK_THREADS, CallbackPool
from elib.robot.signals import SIGNALS
from elib.timebase import SimulatedLoop, Speed, new_loop

T = TypeVar("T")

PATIENCE = 0.05
"""s of real time for which simulated time stands still while a thread that has called works on. After that it may
jump: the thread waits for something else, perhaps for the very thread that calls now."""
LOAN = 0.005
"""s of real time after its last call for which a thread keeps the loop: one that polls need not fetch it each time."""
CLOSING_TIME = 5.0
"""s of real time in which a portal must come to an end."""

log = logging.getLogger("elib")


class Caller:
    """A thread that has called, and when it was last given something to work on."""

    __slots__ = ("seen", "thread")

    def __init__(self, thread: threading.Thread) -> None:
        self.thread = thread
        self.seen = time.monotonic()


class Portal:
    """One event loop, entered from any thread.

    Args:
        speed: How fast the loop's time runs.
    """

    def __init__(self, speed: Speed) -> None:
        self.loop = new_loop(speed)
        self._is_simulated = isinstance(self.loop, SimulatedLoop)
        self._lock = threading.RLock()
        self._baton = threading.Lock()
        """Whoever holds it runs the loop."""
        self._thread: threading.Thread | None = None
        self._thread_runs = False
        self._borrower: int | None = None
        self._last_use = 0.0
        self._take_back = threading.Event()
        self._inline_task: asyncio.Task[Any] | None = None
        self._interruption: BaseException | None = None
        self._main_depth = 0
        self._foreign = 0
        self.is_closed = False
        self._callers: dict[int, Caller] = {}
        self._waiting: set[int] = set()
        self._stalled: SimulationStalled | None = None
        self._must_end = False
        self._alarm: threading.Timer | None = None
        self._death: BaseException | None = None
        self._pool = CallbackPool(self._wake)
        self.last_will: Callable[[], Coroutine[Any, Any, None]] | None = None
        if isinstance(self.loop, SimulatedLoop):
            self.loop.may_jump = self._may_jump
        if not self._is_simulated or _a_loop_runs_here():
            self._start_thread()
        SIGNALS.watch(self)

    # -- calls --

    def call(self, coroutine: Coroutine[Any, Any, T]) -> T:
        """Run *coroutine* in the loop and wait for its outcome. Ctrl-C cancels it."""
        return self._attend(lambda: self._call(coroutine))

    def _call(self, coroutine: Coroutine[Any, Any, T]) -> T:
        if self.is_closed:
            coroutine.close()
            raise LinkClosed("the robot was closed", hint="open a new connection")
        try:
            is_mine = self._borrow()
        except RuntimeError:
            coroutine.close()
            raise
        if not is_mine:
            return self._wait_elsewhere(self.start(coroutine), None)
        try:
            return self._run_here(self.loop.create_task(coroutine))
        finally:
            self._give_back()

    def _attend(self, wait: Callable[[], T]) -> T:
        """Run *wait*; in the main thread, with signals held back until a safe place."""
        if threading.current_thread() is not threading.main_thread():
            return wait()
        # A signal that comes while the main thread is in here is noted and raised at a safe place, below: raised in the
        # middle it could hit a finaliser, where Python swallows it.
        self._main_depth += 1
        try:
            return wait()
        finally:
            self._main_depth -= 1
            if self._main_depth == 0:
                self._raise_interruption()

    def start(self, coroutine: Coroutine[Any, Any, T]) -> concurrent.futures.Future[T]:
        """Let *coroutine* run in the loop and return its future at once."""
        with self._lock:
            if self.is_closed:
                coroutine.close()
                raise LinkClosed("the robot was closed", hint="open a new connection")
            return asyncio.run_coroutine_threadsafe(coroutine, self.loop)

    def wait(self, future: concurrent.futures.Future[T], timeout: float | None = None) -> T:
        """Wait for *future* and return its result.

        Args:
            future: From :meth:`start`.
            timeout: Seconds of the robot's time, or None for as long as the call itself may take.

        Raises:
            TimeoutError: *timeout* passed; the call goes on.
        """
        return self._attend(lambda: self._wait(future, timeout))

    def _wait(self, future: concurrent.futures.Future[T], timeout: float | None) -> T:
        if not self._borrow():
            return self._wait_elsewhere(future, timeout)
        try:
            self._run_here(self.loop.create_task(self._await(future, timeout)))
        finally:
            self._give_back()
        if not future.done():
            raise TimeoutError(f"no outcome within {timeout:g} s; the call goes on")
        return _outcome(future)

    async def _await(self, future: concurrent.futures.Future[T], timeout: float | None) -> None:
        outcome = asyncio.wrap_future(future, loop=self.loop)
        outcome.add_done_callback(_seen)  # it is read from *future*; asyncio would complain that nobody did
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(timeout):
                await asyncio.wait([outcome])

    # -- who runs the loop --

    def _borrow(self) -> bool:
        """Take the loop over, to run it on this thread while it waits; return False if that cannot be.

        The threads change hands once, not twice a call: the portal's thread takes the loop back only when nobody has
        called for a while, or when others wait in it.
        """
        me = threading.get_ident()
        if me == self._borrower or (self._thread is not None and me == self._thread.ident and self._thread_runs):
            raise RuntimeError(
                "a blocking call from within the robot's own event loop would wait for ever; use robot.begin"
            )
        with self._lock:
            if me not in self._callers:
                self._callers[me] = Caller(threading.current_thread())
            if self.is_closed or self._borrower is not None or _a_loop_runs_here():
                return False
            if self._is_simulated and self._others_call(me):
                return False  # time may move only while all of them wait: the portal's thread sees to that
            self._borrower = me
            if self._thread_runs:
                self.loop.call_soon_threadsafe(self.loop.stop)
        self._baton.acquire()
        return True

    def _others_call(self, me: int) -> bool:
        return any(ident != me and caller.thread.is_alive() for ident, caller in self._callers.items())

    def _give_back(self) -> None:
        with self._lock:
            self._last_use = self._callers[threading.get_ident()].seen = time.monotonic()
            self._borrower = None
            is_wanted = self._foreign > 0
            if is_wanted:
                self._start_thread()  # others wait in this loop: somebody must go on running it
        self._baton.release()
        if is_wanted:
            self._take_back.set()

    def _run_here(self, task: asyncio.Task[T]) -> T:
        """Run the borrowed loop on this thread until *task* is done."""
        self._inline_task = task
        try:
            while True:
                try:
                    return self.loop.run_until_complete(task)
                except RuntimeError:
                    if task.done():
                        raise  # its own; else the loop was asked to stop by somebody who wanted to borrow it
        except asyncio.CancelledError:
            self._raise_interruption()
            raise LinkClosed("the call was cancelled") from None
        except BaseException:
            task.cancel()
            raise
        finally:
            self._inline_task = None

    def _wait_elsewhere(self, future: concurrent.futures.Future[T], timeout: float | None) -> T:
        """Wait while the portal's thread, or whoever has borrowed the loop, runs it."""
        with self._lock:
            self._foreign += 1
            self._start_thread()
        self._take_back.set()
        try:
            return self._watch(future, timeout, threading.get_ident())
        finally:
            with self._lock:
                self._foreign -= 1

    def _watch(self, future: concurrent.futures.Future[T], timeout: float | None, me: int) -> T:
        expiry = None if timeout is None else self.start(asyncio.sleep(timeout))

        def resume(_: concurrent.futures.Future[Any]) -> None:
            # On the loop's thread, before the waiting thread wakes: from now on time must stand still for it.
            self._callers[me] = Caller(caller)
            self._waiting.discard(me)

        caller = threading.current_thread()
        self._stalled = None
        self._waiting.add(me)
        future.add_done_callback(resume)
        if expiry is not None:
            expiry.add_done_callback(resume)
        self._wake()
        try:
            while True:
                try:
                    return future.result(PATIENCE)
                except concurrent.futures.CancelledError:
                    raise LinkClosed("the call was cancelled") from None
                except TimeoutError:
                    if future.done():
                        return _outcome(future)  # it ended just now, or with its own ReplyTimeout
                if expiry is not None and expiry.done():
                    raise TimeoutError(f"no outcome within {timeout:g} s; the call goes on")
                if threading.current_thread() is threading.main_thread():
                    self._raise_interruption()
                self._check_progress()
        except (KeyboardInterrupt, SystemExit):
            future.cancel()
            raise
        finally:
            self._waiting.discard(me)
            if expiry is not None:
                expiry.cancel()

    def _check_progress(self) -> None:
        """Make sure somebody runs the loop, and that it has not stalled."""
        stalled, self._stalled = self._stalled, None
        if stalled is not None:
            raise stalled
        if self._death is not None:
            raise LinkLost(f"the robot's event loop ended: {self._death!r}", hint="open a new connection")
        self._take_back.set()
        self._wake()

    def interrupt(self, error: BaseException) -> bool:
        """Cancel the call the main thread waits for, to raise *error* there; False if it waits for none."""
        is_inline = self._inline_task is not None and self._borrower == threading.main_thread().ident
        if self._main_depth == 0 and not is_inline:
            return False
        self._interruption = error
        if is_inline and self._inline_task is not None:
            self.loop.call_soon_threadsafe(self._inline_task.cancel)
        return True

    def _raise_interruption(self) -> None:
        interruption, self._interruption = self._interruption, None
        if interruption is not None:
            raise interruption

    def _wake(self) -> None:
        with contextlib.suppress(RuntimeError):
            self.loop.call_soon_threadsafe(_nothing)

    def _may_jump(self) -> bool:
        """Whether simulated time may move: somebody waits for it, and nobody outside works."""
        if not self._waiting and self._inline_task is None:
            return False
        if min(self._pool.busy, CALLBACK_THREADS) > len(self._waiting & self._pool.idents):
            return False
        me = threading.get_ident()
        now = time.monotonic()
        for ident, caller in tuple(self._callers.items()):
            if not caller.thread.is_alive():
                self._callers.pop(ident, None)
            elif ident not in (me, *self._waiting, *self._pool.idents) and now - caller.seen < PATIENCE:
                self._wake_later()
                return False
        return True

    def _wake_later(self) -> None:
        """Let the loop look again when the patience is over: it may be the one that waits here."""
        if self._alarm is None or not self._alarm.is_alive():
            self._alarm = threading.Timer(PATIENCE, self._wake)
            self._alarm.daemon = True
            self._alarm.start()

    # -- callbacks --

    def later(self, function: Callable[[], None], name: str) -> None:
        """Run *function* off the loop; it may block or raise without harm to the link."""
        self._pool.put(function, name)

    # -- life --

    def _start_thread(self) -> None:
        if self._thread is None and not self.is_closed:
            self._thread = threading.Thread(target=self._run_loop, name="elib event loop", daemon=True)
            self._thread.start()

    def _run_loop(self) -> None:
        asyncio.set_event_loop(self.loop)
        while not self._must_end:
            with self._baton:
                with self._lock:
                    self._thread_runs = self._borrower is None and not self._must_end
                if self._thread_runs:
                    try:
                        self.loop.run_forever()
                    except SimulationStalled as error:
                        self._stalled = error
                    except BaseException as error:  # a hook that raises SystemExit, say
                        self._death = error
                        log.exception("the robot's event loop ended")
                        self._must_end = True
                    finally:
                        with self._lock:
                            self._thread_runs = False
            self._rest()

    def _rest(self) -> None:
        """Leave the loop to who has borrowed it, until it lies idle or others wait in it."""
        while not self._must_end:
            if self._take_back.wait(LOAN):
                self._take_back.clear()
                return
            if self._borrower is None and time.monotonic() - self._last_use >= LOAN:
                return

    def close(self) -> None:
        """Cancel what still runs and end the loop. Bounded; safe to repeat."""
        with self._lock:
            if self.is_closed:
                return
            self.is_closed = True
        SIGNALS.forget(self)
        self._pool.close()
        if _a_loop_runs_here():
            ending = asyncio.run_coroutine_threadsafe(_cancel_all_tasks(), self.loop)
            self._take_back.set()
            with contextlib.suppress(concurrent.futures.TimeoutError, concurrent.futures.CancelledError, ElibError):
                ending.result(CLOSING_TIME)
        with self._lock:
            self._must_end = True
            if self._thread_runs:
                self.loop.call_soon_threadsafe(self.loop.stop)
            elif self._inline_task is not None:
                self.loop.call_soon_threadsafe(self._inline_task.cancel)  # another thread waits in a call: it ends
        if not self._baton.acquire(timeout=CLOSING_TIME):
            log.error("the robot's event loop did not end within %g s", CLOSING_TIME)
            return
        if not _a_loop_runs_here():
            with contextlib.suppress(ElibError, LinkClosed):
                self._run_here(self.loop.create_task(_cancel_all_tasks()))
        self._baton.release()
        self._take_back.set()
        if self._thread is not None:
            self._thread.join(CLOSING_TIME)
        self.loop.close()


def _outcome(future: concurrent.futures.Future[T]) -> T:
    try:
        return future.result()
    except concurrent.futures.CancelledError:
        raise LinkClosed("the call was cancelled") from None


def _seen(outcome: asyncio.Future[Any]) -> None:
    """Take note of an outcome."""
    if not outcome.cancelled():
        outcome.exception()


def _nothing() -> None:
    """Wake the loop."""


def _a_loop_runs_here() -> bool:
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


async def _cancel_all_tasks() -> None:
    me = asyncio.current_task()
    tasks = [task for task in asyncio.all_tasks() if task is not me]
    for task in tasks:
        task.cancel()
    if tasks:
        await asyncio.wait(tasks, timeout=CLOSING_TIME)
    await asyncio.get_running_loop().shutdown_default_executor()
