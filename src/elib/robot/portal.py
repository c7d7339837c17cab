"""The portal from ordinary threads into an event loop, on which the blocking, begin and callback styles are built.

The portal has a thread that runs the loop. While another thread waits in a call, the portal lends the loop to it. In
simulated time the loop runs only on such a thread, so time moves only while the caller waits. When a second thread
calls, or where a loop already runs (a notebook), the portal's thread takes over, and time jumps only while every caller
waits. It also takes over when calls were begun and no thread has called for a while: the program then waits for
something else.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import logging
import threading
import time
import weakref
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from elib.base.errors import ElibError, LinkClosed, LinkError, LinkLost, SimulationStalled
from elib.base.timebase import LoopSpeed, SimulatedLoop, new_loop, running_loop
from elib.robot.callbacks import CallbackPool
from elib.robot.signals import SIGNALS

T = TypeVar("T")

HOLDING_TIME = 0.05
"""s of real time for which simulated time stands still while a thread that has called goes on working. After that it
may jump: the thread waits for something else, perhaps for the thread that calls now."""
LOAN = 0.005
"""s of real time for which a thread keeps the loop after its call, so that one that polls need not take it again."""
MANY_READS = 100_000
"""Reads of a simulated clock that stands still, after which the program is warned. They take some 0.1 s."""
CLOSING_TIME = 5.0
"""s of real time in which a portal must close."""
EXIT_STOP_TIME = 5.0
"""s that stopping a robot may take when the interpreter ends."""

log = logging.getLogger("elib")


class KeepAlive:
    """A token that all objects of one robot share: when the last of them is dropped, the robot is closed."""

    __slots__ = ("__weakref__",)


class Portal:
    """One event loop, entered from any thread.

    Args:
        speed: How fast the loop's time runs.
    """

    _last_time = -1.0
    _reads: int | None = 0
    """Reads of the clock that gave the same time; None once the program was warned."""
    _has_begun = False
    """Whether a call was begun since the last one that waited."""

    def __init__(self, speed: LoopSpeed) -> None:
        self.loop = new_loop(speed)
        self._is_simulated = isinstance(self.loop, SimulatedLoop)
        self._lock = threading.RLock()
        self._baton = threading.Lock()
        """The thread that holds it runs the loop."""
        self._thread: threading.Thread | None = None
        self._thread_runs = False
        self._borrower: threading.Thread | None = None
        self._last_use = 0.0
        self._take_back = threading.Event()
        self._inline_task: asyncio.Task[Any] | None = None
        self._interruption: BaseException | None = None
        self._main_depth = 0
        self._foreign = 0
        self.is_closed = False
        self._program_ends = False
        """Whether the interpreter is about to end: a call that waits in a daemon thread then gets no error."""
        self._leaving = threading.RLock()
        self._leaver: threading.Thread | None = None
        """The thread that closes the portal: from then on simulated time stands still only for that thread."""
        self._is_ending = False
        """Whether all tasks were told to end: simulated time then stands still for no thread."""
        self._callers: dict[threading.Thread, float] = {}
        """Threads that have called, and when each of them last returned to its own work."""
        self._waiting: set[threading.Thread] = set()
        self._begun: set[concurrent.futures.Future[Any]] = set()
        """Begun calls in simulated time, which go on even if no thread waits for them."""
        self._stalled: SimulationStalled | None = None
        self._must_end = False
        self._alarm: threading.Timer | None = None
        self._death: BaseException | None = None
        self._pool = CallbackPool(self._wake)
        self.before_close: Callable[[], Coroutine[Any, Any, None]] | None = None
        self.after_close: Callable[[], None] | None = None
        if isinstance(self.loop, SimulatedLoop):
            self.loop.may_jump = self._may_jump
        if not self._is_simulated or running_loop() is not None:
            self._start_thread()
        self._signals = SIGNALS.signals_of(self.loop)
        self._signals.interrupt = self.interrupt
        self._signals.at_exit = self._leave_at_exit
        self._signals.enter()

    # -- calls --

    def call(self, coroutine: Coroutine[Any, Any, T], *, in_order: bool = False) -> T:
        """Run *coroutine* in the loop and wait for its outcome. Ctrl-C cancels it.

        With *in_order* it runs after the calls that were begun before it.
        """
        return self._attend(lambda: self._call(coroutine, in_order))

    def _call(self, coroutine: Coroutine[Any, Any, T], in_order: bool) -> T:
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
            if in_order and self._has_begun:
                self._has_begun = False
                coroutine = _behind_others(coroutine)
            return self._run_here(self.loop.create_task(coroutine))
        finally:
            self._give_back()

    def _attend(self, wait: Callable[[], T]) -> T:
        """Run *wait*; in the main thread, with signals held back until a safe place."""
        if threading.current_thread() is not threading.main_thread():
            try:
                return wait()
            except LinkError:
                if self._program_ends and threading.current_thread().daemon:
                    threading.Event().wait()  # Python ends such a thread silently, and so does elib
                raise
        # A signal that comes while the main thread is in here is recorded and raised below, at a safe place: raised in
        # the middle it could hit a finaliser, where Python drops it.
        self._main_depth += 1
        try:
            return wait()
        finally:
            self._main_depth -= 1
            if self._main_depth == 0:
                self._raise_interruption()

    def start(self, coroutine: Coroutine[Any, Any, T]) -> concurrent.futures.Future[T]:
        """Start *coroutine* in the loop and return its future at once."""
        with self._lock:
            if self.is_closed:
                coroutine.close()
                raise LinkClosed("the robot was closed", hint="open a new connection")
            self._has_begun = True
            return asyncio.run_coroutine_threadsafe(coroutine, self.loop)

    def begin(self, coroutine: Coroutine[Any, Any, T]) -> concurrent.futures.Future[T]:
        """Start *coroutine* in the loop, to run even if no thread waits for it, and return its future at once.

        In simulated time it runs while a thread waits in a call, and also when this thread has not called for a while,
        because it then waits for something else.
        """
        future = self.start(coroutine)
        if self._is_simulated:
            self._begun.add(future)
            future.add_done_callback(self._begun.discard)
            if running_loop() is not self.loop:
                with self._lock:
                    self._note(threading.current_thread())
                    self._last_use = time.monotonic()
                    self._start_thread()
            self._take_back.set()
            self._wake()  # the loop may have asked whether time may move before this call was there
        return future

    def wait(self, future: concurrent.futures.Future[T], timeout: float | None = None) -> T:
        """Wait for *future* and return its result.

        Args:
            future: From :meth:`start`.
            timeout: Robot time, s; None for as long as the call itself may take.

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
        # The outcome is read from *future*; asyncio would report that this one was not.
        outcome.add_done_callback(lambda each: each.cancelled() or each.exception())
        await asyncio.wait([outcome], timeout=timeout)

    def time(self) -> float:
        """Return the robot's time, s."""
        now, reads = self.loop.time(), self._reads
        if reads is None:
            return now
        self._reads = reads + 1 if now == self._last_time else 0
        self._last_time = now
        if reads == MANY_READS and isinstance(self.loop, SimulatedLoop):
            self._reads = None
            log.warning(
                "robot.time was read %d times and stood still at %.6g s: simulated time moves only while the program "
                "waits in a call; write robot.sleep(0.01) into the loop",
                MANY_READS,
                now,
            )
        return now

    # -- lending the loop --

    def _borrow(self) -> bool:
        """Take the loop over, to run it on this thread while it waits; return False if that is not possible.

        The loop changes threads once a call, not twice: the portal's thread takes it back only when no thread has
        called for a while, or when other threads wait in it.
        """
        self._refuse_inside()
        me = threading.current_thread()
        with self._lock:
            if me not in self._callers:
                self._note(me)
            if self.is_closed or self._borrower is not None or running_loop() is not None:
                return False
            if self._is_simulated and any(each is not me and each.is_alive() for each in self._callers):
                return False  # time may move only while all of them wait; the portal's thread checks that
            self._borrower = me
            if self._thread_runs:
                self.loop.call_soon_threadsafe(self.loop.stop)
        self._baton.acquire()
        return True

    def _refuse_inside(self) -> None:
        if running_loop() is self.loop or self._borrower is threading.current_thread():
            raise RuntimeError(
                "a blocking call from within the robot's own event loop would wait for ever; use robot.begin"
            )

    def _note(self, thread: threading.Thread) -> None:
        """Record that *thread* returns to its own work; simulated time stands still for it, for a while."""
        if not self._pool.resume(thread):
            self._callers[thread] = time.monotonic()

    def _give_back(self) -> None:
        with self._lock:
            self._note(threading.current_thread())
            self._last_use = time.monotonic()
            self._borrower = None
            is_wanted = self._foreign > 0
            if is_wanted:
                self._start_thread()  # others wait in this loop: the portal's thread must go on running it
        self._baton.release()
        if is_wanted:
            self._take_back.set()

    def _run_here(self, task: asyncio.Task[T]) -> T:
        """Run the borrowed loop on this thread until *task* has ended."""
        self._inline_task = task
        if self._interruption is not None and self._borrower is threading.main_thread():
            # The signal came before there was a task to cancel.
            self.loop.call_soon(task.cancel)  # after its first step: a task that never ran stops no robot
        try:
            while True:
                try:
                    return self.loop.run_until_complete(task)
                except RuntimeError:
                    if task.done():
                        raise  # the task's own error; else another thread stopped the loop to borrow it
        except asyncio.CancelledError:
            self._raise_interruption()
            raise LinkClosed("the call was cancelled") from None
        except BaseException:
            task.cancel()
            raise
        finally:
            self._inline_task = None

    def _wait_elsewhere(self, future: concurrent.futures.Future[T], timeout: float | None) -> T:
        """Wait while the portal's thread, or another one that has borrowed the loop, runs it."""
        with self._lock:
            self._foreign += 1
            self._start_thread()
        self._take_back.set()
        try:
            return self._watch(future, timeout)
        finally:
            with self._lock:
                self._foreign -= 1

    def _watch(self, future: concurrent.futures.Future[T], timeout: float | None) -> T:
        me = threading.current_thread()
        expiry = None if timeout is None else self.start(asyncio.sleep(timeout))

        def resume(_: concurrent.futures.Future[Any]) -> None:
            # On the loop's thread, before the waiting thread wakes: from now on time must stand still for it.
            self._note(me)
            self._waiting.discard(me)

        self._stalled = None
        self._waiting.add(me)
        future.add_done_callback(resume)
        if expiry is not None:
            expiry.add_done_callback(resume)
        self._wake()
        try:
            while True:
                concurrent.futures.wait([future], HOLDING_TIME)
                if future.done():
                    return _outcome(future)
                if expiry is not None and expiry.done():
                    raise TimeoutError(f"no outcome within {timeout:g} s; the call goes on")
                if me is threading.main_thread():
                    self._raise_interruption()
                self.check_progress()
        except (KeyboardInterrupt, SystemExit):
            future.cancel()
            raise
        finally:
            self._waiting.discard(me)
            if expiry is not None:
                expiry.cancel()

    def check_progress(self) -> None:
        """Make sure that a thread runs the loop, and that the loop has not stalled."""
        stalled, self._stalled = self._stalled, None
        if stalled is not None:
            raise stalled
        if self._death is not None:
            raise LinkLost(f"the robot's event loop ended: {self._death!r}", hint="open a new connection")
        self._take_back.set()
        self._wake()

    def interrupt(self, error: BaseException) -> bool:
        """Cancel the call that the main thread waits for, to raise *error* there; return False if there is none."""
        is_inline = self._inline_task is not None and self._borrower is threading.main_thread()
        if self._main_depth == 0 and not is_inline:
            return False
        self._interruption = error
        if is_inline and self._inline_task is not None:
            self.loop.call_soon_threadsafe(self._inline_task.cancel)
        return True

    def _raise_interruption(self) -> None:
        interruption, self._interruption = self._interruption, None
        if interruption is not None:
            raise interruption from None

    def _wake(self) -> None:
        with contextlib.suppress(RuntimeError):
            self.loop.call_soon_threadsafe(_nothing)

    def _may_jump(self) -> bool:
        """Return whether simulated time may move: a call goes on, and no thread of the program works."""
        if self._is_ending:
            return True
        me = threading.current_thread()
        if self._leaver is not None:
            return self._leaver is me or self._leaver in self._waiting
        if not self._waiting and not self._begun and self._inline_task is None:
            return False
        now = time.monotonic()
        holding = self._pool.is_at_work(self._waiting)
        for thread, seen in tuple(self._callers.items()):
            if thread is me or thread in self._waiting:
                continue  # when the interpreter ends, the main thread counts as dead, but it still waits here
            if not thread.is_alive():
                self._callers.pop(thread, None)
            elif now - seen < HOLDING_TIME:
                holding = True
        if holding:
            self._wake_later()
        return not holding

    def _wake_later(self) -> None:
        """Let the loop ask again when the holding time is over."""
        if self._alarm is None:
            self._alarm = threading.Timer(HOLDING_TIME, self._on_alarm)
            self._alarm.daemon = True
            self._alarm.start()

    def _on_alarm(self) -> None:
        self._alarm = None  # first, because the loop that it wakes may set it again
        self._wake()

    # -- callbacks --

    def later(self, function: Callable[[], None], name: str) -> None:
        """Run *function* in a callback thread, where it may block or raise without harm to the link."""
        self._pool.put(function, name)

    # -- running and closing --

    def _start_thread(self) -> None:
        if self._thread is None and not self.is_closed:
            thread = threading.Thread(target=self._run_loop, name="elib event loop", daemon=True)
            thread.start()  # it may fail, and a thread that never started must not be joined
            self._thread = thread

    def _run_loop(self) -> None:
        asyncio.set_event_loop(self.loop)
        while not self._must_end:
            self._rest()
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

    def _rest(self) -> None:
        """Wait while a thread has borrowed the loop, until the loop is idle or other threads wait in it."""
        idle_limit = HOLDING_TIME if self._is_simulated else LOAN
        idle = 0.0
        while not self._must_end:
            use = self._last_use
            may_wait = not self._is_simulated or self._begun
            if self._take_back.wait(LOAN if may_wait else None):
                self._take_back.clear()
                if self._foreign or self.is_closed:
                    return
                continue
            # Turns are counted, not seconds: a computer that is busy with something else delays all threads alike.
            idle = idle + LOAN if self._borrower is None and use == self._last_use else 0.0
            if may_wait and idle >= idle_limit:
                return

    def leave(self, timeout: float | None = None) -> None:
        """Run :attr:`before_close`, which stops the robot, close, and run :attr:`after_close`. Safe to repeat.

        All threads wait for the end.

        Args:
            timeout: Robot time that stopping may take, s; None for no limit.
        """
        self._refuse_inside()
        with self._leaving:
            if self.is_closed:
                return
            self._leaver = threading.current_thread()
            self._wake()
            try:
                if self.before_close is not None:
                    self.call(_bounded(self.before_close, timeout))
            finally:
                self.close()
                if self.after_close is not None:
                    self.after_close()

    def _leave_at_exit(self) -> None:
        self._program_ends = True
        self.leave(EXIT_STOP_TIME)

    def keep_alive(self) -> KeepAlive:
        """Return a token; when nothing refers to it any more, the robot is stopped and this portal closed."""
        token = KeepAlive()
        weakref.finalize(token, self._abandon).atexit = False  # at the end all portals are closed anyway
        return token

    def _abandon(self) -> None:
        """Leave in a thread of its own: the last object may have been dropped in the middle of any code."""
        if self.is_closed:
            return
        ending = threading.Thread(target=self._leave_quietly, name="elib forgotten robot", daemon=True)
        ending.start()
        if running_loop() is None:  # an event loop must go on meanwhile, above all this portal's own
            ending.join(CLOSING_TIME)

    def _leave_quietly(self) -> None:
        try:
            self.leave(CLOSING_TIME)
        except Exception as error:
            log.error("a robot that nothing refers to any more could not be closed: %s", error)

    def close(self) -> None:
        """Cancel what still runs and end the loop, within :data:`CLOSING_TIME`. Safe to repeat."""
        with self._lock:
            if self.is_closed:
                return
            self.is_closed = True
        self._signals.interrupt = self._signals.at_exit = None
        self._signals.leave()
        if running_loop() is not None:
            ending = asyncio.run_coroutine_threadsafe(_cancel_all_tasks(), self.loop)
            self._is_ending = True
            self._take_back.set()
            with contextlib.suppress(concurrent.futures.TimeoutError, concurrent.futures.CancelledError, ElibError):
                ending.result(CLOSING_TIME)
        with self._lock:
            self._must_end = True
            if self._thread_runs:
                self.loop.call_soon_threadsafe(self.loop.stop)
            elif self._inline_task is not None:
                self.loop.call_soon_threadsafe(self._inline_task.cancel)  # another thread waits in a call
            self._is_ending = True
        if not self._baton.acquire(timeout=CLOSING_TIME):
            log.error("the robot's event loop did not end within %g s", CLOSING_TIME)
            return
        if running_loop() is None:
            with contextlib.suppress(ElibError, LinkClosed):
                self._run_here(self.loop.create_task(_cancel_all_tasks()))
        self._baton.release()
        self._take_back.set()
        if self._thread is not None:
            self._thread.join(CLOSING_TIME)
        self._pool.close()
        self.loop.close()


async def _behind_others(coroutine: Coroutine[Any, Any, T]) -> T:
    """Run *coroutine* a turn of the loop later: calls that were begun before need one more turn to start."""
    try:
        await asyncio.sleep(0)
        return await coroutine
    finally:
        coroutine.close()


def _outcome(future: concurrent.futures.Future[T]) -> T:
    try:
        return future.result()
    except concurrent.futures.CancelledError:
        raise LinkClosed("the call was cancelled") from None


def _nothing() -> None:
    """Do nothing: being called wakes the loop."""


async def _bounded(function: Callable[[], Coroutine[Any, Any, None]], seconds: float | None) -> None:
    async with asyncio.timeout(seconds):
        await function()


async def _cancel_all_tasks() -> None:
    me = asyncio.current_task()
    tasks = [task for task in asyncio.all_tasks() if task is not me]
    for task in tasks:
        task.cancel()
    if tasks:
        await asyncio.wait(tasks, timeout=CLOSING_TIME)
    await asyncio.get_running_loop().shutdown_default_executor()
