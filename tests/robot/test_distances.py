"""``robot.distances()``: metres from the infrared sensors, without what they read in the open."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import elib
from elib.base.body import SENSOR_DIRECTIONS, SENSOR_RADIUS
from elib.base.infrared import usual_light
from elib.link.protocol.profiles import PROFILES
from elib.simulator.emulator.robotprofile import Infrared, RobotProfile, write
from elib.simulator.physics.profiles import PLACES
from elib.testing import link_of, world_of
from lanes import short


@pytest.mark.parametrize("firmware", short(PROFILES, "asercom-1.2.2", "epuck2"))
def test_a_wall_comes_nearer_by_what_the_robot_drives(firmware: str) -> None:
    with elib.connect(f"sim://square?speed=max&firmware={firmware}&quality=typical") as robot:
        assert robot.distances().nearest == math.inf
        robot.set_speed(0.3, 0.3)
        while robot.distances().ahead >= 0.04:
            assert robot.time < 60, "it has not come to a wall"
        robot.set_speed(0, 0)
        robot.sleep(0.5)
        before = min(robot.distances().ahead for _ in range(5))
        robot.drive(-0.01)
        after = min(robot.distances().ahead for _ in range(5))
        assert after - before == pytest.approx(0.01, abs=0.005)


def test_what_the_sensors_read_in_the_open_is_learned_again_after_a_restart() -> None:
    with elib.connect("sim://square?speed=max&quality=typical") as robot:
        robot.calibrate_proximity()
        assert robot.distances().nearest == math.inf
        robot.reset()  # the calibration is lost: the counts in the open are high again
        assert robot.distances().nearest == math.inf
        assert max(robot.proximity()) > 60


def test_distances_are_numbers_clockwise_from_the_front_right() -> None:
    found = elib.Distances(0.01, 0.02, 0.03, 0.04, 0.05, 0.06, math.inf, 0.02)
    assert (found.ahead, found.nearest, found[2], found.rear_left) == (0.01, 0.01, 0.03, 0.05)
    assert repr(found).startswith("Distances(front_right=0.01")


def facing(sensor: int, distance: float) -> elib.Pose:
    """Return where a sensor looks straight at the left wall of a square."""
    heading = math.pi - SENSOR_DIRECTIONS[sensor]
    bearing = math.atan2(PLACES[sensor][1], PLACES[sensor][0])
    return elib.Pose(distance - SENSOR_RADIUS * math.cos(heading + bearing), 0.5, heading)


@pytest.mark.parametrize("firmware", list(PROFILES))
def test_nine_of_ten_distances_are_as_near_to_the_truth_as_they_say(firmware: str) -> None:
    inside = []
    for seed in range(5):
        with elib.connect(f"sim://square?speed=max&firmware={firmware}&quality=typical&seed={seed}") as robot:
            world = world_of(robot)
            for _ in range(20):
                assert robot.distances().errors == (math.inf,) * 8
            for sensor in range(8):
                for distance in (0.012, 0.02, 0.03, 0.04):
                    world.move_robot(0, facing(sensor, distance))
                    robot.sleep(0.1)
                    near = robot.distances()
                    inside.append(abs(near[sensor] - distance) <= near.errors[sensor])
    assert 0.85 < sum(inside) / len(inside) < 0.97


def test_the_gains_of_a_fitted_robot_make_its_distances_surer() -> None:
    with elib.connect("sim://square?speed=max&quality=typical&seed=3") as robot:
        world = world_of(robot)
        for _ in range(20):
            robot.distances()
        world.move_robot(0, facing(5, 0.03))
        robot.sleep(0.1)
        plain, fitted = robot.distances(), robot.distances(gains=world._state.world.robots[0].gain)
        assert fitted.errors[5] < 0.3 * plain.errors[5]
        assert fitted[5] == pytest.approx(0.03, abs=fitted.errors[5])


@pytest.mark.parametrize("gains", [[math.nan] * 8, [0] * 8, [math.inf] * 8, [-1] * 8, [1] * 7, ["1"] * 8, 5])
def test_gains_that_no_sensor_can_have_are_refused(gains: object) -> None:
    with elib.connect("sim://square?speed=max") as robot:
        for look in (robot.distances, robot.scan):
            with pytest.raises(elib.ArgumentError, match=r"^gains is .*it must be 8 numbers, each from 0.01 to 100"):
                look(gains=gains)
        assert len(robot.distances(gains=np.ones(8)).errors) == 8


def test_a_profile_has_the_gains_that_distances_take(tmp_path: Path) -> None:
    gains = (1.2, 0.8, 1.0, 1.0, 1.0, 1.0, 1.0, 1.1)
    curve = tuple((0.001 * k, min(2 * usual_light(0.001 * k), 40000.0)) for k in range(101))
    write(RobotProfile(infrared=Infrared(curve, gains=gains)), tmp_path / "robot.toml")
    found = elib.load_profile(str(tmp_path / "robot.toml")).infrared_gains
    assert found == pytest.approx([2 * gain for gain in gains])
    assert RobotProfile().infrared_gains is None


def test_a_dark_wall_is_found_by_its_reflectance(tmp_path: Path) -> None:
    world = tmp_path / "dark.toml"
    wall = "[[wall]]\nfrom = [0.2, 0.2]\nto = [0.2, 0.8]\nreflectance = 0.4\n"
    world.write_text(f"[arena]\nsize = [1, 1]\n\n[[robot]]\nposition = [0.5, 0.5]\n\n{wall}", "utf-8")
    with elib.connect(f"sim://{world}?speed=max&quality=ideal") as robot:
        robot.distances()
        world_of(robot).move_robot(0, facing(5, 0.212))
        robot.sleep(0.1)
        assert robot.distances().left == pytest.approx(0.03, abs=0.003)
        assert robot.distances(reflectance=0.4).left == pytest.approx(0.012, abs=0.002)
        with pytest.raises(elib.ArgumentError, match="reflectance is 40"):
            robot.distances(reflectance=40)


def test_the_time_of_flight_sensor_is_read_beside_the_others_and_put_right() -> None:
    with elib.connect("sim://square?speed=max&firmware=epuck2&quality=ideal") as robot:
        world_of(robot).move_robot(0, elib.Pose(0.3, 0.5, math.pi))
        robot.sleep(0.2)
        assert robot.distance().metres == pytest.approx(0.29, abs=0.01)
        assert robot.distances().tof == pytest.approx(0.3 - 0.034, abs=robot.distances().tof_error / 3)
    with elib.connect("sim://square?speed=max") as robot:
        assert math.isnan(robot.distances().tof)


@pytest.mark.parametrize("firmware", list(PROFILES))
def test_a_scan_shows_the_walls_around_the_robot(firmware: str) -> None:
    with elib.connect(f"sim://square?speed=max&firmware={firmware}&quality=typical&seed=6") as robot:
        robot.distances()
        world_of(robot).move_robot(0, elib.Pose(0.065, 0.07, 2.0))
        robot.set_pose(0.065, 0.07, 2.0)
        scan = robot.scan()
        assert scan.pose.heading == pytest.approx(2.0, abs=0.01)
        assert list(scan.directions) == sorted(scan.directions)
        for direction, true in ((math.pi, 0.065), (-math.pi / 2, 0.07)):
            for k in range(36):
                if abs(math.remainder(scan.directions[k] - direction, math.tau)) < 0.1:
                    assert scan.ranges[k] == pytest.approx(true, abs=2 * scan.errors[k])
        assert all(min(x, y) < 0.03 for x, y in scan.points if firmware != "epuck2")
        away = scan.ranges[20]  # towards the middle of the square
        assert (0.3 < away < 1.4) if firmware == "epuck2" else away == math.inf


def test_a_scan_goes_on_over_a_link_that_loses_answers_and_ends_over_one_that_is_dead() -> None:
    with elib.connect("sim://square?speed=max&seed=6&loss=0.05&latency=0.02") as robot:
        world_of(robot).move_robot(0, elib.Pose(0.065, 0.5, 0.0))
        scan = robot.scan()
        assert scan.pose.heading == pytest.approx(0.0, abs=0.01)
        assert min(scan.ranges) == pytest.approx(0.065, abs=0.005)
    with elib.connect("sim://square?speed=max&seed=6") as robot:
        pending = robot.begin.scan()
        robot.sleep(1)
        link_of(robot).silence()
        with pytest.raises(elib.LinkLost, match="no longer answers"):
            pending.end()
        link_of(robot).end_silence()


def test_a_scan_has_every_style_and_an_error_of_it_stops_the_robot() -> None:
    with elib.connect("sim://square?speed=max") as robot:
        pending = robot.begin.scan(turn_rate=3)
        assert len(pending.end().ranges) == 36
        pending = robot.begin.scan()
        robot.sleep(1)
        robot.stop()
        with pytest.raises(elib.MotionInterrupted, match="scan"):
            pending.end()
        before = robot.encoders()
        robot.sleep(1)
        assert robot.encoders() == before
        for wrong in ({"gains": (1.0, 1.0)}, {"reflectance": 2}, {"turn_rate": 0}):
            with pytest.raises(elib.ArgumentError, match=next(iter(wrong))):
                robot.scan(**wrong)
        assert robot.encoders() == before
