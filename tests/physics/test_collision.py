"""Contact: nothing overlaps, nothing passes through, and a robot slides."""

import math
import random
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from world_rig import IDEAL, clearance, put

from elib.simulator.physics import Box, Cylinder, Pose, Scene, Wall, World
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.contacts import slide
from elib.simulator.physics.records import Scratch
from lanes import few_and_many

FULL_SPEED = 0.1288
MICROMETRE = 1e-6


def overlap(world):
    """Return how deep the deepest robot is in anything, m."""
    poses = world.poses
    walls = [RADIUS - clearance(world.scene, pose.x, pose.y) for pose in poses]
    robots = [2 * RADIUS - math.hypot(a.x - b.x, a.y - b.y) for i, a in enumerate(poses) for b in poses[:i]]
    return max(walls + robots)


def test_a_robot_that_pushes_a_wall_stays_in_front_of_it():
    world = World(Scene(1, 1, starts=(Pose(0.8, 0.5),), model=IDEAL))
    world.set_wheel_speeds(0, FULL_SPEED, FULL_SPEED)
    world.run(200)
    assert world.pose(0).x == pytest.approx(1 - RADIUS, abs=1e-9)
    assert world.touching(0)


def test_a_robot_slides_along_a_wall_by_the_part_of_its_speed_along_it():
    world = World(Scene(2, 1, starts=(Pose(0.5, RADIUS, -math.pi / 4),), model=IDEAL))
    world.set_wheel_speeds(0, 0.1, 0.1)
    world.run(64)
    pose = world.pose(0)
    assert pose.x == pytest.approx(0.5 + 0.1 * math.cos(math.pi / 4), abs=1e-9)
    assert pose.y == pytest.approx(RADIUS, abs=1e-9)
    assert pose.heading == pytest.approx(-math.pi / 4)


STEEP = math.radians(20)
NARROW = math.asin(0.03 / RADIUS)  # Of the line from a robot's centre to the ends of a slit of 6 cm.
ROUND = 5e-5
"""m. What is round counts as flat where a robot slides along it for a part of a step, 1 mm: it keeps off by so much."""

CORNERS = {
    "two walls": (
        Scene(
            2,
            2,
            walls=tuple(Wall(1, 1, 1 - 0.5 * math.cos(STEEP), 1 + side * 0.5 * math.sin(STEEP)) for side in (1, -1)),
            model=IDEAL,
        ),
        (1 - RADIUS / math.sin(STEEP), 1.0),
        1e-9,
    ),
    "the ends of two walls": (
        Scene(2, 2, walls=(Wall(0.9, 1.03, 1.5, 1.03), Wall(0.9, 0.97, 1.5, 0.97)), model=IDEAL),
        (0.9 - RADIUS * math.cos(NARROW), 1.0),
        ROUND,
    ),
    "two posts": (
        Scene(2, 2, cylinders=(Cylinder(1, 1.1, 0.08), Cylinder(1, 0.9, 0.08)), model=IDEAL),
        (1 - math.sqrt((RADIUS + 0.08) ** 2 - 0.01), 1.0),
        ROUND,
    ),
    "a post and a wall": (
        Scene(2, 2, walls=(Wall(0.2, 1 + RADIUS, 1.8, 1 + RADIUS),), cylinders=(Cylinder(1, 0.95, 0.05),), model=IDEAL),
        (1 - math.sqrt((RADIUS + 0.05) ** 2 - 0.0025), 1.0),
        ROUND,
    ),
    "a wall and the edge": (
        Scene(2, 1 + RADIUS, walls=(Wall(0.8, 0.8, 1.4, 0.8 + 0.6 * math.tan(STEEP)),), model=IDEAL),
        (0.8 + (0.2 - RADIUS / math.cos(STEEP)) / math.tan(STEEP), 1.0),
        1e-9,
    ),
}


@pytest.mark.parametrize("others", [0, 1])
@pytest.mark.parametrize("corner", CORNERS)
def test_a_robot_driven_into_a_corner_rests_at_both_its_sides_after_one_pass(corner, others):
    scene, place, tolerance = CORNERS[corner]
    scene = replace(scene, starts=(Pose(0.6, 0.96, 0.15), Pose(1.9, 0.1))[: 1 + others])
    world = World(scene)
    world.set_wheel_speeds(0, FULL_SPEED, FULL_SPEED)
    world.run(400)
    for _ in range(8):
        world.step()
        assert (world.pose(0).x, world.pose(0).y) == pytest.approx(place, abs=tolerance)
        assert world._state.world.robots[0].touched == 1  # Nothing was left to do in the second pass.


