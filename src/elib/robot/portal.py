"""The portal from ordinary threads into an event loop, on which the blocking, begin and callback styles are built.

One thread at a time runs the loop: the *runner*. A thread that makes a call becomes the runner if there is none. If
there is one, it waits until its own call has ended, or until it can become the runner. So a call in a program with one
thread needs no second thread.

The portal has a thread of its own that runs the loop when no other thread does. In real time it takes over soon after
a call, because the link goes on. In simulated time it takes over only for calls that were begun, when no thread has
called for a while: the program then waits for something else. Simulated time moves only while every thread that has
called waits.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import logging
import threading
import time
from collections.abc import Callable, Coroutine, Iterable, Iterator
from typing import Any, TypeVar

from elib.base.errors import ElibError, LinkClosed, SimulationStalled
from elib.base.timebase import LoopSpeed, SimulatedLoop, host, new_loop, outside, running_loop
from elib.robot.callbacks import CALLBACK_THREADS, CallbackPool, CallbackQueue, reported
from elib.robot.signals import SIGNALS, error_of

T = TypeVar("T")
AnyFuture = concurrent.futures.Future[Any]

HOLDING_TIME = 0.05
"""s of real time for which simulated time stands still while a thread that has called goes on working. After that it
may move: the thread waits for something else, perhaps for the thread that calls now."""
CALLBACK_HOLDING_TIME = 5.0
"""s of real time for which simulated time stands still while a callback runs: most work for themselves. After that it
goes on: the callback waits for something else, perhaps for the program that waits for the robot."""
IDLE_TIME = 0.005
"""s of real time after a call in which no thread runs the loop, so that a thread that polls need not take it back."""
CLOSING_TIME = 5.0
"""s of real time in which a portal must close."""

log = logging.getLogger("elib")


class Portal:
    """One event loop, entered from any thread.

    Args:
        speed: How fast the loop's time runs.
    """

    def __init__(self, speed: LoopSpeed) -> None:
        self.loop = new_loop(speed)
        self.is_closed = False  # whether it takes no more calls
        # run in the loop before it ends: it stops the robot
        self.before_close: Callable[[], Coroutine[Any, Any, None]] | None = None
        self.after_close: Callable[[], None] | None = None  # called after that
        self._is_simulated = isinstance(self.loop, SimulatedLoop)
        lock = threading.RLock()
        self._turn = threading.Condition(lock)
        """Held where fields change together; told when the loop has lost its runner, and when a call has ended."""
        self._demand = threading.Condition(lock)
        """Told when the portal's own thread is needed."""
        self._runner: threading.Thread | None = None
        self._thread: threading.Thread | None = None
        """The portal's own thread, once it was needed."""
        self._waiting: set[threading.Thread] = set()
        self._needy: set[threading.Thread] = set()
        """Threads that wait and cannot run the loop themselves."""
        self._uses = 0
        """How often a thread has called."""
        self._is_over = False
        self._failure: BaseException | None = None
        """What ended a run of the loop on the portal's own thread."""
        self._working: dict[threading.Thread, float] = {}
        """Threads that hold simulated time back, and when each of them last returned to its own work."""
        self._callbacks: dict[threading.Thread, str] = {}
        """What each thread of the pool runs."""
        self._callback_count = 0
        """Callbacks queued or running."""
        self._begun: set[AnyFuture] = set()
        """Calls that go on in simulated time even if no thread waits for them."""
        self._has_begun = False
        """Whether a call was begun since the last one that waited."""
        self._leaving = threading.RLock()
        self._leaver: threading.Thread | None = None
        """The thread that closes the portal: from then on simulated time stands still only for that thread."""
        self._program_ends = False
        self._pool = CallbackPool()
        if (place := host()) is not None:
            self._pool = CallbackQueue(self.loop)
            place.portals.add(self)
        elif isinstance(self.loop, SimulatedLoop):
            self.loop.may_jump = self._may_jump
        if not self._is_simulated or running_loop() is not None:
            self._start_thread()
        self._signals = SIGNALS.signals_of(self.loop)
        self._signals.waiter = None
        """The main thread, while it waits in a call. A signal that comes meanwhile cancels that, and is raised at its
        end: raised in the middle it could hit a finaliser, where Python drops it."""
        self._signals.at_exit = self._leave_at_exit
        self._signals.enter()

    # -- calls --

    def call(self, coroutine: Coroutine[Any, Any, T], *, is_last: bool = False) -> T:
        """Run *coroutine* in the loop, after the calls that were begun before it, and wait for its outcome.

        Ctrl-C cancels it. With *is_last* the portal takes no more calls.
        """
        try:
            is_runner = self._enter(is_last)
        except BaseException:
            coroutine.close()
            self._end_silently()
            raise
        try:
            if not is_runner:
                return self._follow(coroutine)
            if self._has_begun:
                coroutine = _behind_others(coroutine)
                self._has_begun = False
            return self._run(self.loop.create_task(coroutine))
        finally:
            self._exit()

    def begin(self, coroutine: Coroutine[Any, Any, T]) -> concurrent.futures.Future[T]:
        """Start *coroutine* in the loop, to run even if no thread waits for it, and return its future at once."""
        try:
            with self._turn:  # the loop can look whether time may move only after all of this
                self._require_open()
                self._has_begun = True
                self._uses += 1
                future = asyncio.run_coroutine_threadsafe(coroutine, self.loop)
                self._begun.add(future)
                future.add_done_callback(self._begun.discard)
                if running_loop() is not self.loop:
                    if threading.current_thread() not in self._needy:
                        self._note(threading.current_thread())
                    self._start_thread()
                self._demand.notify_all()
        except LinkClosed:
            coroutine.close()
            self._end_silently()
            raise
        return future

    def wait(self, future: concurrent.futures.Future[T], timeout: float | None = None) -> T:
        """Wait for *future* and return its result.

        Args:
            future: From :meth:`begin`.
            timeout: Robot time, s; None for as long as the call itself may take.

        Raises:
            TimeoutError: *timeout* passed; the call goes on.
        """
        self.call(ended([future], timeout=timeout))
        if not future.done():
            raise TimeoutError(f"no outcome within {timeout:g} s; the call goes on")
        return future.result()

    @contextlib.contextmanager
    def lent(self) -> Iterator[None]:
        """Let the portal's own thread run the loop, and time pass, while this thread waits for something else."""
        me = threading.current_thread()
        with self._turn:
            self._working.pop(me, None)
            self._needy.add(me)
            self._start_thread()
            self._demand.notify_all()
        try:
            yield
        finally:
            with self._turn:
                self._needy.discard(me)
                self._note(me)

    def check(self) -> None:
        """Raise what ended a run of the loop on the portal's own thread, once."""
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    def later(self, function: Callable[[], None], name: str) -> None:
        """Run *function* in a callback thread, where it may block or raise without harm to the link."""

        def run() -> None:
            me = threading.current_thread()
            with self._turn:
                self._callbacks[me] = name
                self._note(me)
            reported(function, name)
            with self._turn:
                del self._callbacks[me]
                self._working.pop(me, None)
                self._callback_count -= 1
            with contextlib.suppress(RuntimeError):  # it is closed
                self.loop.call_soon_threadsafe(_nothing)

        with self._turn:
            self._callback_count += 1
        self._pool.put(run, name)

    # -- running the loop --

    def _enter(self, is_last: bool) -> bool:
        """Let this thread wait; return whether it is the runner.

        Raises:
            LinkClosed: The portal was closed.
            RuntimeError: This thread runs the loop already.
        """
        me, here = threading.current_thread(), running_loop()
        self._refuse_inside(here)
        with self._turn:
            self._require_open()
            self.is_closed = is_last
            if me is threading.main_thread():
                self._signals.cancel, self._signals.waiter = _nothing, me
            self._uses += 1
            if self._runner is None and (here is None or host() is not None):
                self._runner = me
                self._waiting.add(me)
        return self._runner is me

    def _require_open(self) -> None:
        if self.is_closed:
            raise LinkClosed("the robot was closed", hint="open a new connection")

    def _refuse_inside(self, here: asyncio.AbstractEventLoop | None) -> None:
        if here is self.loop or self._runner is threading.current_thread():
            raise RuntimeError(
                "a blocking call from within the robot's own event loop would wait for ever; use robot.begin"
            )

    def _exit(self) -> None:
        """Let this thread return to its own work, and another one run the loop."""
        me = threading.current_thread()
        with self._turn:
            self._note(me)
            self._waiting.discard(me)
            if self._runner is me:
                self._runner = None
            self._turn.notify_all()
        self._end_silently()
        if me is threading.main_thread():
            self._signals.waiter = None
            if self._signals.came is not None:
                raise error_of(self._signals.take()) from None

    def _end_silently(self) -> None:
        """Let a daemon thread stand still from the end of the program on, as Python does, instead of raise."""
        me = threading.current_thread()
        if self._program_ends and me.daemon and me not in (self._leaver, self._runner):
            threading.Event().wait()

    def _note(self, thread: threading.Thread) -> None:
        """Record that *thread* returns to its own work; simulated time stands still for it, for a while."""
        if self._is_simulated:
            self._working[thread] = time.monotonic()

    def _run(self, task: asyncio.Future[T]) -> T:
        """Run the loop on this thread until *task* has ended."""
        self._let_signals(task.cancel)
        try:
            while True:
                try:
                    with contextlib.nullcontext() if host() is None else outside():
                        return self.loop.run_until_complete(task)
                except RuntimeError:
                    if task.done() or self.loop.is_closed():
                        raise
                    # Another thread stopped the loop while the portal's thread ran it, and that came too late: go on.
                finally:
                    if isinstance(self._pool, CallbackQueue):
                        me, self._runner = self._runner, None  # a callback may call, too
                        self._pool.run()
                        self._runner = me
        except asyncio.CancelledError:
            raise LinkClosed("the call was cancelled") from None
        except BaseException:
            task.cancel()
            raise

    def _let_signals(self, cancel: Callable[[], object]) -> None:
        """Let a signal call *cancel* in the loop, until this thread returns to its work, if it is the main thread."""
        if threading.current_thread() is threading.main_thread():
            self._signals.wait_by(cancel)

    def _follow(self, coroutine: Coroutine[Any, Any, T]) -> T:
        """Run *coroutine* in the loop that another thread runs; on this thread as soon as no other one runs it.

        A thread in which another event loop runs cannot run this one.
        """
        me, may_run = threading.current_thread(), running_loop() is None

        def resume(_: AnyFuture) -> None:
            # In the runner, before the waiting thread wakes: from now on time must stand still for it.
            with self._turn:
                if me in self._waiting:
                    self._note(me)
                    self._waiting.discard(me)
                self._turn.notify_all()

        with self._turn, contextlib.nullcontext() if may_run else self.lent():
            # The loop can look whether time may move only when this thread waits, below.
            future = asyncio.run_coroutine_threadsafe(coroutine, self.loop)
            self._waiting.add(me)
            future.add_done_callback(resume)
            self._let_signals(future.cancel)
            try:
                while not future.done() and not (may_run and self._runner is None):
                    if may_run and self._runner is self._thread:
                        self.loop.call_soon_threadsafe(self.loop.stop)
                    self._turn.wait(HOLDING_TIME)
                    self.check()
            except BaseException:
                future.cancel()
                raise
            if is_runner := not future.done():
                self._runner = me
        if is_runner:
            return self._run(asyncio.wrap_future(future, loop=self.loop))
        try:
            return future.result()
        except concurrent.futures.CancelledError:
            raise LinkClosed("the call was cancelled") from None

    def _start_thread(self) -> None:
        with self._turn:
            if self._thread is None and not self._is_over and host() is None:
                thread = threading.Thread(target=self._serve, name="elib event loop", daemon=True)
                thread.start()  # it may fail, and a thread that never started must not be joined
                self._thread = thread

    def _serve(self) -> None:
        """Run the loop on the portal's own thread whenever that is needed."""
        while self._take_turn():
            try:
                self.loop.run_forever()
            except BaseException as error:
                self._failure = error
                if not isinstance(error, SimulationStalled):  # a hook that raises SystemExit, say
                    log.exception("the robot's event loop was interrupted")
            finally:
                with self._turn:
                    self._runner = None
                    self._turn.notify_all()

    def _take_turn(self) -> bool:
        """Wait until the loop needs this thread as its runner; return False at the end."""
        limit = HOLDING_TIME if self._is_simulated else IDLE_TIME
        idle, uses = 0.0, -1
        with self._turn:
            while not self._is_over:
                # Turns are counted, not seconds: a computer that is busy with something else delays all threads alike.
                idle, uses = (idle + IDLE_TIME if uses == self._uses and self._runner is None else 0.0), self._uses
                goes_on = not self._is_simulated or self._begun
                if self._runner is None and (self._needy or (goes_on and idle > limit)):
                    self._runner = threading.current_thread()
                    return True
                self._demand.wait(IDLE_TIME if goes_on else None)
        return False

    def _may_jump(self) -> bool:
        """Return whether simulated time may move: a call goes on, and no thread of the program works.

        A thread that has worked for too long holds it back no more: it is forgotten here.
        """
        late: list[str] = []
        with self._turn:
            answer = self._may_jump_now(late)
        for name in late:  # not under the lock: a handler of the log may wait for a thread that needs it
            reason = f"has not returned for {CALLBACK_HOLDING_TIME:g} s; simulated time goes on without it"
            log.warning("%s %s", name, reason)
        return answer

    def _may_jump_now(self, late: list[str]) -> bool:
        """Return what :meth:`_may_jump` does, and add the names of callbacks that are forgotten to *late*."""
        if self._leaver is not None:
            return self._leaver in self._waiting
        # A call that another thread cancels has ended before it is taken out.
        if not self._waiting and all(call.done() for call in tuple(self._begun)):
            return False
        me, now = threading.current_thread(), time.monotonic()
        for thread, since in tuple(self._working.items()):
            if thread is me or thread in self._waiting:
                continue  # when the interpreter ends, the main thread counts as dead, but it still waits here
            name = self._callbacks.get(thread)
            if thread.is_alive() and now - since < (HOLDING_TIME if name is None else CALLBACK_HOLDING_TIME):
                return False
            del self._working[thread]
            if name is not None:
                late.append(name)
        return len(self._callbacks) >= min(self._callback_count, CALLBACK_THREADS)  # else one is about to begin

    # -- closing --

    def leave(self) -> None:
        """Run :attr:`before_close`, which stops the robot, close, and run :attr:`after_close`. Safe to repeat.

        All threads wait for the end.
        """
        self._refuse_inside(running_loop())
        with self._leaving:
            if self.is_closed:
                return
            self._leaver = threading.current_thread()
            try:
                if self.before_close is not None:
                    self._has_begun = False  # the stop waits for no call, and no signal comes before it
                    self.call(self.before_close())
            finally:
                self.close()
                if self.after_close is not None:
                    self.after_close()

    def _leave_at_exit(self) -> None:
        self._program_ends = True
        self.leave()

    def close(self) -> None:
        """Cancel what still runs and end the loop. Safe to repeat."""
        if self.is_closed:
            return
        try:
            with contextlib.suppress(ElibError):
                self.call(_cancel_all_tasks(), is_last=True)
        finally:
            self._signals.at_exit = None
            self._signals.leave()
            self._end()

    def _end(self) -> None:
        with self._turn:
            self._is_over = True
            if self._runner is not None:
                self.loop.call_soon_threadsafe(self.loop.stop)
            self._demand.notify_all()
            if not self._turn.wait_for(lambda: self._runner is None, CLOSING_TIME):
                log.error("the robot's event loop did not end within %g s", CLOSING_TIME)
                return
        if self._thread is not None:
            self._thread.join(CLOSING_TIME)
        self._pool.close()
        self.loop.close()


