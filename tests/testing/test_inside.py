"""Helpers that lead from a robot to what simulates it."""

from types import SimpleNamespace

import pytest

import elib
from elib.link.transport.memory import memory_pair
from elib.testing import emulator_of, faults_of, link_of, simulated, simulation_of, world_of


@simulated
async def test_the_link_and_the_world_of_an_async_robot_are_its_own() -> None:
    async with elib.open("sim://square") as robot:
        link_of(robot).lose_next_reply()
        with pytest.raises(elib.ReplyTimeout):
            await robot.within(0.1).proximity()
        assert world_of(robot) is simulation_of(robot).world
        assert link_of(robot).robot is emulator_of(robot)


def test_a_blocking_robot_has_the_same_helpers() -> None:
    with elib.connect("sim://square?speed=max") as robot:
        robot.set_speed(0.5, -0.5)
        assert [motor.speed for motor in emulator_of(robot).firmware.motors] == [500, -500]
        assert world_of(robot).robots == 1


@simulated
async def test_each_member_of_a_swarm_has_a_link_of_its_own_in_a_common_world() -> None:
    async with elib.swarm("sim://square?robots=2") as robots:
        assert link_of(robots[0]) is not link_of(robots[1])
        assert world_of(robots[0]) is world_of(robots[1])


def test_a_robot_that_is_not_simulated_here_is_refused_with_a_cure() -> None:
    robot = SimpleNamespace(url="tcp://127.0.0.1:4000", session=SimpleNamespace(transport=memory_pair()[0]))
    for helper in (link_of, world_of, simulation_of, emulator_of, faults_of):
        with pytest.raises(elib.ArgumentError, match="is not simulated in this process") as caught:
            helper(robot)
        assert "sim://" in caught.value.hint


@simulated
async def test_constant_readings_have_no_world(tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("hardware") / "rest.json"
    path.write_text("{}")
    async with elib.open(f"sim://?hardware={path}") as robot:
        with pytest.raises(elib.ArgumentError, match="has no fault script"):
            faults_of(robot)
        with pytest.raises(elib.ArgumentError, match="constant readings and no world"):
            world_of(robot)