@pytest.mark.parametrize("speed", [0.1, FULL_SPEED, 0.19])
@few_and_many(15, 50)
def test_a_robot_that_is_pushed_at_a_slit_too_narrow_for_it_never_gets_through_at_any_step(speed, examples):
    chance = random.Random(7)
    for _ in range(examples):
        slit, ahead = chance.uniform(0.055, 0.0735), chance.uniform(0.02, 0.05)
        start = Pose(1 - 0.045 - chance.uniform(0, 0.03), 1 + chance.uniform(-0.003, 0.003))
        behind = start.x - RADIUS - 0.001
        walls = (
            Wall(1.0, 1 + slit / 2, 1.0, 2.0),
            Wall(1.0, 1 - slit / 2, 1.0, 0.0),
            Wall(1 + ahead, 0.0, 1 + ahead, 2.0),
            Wall(behind, 0.0, behind, 2.0),
        )
        world = World(Scene(2, 2, walls=walls, step=0.1, starts=(start,), model=IDEAL))
        world.set_wheel_speeds(0, speed, speed)
        for _ in range(25):
            before = world.pose(0)
            world.step()
            here = world.pose(0)
            assert behind < here.x < 1 + ahead
            assert math.dist((before.x, before.y), (here.x, here.y)) < 0.04


def test_a_robot_in_a_slit_stays_in_front_of_what_it_cannot_see_from_where_it_was():
    # The ends of the slit ask for a place far behind the third wall, which the robot does not touch on its way there.
    slit = 0.07001283984510091
    walls = (Wall(1, 1 + slit / 2, 1, 2), Wall(1, 1 - slit / 2, 1, 0), Wall(1.04, 0, 1.04, 2))
    scene = Scene(2, 2, walls=walls, step=0.1, starts=(Pose(0.9408166033910874, 0.9987067554679833),), model=IDEAL)
    world = World(scene)
    world.set_wheel_speeds(0, FULL_SPEED, FULL_SPEED)
    for _ in range(20):
        world.step()
        assert world.pose(0).x < 1.0


@settings(max_examples=200)
@given(st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi), st.floats(-0.05, 0.05))
def test_a_robot_slides_clear_of_the_last_contact_by_the_way_it_may_at_most(turn, last, lack):
    normal, before = (math.cos(turn), math.sin(turn)), (math.cos(last), math.sin(last))
    contact = Scratch(exit_x=0.3, exit_y=0.4, normal_x=before[0], normal_y=before[1], longest=0.02**2)
    contact.level = 0.3 * before[0] + 0.4 * before[1] + lack
    slide(contact, *normal)
    x, y, level = contact.exit_x, contact.exit_y, contact.level
    assert math.hypot(x - 0.3, y - 0.4) <= 0.02 + 1e-12
    assert (x - 0.3) * normal[0] + (y - 0.4) * normal[1] == pytest.approx(0, abs=1e-12)  # Along the one thing,
    assert level == pytest.approx(0.3 * normal[0] + 0.4 * normal[1], abs=1e-12)
    if (x, y) == (0.3, 0.4):
        assert lack <= 1e-12 or lack >= 0.02 * abs(math.sin(turn - last)) - 1e-12
    else:
        assert (x - 0.3) * before[0] + (y - 0.4) * before[1] == pytest.approx(lack, abs=1e-9)  # clear of the other.


@pytest.mark.parametrize("side", [1, -1])
def test_a_thin_wall_holds_from_both_sides(side):
    wall = Wall(0.5, 0.2, 0.5, 0.8)
    heading = 0.0 if side > 0 else math.pi
    world = World(Scene(1, 1, walls=(wall,), starts=(Pose(0.5 - side * 0.2, 0.5, heading),), model=IDEAL))
    world.set_wheel_speeds(0, FULL_SPEED, FULL_SPEED)
    world.run(300)
    assert world.pose(0).x == pytest.approx(0.5 - side * RADIUS, abs=1e-9)


def test_the_end_of_a_wall_is_round():
    world = World(Scene(1, 1, walls=(Wall(0.5, 0.5, 0.5, 0.8),), starts=(Pose(0.3, 0.48),), model=IDEAL))
    world.set_wheel_speeds(0, 0.1, 0.1)
    world.run(400)
    assert world.pose(0).x > 0.6  # It was pushed aside, went round the end and on.
    assert world.pose(0).y < 0.48