class KeepAlive:
    """A token that all objects of one robot share: when the last of them is dropped, the robot is stopped and closed.

    Nothing in the portal refers to it.
    """

    def __init__(self, portal: Portal) -> None:
        self._portal = portal

    def __del__(self) -> None:
        if self._portal.is_closed:
            return
        if host() is not None:
            if not self._portal.loop.is_running():
                self._leave()
            return
        # In a thread of its own: the last object may have been dropped in the middle of any code.
        ending = threading.Thread(target=self._leave, name="elib forgotten robot", daemon=True)
        ending.start()
        if running_loop() is None:  # an event loop must go on meanwhile, above all the portal's own
            ending.join(CLOSING_TIME)

    def _leave(self) -> None:
        try:
            self._portal.leave()
        except Exception as error:
            log.error("a robot that nothing refers to any more could not be closed: %s", error)


async def ended(futures: Iterable[AnyFuture], *, first: bool = False, timeout: float | None = None) -> None:
    """Wait until all calls that were begun, or the first of them, have ended, whatever their outcome.

    Args:
        futures: From :meth:`Portal.begin`, at least one.
        first: Wait for one of them.
        timeout: The loop's time after which to stop waiting, s.
    """
    outcomes = [asyncio.wrap_future(future) for future in futures]
    for each in outcomes:
        each.add_done_callback(lambda each: each.cancelled() or each.exception())  # asyncio would report it as not read
    how_many = asyncio.FIRST_COMPLETED if first else asyncio.ALL_COMPLETED
    await asyncio.wait(outcomes, timeout=timeout, return_when=how_many)


async def _behind_others(coroutine: Coroutine[Any, Any, T]) -> T:
    """Run *coroutine* a turn of the loop later: calls that were begun before need one more turn to start."""
    try:
        await asyncio.sleep(0)
        return await coroutine
    finally:
        coroutine.close()


def _nothing() -> None:
    """Do nothing: being called wakes the loop."""


async def _cancel_all_tasks() -> None:
    me = asyncio.current_task()
    tasks = [task for task in asyncio.all_tasks() if task is not me]
    for task in tasks:
        task.cancel()
    if tasks:
        await asyncio.wait(tasks, timeout=CLOSING_TIME)
    await asyncio.get_running_loop().shutdown_default_executor()
