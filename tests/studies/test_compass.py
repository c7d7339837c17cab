"""The compass: hard and soft iron found by a turn on the spot, and the readings that are refused."""

from __future__ import annotations

import asyncio
import math
import random

import pytest

import elib
from elib.base.errors import ArgumentError, Unsupported
from elib.link.protocol.values import MagneticField
from elib.simulator.emulator.simulated_hardware import SimulatedHardware
from elib.simulator.physics import Pose
from elib.studies import Compass, calibrate_compass, fit_compass
from elib.testing import simulated
from elib.testing.inside import transport_of, world_of

NORTH = 20e-6


def field(heading: float, *, hard=(0.0, 0.0), soft=(1.0, 0.0, 0.0, 1.0), noise: float = 0.0, chance=None):
    """Return what a robot's magnetometer says that looks in a direction; north is y."""
    x, y = NORTH * math.sin(heading), NORTH * math.cos(heading)
    wrong = [noise * chance.gauss() if noise else 0.0 for _ in range(2)]
    return MagneticField(
        soft[0] * x + soft[1] * y + hard[0] + wrong[0], soft[2] * x + soft[3] * y + hard[1] + wrong[1], -44e-6
    )


def turn(count: int = 100, part: float = 1.0, **iron):
    return [field(0.3 + math.tau * part * k / count, **iron) for k in range(count)]


def error(compass: Compass, heading: float, **iron) -> float:
    """Return how wrong a heading is, degrees."""
    return math.degrees(math.remainder(compass.heading(field(heading, **iron)) - heading, math.tau))


def test_a_robot_without_iron_needs_no_correction() -> None:
    compass = fit_compass(turn())
    assert compass.centre == pytest.approx((0, 0), abs=1e-12)
    assert compass.matrix[0] == pytest.approx((1, 0), abs=1e-9)
    assert compass.matrix[1] == pytest.approx((0, 1), abs=1e-9)
    assert compass.strength == pytest.approx(NORTH)
    assert compass.deviation == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("hard", [(35e-6, -12e-6), (0.0, 400e-6)])
def test_a_constant_field_is_found_and_taken_out_however_strong_it_is(hard) -> None:
    compass = fit_compass(turn(hard=hard))
    assert compass.centre == pytest.approx(hard, abs=1e-12)
    for k in range(24):
        assert error(compass, k * 0.3, hard=hard) == pytest.approx(0, abs=1e-6)


def test_symmetric_soft_iron_is_taken_out_too() -> None:
    iron = {"hard": (30e-6, 9e-6), "soft": (1.25, 0.1, 0.1, 0.9)}
    compass = fit_compass(turn(**iron))
    for k in range(24):
        assert error(compass, k * 0.3, **iron) == pytest.approx(0, abs=1e-6)
    assert compass.strength == pytest.approx(NORTH * math.sqrt(1.25 * 0.9 - 0.01))


def test_noise_of_a_count_makes_half_a_degree() -> None:
    chance = random.Random(4)
    iron = {"hard": (30e-6, 9e-6), "soft": (1.2, 0.05, 0.05, 0.9)}
    compass = fit_compass(turn(noise=0.15e-6, chance=chance, **iron))
    assert max(abs(error(compass, k * 0.3, **iron)) for k in range(24)) < 0.5


def test_headings_are_those_of_a_pose_and_north_is_seen_from_the_robot() -> None:
    compass = fit_compass(turn())
    assert compass.heading(field(0.0)) == pytest.approx(0)
    assert compass.north(field(0.0)) == pytest.approx(math.pi / 2)  # it looks east: north is to the left
    assert compass.north(field(math.pi / 2)) == pytest.approx(0)
    assert compass.heading(field(3.0)) == pytest.approx(3)
    assert compass.corrected(field(1.0)).z == -44e-6


def test_a_mirrored_chip_is_recognised_by_the_sense_of_the_turn() -> None:
    upside_down = [MagneticField(each.x, -each.y, -each.z) for each in turn(hard=(30e-6, 9e-6))]
    compass = fit_compass(upside_down)
    for each, k in zip(upside_down, range(100), strict=True):
        truth = 0.3 + math.tau * k / 100
        assert math.remainder(compass.heading(each) - truth, math.tau) == pytest.approx(0, abs=1e-9)


def test_a_chip_that_is_turned_in_the_robot_is_aligned_by_one_known_heading() -> None:
    turned = [MagneticField(-each.y, each.x, each.z) for each in turn(hard=(30e-6, 9e-6))]
    compass = fit_compass(turned).aligned(turned[0], 0.3)
    for each, k in zip(turned, range(100), strict=True):
        truth = 0.3 + math.tau * k / 100
        assert math.remainder(compass.heading(each) - truth, math.tau) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("readings", "words"),
    [
        (turn(15), "there are 15 readings"),
        ([field(1.0)] * 50, "switched off"),
        ([MagneticField(0.0, 0.0, 0.0)] * 50, "switched off"),
        (turn(part=0.8), "degrees of the turn have no reading"),
        (turn()[::2] + turn()[1::2][::-1], "not in the order of one turn"),
    ],
)
def test_readings_that_are_no_turn_are_refused_with_the_reason(readings, words: str) -> None:
    with pytest.raises(ArgumentError, match=words):
        fit_compass(readings)


def test_a_field_that_changes_meanwhile_is_refused() -> None:
    chance = random.Random(1)
    with pytest.raises(ArgumentError, match=r"beside the ellipse|not on an ellipse"):
        fit_compass(turn(noise=8e-6, chance=chance))


@simulated
async def test_a_virtual_robot_calibrates_itself_and_then_knows_where_it_looks() -> None:
    async with elib.open("sim://square?firmware=epuck2&speed=max&quality=ideal") as robot:
        hardware = transport_of(robot).robot.hardware
        assert isinstance(hardware, SimulatedHardware)
        hardware.hard_iron, hardware.soft_iron = (31.0, -14.0, 5.0), (1.1, 0.07, 0.07, 0.92)
        compass = await calibrate_compass(robot)
        world, start = world_of(robot), world_of(robot).pose(0)
        await robot.sleep(0.5)
        assert world.pose(0) == start  # it stands
        assert [1e6 * each for each in compass.centre] == pytest.approx((31, -14), abs=0.2)
        for k in range(12):
            world.move_robot(0, Pose(start.x, start.y, 0.5 * k))
            off = math.remainder(compass.heading(await robot.magnetometer()) - 0.5 * k, math.tau)
            assert abs(math.degrees(off)) < 1.5


@simulated
async def test_a_robot_that_is_interrupted_in_its_turn_stands() -> None:
    async with elib.open("sim://square?firmware=epuck2&speed=max") as robot:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(2):
                await calibrate_compass(robot)
        before = await robot.encoders()
        assert before != (0, 0)
        await robot.sleep(0.5)
        assert await robot.encoders() == before


@simulated
async def test_a_robot_without_a_magnetometer_does_not_move() -> None:
    async with elib.open("sim://square?speed=max") as robot:
        with pytest.raises(Unsupported):
            await calibrate_compass(robot)
        assert await robot.encoders() == (0, 0)
