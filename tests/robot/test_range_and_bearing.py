"""Neighbours and messages on robot objects: every API style, shared worlds, and where there are none."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path

import pytest

import elib
from elib.base.errors import ArgumentError, LinkClosed, LinkLost, Unsupported
from elib.simulator.emulator import sim_transport
from elib.testing import simulated
from elib.testing.inside import link_of, simulation_of, world_of

FACE_TO_FACE = """
[arena]
size = [1.0, 1.0]

[epuck]
sensor_noise = 0

[[robot]]
position = [0.3, 0.5]
heading = 0

[[robot]]
position = [0.7, 0.5]
heading = 90
firmware = "epuck2"
"""


@pytest.fixture
def pair(tmp_path: Path) -> str:
    """URL of a world of two robots, without noise."""
    path = tmp_path / "pair.toml"
    path.write_text(FACE_TO_FACE)
    return f"sim://{path}?speed=max"


@simulated
async def test_robots_of_a_swarm_hear_each_other(pair: str) -> None:
    async with elib.swarm(pair) as robots:
        one, other = robots
        await one.send_message(b"hi")
        await other.send_message(bytearray((1, 2, 3, 4)))
        await robots.all.sleep(0.2)
        (right,) = await one.neighbours()
        assert (right.distance, right.bearing, right.message) == (0.4, 0.0, b"\x01\x02\x03\x04")
        assert right.origin == "simulator"
        assert one.time - 0.12 < right.time <= one.time
        heard = await robots.all.neighbours()
        assert [[each.message for each in found] for found in heard.values()] == [[b"\x01\x02\x03\x04"], [b"hi"]]
        assert heard[robots.names[1]][0].bearing == pytest.approx(1.5708, abs=0.0001)


@pytest.mark.parametrize("numbers", [(1, 2, 2), (1, 1)])
def test_robots_of_one_world_that_blocking_code_opens_apart_are_told_once_that_their_worlds_are_two(
    pair: str, numbers: tuple[int, ...], caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sim_transport, "_has_warned", False)
    with contextlib.ExitStack() as stack:
        robots = [stack.enter_context(elib.connect(f"{pair}&robot={number}")) for number in numbers]
        robots[0].send_message(b"hi")
        robots[-1].sleep(0.2)
        assert [each.message for each in robots[-1].neighbours()] == [b""]
    # Who opens the same robot twice wants two worlds.
    assert [record.name for record in caplog.records] == ["elib"] * (2 in numbers)
    assert ("elib.swarm(" in caplog.text) == (2 in numbers)


def test_a_world_that_was_closed_before_is_not_missed(
    pair: str, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sim_transport, "_has_warned", False)
    for number in (1, 2):
        with elib.connect(f"{pair}&robot={number}"):
            pass
    assert not caplog.records


@simulated
async def test_a_program_that_does_nothing_but_ask_lets_time_go_on(pair: str) -> None:
    async with elib.open(f"{pair}&baud=0") as robot:
        began = robot.time
        for _ in range(100):
            await robot.neighbours()
        assert robot.time - began == pytest.approx(0.2)


def test_every_style_has_them(pair: str) -> None:
    with elib.connect(pair) as robot:
        robot.send_message(b"a")
        robot.sleep(0.2)
        (found,) = robot.neighbours()
        assert found.distance == 0.4
        assert found.message == b""
        (begun,) = robot.begin.neighbours().end()
        assert begun.distance == 0.4
        heard: list[object] = []
        robot.callback(lambda value, state: heard.append(value)).neighbours()
        robot.sleep(0.1)
        assert len(heard) == 1
        with pytest.raises(ArgumentError, match="5 bytes"):
            robot.send_message(b"12345")
        (alone,) = world_of(robot).neighbours(1)
        assert alone.message == b"a"


@simulated
async def test_what_is_not_in_a_shared_world_says_so(tmp_path: Path) -> None:
    async with elib.open("sim://square?speed=max") as robot:
        with robot.record(tmp_path / "run.mcap"):
            await robot.proximity()
    async with elib.open(f"replay://{tmp_path / 'run.mcap'}?speed=max") as robot:
        with pytest.raises(Unsupported, match="no firmware's protocol carries range and bearing") as raised:
            await robot.neighbours()
        assert "sim://crowd" in str(raised.value)
        with pytest.raises(Unsupported):
            await robot.send_message(b"")


@simulated
async def test_constant_readings_have_no_neighbours(tmp_path: Path) -> None:
    readings = tmp_path / "hardware.json"
    readings.write_text("{}")
    async with elib.open(f"sim://?hardware={readings}&speed=max") as robot:
        with pytest.raises(Unsupported, match="constant readings"):
            await robot.neighbours()


@simulated
async def test_a_lost_link_and_a_closed_robot_say_so(pair: str) -> None:
    async with elib.open(pair) as robot:
        link_of(robot).cut()
        await asyncio.sleep(0.1)
        with pytest.raises(LinkLost):
            await robot.neighbours()
    with pytest.raises(LinkLost):
        await robot.send_message(b"")
    async with elib.open(pair) as robot:
        pass
    with pytest.raises(LinkClosed):
        await robot.neighbours()


@simulated
async def test_nothing_goes_over_the_line(pair: str) -> None:
    async with elib.open(pair) as robot:
        before = robot.statistics.count
        await robot.neighbours()
        await robot.send_message(b"x")
        assert robot.statistics.count == before


def test_what_one_robot_asks_changes_nothing_for_the_others() -> None:
    def drive(*, is_curious: bool) -> tuple[str, list[object]]:
        heard: list[object] = []

        async def listen(robot: elib.Epuck) -> None:
            await robot.set_speed(0.3, 0.2)
            for number in range(20):
                await robot.send_message(bytes([number]))
                await robot.sleep(0.1)
                heard.append(await robot.neighbours())

        async def ask(robot: elib.Epuck) -> None:
            await robot.set_speed(-0.1, 0.2)
            for _ in range(60):
                await (robot.neighbours() if is_curious else robot.sleep(0.002))
                await robot.sleep(0.03)

        async def main(robots: elib.Swarm) -> str:
            await asyncio.gather(*(listen(robot) for robot in robots[:3]), *(ask(robot) for robot in robots[3:]))
            simulation_of(robots[0]).catch_up()
            return world_of(robots[0]).hash()

        return elib.swarm("sim://crowd?robots=6&speed=max&seed=1").run(main), heard

    curious, other = drive(is_curious=True), drive(is_curious=False)
    assert curious == other
    assert any(curious[1])