def test_a_fixed_post_turns_a_robot_aside():
    world = World(Scene(1, 1, cylinders=(Cylinder(0.5, 0.5, 0.05),), starts=(Pose(0.3, 0.51),), model=IDEAL))
    world.set_wheel_speeds(0, 0.1, 0.1)
    for _ in range(400):
        world.step()
        assert overlap(world) < MICROMETRE
    assert world.pose(0).x > 0.6


def test_two_equal_robots_push_each_other_to_a_stand():
    world = World(Scene(1, 1, starts=(Pose(0.4, 0.5), Pose(0.6, 0.5, math.pi)), model=IDEAL))
    for robot in (0, 1):
        world.set_wheel_speeds(robot, 0.1, 0.1)
    world.run(200)
    a, b = world.poses
    assert b.x - a.x == pytest.approx(2 * RADIUS, abs=1e-5)
    assert (a.x + b.x) / 2 == pytest.approx(0.5, abs=1e-9)


def test_a_moving_robot_shoves_a_resting_one():
    world = World(Scene(2, 1, starts=(Pose(0.4, 0.5), Pose(0.6, 0.5)), model=IDEAL))
    world.set_wheel_speeds(0, 0.1, 0.1)
    world.run(256)
    a, b = world.poses
    assert b.x > 0.65
    assert b.x - a.x == pytest.approx(2 * RADIUS, abs=1e-4)


@few_and_many(10, 20)
def test_no_crowd_in_any_corner_overlaps_by_more_than_a_micrometre(examples):
    @settings(max_examples=examples)
    @given(st.integers(0, 2**32), st.lists(st.floats(-0.14, 0.14), min_size=16, max_size=16))
    def check(seed, speeds):
        scene = Scene(
            0.5,
            0.5,
            walls=(Wall(0.1, 0.3, 0.2, 0.3),),
            boxes=(Box(0.35, 0.35, 0.08, 0.05, 0.5),),
            cylinders=(Cylinder(0.35, 0.12, 0.02),),
            model=IDEAL,
        )
        world = World(scene, robots=8, seed=seed)
        for robot in range(8):
            world.set_wheel_speeds(robot, speeds[2 * robot], speeds[2 * robot + 1])
        for _ in range(60):
            world.step()
            assert overlap(world) < MICROMETRE

    check()


def test_a_row_squeezed_against_a_wall_settles():
    starts = tuple(Pose(0.1 + 0.075 * k, 0.5) for k in range(5))
    world = World(Scene(0.55, 1, starts=starts, model=IDEAL))
    for robot in range(5):
        world.set_wheel_speeds(robot, FULL_SPEED, FULL_SPEED)
    for _ in range(200):
        world.step()
        assert overlap(world) < MICROMETRE
    assert all(world.touching(robot) for robot in range(5))


def test_robots_on_top_of_each_other_part_the_same_way_every_time():
    def parted():
        world = World(Scene(1, 1, starts=(Pose(0.4, 0.5), Pose(0.6, 0.5)), model=IDEAL))
        put(world, 0, 0.5, 0.5)
        put(world, 1, 0.5, 0.5)
        world.step()
        return world.poses

    assert parted() == parted()
    assert parted()[1].x - parted()[0].x == pytest.approx(2 * RADIUS, abs=1e-5)


@pytest.mark.parametrize(
    "things",
    [
        {"cylinders": (Cylinder(0.6, 0.5, 0.05),)},
        {"boxes": (Box(0.6, 0.5, 0.1, 0.1),)},
        {"walls": (Wall(0.55, 0.4, 0.55, 0.6),)},
    ],
)
def test_leaning_on_anything_is_touching_it(things):
    world = World(Scene(1, 1, starts=(Pose(0.5, 0.5),), model=IDEAL, **things))
    world.set_wheel_speeds(0, 0.1, 0.1)
    world.run(64)
    assert world.touching(0)
    assert world.pose(0).x == pytest.approx(0.55 - RADIUS, abs=1e-6)
    world.set_wheel_speeds(0, -0.1, -0.1)
    world.run(2)
    assert not world.touching(0)


def test_a_free_robot_touches_nothing():
    world = World(Scene(1, 1, starts=(Pose(0.5, 0.5),), model=IDEAL))
    world.set_wheel_speeds(0, 0.1, 0.1)
    world.run(10)
    assert not world.touching(0)
