"""Runs: reproducible, observable, and set up where there is room."""

import dataclasses
import math

import numpy as np
import pytest
from world_rig import IDEAL, clearance

from elib.base.errors import ArgumentError, SimulationError
from elib.simulator.physics import Batch, Box, Colour, EpuckModel, Lamps, Pose, Scene, World, simulation
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.controller import Controller
from elib.simulator.worlds.files import gallery
from lanes import short


def wander(world, ticks):
    """Drive every robot by its own noisy sensors, so that noise decides the way."""
    for _ in range(ticks):
        for robot in range(world.robots):
            near = world.proximity(robot)
            world.set_wheel_speeds(robot, 0.08 - 4e-5 * sum(near[5:]), 0.08 - 4e-5 * sum(near[:3]))
        world.step()
    return world


@pytest.mark.parametrize("name", short(gallery(), "arena", "soccer"))
def test_the_same_seed_gives_the_same_run_to_the_last_bit(name):
    first, second = (wander(World.load(name, robots=3, seed=5), 200) for _ in range(2))
    assert first.hash() == second.hash()
    assert first.poses == second.poses


def test_the_run_of_this_release_is_known():
    # Changes when the physics changes: then say so in the changelog, and write the new digest down.
    world = World.load("square")
    world.set_wheel_speeds(0, 0.05, 0.06)
    world.run(64)
    assert world.hash() == "c28e9c8d76a82939134a97d68a5a253e"


def test_the_digest_tells_ticks_and_places_apart():
    world = World.load("square")
    digests = {world.hash()}
    world.step()
    digests.add(world.hash())
    world.set_wheel_speeds(0, 1e-12, 1e-12)
    world.step()
    digests.add(world.hash())
    assert len(digests) == 3


def test_time_is_whole_ticks():
    world = World.load("square")
    world.run_to(0.999)
    assert (world.tick, world.time) == (63, 63 / 64)
    world.run_to(1.0)
    assert (world.tick, world.time) == (64, 1.0)


def test_the_default_world_lets_a_simple_avoider_go_about_without_touching_anything():
    world = World.load("arena", seed=4)  # With some seeds it shuttles along one wall.
    seen, least = set(), [4095] * 8
    for _ in range(60 * 64):
        least = [min(pair) for pair in zip(least, world.proximity(0), strict=True)]
        near = [count - open_air for count, open_air in zip(world.proximity(0), least, strict=True)]
        right, left = max(near[0], near[1]), max(near[6], near[7])
        if max(right, left) < 150:
            world.set_wheel_speeds(0, 0.1, 0.1)
        else:
            world.set_wheel_speeds(0, 0.03 if right < left else -0.03, -0.03 if right < left else 0.03)
        world.step()
        assert not world.touching(0)
        seen.add((int(world.pose(0).x * 3), int(world.pose(0).y * 3)))
    assert len(seen) >= 6  # Of nine squares.


def test_extra_robots_stand_free_and_the_first_ones_do_not_move_when_more_come():
    few, many = World.load("arena", robots=4, seed=2), World.load("arena", robots=12, seed=2)
    assert many.poses[:4] == few.poses
    for i, pose in enumerate(many.poses):
        assert clearance(many.scene, pose.x, pose.y) >= RADIUS
        for other in many.poses[:i]:
            assert math.hypot(pose.x - other.x, pose.y - other.y) >= 2 * RADIUS
    assert World.load("arena", robots=4, seed=3).poses[1:] != few.poses[1:]


def test_fewer_robots_than_the_file_names_are_possible():
    assert World.load("arena", robots=0).poses == []


def test_a_start_in_an_obstacle_or_on_another_robot_is_refused():
    with pytest.raises(SimulationError, match="stands in a wall or an obstacle"):
        World(Scene(1, 1, boxes=(Box(0.5, 0.5, 0.3, 0.3),), starts=(Pose(0.5, 0.5),), model=IDEAL))
    with pytest.raises(SimulationError, match="stands in a wall"):
        World(Scene(1, 1, starts=(Pose(0.98, 0.5),), model=IDEAL))
    with pytest.raises(SimulationError, match="stands on another"):
        World(Scene(1, 1, starts=(Pose(0.5, 0.5), Pose(0.52, 0.5)), model=IDEAL))


