import contextlib
import gc
import logging
import re
import signal
import threading
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from turns import let_turn

import elib
from elib.base.errors import ArgumentError, LinkClosed, LinkNotFound, ReplyTimeout, Unsupported
from elib.base.timebase import SimulatedLoop
from elib.link.protocol.profiles import FIRMWARES, PROFILES
from elib.link.session import Wrote
from elib.robot.sleeping import MANY_READS
from elib.testing import emulator_of, link_of
from shared import PATIENCE, run_python

SIM = "sim://square?speed=max&firmware=btcom-2.0"


def lose_replies(robot: elib.BlockingEpuck, count: int) -> None:
    """Let the robot's next answers be lost on the way."""
    for _ in range(count):
        link_of(robot).lose_next_reply()


def wheels(robot: elib.BlockingEpuck) -> tuple[int, int]:
    """Return the speeds of the virtual robot's motors, steps/s."""
    motors = emulator_of(robot).firmware.motors
    return tuple(motor.speed for motor in motors)


def test_a_blocking_call_returns_the_value() -> None:
    with elib.connect(SIM) as robot:
        robot.set_speed(0.25, -0.5)
        assert robot.speed() == (0.25, -0.5)
        assert robot.firmware == "btcom-2.0"
        assert robot.name == robot.url == SIM


def test_simulated_time_passes_only_while_the_program_waits() -> None:
    with elib.connect(SIM) as robot:
        robot.set_speed(0.5, 0.5)
        began = robot.time
        robot.sleep(2.0)
        assert robot.time - began == pytest.approx(2.0)
        steps = robot.encoders()
        assert steps.left == pytest.approx(1000, abs=5)


def test_a_computer_that_starts_no_more_threads_says_so_and_the_robot_can_be_closed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    with elib.connect(SIM) as robot, monkeypatch.context() as few:
        few.setattr(threading.Thread, "start", refuse)
        with pytest.raises(RuntimeError, match="can't start new thread"):
            robot.begin.selector()
        robot.close()


def test_a_slow_program_gives_the_same_result_as_a_fast_one() -> None:
    def drive(work: int) -> list[object]:
        with elib.connect(SIM) as robot:
            seen: list[object] = []
            for turn in range(10):
                robot.set_speed(0.3, turn / 10)
                sum(range(work))
                robot.sleep(0.1)
                seen.append((robot.encoders(), robot.proximity(), robot.time))
            return seen

    assert drive(0) == drive(200_000)


def test_arguments_are_checked_before_a_byte_is_made() -> None:
    with elib.connect(SIM) as robot:
        wrote: list[object] = []
        robot.trace(lambda time, event: wrote.append(event) if isinstance(event, Wrote) else None)
        for wrong in (1.01, -1.01, float("nan"), float("inf"), "fast", None, True, [1], 1j):
            with pytest.raises(ArgumentError, match="left"):
                robot.set_speed(wrong, 0)  # type: ignore[arg-type]
        with pytest.raises(ArgumentError, match="n is 9; it must be a whole number from 0 to 8"):
            robot.set_led(9, 1)
        with pytest.raises(ArgumentError, match="needs right"):
            robot.set_speed(1)  # type: ignore[call-arg]
        for call in (robot.begin, robot.callback()):
            with pytest.raises(ArgumentError):
                call.set_speed(2, 2)
        assert wrote == []
        assert robot.speed() == (0, 0)


@pytest.mark.parametrize("seconds", [float("nan"), float("inf"), -1, "1", None, True])
def test_a_timeout_that_bounds_nothing_is_refused(seconds: object) -> None:
    with elib.connect(SIM) as robot, pytest.raises(ArgumentError, match="timeout"):
        robot.within(seconds)  # type: ignore[arg-type]


def test_within_changes_this_call_only() -> None:
    with elib.connect(SIM) as robot:
        lose_replies(robot, 1)
        began = robot.time
        with pytest.raises(ReplyTimeout):
            robot.within(0.125).selector()
        assert robot.time - began == pytest.approx(0.125)
        robot.speed()  # the line is in sync again
        lose_replies(robot, 1)
        began = robot.time
        with pytest.raises(ReplyTimeout):
            robot.selector()
        assert robot.time - began == pytest.approx(1.0)


