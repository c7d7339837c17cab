"""Simulated time while the program waits for something of its own, and waiting for several calls at once."""

import asyncio
import os
import queue
import selectors
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from typing import Any

import pytest
from turns import let_turn

import elib
from elib.base import timebase
from elib.base.errors import LinkClosed
from elib.testing import link_of
from shared import PATIENCE

MAX, REAL = "sim://square?speed=max&firmware=btcom-2.0", "sim://square?baud=0"


# -- while the program waits elsewhere ---------------------------------------------------------------------------------


def chain(robot: elib.BlockingEpuck) -> None:
    """Drive, wait, stop and close by callbacks alone, while the program waits for an event: figure 6.3 of 2011."""
    done = threading.Event()
    seen: list[object] = []

    def moving(value: object, state: object) -> None:
        robot.callback(waited, seen.append).sleep(2.0)

    def waited(value: object, state: object) -> None:
        robot.callback(counted, seen.append).encoders()

    def counted(value: elib.Steps, state: object) -> None:
        seen.append(value.left)
        robot.callback(stopped, seen.append).stop()

    def stopped(value: object, state: object) -> None:
        robot.close()
        done.set()

    robot.callback(moving, seen.append).set_speed(0.5, 0.5)
    assert done.wait(PATIENCE)
    assert seen == [pytest.approx(1000, abs=15)]


@pytest.mark.parametrize("place", ["the main thread", "a notebook's cell", "a second thread"])
def test_a_chain_of_callbacks_goes_on_while_the_program_waits_for_an_event(place: str) -> None:
    def program() -> None:
        chain(elib.connect(MAX))

    async def cell() -> None:
        program()

    if place == "the main thread":
        program()
    elif place == "a notebook's cell":
        asyncio.run(cell())
    else:
        with ThreadPoolExecutor() as threads:
            threads.submit(program).result(PATIENCE)


def test_a_begun_call_ends_while_the_program_asks_again_and_again_whether_it_has() -> None:
    with elib.connect(MAX) as robot:
        pending = robot.begin.sleep(100)
        while not pending.done():
            pass
        assert robot.time >= 100


def test_a_begun_call_ends_while_the_program_waits_for_its_callback() -> None:
    with elib.connect(MAX) as robot:
        ended: queue.SimpleQueue[elib.Selector] = queue.SimpleQueue()
        for _ in range(3):
            robot.begin(lambda pending: ended.put(pending.end())).selector()
            assert ended.get(timeout=PATIENCE).position == 3


def test_time_passes_for_the_calls_that_go_on_and_no_further() -> None:
    with elib.connect(MAX) as robot:
        before = robot.time
        ended = threading.Event()
        robot.begin(lambda pending: ended.set()).sleep(5)
        assert ended.wait(PATIENCE)
        assert robot.time - before == pytest.approx(5)
        let_turn(robot)
        assert robot.time - before == pytest.approx(5)
        robot.sleep(1)
        assert robot.time - before == pytest.approx(6)


def test_time_does_not_wait_for_a_callback_of_before_when_the_program_calls_again() -> None:
    with elib.connect(MAX) as robot:
        for turn in range(5):
            ended = threading.Event()
            robot.begin(lambda pending, ended=ended: ended.set()).sleep(1)
            assert ended.wait(PATIENCE)
            before = robot.time
            robot.sleep(1)
            assert robot.time - before == pytest.approx(1), turn


# -- how soon time moves -----------------------------------------------------------------------------------------------


