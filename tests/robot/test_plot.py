"""``robot.plot``: a picture of what the robot did, drawn when it is closed."""

from __future__ import annotations

import asyncio
import importlib.util
import logging
import math
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

import elib
from elib.base.errors import ArgumentError, LinkClosed, Unsupported
from elib.base.extras import install
from elib.base.pose import apart
from elib.robot.runner import run_on
from elib.studies.drive import RobotReport

FAST = "sim://square?speed=max"


def is_png(path: Path) -> bool:
    return path.read_bytes().startswith(b"\x89PNG") and path.stat().st_size > 10_000


def test_a_blocking_program_finds_its_plot_when_the_block_has_ended(tmp_path: Path) -> None:
    path = tmp_path / "path.png"
    with elib.connect(FAST) as robot:
        robot.plot(path)
        robot.set_speed(0.3, 0.5)
        robot.sleep(2)
        robot.proximity()
        assert not path.exists()
    assert is_png(path)


def test_an_async_program_does_too_and_robots_of_a_swarm_have_one_each(tmp_path: Path) -> None:
    async def one(robot: elib.Epuck) -> None:
        robot.plot(tmp_path / f"{robot.name}.svg")
        await robot.set_speed(0.2, 0.2)

    async def main(robots: elib.Swarm) -> None:
        await robots.all.run(one)
        await asyncio.sleep(1)  # clock: simulated

    elib.swarm("sim://crowd?robots=2&speed=max").run(main)
    assert {path.name for path in tmp_path.iterdir()} == {"epuck-1.svg", "epuck-2.svg"}
    assert "0.0" not in (tmp_path / "epuck-1.svg").read_text()[:500]


def test_a_plot_may_be_closed_before_the_robot(tmp_path: Path) -> None:
    with elib.connect(FAST) as robot:
        with robot.plot(tmp_path / "first.png") as plot:
            robot.sleep(1)
        assert is_png(tmp_path / "first.png")
        (tmp_path / "first.png").unlink()
        plot.close()
        assert "drawn" in repr(plot)
    assert not list(tmp_path.iterdir())


def test_a_program_without_with_has_its_plot_too(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        f"import elib\nrobot = elib.connect({FAST!r})\nrobot.plot('path.png')\n"
        "robot.set_speed(0.3, 0.3)\nrobot.sleep(1)\n"
    )
    done = subprocess.run([sys.executable, program], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert is_png(tmp_path / "path.png")


def test_what_cannot_be_drawn_is_refused_at_the_call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with elib.connect(FAST) as robot:
        with pytest.raises(ArgumentError, match=r"must end in \.png"):
            robot.plot(tmp_path / "path.gif")
        with pytest.raises(ArgumentError, match="no folder"):
            robot.plot(tmp_path / "nowhere" / "path.png")
        monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
        with pytest.raises(Unsupported, match="Matplotlib") as caught:
            robot.plot(tmp_path / "path.png")
        assert install("plot") in caught.value.hint
    with pytest.raises(LinkClosed):
        robot.plot(tmp_path / "path.png")


def test_a_plot_that_cannot_be_written_at_the_end_is_logged(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "folder").mkdir()
    with caplog.at_level(logging.ERROR, "elib"), elib.connect(FAST) as robot:
        robot.plot(tmp_path / "folder" / "path.png")
        (tmp_path / "folder").rmdir()
    assert "path.png" in caplog.text


async def _arc(robot: elib.Epuck) -> RobotReport:
    report = RobotReport(robot)
    await robot.set_speed(0.3, 0.5)
    await asyncio.sleep(10)  # clock: simulated; in one go, without any command
    await robot.stop()
    report.close()
    await asyncio.sleep(1)  # clock: simulated
    return report


def test_a_long_wait_is_drawn_as_the_arc_that_it_was(tmp_path: Path) -> None:
    report = run_on("sim://square?speed=max", _arc)
    assert report.time == pytest.approx(10, abs=0.1)
    expected = 0.4 * math.pi * 0.041 * report.time  # the wheels' diameter, 41 mm
    assert report.distance == pytest.approx(expected, rel=0.03)
    assert len(report.path) > 90
    constant = tmp_path / "readings.json"
    constant.write_text("{}")
    told = run_on(f"sim://?hardware={constant}&speed=max", _arc)
    assert told.world is None
    assert told.distance == pytest.approx(expected, rel=0.03)
    assert math.fsum(apart(a, b) for a, b in pairwise(told.path)) == told.distance


def test_after_a_reset_the_wheels_are_drawn_standing() -> None:
    async def restart(robot: elib.Epuck) -> list[tuple[float, float]]:
        report = RobotReport(robot)
        await robot.set_speed(0.5, 0.5)
        await robot.reset()
        return [speeds for _, speeds in report.speeds]

    assert run_on("sim://square?speed=max", restart) == [(0.5, 0.5), (0.0, 0.0)]


def test_contacts_are_counted_where_the_world_is_known() -> None:
    async def bump(robot: elib.Epuck) -> RobotReport:
        report = RobotReport(robot)
        for speed in (1.0, -0.5, 1.0):
            await robot.set_speed(speed, speed)
            await asyncio.sleep(15 if speed > 0 else 1)  # clock: simulated
        report.close()
        return report

    report = run_on("sim://square?speed=max", bump)
    assert report.contacts == 2
    assert report.contact_time > 1