def test_a_command_that_the_firmware_does_not_have_says_why() -> None:
    with elib.connect(SIM) as robot:
        with pytest.raises(Unsupported, match=r"battery\(\) does not exist on btcom-2.0: BTcom has no command"):
            robot.battery()
        with pytest.raises(Unsupported, match="e-puck2"):
            robot.set_obstacle_avoidance(True)


@pytest.mark.parametrize("part", [lambda robot: robot, lambda robot: robot.begin, lambda robot: robot.robot])
def test_a_command_cannot_be_assigned_to(part: Callable[[elib.BlockingEpuck], Any]) -> None:
    with elib.connect(SIM) as robot:
        with pytest.raises(AttributeError, match=r"^speed is a command and cannot be assigned to; call robot.speed"):
            part(robot).speed = 0.5
        with pytest.raises(AttributeError, match="drive is a command"):
            part(robot).drive = 0.5
        assert robot.speed() == (0, 0)


def test_a_program_that_waits_for_a_clock_that_stands_still_is_told_why(caplog: pytest.LogCaptureFixture) -> None:
    with elib.connect(SIM) as robot:
        for _ in range(2):
            for _ in range(3 * MANY_READS):
                if robot.time >= 3:
                    break
            assert robot.time < 3
            robot.sleep(0.1)
        assert [record.levelname for record in caplog.records] == ["WARNING"]
        assert "it moves only while the program waits in a call; write robot.sleep(0.01)" in caplog.text


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize("world", ["square", "line"])
def test_a_robot_whose_ground_sensors_read_nothing_says_so_once(
    caplog: pytest.LogCaptureFixture, firmware: str, world: str
) -> None:
    with elib.connect(f"sim://{world}?speed=max&firmware={firmware}") as robot:
        is_missing = [len(set(robot.ground().counts)) == 1 for _ in range(3)]
    assert is_missing == [world == "square" or firmware.startswith("btcom")] * 3
    assert len(caplog.records) == is_missing[0]
    if caplog.records:
        count = "-1" if firmware.startswith("asercom") else "0"
        assert f"every count of ground() is {count}: the robot has no ground module" in caplog.text
        assert "ground_module = true" in caplog.text


