"""Simulated time while the program waits for something of its own, and waiting for several calls at once."""

import asyncio
import queue
import threading

import pytest

import elib

MAX, REAL = "sim://square?speed=max&firmware=btcom-2.0", "sim://square?baud=0"
LONG = 20.0
"""s of real time: more than anything here may take on any machine."""


# -- while the program waits elsewhere ---------------------------------------------------------------------------------


def chain(robot: elib.BlockingEpuck) -> None:
    """Drive, wait, stop and close by callbacks alone, while the program waits for an event: figure 6.3 of the thesis."""
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
    assert done.wait(LONG)
    assert seen == [pytest.approx(1000, abs=15)]


def test_a_chain_of_callbacks_goes_on_while_the_main_thread_waits_for_an_event() -> None:
    chain(elib.connect(MAX))


def test_a_chain_of_callbacks_goes_on_while_a_notebooks_cell_waits_for_an_event() -> None:
    async def cell() -> None:
        chain(elib.connect(MAX))

    asyncio.run(cell())


def test_a_chain_of_callbacks_goes_on_while_a_second_thread_waits_for_an_event() -> None:
    errors: list[BaseException] = []

    def program() -> None:
        try:
            chain(elib.connect(MAX))
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=program)
    thread.start()
    thread.join(LONG)
    assert not thread.is_alive()
    assert errors == []


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
            assert ended.get(timeout=LONG).position == 3


def test_time_passes_for_the_calls_that_go_on_and_no_further() -> None:
    with elib.connect(MAX) as robot:
        before = robot.time
        ended = threading.Event()
        robot.begin(lambda pending: ended.set()).sleep(5)
        assert ended.wait(LONG)
        assert robot.time - before == pytest.approx(5)
        threading.Event().wait(0.2)
        assert robot.time - before == pytest.approx(5)
        robot.sleep(1)
        assert robot.time - before == pytest.approx(6)


def test_time_does_not_wait_for_a_callback_of_before_when_the_program_calls_again() -> None:
    with elib.connect(MAX) as robot:
        for turn in range(5):
            ended = threading.Event()
            robot.begin(lambda pending, ended=ended: ended.set()).sleep(1)
            assert ended.wait(LONG)
            before = robot.time
            robot.sleep(1)
            assert robot.time - before == pytest.approx(1), turn
