import asyncio
import itertools
import math
import select
import selectors
import socket
import threading
from collections.abc import Coroutine
from time import monotonic as wall  # noqa: TID251  # what loop time is compared with
from types import SimpleNamespace
from typing import TypeVar

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elib.base import timebase
from elib.base.errors import ArgumentError, SimulationError, SimulationStalled
from elib.base.timebase import (
    CATCHING_UP,
    MAX_WAIT,
    LoopSpeed,
    Paced,
    PacedLoop,
    ScaledLoop,
    SimulatedLoop,
    new_loop,
    require_real_time,
)
from elib.testing import simulated
from shared import PATIENCE, now

T = TypeVar("T")


def simulate(main: Coroutine[object, object, T]) -> T:
    with asyncio.Runner(loop_factory=SimulatedLoop) as runner:
        return runner.run(main)


@simulated
async def test_a_sleep_takes_exactly_its_time_and_no_wall_time() -> None:
    times = [now()]
    for seconds in (3600, 0.25, 86400 * 365):
        await asyncio.sleep(seconds)  # clock: simulated
        times.append(now())
    assert times == [0.0, 3600.0, 3600.25, 31539600.25]


@given(st.lists(st.floats(0, 1e6), min_size=1, max_size=20))
def test_timers_ring_in_order_each_exactly_at_its_time(times: list[float]) -> None:
    async def main() -> list[tuple[float, float]]:
        loop = asyncio.get_running_loop()
        rung: list[tuple[float, float]] = []
        for time in times:
            loop.call_at(time, lambda time=time: rung.append((time, loop.time())))
        await asyncio.sleep(max(times) + 1)  # clock: simulated
        return rung

    rung = simulate(main())
    assert [asked for asked, _ in rung] == sorted(times)
    assert all(asked == actual for asked, actual in rung)