@pytest.mark.parametrize(
    "arguments",
    [{"width": 0.1}, {"depth": math.nan}, {"step": 0}, {"step": 0.2}, {"seed": -1}, {"seed": 1 << 64}],
)
def test_a_scene_out_of_range_is_refused(arguments):
    with pytest.raises(ArgumentError, match=next(iter(arguments))):
        Scene(**{"width": 1, "depth": 1, **arguments})


def test_a_bad_number_of_robots_or_seed_is_refused():
    with pytest.raises(ArgumentError, match="robots is -1"):
        World.load("square", robots=-1)
    with pytest.raises(ArgumentError, match="seed is -5"):
        World.load("square", seed=-5)


def test_the_distance_ahead_is_the_true_one_up_to_two_metres():
    world = World(Scene(1, 1, starts=(Pose(0.5, 0.5),), model=EpuckModel(sensor_noise=0, quality="ideal")))
    assert world.distance(0) == pytest.approx(0.5 - 0.034)
    assert World(Scene(4, 4, starts=(Pose(0.5, 2),), model=IDEAL)).distance(0) == 2.0


def test_a_snapshot_is_frozen_and_stays_as_it_was():
    world = World.load("arena", robots=2)
    world.show(1, Lamps(body=True))
    before = world.snapshot(beams=True)
    wander(world, 20)
    assert before.tick == 0
    assert before.robots[0].pose != world.poses[0]
    assert [robot.lamps.body for robot in before.robots] == [False, True]
    with pytest.raises(dataclasses.FrozenInstanceError):
        before.tick = 3
    assert (before.name, before.width, before.depth) == ("arena", 1.0, 1.0)
    assert world.snapshot().robots[0].beams == ()


def test_beams_end_where_the_sensors_look():
    world = World(Scene(1, 1, starts=(Pose(0.95, 0.5),), model=IDEAL))
    front_right = world.snapshot(beams=True).robots[0].beams[0]
    assert front_right.end[0] == pytest.approx(1.0)
    assert front_right.end[1] < front_right.start[1] < 0.5
    assert front_right.strength > 0.05
    assert hash(front_right)


def test_colours_of_the_default_world_can_be_told_apart():
    things = World.load("arena").snapshot()
    colours = [thing.colour for thing in (*things.boxes, *things.cylinders)]
    assert len(set(colours)) == len(colours) == 4
    assert all(isinstance(colour, Colour) for colour in colours)


def test_numbers_of_numpy_are_numbers() -> None:
    world = World.load("square")
    controller = Controller(simulation.braitenberg, tuple(np.arange(18, dtype=np.float32)))
    world.run(2, controller)
    assert Controller(simulation.braitenberg, (np.int64(3),)).parameters == (3,)
    assert world.pose(np.int64(0)) == world.pose(0)
    with pytest.raises(ArgumentError, match=r"parameters are .*; they must be numbers"):
        Controller(simulation.braitenberg, (np.bool_(True),))


@pytest.mark.parametrize("robot", ["a", None, 0.5])
def test_a_robot_that_is_not_a_number_is_refused_in_words(robot: object) -> None:
    with pytest.raises(ArgumentError, match=r"the robot is .*; it must be a whole number, counted from 0"):
        World.load("square").pose(robot)


def test_a_world_by_its_name_is_answered_with_how_it_is_loaded():
    for kind, mistake in (("World", lambda: World("arena")), ("Batch", lambda: Batch("arena", 2))):
        with pytest.raises(ArgumentError, match=rf"^elib\.{kind}\(\) takes an elib\.Scene, not 'arena'") as caught:
            mistake()
        assert caught.value.hint == f"did you mean elib.{kind}.load('arena', ...)?"
    with pytest.raises(ArgumentError, match=r"not None$"):
        World(None)
