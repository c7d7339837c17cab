"""``elib.run``: which robot, which loop, which exit code."""

from __future__ import annotations

import argparse
import asyncio
from collections.abc import Callable

import pytest

import elib
from elib.base.errors import ArgumentError, LinkNotFound, ReplyTimeout
from elib.base.timebase import RealLoop, ScaledLoop, SimulatedLoop
from elib.robot.aio import Epuck
from elib.robot.runner import robot_url, robot_urls, run, run_on
from elib.testing import emulator_of

SIM = "sim://square?speed=max"


async def ask(robot: Epuck) -> tuple[str, elib.Wheels]:
    return robot.url, await robot.speed()


def test_the_url_comes_from_the_command_line_and_the_result_comes_back() -> None:
    assert run(ask, argv=["--robot", SIM]) == (SIM, (0.0, 0.0))


def test_a_url_on_the_command_line_may_stand_by_itself() -> None:
    assert run(ask, argv=[SIM])[0] == SIM
    assert robot_url(argv=[SIM]) == robot_url(argv=["--robot", SIM]) == SIM


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--robott", SIM], "--robott is not an argument of this program; did you mean --robot?"),
        (["--robott=" + SIM], "did you mean --robot?"),
        (["--mine", "1"], "--mine is not an argument of this program"),
        ([SIM, "file"], "file is not an argument of this program"),
        ([SIM, "--robot", SIM], "this program drives one robot, not"),
        (["--robot"], "expected one argument"),
    ],
)
@pytest.mark.parametrize("start", [lambda argv: run(ask, argv=argv), lambda argv: robot_url(argv=argv)])
def test_what_the_command_line_says_is_obeyed_or_refused_with_the_usage(
    arguments: list[str],
    said: str,
    start: Callable[[list[str]], object],
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit) as caught:
        start(arguments)
    assert caught.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith("usage: ")
    assert said in error


@pytest.mark.parametrize("wrong", ["file", "sim://?sped=1", ""])
def test_an_impossible_robot_is_never_replaced_by_a_virtual_one(wrong: str, capsys: pytest.CaptureFixture[str]) -> None:
    for start in (lambda: run(ask, argv=["--robot", wrong]), lambda: robot_url(argv=[wrong])):
        with pytest.raises(SystemExit) as caught:
            start()
        assert caught.value.code == 2
        assert capsys.readouterr().err.startswith("error: ")


def test_without_a_robot_on_the_command_line_the_program_says_which() -> None:
    assert run(ask, argv=[], default=SIM)[0] == SIM
    assert robot_url(SIM, argv=[]) == SIM
    assert robot_url(argv=[]) == "sim://"


def test_a_program_of_several_robots_takes_all_that_the_command_line_names() -> None:
    assert robot_urls("sim://", argv=["sim://a", "--robot", "sim://b", "--robot=sim://c"]) == [
        "sim://a",
        "sim://b",
        "sim://c",
    ]
    assert robot_urls("sim://1", "sim://2", argv=[]) == ["sim://1", "sim://2"]


def test_a_program_reads_its_own_options_first_and_hands_on_the_rest() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--rounds", type=int)
    options, rest = parser.parse_known_args(["--rounds", "3", "--robot", SIM])
    assert run(ask, argv=rest)[0] == SIM
    assert options.rounds == 3


def test_a_url_given_in_the_program_outweighs_the_command_line() -> None:
    assert run(ask, robot=SIM, argv=["--robot", "sim://nowhere"])[0] == SIM


@pytest.mark.parametrize(
    ("url", "kind"),
    [(SIM, SimulatedLoop), ("sim://square?speed=50", ScaledLoop), ("sim://", RealLoop)],
)
def test_the_loop_has_the_speed_of_the_url(url: str, kind: type) -> None:
    async def main(robot: Epuck) -> object:
        return type(asyncio.get_running_loop())

    assert run(main, robot=url) is kind


def test_what_is_not_a_coroutine_function_is_refused_with_a_hint() -> None:
    with pytest.raises(ArgumentError, match="coroutine function") as caught:
        run(lambda robot: None, robot=SIM)  # type: ignore[arg-type, return-value]  # that is the mistake
    assert caught.value.hint == "async def main(robot): ..."


def test_an_object_that_is_called_like_a_coroutine_function_will_do() -> None:
    class Program:
        async def __call__(self, robot: Epuck) -> str:
            return robot.firmware

    assert run(Program(), robot=SIM) == "asercom-1.2.2"


@pytest.mark.parametrize(
    ("arguments", "code"), [(["--robot", "sim://nowhere?speed=max"], 1), (["--robot", "sim://?sped=1"], 2)]
)
def test_from_the_command_line_a_failure_is_a_message_and_an_exit_code(
    arguments: list[str], code: int, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        run(ask, argv=arguments)
    assert caught.value.code == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: ")
    assert "hint: " in err


def test_with_a_url_in_the_program_errors_come_as_they_are() -> None:
    async def impatient(robot: Epuck) -> None:
        await robot.within(0).speed()

    with pytest.raises(LinkNotFound):
        run(ask, robot="sim://nowhere?speed=max")
    with pytest.raises(ReplyTimeout):
        run(impatient, robot=SIM)


def test_an_error_of_the_program_itself_is_raised_unchanged() -> None:
    async def broken(robot: Epuck) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run(broken, argv=["--robot", SIM])


def test_the_robot_is_stopped_whatever_ends_the_program_unless_told_otherwise() -> None:
    def ended_with(error: type[BaseException], keep_moving: bool) -> tuple[float, float]:
        hardware = None

        async def main(robot: Epuck) -> None:
            nonlocal hardware
            hardware = emulator_of(robot).firmware
            await robot.set_speed(0.5, 0.5)
            raise error

        with pytest.raises(error):
            run_on(SIM, main, keep_moving=keep_moving)
        assert hardware is not None
        return tuple(motor.speed for motor in hardware.motors)  # type: ignore[return-value]  # two motors

    assert ended_with(ZeroDivisionError, keep_moving=False) == (0, 0)
    assert ended_with(ZeroDivisionError, keep_moving=True) == (500, 500)
    assert ended_with(asyncio.CancelledError, keep_moving=True) == (0, 0)