@pytest.mark.parametrize("speed", ["real", "max", 2, Paced()])
def test_the_time_of_every_loop_begins_at_zero(speed: LoopSpeed, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("time.monotonic", lambda: 27_000.0)  # a computer that was switched on hours ago
    loop = new_loop(speed)
    try:
        assert loop.time() == 0
    finally:
        loop.close()


@simulated
async def test_time_stands_still_while_code_runs() -> None:
    before = now()
    for _ in range(1000):
        await asyncio.sleep(0)
    assert now() == before


@simulated
async def test_a_timer_one_step_of_the_float_later_rings_later() -> None:
    loop = asyncio.get_running_loop()
    first, rung = 1000.0, []
    for time in (math.nextafter(first, math.inf), first):
        loop.call_at(time, lambda: rung.append(loop.time()))
    await asyncio.sleep(2000)  # clock: simulated
    assert rung == [1000.0, math.nextafter(1000.0, math.inf)]


@simulated
async def test_a_timeout_expires_on_time() -> None:
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(5):  # clock: simulated
            await asyncio.Event().wait()
    assert now() == 5.0


@simulated
async def test_a_cancelled_timer_does_not_make_the_time_jump() -> None:
    async with asyncio.timeout(5):  # clock: simulated
        await asyncio.sleep(1)  # clock: simulated
    await asyncio.sleep(1)  # clock: simulated
    assert now() == 2.0


@simulated
async def test_tasks_of_a_group_share_the_time() -> None:
    async with asyncio.TaskGroup() as group:
        for seconds in (1, 2, 3):
            group.create_task(asyncio.sleep(seconds))  # clock: simulated
    assert now() == 3.0


@simulated
async def test_no_time_passes_while_a_thread_works() -> None:
    ticks = itertools.count()
    started = threading.Event()

    async def tick() -> None:
        while True:
            await asyncio.sleep(1)  # clock: simulated
            next(ticks)

    def work() -> float:
        started.wait(PATIENCE)
        return loop.time()

    loop = asyncio.get_running_loop()
    ticking = asyncio.create_task(tick())
    working = asyncio.create_task(asyncio.to_thread(work))
    await asyncio.sleep(0)
    loop.call_soon(started.set)
    seen = await working
    ticking.cancel()
    assert (seen, now()) == (0.0, 0.0)


@simulated
async def test_a_thread_pool_is_shut_down_without_a_warning() -> None:
    assert sum(await asyncio.gather(*(asyncio.to_thread(lambda n=n: n) for n in range(10)))) == 45


@simulated
async def test_a_hold_stops_time_until_it_is_released() -> None:
    loop = asyncio.get_running_loop()
    assert isinstance(loop, SimulatedLoop)
    hold = loop.hold()
    hold.acquire()
    hold.acquire()
    sleeping = asyncio.create_task(asyncio.sleep(10))  # clock: simulated
    seen: list[float] = []

    def outside() -> None:
        seen.append(loop.time())
        hold.release()
        hold.release()

    thread = threading.Thread(target=outside)
    loop.call_soon(thread.start)
    await sleeping
    thread.join()
    assert [*seen, loop.time()] == [0.0, 10.0]


def test_a_hold_of_a_closed_loop_is_released_quietly() -> None:
    loop = SimulatedLoop()
    hold = loop.hold()
    hold.acquire()
    loop.close()
    hold.release()
    assert loop.is_closed()


@simulated
async def test_the_portal_is_asked_before_each_jump() -> None:
    loop = asyncio.get_running_loop()
    assert isinstance(loop, SimulatedLoop)
    answers = iter([False, True])

    def may_jump() -> bool:
        answer = next(answers, True)
        if not answer:
            threading.Thread(target=loop.call_soon_threadsafe, args=(lambda: None,)).start()
        return answer

    loop.may_jump = may_jump
    await asyncio.sleep(1)  # clock: simulated
    assert next(answers, None) is None
    assert loop.time() == 1.0


def test_when_everybody_waits_for_ever_the_simulation_says_who() -> None:
    async def main() -> None:
        async with asyncio.TaskGroup() as group:
            group.create_task(asyncio.Event().wait(), name="reader")
            group.create_task(asyncio.Queue().get(), name="writer")

    with pytest.raises(SimulationStalled) as caught:
        simulate(main())
    text = str(caught.value)
    assert "time stands still at 0 s" in text
    assert "reader waits in Event.wait (locks.py:" in text
    assert "writer waits in Queue.get (queues.py:" in text
    assert "main (test_timebase.py:" in text.replace(f"{main.__qualname__}", "main")
    assert "hint: put a timeout around" in text


def test_tasks_can_clean_up_after_a_stall() -> None:
    cleaned = []

    async def main() -> None:
        try:
            await asyncio.Event().wait()
        finally:
            await asyncio.sleep(1)  # clock: simulated
            cleaned.append(now())

    with pytest.raises(SimulationStalled):
        simulate(main())
    assert cleaned == [1.0]


def test_a_socket_may_still_wake_a_loop_without_timers() -> None:
    async def main() -> bytes:
        loop = asyncio.get_running_loop()
        ours, theirs = socket.socketpair()
        ours.setblocking(False)
        with ours, theirs:
            thread = threading.Thread(target=theirs.sendall, args=(b"hello",))
            loop.call_soon(thread.start)
            data = await loop.sock_recv(ours, 10)
            thread.join()
            return data

    assert simulate(main()) == b"hello"


@pytest.mark.parametrize("speed", ["real", 10.0, Paced(), "max"])
def test_no_loop_waits_so_long_at_once_that_a_signal_would_have_to_wait(
    speed: LoopSpeed, monkeypatch: pytest.MonkeyPatch
) -> None:
    waits: list[float | None] = []
    look = selectors.DefaultSelector.select

    def looked(selector: selectors.DefaultSelector, timeout: float | None = None) -> object:
        waits.append(timeout)
        if len(waits) == 10:
            theirs.send(b"!")
        return look(selector, 0)

    async def main() -> bytes:
        loop = asyncio.get_running_loop()
        if speed != "max":  # there the timer would end it at once
            loop.call_later(3600, int)
        return await loop.sock_recv(ours, 1)

    monkeypatch.setattr(selectors.DefaultSelector, "select", looked)
    monkeypatch.setattr(timebase, "_look", looked)
    ours, theirs = socket.socketpair()
    ours.setblocking(False)
    with ours, theirs, asyncio.Runner(loop_factory=lambda: new_loop(speed)) as runner:
        assert runner.run(main()) == b"!"
    assert all(wait is not None and wait <= MAX_WAIT for wait in waits)


def test_real_things_are_refused_in_simulated_time_only() -> None:
    async def ask() -> None:
        require_real_time("a serial port")

    with pytest.raises(SimulationError, match="a serial port works in real time"):
        simulate(ask())
    with asyncio.Runner(loop_factory=lambda: new_loop("real")) as runner:
        runner.run(ask())


@pytest.mark.parametrize(
    ("speed", "kind"), [("max", SimulatedLoop), (2, ScaledLoop), (0.5, ScaledLoop), (Paced(), PacedLoop)]
)
def test_the_speed_decides_the_loop(speed: float, kind: type[asyncio.AbstractEventLoop]) -> None:
    loop = new_loop(speed)
    assert type(loop) is kind
    loop.close()


@pytest.mark.parametrize("speed", [0, -1, 1e9, math.nan, math.inf, "fast", None])
def test_an_impossible_speed_is_refused(speed: float) -> None:
    with pytest.raises(ArgumentError, match="it must be 'real', 'max' or a factor from"):
        new_loop(speed)


def test_paced_time_is_exact_and_never_ahead_of_the_wall_clock() -> None:
    loop = PacedLoop(50)
    before = wall()

    async def main() -> list[tuple[float, float]]:
        seen = []
        for _ in range(20):
            await asyncio.sleep(0.1)  # clock: only that it is not shorter is read from the wall clock
            seen.append((loop.time(), 50 * (wall() - before)))
        return seen

    with asyncio.Runner(loop_factory=lambda: loop) as runner:
        seen = runner.run(main())
    assert [paced for paced, _ in seen] == list(itertools.accumulate([0.1] * 20))
    assert all(paced <= passed + 1e-6 for paced, passed in seen)


def test_computing_takes_no_paced_time_and_a_thread_wakes_the_loop() -> None:
    async def main() -> list[float]:
        loop = asyncio.get_running_loop()
        times = [loop.time()]
        sum(range(200_000))
        times.append(loop.time())
        woken = asyncio.Event()
        thread = threading.Thread(target=lambda: loop.call_soon_threadsafe(woken.set))
        thread.start()
        async with asyncio.timeout(3600):
            await woken.wait()
        times.append(loop.time())
        return times

    with asyncio.Runner(loop_factory=PacedLoop) as runner:
        assert runner.run(main()) == [0.0, 0.0, 0.0]


def test_paced_time_that_was_lost_is_not_made_up_for_at_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    wall = 100.0
    monkeypatch.setattr("asyncio.base_events.time.monotonic", lambda: wall)
    loop = PacedLoop()
    loop.call_later(1.0, int)
    assert loop._wait() == pytest.approx(1.0)
    wall += 60.0  # a breakpoint
    assert loop._jump()
    loop._scheduled.clear()
    loop.call_later(1.0, int)
    assert loop._wait() == pytest.approx(1.0 - CATCHING_UP)
    loop.close()


def test_scaled_time_runs_by_its_factor(monkeypatch: pytest.MonkeyPatch) -> None:
    wall = 100.0
    monkeypatch.setattr("asyncio.base_events.time.monotonic", lambda: wall)
    loop = ScaledLoop(50)
    assert loop.time() == 0.0
    wall += 0.5
    assert loop.time() == pytest.approx(25.0)
    loop.close()


def test_a_scaled_loop_asks_the_system_for_less_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    wall = 100.0
    waits: list[float] = []

    def wait(read: list[int], write: list[int], extra: list[int], timeout: float) -> object:
        nonlocal wall
        waits.append(timeout)
        wall += timeout
        return select.select(read, write, extra, 0)

    monkeypatch.setattr("elib.base.timebase.select", SimpleNamespace(select=wait))
    monkeypatch.setattr("asyncio.base_events.time.monotonic", lambda: wall)
    with asyncio.Runner(loop_factory=lambda: ScaledLoop(100)) as runner:
        runner.run(asyncio.sleep(20.0))  # clock: a clock of the test's own
    assert sum(waits) == pytest.approx(0.2)


def test_files_and_threads_work_on_a_scaled_loop() -> None:
    async def main() -> bytes:
        reader, writer = await asyncio.open_connection(sock=ours)
        theirs.sendall(b"hello\n")
        line = await reader.readline()
        writer.close()
        await writer.wait_closed()
        return line + await asyncio.to_thread(bytes, 1)

    ours, theirs = socket.socketpair()
    with theirs, asyncio.Runner(loop_factory=lambda: ScaledLoop(100)) as runner:
        assert runner.run(main()) == b"hello\n\0"


def test_work_that_was_handed_in_before_time_may_jump_is_done_before_the_jump() -> None:
    loop = SimulatedLoop()
    handed_in: list[float] = []

    def may_jump() -> bool:
        if not handed_in:
            # Another thread does this between the loop's look at its files and its question.
            loop.call_soon_threadsafe(lambda: handed_in.append(loop.time()))
            handed_in.append(-1.0)
        return True

    loop.may_jump = may_jump
    try:
        loop.run_until_complete(asyncio.sleep(1.0))  # clock: simulated
    finally:
        loop.close()
    assert handed_in == [-1.0, 0.0]
