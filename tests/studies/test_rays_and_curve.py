"""The rays that the fit casts are those of the simulator, and its curve finds any response again."""

import math
from dataclasses import replace

import numpy as np
import pytest

from elib.base.errors import ArgumentError
from elib.simulator.physics import Box, Cylinder, EpuckModel, Pose, Scene, Wall, World
from elib.simulator.physics.profiles import APERTURE, NARROW, profile
from elib.studies.infrared import REACH, fit_curve, usual
from elib.studies.rays import depths

SCENE = Scene(
    1.0,
    1.0,
    walls=(Wall(0.5, 0.2, 0.6, 0.3), Wall(0.0, 0.9, 1.0, 0.9, height=0.01)),
    boxes=(Box(0.3, 0.7, 0.1, 0.2, angle=0.5, reflectance=0.5),),
    cylinders=(Cylinder(0.7, 0.7, 0.05),),
    starts=(Pose(0.5, 0.5),),
    model=EpuckModel(quality="ideal", sensor_noise=0.0),
)
POSES = [(0.44, 0.25, 0.3), (0.3, 0.55, 1.2), (0.63, 0.63, 0.8), (0.06, 0.3, 3.0), (0.4, 0.8, -2.0), (0.5, 0.5, 0.0)]


@pytest.mark.parametrize("aperture", [APERTURE, NARROW])
@pytest.mark.parametrize("pose", POSES)
def test_a_robot_reads_what_its_rays_and_the_usual_curve_say(pose: tuple[float, float, float], aperture: float) -> None:
    response = replace(profile("measured"), aperture=aperture)
    scene = replace(SCENE, model=replace(SCENE.model, profile=response))
    world = World(scene)
    world.move_robot(0, Pose(*pose))
    depth, shares = depths(scene, np.array([pose]), REACH)
    light = (shares * usual(depth)).sum(axis=-1)[0]
    assert world.proximity(0) == pytest.approx(light, abs=20, rel=0.02)


def drawn(gains: np.ndarray, levels: np.ndarray, bend: float) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(8)
    depth = rng.uniform(0.01, REACH, (300, 8, 1))
    light = usual(depth[..., 0]) * np.exp(bend * (depth[..., 0] - 0.03) / 0.03)
    return depth, np.clip(np.round(gains * light + levels + rng.normal(size=light.shape) * 6), 0, 4095)


def test_curve_gains_levels_and_noise_are_found_again() -> None:
    gains = np.array([0.9, 1.1, 1.0, 1.0, 0.95, 1.05, 1.0, 1.0])
    levels = np.array([40.0, 95.0, 0.0, 310.0, 560.0, 120.0, 200.0, 75.0])
    depth, read = drawn(gains, levels, 0.4)
    found = fit_curve(lambda age: (depth, np.ones(1)), read, 0.02)
    for distance in (0.015, 0.02, 0.03, 0.05):
        true = float(usual(np.array(distance))) * math.exp(0.4 * (distance - 0.03) / 0.03)
        # Where it is far, the curve and what is read in the open cannot be told apart.
        read_there = found.infrared.counts(distance) + np.mean(found.infrared.offsets)
        assert read_there == pytest.approx(true + levels.mean(), rel=0.04)
    assert found.infrared.gains == pytest.approx(gains / np.exp(np.log(gains).mean()), abs=0.02)
    assert found.infrared.offsets == pytest.approx(levels, abs=8)
    assert found.infrared.noise == pytest.approx(6, abs=1.5)
    assert found.near_error < 0.04


def test_readings_that_fit_nothing_have_no_weight() -> None:
    depth, read = drawn(np.ones(8), np.zeros(8), 0.0)
    read[::20, 3] = 3000
    found = fit_curve(lambda age: (depth, np.ones(1)), read, 0.02)
    assert found.infrared.counts(0.03) == pytest.approx(float(usual(np.array(0.03))), rel=0.05)


def test_a_drive_in_the_open_has_no_curve() -> None:
    with pytest.raises(ArgumentError, match=r"(?s)only 0 infrared readings.*up to a wall"):
        fit_curve(lambda age: (np.full((50, 8, 1), REACH), np.ones(1)), np.full((50, 8), 4.0), 0.02)


def test_the_curve_never_falls_towards_the_wall() -> None:
    depth, read = drawn(np.ones(8), 0.0, -0.5)
    counts = [each for _, each in fit_curve(lambda age: (depth, np.ones(1)), read, 0.02).infrared.curve]
    assert counts == sorted(counts, reverse=True)