@pytest.fixture
def slept(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return the waits of simulated loops that nothing ended but their own time, s."""
    found: list[float] = []
    look = timebase._look

    def looked(selector: selectors.DefaultSelector, timeout: float | None = None) -> list[object]:
        is_held = timeout == timebase.HELD_PERIOD
        ready = look(selector, PATIENCE if is_held and not found else timeout)
        if is_held and not ready:
            found.append(timeout)
        return ready

    monkeypatch.setattr(timebase, "_look", looked)
    return found


def test_time_moves_at_once_for_a_call_in_a_notebook(monkeypatch: pytest.MonkeyPatch, slept: list[float]) -> None:
    asked = threading.Event()
    submit = asyncio.run_coroutine_threadsafe

    def late(*call: Any) -> object:
        asked.clear()
        future = submit(*call)
        assert asked.wait(PATIENCE)  # the loop may ask whether this thread waits before it goes on
        return future

    async def cell() -> None:
        with elib.connect(MAX) as robot:
            loop, may_jump = robot._portal.loop, robot._portal.loop.may_jump
            loop.may_jump = lambda: asked.set() or may_jump()
            monkeypatch.setattr(asyncio, "run_coroutine_threadsafe", late)
            for _ in range(20):
                robot.selector()
            monkeypatch.setattr(asyncio, "run_coroutine_threadsafe", submit)

    asyncio.run(cell())
    assert slept == []


def test_time_moves_at_once_for_several_robots_that_are_waited_for(slept: list[float]) -> None:
    with elib.connect(MAX) as alice, elib.connect(MAX) as bob:
        for _ in range(5):
            done, _ = elib.wait([alice.begin.selector(), bob.begin.selector()])
            assert [call.end().position for call in done] == [3, 3]
    assert slept == []


@pytest.mark.parametrize("style", ["a blocking call", "a call that was begun"])
def test_a_call_that_ends_before_its_thread_follows_it_does_not_stall_time(
    style: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    submit = asyncio.run_coroutine_threadsafe

    def followed_late(*call: Any) -> Any:
        future = submit(*call)
        follow = future.add_done_callback

        def late(function: Callable[..., object]) -> None:
            for _ in range(200):  # so often could the loop run, and look whether time may move
                pool.submit(int).result(PATIENCE)
            follow(function)

        future.add_done_callback = late
        return future

    async def cell() -> None:
        with elib.connect(MAX) as robot:
            portal, before = robot._portal, robot.time
            with monkeypatch.context() as patch:
                patch.setattr(asyncio, "run_coroutine_threadsafe", followed_late)
                if style == "a blocking call":
                    portal.call(asyncio.sleep(0))
                else:
                    with portal.lent():
                        portal.begin(asyncio.sleep(0)).result(PATIENCE)
            portal.check()
            assert robot.time == before

    with ThreadPoolExecutor(1) as pool:
        asyncio.run(cell())


# -- waiting for several calls ---------------------------------------------------------------------------------------


@pytest.fixture(params=[MAX, REAL])
def robot(request: pytest.FixtureRequest, thought_takes_no_time: None) -> Iterator[elib.BlockingEpuck]:
    with elib.connect(request.param) as robot:
        yield robot


def test_all_calls_that_were_begun_are_waited_for(robot: elib.BlockingEpuck) -> None:
    calls = [robot.begin.sleep(0.1), robot.begin.selector(), robot.begin.sleep(0.2)]
    assert elib.wait(calls) == (calls, [])
    assert all(call.done() for call in calls)


def test_waiting_for_the_first_ends_with_it(robot: elib.BlockingEpuck) -> None:
    early, never = robot.begin.sleep(0.1), robot.begin.sleep(3600)
    assert elib.wait([never, early], first=True) == ([early], [never])
    late = robot.begin.sleep(0.1)
    assert elib.wait([late, never], first=True) == ([late], [never])
    assert elib.wait([late, early, never], first=True) == ([late, early], [never])


def test_waiting_ends_after_its_time_and_the_calls_go_on(robot: elib.BlockingEpuck) -> None:
    never, early = robot.begin.sleep(3600), robot.begin.sleep(0.1)
    early.end()
    assert elib.wait([never, early], timeout=0.1) == ([early], [never])
    assert elib.wait([never, early], timeout=0) == ([early], [never])
    late = robot.begin.sleep(0.1)
    assert elib.wait([late, early], timeout=PATIENCE) == ([late, early], [])


@pytest.mark.usefixtures("thought_takes_no_time")
def test_simulated_time_is_waited_for_exactly() -> None:
    with elib.connect(MAX) as robot:
        before = robot.time
        elib.wait([robot.begin.sleep(2), robot.begin.sleep(1)], first=True)
        assert robot.time - before == pytest.approx(1)
        elib.wait([robot.begin.sleep(60)], timeout=3)
        assert robot.time - before == pytest.approx(4)


def test_a_call_that_failed_has_ended_and_its_error_is_raised_by_nobody_else(robot: elib.BlockingEpuck) -> None:
    link_of(robot).lose_next_reply()
    failed = robot.begin.within(0.1).selector()
    assert elib.wait([failed]) == ([failed], [])
    with pytest.raises(elib.ReplyTimeout):
        failed.end()


def test_calls_that_have_ended_and_no_calls_at_all_are_not_waited_for(robot: elib.BlockingEpuck) -> None:
    call = robot.begin.selector()
    call.end()
    before = robot.time if "max" in robot.url else None
    assert elib.wait([call, call]) == ([call, call], [])
    assert elib.wait([], first=True, timeout=1) == ([], [])
    assert elib.wait(iter([call, robot.begin.sleep(0.1)]), first=True)[0] == [call]
    assert before is None or robot.time == before


def test_closing_the_robot_ends_the_wait_for_its_calls(robot: elib.BlockingEpuck) -> None:
    calls = [robot.begin.sleep(60), robot.begin.sleep(90)]
    robot.callback(lambda value, state: robot.close()).sleep(0.1)
    assert elib.wait(calls) == (calls, [])
    for call in calls:
        with pytest.raises(LinkClosed):
            call.end()


@pytest.mark.parametrize("other", [MAX, REAL])
@pytest.mark.parametrize("one", [MAX, REAL])
def test_calls_of_several_robots_are_waited_for_together(one: str, other: str) -> None:
    with elib.connect(one) as ada, elib.connect(other) as bob:
        calls = [ada.begin.selector(), bob.begin.selector(), bob.begin.sleep(0.1)]
        assert elib.wait(calls) == (calls, [])
        assert elib.wait([ada.begin.sleep(0.1), bob.begin.sleep(0.1)], first=True)[0]
        before = ada.time, bob.time
        elib.wait([ada.begin.sleep(60), bob.begin.sleep(60)], timeout=0.2)
        assert ada.time - before[0] >= 0.2 - 1e-9  # a difference of two rounded times
        assert bob.time - before[1] >= 0.2 - 1e-9


@pytest.mark.usefixtures("thought_takes_no_time")
def test_waiting_for_the_first_call_does_not_stall_the_time_of_another_robot() -> None:
    with elib.connect(MAX) as alice, elib.connect(MAX) as bob:
        portal, before = bob._portal, bob.time

        class Late(set[Any]):
            def discard(self, call: Any) -> None:
                if call.cancelled():  # the wait for bob: his call ends before this is noted
                    hold.release()
                    wait([calls[1]._future], PATIENCE)
                    let_turn(bob)
                super().discard(call)

        portal._begun, hold = Late(), portal.loop.hold()
        hold.acquire()
        calls = [alice.begin.selector(), bob.begin.sleep(1)]
        elib.wait(calls, first=True)
        portal.check()
        assert calls[1].done()
        assert bob.time - before == pytest.approx(1)


def test_waiting_for_several_robots_ends_after_its_time_and_when_the_first_is_closed() -> None:
    with elib.connect(REAL) as ada, elib.connect(REAL) as bob:
        calls = [ada.begin.sleep(60), bob.begin.sleep(60)]
        assert elib.wait(calls, timeout=0.2) == ([], calls)
        ada.close()
        assert elib.wait(calls, first=True) == ([calls[0]], [calls[1]])


@pytest.mark.parametrize(
    "wrong",
    [
        lambda robot: elib.wait([robot.selector]),
        lambda robot: elib.wait(robot.begin.selector()),
        lambda robot: elib.wait([robot.begin.selector()], timeout=-1),
        lambda robot: elib.wait([robot.begin.selector()], timeout=float("inf")),
    ],
)
def test_what_was_not_begun_cannot_be_waited_for(wrong: Callable[[elib.BlockingEpuck], object]) -> None:
    with elib.connect(MAX) as robot, pytest.raises((elib.ArgumentError, TypeError)):
        wrong(robot)


def test_a_signal_ends_the_wait_for_several_robots() -> None:
    with pytest.raises(KeyboardInterrupt), elib.connect(MAX) as ada, elib.connect(REAL) as bob:
        calls = [ada.begin.selector(), bob.begin.sleep(3600)]
        bob.callback(lambda value, state: os.kill(os.getpid(), signal.SIGINT)).sleep(0.1)
        elib.wait(calls)


def test_a_robot_that_is_just_being_closed_fails_nobody_who_waits_for_several() -> None:
    with elib.connect("sim://?speed=max") as alice, elib.connect("sim://?speed=max") as bob:
        calls = [alice.begin.sleep(5), bob.begin.sleep(5)]
        bob._portal.is_closed = True  # as it is from the first moment of closing, when its calls have not ended yet
        try:
            done, pending = elib.wait(calls, timeout=1)
            assert {*done, *pending} == set(calls)
        finally:
            bob._portal.is_closed = False
