"""``elib bench``: how long each command takes."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

import pytest
from elib_process import Told

import elib
from elib.base.quantiles import quantile
from elib.cli import bench as module
from elib.cli import main
from elib.cli.bench import DISTURBING, MEASURED, USUAL_CAMERA, Report, Result, run, to_text
from elib.cli.terminal import LiveLine
from elib.link.protocol.commands import SPECS
from elib.link.protocol.profiles import PROFILES
from elib.link.session import Ended, TraceEvent
from elib.robot.runner import run_on
from elib.testing import link_of

FAST = "sim://?speed=max"
FIGURES = ("mean", "sd", "p50", "p99")


@pytest.fixture
def report_of(capsys: pytest.CaptureFixture[str]) -> Callable[..., Any]:
    """Return a function that runs the benchmark, of which nothing is said beside, and returns its report."""

    def run(*options: str) -> Any:
        assert main(["bench", "--json", *options]) == 0
        out, err = capsys.readouterr()
        assert err == ""
        return json.loads(out)

    return run


def test_the_json_has_this_shape(report_of: Callable[..., Any]) -> None:
    found = report_of("--count", "3", "--robot", FAST)
    assert list(found) == ["robot", "firmware", "origin", "unit", "count", "commands"]
    assert (found["firmware"], found["origin"], found["unit"], found["count"]) == (
        "asercom-1.2.2",
        "simulator",
        "ms",
        3,
    )
    commands = found["commands"]
    assert [each["command"] for each in commands] == [*MEASURED]
    for each in commands:
        assert list(each) == ["command", "calls", "lost", "refused", *FIGURES, "skipped"]
        if each["skipped"]:
            assert each["calls"] == 0
            assert [each[name] for name in FIGURES] == [None] * 4
        else:
            assert (each["calls"], each["lost"], each["refused"]) == (3, 0, 0)
            assert all(each[name] >= 0 for name in FIGURES)


def test_the_figures_are_those_of_the_link(report_of: Callable[..., Any]) -> None:
    def mean(latency: float, command: str) -> float:
        found = report_of("--count", "2", "--robot", f"{FAST}&latency={latency}")
        commands = found["commands"]
        return float(next(each["mean"] for each in commands if each["command"] == command))

    for command in ("proximity", "set_speed", "image"):
        assert mean(0.01, command) - mean(0.0, command) == pytest.approx(20, abs=0.5), command


def test_what_is_measured_are_commands_that_exist() -> None:
    assert set(MEASURED) - {"sensors"} <= set(SPECS)
    assert set(DISTURBING) <= set(MEASURED)


def test_what_a_robot_does_not_have_is_said_with_the_reason(printed: Told) -> None:
    out = printed("bench", "--count", "1", "--all", "--robot", FAST + "&firmware=epuck2")
    assert "  reset  epuck2 does not have it: the firmware takes R and does" in out


@pytest.mark.parametrize("firmware", sorted(PROFILES))
def test_the_table_fits_80_columns(firmware: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--count", "1", "--robot", f"{FAST}&firmware={firmware}"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert [line for line in out.splitlines() if len(line) > 80] == []
    assert all(f"{name} " in out for name in MEASURED)
    assert "These are figures of a simulation." in out


def measured(
    everything: bool, before: tuple[int, int, int, int] = USUAL_CAMERA
) -> tuple[list[str], elib.Steps, Report]:
    """Run the benchmark on a robot that was used before; return what was asked, and how the robot was left."""
    asked: list[str] = []

    def note(time: float, event: TraceEvent) -> None:
        if isinstance(event, Ended):
            asked.append(str(event.request))

    async def story(robot: elib.Epuck) -> tuple[list[str], elib.Steps, Report]:
        await robot.set_encoders(123, -45)
        await robot.set_camera(*before)
        robot.trace(note)
        report = Report(FAST, 2)
        await run(robot, report, LiveLine(), everything=everything)
        camera = await robot.camera()
        if not everything:
            assert (camera.width, camera.height, camera.zoom, camera.mode) == before
        return asked, await robot.encoders(), report

    return run_on(FAST, story)


def test_nothing_moves_sounds_or_restarts_unless_all_is_asked_for() -> None:
    asked, steps, report = measured(False)
    assert {name for name in asked if name.startswith("set_speed")} == {"set_speed(0, 0)"}
    assert not {name.partition("(")[0] for name in asked} & set(DISTURBING)
    assert steps == (123, -45)
    assert {result.command: result.skipped for result in report.results if result.skipped} == {
        name: f"{reason}; --all measures it" for name, reason in DISTURBING.items()
    }


def test_the_camera_is_put_back_as_it_was_found() -> None:
    asked, _, _ = measured(False, before=(20, 30, 8, 0))
    assert asked.count("set_camera()") == 2
    assert asked.count("set_camera(20, 30, 8, GREY)") == 1


def test_all_measures_what_takes_seconds_too() -> None:
    asked, _, report = measured(True)
    found = {result.command: result for result in report.results}
    assert not any(result.skipped for result in report.results)
    assert 2 < found["calibrate_proximity"].figures["mean"] < 4
    assert 1 < found["reset"].figures["mean"] < 3
    assert asked.count("play_sound(1)") == 2


def test_lost_answers_are_counted_and_do_not_spoil_the_next_call() -> None:
    async def story(robot: elib.Epuck) -> Result:
        link = link_of(robot)
        calls = 0

        async def call(robot: elib.Epuck) -> object:
            nonlocal calls
            calls += 1
            if calls == 2:
                link.lose_next_reply()
            return await robot.proximity()

        return await module.measure(robot, "proximity", call, 5, LiveLine())

    result = run_on(FAST, story)
    assert (len(result.times), result.lost, result.refused) == (4, 1, 0)
    assert max(result.times) < 0.005


def test_what_was_measured_before_the_robot_was_lost_is_shown(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    real = module.measure

    async def measure_and_cut(robot: elib.Epuck, name: str, *rest: object) -> Result:
        if name == "encoders":
            link_of(robot).cut()
        return await real(robot, name, *rest)  # type: ignore[arg-type]  # handed through

    monkeypatch.setattr(module, "measure", measure_and_cut)
    assert main(["bench", "--count", "2", "--robot", FAST]) == 1
    out, err = capsys.readouterr()
    assert "set_encoders " in out
    assert "\nencoders " not in out
    assert err.startswith("error: encoders():")


@pytest.mark.parametrize("count", ["0", "-3", "10001"])
def test_an_impossible_count_is_wrong_usage(refused: Told, count: str) -> None:
    assert f"--count is {count}; it must be a whole number from 1 to 10000" in refused(
        "bench", "--count", count, "--robot", "tcp://127.0.0.1:9"
    )


def test_figures_are_mean_sample_deviation_and_nearest_rank() -> None:
    figures = Result("speed", tuple(range(1, 101))).figures
    assert figures["mean"] == 50.5
    assert figures["sd"] == pytest.approx(29.011, abs=1e-3)
    assert (figures["p50"], figures["p99"], quantile(range(1, 101), 0.01)) == (50, 99, 1)
    one = Result("speed", (0.002,))
    assert (one.figures["mean"], one.figures["p99"]) == (0.002, 0.002)
    assert math.isnan(one.figures["sd"])
    none = Result("speed", (), lost=3)
    text = to_text(Report("sim://", 3, "btcom-2.0", "robot", [one, none]))
    assert [line.split() for line in text.splitlines()[2:5]] == [
        ["command", "mean", "sd", "p50", "p99", "lost"],
        ["speed", "2.0", "-", "2.0", "2.0", "0"],
        ["speed", "-", "-", "-", "-", "3"],
    ]
    assert "simulation" not in text