@pytest.mark.parametrize("url", [SIM, "sim://square?baud=0"])
def test_a_program_that_reads_the_clock_often_but_waits_in_between_is_told_nothing(
    url: str, caplog: pytest.LogCaptureFixture
) -> None:
    with elib.connect(url) as robot:
        for _ in range(3):
            for _ in range(MANY_READS // 2):
                assert robot.time >= 0
            robot.sleep(0.01)
    assert caplog.records == []


SLEEPERS = (
    "import time\nfor _ in range(3):\n    robot.speed()\n    rest(robot)\n    time.sleep(0)",
    "from time import sleep as nap\nfor _ in range(3):\n    robot.speed()\n    rest(robot)\n    nap(0)",
    "def go():\n    import time as t\n    rest(robot)\n    t.sleep(0)\n    robot.speed()\ngo()\ngo()",
)


def rest(robot: elib.BlockingEpuck) -> None:
    """Let it be as if the program had rested for 2 s of real time."""
    loop = robot.robot._link.loop
    if isinstance(loop, SimulatedLoop):
        loop.turned -= 2


@pytest.mark.parametrize("source", SLEEPERS)
def test_a_program_that_sleeps_while_simulated_time_stands_still_is_told_once(
    source: str, caplog: pytest.LogCaptureFixture
) -> None:
    with elib.connect(SIM) as robot:
        exec(source, {"robot": robot, "rest": rest})
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    assert re.search(r"the program waited 2(\.\d)? s in time.sleep\(\)", caplog.text)
    assert "write robot.sleep() instead" in caplog.text


def test_an_async_program_that_sleeps_is_told_too(caplog: pytest.LogCaptureFixture) -> None:
    source = "import time\nasync def main(robot):\n    rest(robot)\n    time.sleep(0)\n    await robot.speed()"
    program: dict[str, Any] = {"rest": lambda robot: setattr(robot._link.loop, "turned", robot._link.loop.turned - 2)}
    exec(source, program)
    elib.run(program["main"], robot=SIM, argv=[])
    assert re.search(r"the program waited 2(\.\d)? s in time.sleep\(\)", caplog.text)


@pytest.mark.parametrize(
    ("url", "source"),
    [
        (SIM, SLEEPERS[0].replace("rest(robot)", "pass")),
        (SIM, SLEEPERS[0].replace("time.sleep(0)", "robot.sleep(0.01)\n    time.time()")),
        ("sim://square?baud=0", SLEEPERS[0]),
        ("sim://square?baud=0&speed=100", SLEEPERS[0]),
    ],
)
def test_a_program_that_computes_between_its_calls_or_lives_in_real_time_is_told_nothing(
    url: str, source: str, caplog: pytest.LogCaptureFixture
) -> None:
    with elib.connect(url) as robot:
        exec(source, {"robot": robot, "rest": rest})
    assert caplog.records == []


def test_a_program_is_not_told_of_the_sleep_of_what_runs_it(caplog: pytest.LogCaptureFixture) -> None:
    kernel: dict[str, Any] = {}
    exec("import time\ndef serve(source, names):\n    exec(source, names)\n    time.sleep(0)", kernel)
    cell = "for _ in range(3):\n    robot.speed()\n    rest(robot)"
    with elib.connect(SIM) as robot:
        kernel["serve"](cell, {"robot": robot, "rest": rest, "__name__": "__main__"})
        assert caplog.records == []
        kernel["serve"](SLEEPERS[0], {"robot": robot, "rest": rest, "__name__": "__main__"})
    assert [record.levelname for record in caplog.records] == ["WARNING"]


# -- leaving ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", ["at its end", "by an exception", "unconfirmed"])
def test_leaving_stops_the_robot(way: str) -> None:
    with contextlib.suppress(KeyError), elib.connect(SIM) as robot:
        robot.set_speed(0.5, 0.5)
        assert wheels(robot) == (500, 500)
        if way == "by an exception":
            raise KeyError
        if way == "unconfirmed":
            lose_replies(robot, 5)
    assert wheels(robot) == (0, 0)


def test_keep_moving_leaves_the_wheels_turning() -> None:
    with elib.connect(SIM, keep_moving=True) as robot:
        robot.set_speed(0.5, 0.5)
    assert wheels(robot) == (500, 500)


def test_a_name_that_is_no_text_is_refused() -> None:
    with pytest.raises(ArgumentError, match=r"^name is 5; it must be a text"):
        elib.connect(SIM, name=5)  # type: ignore[arg-type]


def test_a_closed_robot_says_so_and_still_knows_its_name() -> None:
    robot = elib.connect(SIM, name="Ada")
    robot.close()
    robot.close()
    with pytest.raises(LinkClosed):
        robot.proximity()
    with pytest.raises(LinkClosed):
        robot.begin.proximity()
    with pytest.raises(LinkClosed), robot:
        pass
    assert (robot.name, robot.url) == ("Ada", SIM)
    assert "Ada closed" in repr(robot)


def test_a_robot_can_be_opened_again_from_its_url() -> None:
    first = elib.connect(SIM, name="Ada")
    first.close()
    with elib.connect(first.url, name=first.name) as again:
        assert again.selector().position == 3


def test_a_port_that_does_not_exist_leaves_no_thread_behind() -> None:
    before = set(threading.enumerate())
    with pytest.raises(LinkNotFound):
        elib.connect("serial:///dev/no-such-port")
    assert set(threading.enumerate()) <= before


# -- begin and end ---------------------------------------------------------------------------------------------------


def test_end_and_result_give_the_same_value_any_number_of_times() -> None:
    with elib.connect(SIM) as robot:
        pending = robot.begin.selector()
        assert not pending.done()
        assert pending.end() == pending.result() == pending.end()
        assert pending.done()


def test_calls_that_were_begun_run_while_the_program_does_other_things() -> None:
    with elib.connect(SIM) as robot:
        pending = [robot.begin.selector() for _ in range(5)]
        robot.sleep(1.0)
        assert all(each.done() for each in pending)


def test_every_row_can_be_begun() -> None:
    for firmware in PROFILES:
        with elib.connect(f"sim://square?speed=max&firmware={firmware}") as robot:
            for name in ("set_encoders", "help_text", "version"):
                args = (1, 2) if name == "set_encoders" else ()
                getattr(robot.begin, name)(*args).end()


def test_the_error_of_an_end_names_the_call() -> None:
    with elib.connect(SIM) as robot:
        lose_replies(robot, 1)
        pending = robot.begin.within(0.1).selector()
        pending.name += " for the red one"
        for _ in range(2):
            with pytest.raises(ReplyTimeout, match=r"for the red one.*selector\(\)"):
                pending.end()
        assert isinstance(pending.exception(), ReplyTimeout)


@pytest.mark.usefixtures("thought_takes_no_time")
def test_waiting_for_a_result_can_be_bounded_without_ending_the_call() -> None:
    with elib.connect(SIM) as robot:
        pending = robot.begin.calibrate_proximity()
        with pytest.raises(TimeoutError):
            pending.result(0.1)  # clock: simulated
        assert pending.end() is None


def test_a_begun_call_runs_its_callback_once_with_its_state() -> None:
    with elib.connect(SIM) as robot:
        seen: list[tuple[object, object]] = []
        view = robot.begin(lambda pending: seen.append((pending.end().position, pending.state)), state="mine")
        view.selector().end()
        robot.sleep(0.5)
        assert seen == [(3, "mine")]


def test_closing_ends_calls_that_were_begun_and_later_ones_leave_nothing_behind() -> None:
    robot = elib.connect(SIM)
    pending = robot.begin.calibrate_proximity()
    robot.close()
    with pytest.raises(LinkClosed, match="was closed"):
        pending.end()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with pytest.raises(LinkClosed):
            robot.selector()
        gc.collect()
    assert [str(each.message) for each in caught] == []


# -- callbacks -------------------------------------------------------------------------------------------------------


def test_exactly_one_callback_gets_the_outcome_and_the_state() -> None:
    with elib.connect(SIM) as robot:
        seen: list[object] = []
        state = object()
        robot.callback(lambda value, s: seen.append(("ok", value.position, s is state)), None, state).selector()
        robot.sleep(0.5)
        lose_replies(robot, 1)
        view = robot.callback(
            lambda value, s: seen.append("no"), lambda error, s: seen.append(("ko", type(error), s)), 7
        )
        view.within(0.1).proximity()
        robot.sleep(2)
        assert seen == [("ok", 3, True), ("ko", ReplyTimeout, 7)]


def test_callbacks_run_off_the_loop_and_may_block(caplog: pytest.LogCaptureFixture) -> None:
    with elib.connect(SIM) as robot:
        threads: set[str] = set()
        entered, gate = threading.Event(), threading.Event()

        def block(value: object, state: object) -> None:
            threads.add(threading.current_thread().name)
            entered.set()
            gate.wait(PATIENCE)

        robot.callback(block).selector()
        pending = robot.begin.proximity()
        threading.Thread(target=lambda: (entered.wait(), gate.set())).start()
        assert len(pending.end()) == 8
        robot.sleep(0.1)
        assert entered.is_set()
        assert threads
        assert threading.current_thread().name not in threads


def test_simulated_time_stands_still_while_a_callback_runs() -> None:
    with elib.connect(SIM) as robot:
        times: list[float] = []

        def work(value: object, state: object) -> None:
            times.append(robot.time)
            let_turn(robot)
            times.append(robot.time)

        robot.callback(work).selector()
        robot.sleep(100.0)
        assert len(times) == 2
        assert times[0] == times[1] < 1


def test_a_callback_may_call_the_robot() -> None:
    with elib.connect(SIM) as robot:
        seen: list[object] = []
        robot.callback(lambda value, state: seen.append(robot.speed())).set_speed(0.25, 0.25)
        robot.sleep(1.0)
        assert seen == [(0.25, 0.25)]


def test_a_callback_that_raises_is_reported_and_disturbs_nothing(caplog: pytest.LogCaptureFixture) -> None:
    with elib.connect(SIM) as robot, caplog.at_level(logging.ERROR, "elib"):
        robot.callback(lambda value, state: 1 / 0).selector()
        robot.sleep(0.5)
        assert robot.selector().position == 3
    assert "callback of selector() raised" in caplog.text
    assert "ZeroDivisionError" in caplog.text


# -- threads ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("speed", ["max", "200"])
def test_many_callers_from_many_threads_each_get_their_own_answer(speed: str) -> None:
    with elib.connect(f"sim://square?speed={speed}&firmware=btcom-2.0&baud=0") as robot:
        outcomes: list[object] = []

        def caller(number: int) -> None:
            for _ in range(8):
                outcomes.append(robot.within(elib.really(200 * PATIENCE)).selector().position)
                robot.begin.within(elib.really(200 * PATIENCE)).encoders().end()

        threads = [threading.Thread(target=caller, args=(n,)) for n in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(PATIENCE)
        assert not any(thread.is_alive() for thread in threads)
        assert outcomes == [3] * 64


def test_a_thread_that_waits_for_another_does_not_stop_the_time() -> None:
    with elib.connect(SIM) as robot:
        robot.selector()
        slept: list[float] = []

        def sleeper() -> None:
            began = robot.time
            robot.sleep(5)
            slept.append(robot.time - began)

        thread = threading.Thread(target=sleeper)
        thread.start()
        thread.join(PATIENCE)
        assert slept == [pytest.approx(5)]


def test_a_blocking_robot_works_where_a_loop_already_runs() -> None:
    import asyncio

    async def notebook() -> int:
        with elib.connect(SIM) as robot:
            robot.sleep(1.0)
            return robot.selector().position

    assert asyncio.run(notebook()) == 3


# -- the end of the program ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("url", "name", "code"),
    [(SIM, "SIGINT", 130), ("sim://square?baud=0", "SIGTERM", 143)],
)
def test_a_signal_ends_the_block_and_stops_the_robot(url: str, name: str, code: int) -> None:
    done = run_python(
        f"""
        import os, signal, sys, threading
        import elib
        from elib.testing import emulator_of
        try:
            with elib.connect({url!r}) as robot:
                robot.set_speed(0.5, 0.5)
                motors = emulator_of(robot).firmware.motors
                sent = threading.Thread(target=os.kill, args=(os.getpid(), signal.{name}))
                while True:
                    robot.sleep(0.01)
                    if sent.ident is None:
                        sent.start()
        except KeyboardInterrupt:
            sys.exit(130)
        finally:
            print([motor.speed for motor in motors])
        """
    )
    assert (done.returncode, done.stdout) == (code, "[0, 0]\n"), done.stderr


def interrupt_the_next_call(robot: elib.BlockingEpuck, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let Ctrl-C come after the robot's next call was made, and before its loop has taken it."""
    enter = robot._portal._enter

    def interrupted(is_last: bool) -> bool:
        monkeypatch.undo()
        is_runner = enter(is_last)
        signal.raise_signal(signal.SIGINT)
        return is_runner

    monkeypatch.setattr(robot._portal, "_enter", interrupted)


def test_a_signal_that_comes_while_a_call_is_about_to_begin_ends_that_call(monkeypatch: pytest.MonkeyPatch) -> None:
    with elib.connect("sim://?speed=max") as robot:
        interrupt_the_next_call(robot, monkeypatch)
        began = robot.time
        with pytest.raises(KeyboardInterrupt):
            robot.sleep(1000)
        assert robot.time - began < 1


def test_a_signal_that_comes_while_the_robot_is_about_to_be_stopped_lets_it_stop(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot = elib.connect("sim://?speed=max")
    motors = emulator_of(robot).firmware.motors
    robot.set_speed(0.5, 0.5)
    interrupt_the_next_call(robot, monkeypatch)
    with pytest.raises(KeyboardInterrupt):
        robot.close()
    assert [motor.speed for motor in motors] == [0, 0]


def test_importing_elib_loads_nothing_heavy() -> None:
    done = run_python(
        """
        import sys, elib
        heavy = {"numpy", "PIL", "serialx", "rich", "cyclopts", "elib.simulator.physics", "elib.simulator.emulator"}
        print(sorted(heavy & set(sys.modules)))
        """
    )
    assert done.stdout == "[]\n", done.stderr


def test_connecting_loads_at_most_60_modules_of_elib_and_none_of_the_simulator() -> None:
    done = run_python("import sys, elib; elib.connect; print(*(name for name in sys.modules if name[:5] == 'elib.'))")
    modules = done.stdout.split()
    assert 30 < len(modules) <= 60, modules
    wings = {name.split(".")[1] for name in modules}
    assert not {"simulator", "records", "behaviours", "panel", "learn", "lab"} & wings


def test_the_tests_run_on_the_tree_they_stand_in() -> None:
    assert Path(elib.__file__).is_relative_to(Path(__file__).parents[2])
