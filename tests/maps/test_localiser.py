"""Finding a robot on a map: by wheels and infrared readings that a world gives."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import numpy as np
import pytest

import elib
from elib.base.body import GROUND_SENSORS, LENS
from elib.base.errors import ArgumentError
from elib.base.pose import Pose, advanced
from elib.behaviours.wall_following import follow
from elib.link.protocol.distances import distances
from elib.link.protocol.tags import Tag
from elib.link.protocol.values import Proximity, Wheels
from elib.maps.localiser import FARTHEST, MIN_GUESSES
from elib.simulator.physics import Box, Colour, Patch, Scene, World
from lanes import short

NOTHING = [math.inf] * 8


class Drive:
    """A robot that follows the walls of a world, its odometry, and a localiser that hears of both."""

    def __init__(self, world: World, localiser: elib.Localiser) -> None:
        self.world, self.localiser = world, localiser
        self.odometry = Pose(0.0, 0.0)
        self.steps = world.encoders(0)
        self.wheels = Wheels(0.0, 0.0)

    def on(self, seconds: float) -> None:
        """Follow walls, with ten looks a second."""
        for _ in range(round(10 * seconds)):
            near = Proximity(*self.world.proximity(0))
            now = self.world.encoders(0)
            self.odometry = advanced(self.odometry, now[0] - self.steps[0], now[1] - self.steps[1])
            self.steps = now
            self.localiser.update(self.odometry, distances(near))
            self.wheels = follow(near, self.wheels)
            self.world.set_step_rates(0, 1000 * self.wheels.left, 1000 * self.wheels.right)
            self.world.run(6)

    @property
    def error(self) -> tuple[float, float]:
        """How far the estimate is off, m and rad."""
        found, real = self.localiser.estimate.pose, self.world.pose(0)
        off = math.remainder(found.heading - real.heading, math.tau)
        return math.dist((found.x, found.y), (real.x, real.y)), abs(off)


def maze(seed: int) -> World:
    """Return the maze with a drawn robot; its sensors read 0 in the open, as after a calibration."""
    scene = Scene.load("maze")
    return World(replace(scene, model=replace(scene.model, quality="typical", offset_spread=0.0)), seed=seed)


@pytest.fixture(scope="module")
def grid() -> elib.Grid:
    return elib.Grid.of_world("maze")


def test_what_the_map_tells_of_a_pose_is_what_the_simulator_reads_there(grid: elib.Grid) -> None:
    scene = Scene.load("maze")
    world = World(replace(scene, model=replace(scene.model, quality="ideal", sensor_noise=0.0)))
    localiser, chance = elib.Localiser(grid, Pose(0.1, 0.1)), random.Random(3)
    off = []
    for _ in range(100):
        x, y = (0.1 + 0.2 * chance.randrange(7) + chance.uniform(-0.06, 0.06) for _ in range(2))
        world.move_robot(0, Pose(x, y, chance.uniform(-math.pi, math.pi)))
        world.step()
        seen = np.minimum(list(distances(Proximity(*world.proximity(0)))), FARTHEST)
        off.append(seen - localiser.expected(world.pose(0)))
    assert np.abs(np.mean(off)) < 0.002
    assert np.quantile(np.abs(off), 0.9) < 0.006


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_robot_whose_place_is_known_is_followed_though_its_wheels_are_not_nominal(grid: elib.Grid, seed: int) -> None:
    world = maze(seed)
    drive = Drive(world, elib.Localiser(grid, world.pose(0), seed=seed))
    drive.on(60)
    assert drive.localiser.estimate.is_sure
    assert drive.error[0] < 0.025
    assert drive.error[1] < math.radians(10)
    assert drive.localiser.estimate.pose.uncertainty < 0.04


def test_a_robot_that_was_put_elsewhere_is_noticed(grid: elib.Grid) -> None:
    world = maze(1)
    drive = Drive(world, elib.Localiser(grid, world.pose(0)))
    drive.on(5)
    assert not drive.localiser.is_lost
    world.move_robot(0, Pose(0.9, 0.7, 2.0))
    drive.on(6)
    assert drive.localiser.is_lost or drive.error[0] < 0.03


def test_where_nothing_is_known_nothing_is_believed(grid: elib.Grid) -> None:
    localiser = elib.Localiser(grid)
    assert localiser.is_lost
    assert localiser.estimate.share < 0.1
    assert localiser.update(Pose(0, 0), NOTHING).is_sure is False


def test_odometry_may_begin_anywhere_and_a_robot_that_stands_learns_nothing(grid: elib.Grid) -> None:
    localiser = elib.Localiser(grid, Pose(0.1, 0.1, math.pi / 2))
    first = localiser.update(Pose(7.0, -3.0, 1.0), NOTHING)
    again = [localiser.update(Pose(7.0, -3.0, 1.0), [0.01] * 8) for _ in range(50)]
    assert again[-1] == first
    assert math.dist((first.pose.x, first.pose.y), (0.1, 0.1)) < 0.01


def test_the_same_seed_gives_the_same_estimates(grid: elib.Grid) -> None:
    runs = []
    for _ in range(2):
        localiser = elib.Localiser(grid, Pose(0.1, 0.1, math.pi / 2), seed=4)
        runs.append([localiser.update(Pose(0.01 * k, 0.0), NOTHING) for k in range(5)])
    assert runs[0] == runs[1]


def test_a_map_without_room_for_a_robot_is_an_error() -> None:
    with pytest.raises(ArgumentError, match="no place where a robot has room"):
        elib.Localiser(elib.Grid())


def test_the_first_looks_draw_guesses_at_the_place_of_the_robot(grid: elib.Grid) -> None:
    found = []
    for seed in range(3):
        world = maze(seed)
        localiser = elib.Localiser(grid, seed=seed)
        Drive(world, localiser).on(2.5)
        real, (x, y, heading) = world.pose(0), localiser._guesses.T[:3]
        off = np.abs(np.remainder(heading - real.heading + math.pi, math.tau) - math.pi)
        found.append(int(((np.hypot(x - real.x, y - real.y) < 0.02) & (off < math.radians(9))).sum()))
    assert min(found) >= 1, found
    assert sum(found) > 6, found


def test_a_guess_that_seems_unlikely_is_drawn_again_and_stays_as_unlikely(grid: elib.Grid) -> None:
    localiser = elib.Localiser(grid, Pose(0.1, 0.1, math.pi / 2))
    localiser._guesses[:30, 0] = 1.3
    localiser._weights[:] = 0.99 / (MIN_GUESSES - 30)
    localiser._weights[:30] = 0.01 / 30
    localiser._draw()
    is_there = localiser._guesses[:, 0] > 1
    assert 6 <= is_there.sum() < MIN_GUESSES / 4
    assert localiser._weights[is_there].sum() == pytest.approx(0.01, rel=0.3)


@pytest.mark.parametrize("seed", short([1, 2, 3], 1))
def test_the_first_place_that_is_believed_is_the_right_one(grid: elib.Grid, seed: int) -> None:
    world = maze(seed)
    world.move_robot(0, Pose(0.1 + 0.2 * (seed % 7), 0.1 + 0.2 * (3 * seed % 7), seed))
    drive = Drive(world, elib.Localiser(grid, seed=seed))
    for _ in range(90):
        drive.on(1)
        if not drive.localiser.is_lost:
            break
    assert not drive.localiser.is_lost
    assert drive.error[0] < drive.localiser.estimate.pose.uncertainty < 0.03
    assert drive.error[1] < math.radians(10)


@pytest.mark.parametrize("place", [(5.0, 5.0), (-0.2, 0.1), (0.3, 0.5)])
def test_a_place_off_the_map_or_in_a_wall_is_refused(place: tuple[float, float]) -> None:
    grid = elib.Grid.of_world(Scene(1.0, 1.0, boxes=(Box(0.3, 0.5, 0.2, 0.2),)))
    with pytest.raises(ArgumentError, match="is not on the map, or something stands there"):
        elib.Localiser(grid, Pose(*place))


def test_where_nothing_is_near_no_guess_is_drawn(grid: elib.Grid) -> None:
    localiser = elib.Localiser(grid)
    for k in range(20):
        assert not localiser.update(Pose(0.01 * k, 0.0), NOTHING).is_sure
    assert len(localiser._guesses) == MIN_GUESSES


def test_tags_find_a_robot_where_nothing_is_near() -> None:
    localiser = elib.Localiser(elib.Grid.of_world("square"))
    real, tags = Pose(0.4, 0.5, 0.3), ((1.0, 0.7), (1.0, 0.35))
    for x, y in tags:
        right, up = x - real.x - LENS * math.cos(real.heading), y - real.y - LENS * math.sin(real.heading)
        tag = Tag(1, math.hypot(right, up), math.atan2(up, right) - real.heading, 0.02, 0.02)
        localiser.see_tag(tag, x, y)
    found = localiser.estimate
    assert found.share > 0.7
    assert math.dist((found.pose.x, found.pose.y), (real.x, real.y)) < found.pose.uncertainty < 0.08


def test_the_floor_tells_two_places_apart_that_look_alike() -> None:
    grid = elib.Grid.of_world(Scene(1.0, 1.0, paint=(Patch(0.2, 0.4, 0.2, 0.2, Colour(16, 16, 16)),)))
    localiser = elib.Localiser(grid, Pose(0.5, 0.5, uncertainty=0.6, heading_uncertainty=0.1))
    localiser.see_floor([900] * 3)
    for k in range(5):
        localiser.update(Pose(0.01 * k, 0.0), NOTHING)
        localiser.see_floor([350] * 3)
    x, y = localiser._guesses.T[:2]
    assert np.mean((abs(x + GROUND_SENSORS[1][0] - 0.3) < 0.12) & (abs(y - 0.5) < 0.12)) > 0.75


def test_a_place_that_is_known_badly_says_so_and_is_not_lost() -> None:
    localiser = elib.Localiser(elib.Grid.of_world("square"), Pose(0.3, 0.5, uncertainty=0.2, heading_uncertainty=0.2))
    pose = localiser.update(Pose(0.0, 0.0), None).pose
    assert pose.uncertainty == pytest.approx(0.2 * math.sqrt(2), rel=0.2)
    assert localiser.estimate.share > 0.9
    assert not localiser.estimate.is_sure
