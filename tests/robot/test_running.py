"""A coroutine run to its end from ordinary code: signals, and event loops that run already."""

import asyncio
from collections.abc import Awaitable, Callable

import pytest

import elib
from elib.base.errors import ArgumentError, ReplyTimeout
from elib.behaviours import find, play
from elib.robot.running import run_coroutine
from lanes import short
from shared import run_python

FAST = "sim://?speed=max"


async def position(robot: elib.Epuck) -> elib.Steps:
    """Drive a little."""
    await robot.set_speed(0.5, 0.5)
    await robot.sleep(0.1)
    return await robot.encoders()


async def refuse(robot: elib.Epuck) -> None:
    """Fail."""
    raise ReplyTimeout("of the program", request="none")


@pytest.mark.parametrize(
    "run",
    [
        lambda main: elib.run(main, robot=FAST),
        lambda main: elib.swarm(FAST).run(lambda robots: main(robots[0])),
    ],
)
def test_a_program_runs_where_an_event_loop_runs_already(
    run: Callable[[Callable[..., Awaitable[object]]], object],
) -> None:
    async def notebook() -> object:
        with pytest.raises(ReplyTimeout, match="of the program"):
            run(refuse)
        return run(position)

    assert asyncio.run(notebook()) == run(position)


def test_a_behaviour_plays_where_an_event_loop_runs_already() -> None:
    async def notebook() -> object:
        return play(find("avoid"), FAST, seconds=1).duration

    assert asyncio.run(notebook()) == pytest.approx(1)


def test_an_impossible_speed_leaves_nothing_behind(recwarn: pytest.WarningsRecorder) -> None:
    with pytest.raises(ArgumentError):
        run_coroutine(lambda: asyncio.sleep(0), 1e9)
    assert not recwarn


GAPS = (0, 0.02)
REPEATED = ("SIGINT SIGINT", "SIGTERM SIGINT", "SIGINT SIGTERM SIGHUP", "SIGINT SIGINT SIGINT")


def repeated_signals() -> list[object]:
    """Return places, signals and gaps; each pair of two of them once, and two of them for the quick form."""
    cases = [
        (("alone", "notebook")[(row + column) % 2], numbers, gap)
        for row, numbers in enumerate(REPEATED)
        for column, gap in enumerate(GAPS)
    ]
    quick = {("alone", "SIGINT SIGTERM SIGHUP", 0), ("notebook", "SIGTERM SIGINT", 0)}
    return short(cases, *quick)


@pytest.mark.parametrize(("place", "numbers", "gap"), repeated_signals())
def test_repeated_signals_do_not_cut_short_how_a_program_ends(place: str, numbers: str, gap: float) -> None:
    done = run_python(
        f"""
        import asyncio, os, signal, threading
        from elib.robot.running import run_coroutine

        all_came = threading.Event()

        def press():
            for name in {numbers!r}.split():
                os.kill(os.getpid(), getattr(signal, name))
                threading.Event().wait({gap})
            all_came.set()

        async def main():
            threading.Thread(target=press, daemon=True).start()
            try:
                await asyncio.Event().wait()
            finally:
                while not all_came.is_set():
                    await asyncio.sleep(0.01)
                print("stopped")

        async def notebook():
            run_coroutine(main)

        if {place!r} == "alone":
            run_coroutine(main)
        else:
            asyncio.run(notebook())
        """
    )
    assert done.stdout == "stopped\n", done.stderr
    codes = {"SIGINT": -2, "SIGTERM": 143, "SIGHUP": 129}
    # Of those that come at nearly the same time Python may handle any first.
    assert done.returncode in [codes[name] for name in numbers.split()]


@pytest.mark.parametrize(
    ("name", "codes"), [("SIGINT", (1, -2)), pytest.param("SIGTERM", (143,), marks=pytest.mark.long)]
)
def test_a_signal_ends_a_program_that_blocks_its_event_loop(name: str, codes: tuple[int, ...]) -> None:
    done = run_python(
        f"""
        import asyncio, os, signal
        from elib.robot.running import run_coroutine

        async def main():
            try:
                os.kill(os.getpid(), signal.{name})
                while True:
                    pass
            finally:
                await asyncio.sleep(0.05)
                print("stopped")

        run_coroutine(main)
        """
    )
    assert done.stdout == "stopped\n", done.stderr
    assert done.returncode in codes, done.stderr


def test_a_signal_ends_a_blocking_call_whose_event_loop_a_hook_blocks() -> None:
    done = run_python(
        f"""
        import os, signal, threading, elib
        from elib.testing import emulator_of

        def block(time, event):
            os.kill(os.getpid(), signal.SIGTERM)
            threading.Event().wait()

        with elib.connect({FAST!r}) as robot:
            robot.set_speed(0.5, 0.5)
            motors = emulator_of(robot).firmware.motors
            robot.trace(block)
            try:
                robot.proximity()
            finally:
                robot.robot.session.hooks.remove(block)
                robot.close()
                print([motor.speed for motor in motors])
        """
    )
    assert (done.returncode, done.stdout) == (143, "[0, 0]\n"), done.stderr


def test_a_signal_has_its_usual_effect_again_when_all_is_over() -> None:
    done = run_python(
        """
        import asyncio, os, signal, time
        from elib.robot.running import run_coroutine

        before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
        run_coroutine(lambda: asyncio.sleep(0))
        assert before == [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
        """
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("url", short([FAST, "sim://square?baud=0"], FAST))
def test_signals_that_a_program_handles_itself_stay_its_own_and_the_others_are_given_back(url: str) -> None:
    done = run_python(
        f"""
        import signal, elib

        names = "SIGINT SIGTERM SIGHUP SIGQUIT SIGTSTP".split()
        numbers = [getattr(signal, name) for name in names]
        before = [signal.getsignal(number) for number in numbers]
        with elib.connect({url!r}):
            assert not any(signal.getsignal(number) == old for number, old in zip(numbers, before))
        assert [signal.getsignal(number) for number in numbers] == before
        for number in numbers:
            signal.signal(number, lambda number, frame: None)
        before = [signal.getsignal(number) for number in numbers]
        with elib.connect({url!r}):
            assert [signal.getsignal(number) for number in numbers] == before
        """
    )
    assert done.returncode == 0, done.stderr
