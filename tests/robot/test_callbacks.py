"""Callbacks that raise, block or never return: the others go on, and so do time and the robot."""

import logging
import os
import queue
import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest
from turns import let_turn

import elib
from elib.base.errors import ElibError, LinkClosed
from elib.link.session import TraceEvent
from elib.robot import portal
from elib.robot.callbacks import CALLBACK_THREADS, CallbackPool
from elib.robot.portal import CALLBACK_HOLDING_TIME, HOLDING_TIME
from elib.testing import emulator_of
from shared import PATIENCE, wait_until

MAX, REAL = "sim://square?speed=max&firmware=btcom-2.0", "sim://square?baud=0"


class Clock:
    """The clock by which threads are seen to work."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 0.0
        monkeypatch.setattr(portal, "time", SimpleNamespace(monotonic=lambda: self.now))


@pytest.fixture
def pool() -> CallbackPool:
    return CallbackPool()


# -- raising ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("url", [MAX, REAL])
@pytest.mark.parametrize("error", [SystemExit, KeyboardInterrupt, GeneratorExit])
def test_callbacks_that_end_the_program_end_nothing_and_are_reported(
    url: str, error: type[BaseException], caplog: pytest.LogCaptureFixture
) -> None:
    def leave(value: object, state: object) -> None:
        raise error("from a callback")

    with elib.connect(url) as robot, caplog.at_level(logging.ERROR, "elib"):
        for _ in range(CALLBACK_THREADS + 1):
            robot.callback(leave).selector()
        called = threading.Event()
        robot.callback(lambda value, state: called.set()).selector()
        assert called.wait(PATIENCE)
        reported = "the callback of selector() raised; the link goes on"
        wait_until(lambda: caplog.text.count(reported) == CALLBACK_THREADS + 1)
    assert f"{error.__name__}: from a callback" in caplog.text


def test_a_callback_of_a_call_that_has_ended_is_called_after_the_robot_was_closed_too() -> None:
    called = queue.SimpleQueue[object]()
    with elib.connect(MAX) as robot:
        pending = robot.begin.selector()
        pending.add_done_callback(called.put)
        assert called.get(timeout=PATIENCE) is pending  # a thread for callbacks has begun
    pending.add_done_callback(called.put)
    assert called.get(timeout=PATIENCE) is pending


# -- blocking --------------------------------------------------------------------------------------------------------


def test_sixteen_callbacks_run_at_once() -> None:
    with elib.connect(MAX) as robot:
        pending = robot.begin.selector()
        pending.end()
        meeting = threading.Barrier(CALLBACK_THREADS + 1)
        for _ in range(CALLBACK_THREADS):
            pending.add_done_callback(lambda _: meeting.wait(PATIENCE))
        meeting.wait(PATIENCE)  # broken, if one of them waited for another to end
    assert CALLBACK_THREADS == 16


def test_a_callback_never_waits_behind_a_blocked_one_while_threads_are_free(pool: CallbackPool) -> None:
    fetched, go_on, ran = threading.Event(), threading.Event(), threading.Event()

    class Slow(queue.SimpleQueue):  # type: ignore[type-arg]
        """Holds a thread up between fetching a callback and running it."""

        def get(self, *args: object) -> object:
            item = super().get()
            if not fetched.is_set():
                fetched.set()
                go_on.wait(PATIENCE)
            return item

    pool._queue = Slow()
    pool.put(threading.Event().wait, "one that never returns")
    assert fetched.wait(PATIENCE)
    pool.put(ran.set, "another one")
    go_on.set()
    assert ran.wait(PATIENCE)


def test_simulated_time_goes_on_without_a_callback_that_waits_for_the_main_program(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = Clock(monkeypatch)
    main_went_on = threading.Event()
    seen: queue.SimpleQueue[int] = queue.SimpleQueue()

    def wait(value: object, state: object) -> None:
        clock.now += CALLBACK_HOLDING_TIME
        main_went_on.wait()
        seen.put(robot.selector().position)

    def others_go_on() -> bool:
        with robot._portal._turn:
            return True

    class Waiting(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            assert pool.submit(others_go_on).result(PATIENCE)

    handler = Waiting(logging.WARNING)
    with ThreadPoolExecutor(1) as pool, elib.connect(MAX) as robot:
        for _ in range(3):
            robot.callback(wait).selector()
        before = robot.time
        logging.getLogger("elib").addHandler(handler)
        robot.sleep(10)
        logging.getLogger("elib").removeHandler(handler)
        assert robot.time - before == pytest.approx(10)
        main_went_on.set()
        clock.now += HOLDING_TIME  # the main thread waits for something else from now on
        assert [seen.get(timeout=PATIENCE) for _ in range(3)] == [3, 3, 3]
    assert caplog.text.count("the callback of selector() has not returned for 5 s; simulated time goes on") == 3


def test_a_callback_that_works_between_its_calls_holds_the_time_until_it_ends(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = Clock(monkeypatch)
    times: list[tuple[float, float]] = []

    def work(value: object, state: object) -> None:
        for _ in range(8):
            robot.selector()
            before = robot.time
            clock.now += 0.9 * CALLBACK_HOLDING_TIME
            let_turn(robot)
            times.append((before, robot.time))

    with elib.connect(MAX) as robot:
        robot.callback(work).selector()
        robot.sleep(3600)
    assert len(times) == 8
    assert all(before == after < 3600 for before, after in times)


@pytest.mark.parametrize("url", [MAX, REAL])
def test_a_robot_closes_and_stops_although_callbacks_never_return(url: str) -> None:
    robot = elib.connect(url)
    motors = emulator_of(robot).firmware.motors
    robot.set_speed(0.5, 0.5)
    pending = robot.begin.selector()
    pending.end()
    entered = threading.Barrier(CALLBACK_THREADS + 1)

    def block(_: object) -> None:
        entered.wait(PATIENCE)
        threading.Event().wait()

    for _ in range(CALLBACK_THREADS):
        pending.add_done_callback(block)
    entered.wait(PATIENCE)
    robot.close()
    assert [motor.speed for motor in motors] == [0, 0]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("url", [MAX, REAL])
def test_one_signal_ends_the_block_although_a_callback_never_returns(url: str, number: signal.Signals) -> None:
    def block(value: object, state: object) -> None:
        os.kill(os.getpid(), number)
        threading.Event().wait()

    with pytest.raises((KeyboardInterrupt, SystemExit)), elib.connect(url) as robot:
        motors = emulator_of(robot).firmware.motors
        robot.set_speed(0.5, 0.5)
        robot.callback(block).selector()
        robot.sleep(3600)
    assert [motor.speed for motor in motors] == [0, 0]


# -- closing ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("url", [MAX] * 4 + [REAL])
def test_any_number_of_threads_may_close_a_robot_and_each_finds_it_closed(url: str) -> None:
    robot = elib.connect(url)
    motors = emulator_of(robot).firmware.motors
    robot.set_speed(0.5, 0.5)
    together = threading.Barrier(16)
    outcomes: list[object] = []

    def close() -> None:
        together.wait(PATIENCE)
        try:
            robot.close()
            outcomes.append((repr(robot).endswith("closed>"), [motor.speed for motor in motors]))
        except BaseException as error:
            outcomes.append(error)

    threads = [threading.Thread(target=close) for _ in range(16)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    assert outcomes == [(True, [0, 0])] * 16


@pytest.mark.parametrize("url", [MAX, REAL])
def test_a_callback_may_close_its_robot(url: str) -> None:
    robot = elib.connect(url)
    closed = threading.Event()

    def close(value: object, state: object) -> None:
        robot.close()
        closed.set()

    robot.callback(close).selector()
    with pytest.raises(LinkClosed):
        robot.sleep(60)
    assert closed.wait(PATIENCE)


@pytest.mark.parametrize("url", [MAX, REAL])
def test_closing_gives_every_callback_that_waits_an_error_actions_too(url: str) -> None:
    for _ in range(10):
        robot = elib.connect(url)
        errors: queue.SimpleQueue[ElibError] = queue.SimpleQueue()
        view = robot.callback(None, lambda error, errors: errors.put(error), errors)
        view.sleep(60)
        view.calibrate_proximity()
        view.selector()
        robot.close()
        assert [type(errors.get(timeout=PATIENCE)) for _ in range(3)] == [LinkClosed] * 3


def test_closing_from_within_the_robots_own_loop_is_refused_at_once() -> None:
    errors: list[str] = []

    def hook(time: float, event: TraceEvent) -> None:
        if not errors:
            try:
                robot.close()
            except RuntimeError as error:
                errors.append(str(error))

    with elib.connect(MAX) as robot:
        robot.trace(hook)
        assert robot.selector().position == 3
    assert "from within the robot's own event loop" in errors[0]


@pytest.mark.parametrize("url", [MAX, REAL])
def test_a_closed_robot_leaves_no_thread_behind(url: str) -> None:
    before = set(threading.enumerate())
    with elib.connect(url) as robot:
        called = threading.Event()
        robot.callback(lambda value, state: called.set()).selector()
        robot.sleep(0.5)
        assert called.wait(PATIENCE)
    for thread in set(threading.enumerate()) - before:
        thread.join(PATIENCE)
        assert not thread.is_alive(), thread.name
