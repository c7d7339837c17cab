"""Things that can be pushed: friction holds them, a robot's grip moves them, and they come to rest by themselves."""

import math
from dataclasses import replace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from world_rig import IDEAL

from elib.simulator.physics import Box, Cylinder, Pose, Scene, Wall, World
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.geometry import extent, gap
from elib.simulator.physics.pushing import FASTEST, GRAVITY, GRIP
from lanes import few_and_many

SPEED = 0.1
ONE = (Pose(0.3, 0.5),)
KINDS = [Box(0.4, 0.5, 0.1, 0.1, is_pushable=True), Cylinder(0.4, 0.5, 0.05, is_pushable=True)]
BAR = 0.3, 0.02


def world_of(*things, starts=ONE, walls=(), step=1 / 64):
    boxes = tuple(thing for thing in things if isinstance(thing, Box))
    cylinders = tuple(thing for thing in things if isinstance(thing, Cylinder))
    return World(Scene(2.0, 1.0, walls, boxes, cylinders, starts, step, model=IDEAL))


def drive(world, seconds, speed=SPEED):
    """Drive all robots straight on, and return the world."""
    for robot in range(world.robots):
        world.set_wheel_speeds(robot, speed, speed)
    world.run(round(seconds / world.scene.step))
    return world


def moved(world):
    """Return everything that can be pushed, as it is now, boxes first."""
    now = world.snapshot()
    return [thing for thing in (*now.boxes, *now.cylinders) if thing.is_pushable]


def overlap(world):
    """Return how deep anything is in anything that can be pushed, in a robot or beyond the edge, m."""
    now = world.snapshot()
    pushables = moved(world)
    fixed = [thing for thing in (*now.walls, *now.boxes, *now.cylinders) if not getattr(thing, "is_pushable", False)]
    deep = [-gap(one, other) for k, one in enumerate(pushables) for other in (*pushables[:k], *fixed)]
    for x, y in ((pose.x, pose.y) for pose in world.poses):
        deep += [RADIUS - thing.distance(x, y) for thing in (*pushables, *fixed)]
    for left, right, low, high in map(extent, pushables):
        deep += [-left, right - now.width, -low, high - now.depth]
    return max(deep)


@pytest.mark.parametrize("step", [1 / 64, 0.1])
@pytest.mark.parametrize("thing", KINDS)
def test_a_light_thing_is_pushed_at_the_robots_full_speed_and_stays_where_it_is_left(thing, step):
    world = drive(world_of(thing, step=step), 1)
    before = world.pose(0).x
    drive(world, 2)
    assert world.pose(0).x - before == pytest.approx(2 * SPEED, abs=1e-6)
    (left,) = moved(world)
    assert left.x - world.pose(0).x == pytest.approx(RADIUS + 0.05, abs=1e-6)
    assert left.y == pytest.approx(0.5, abs=1e-9)
    drive(world, 1, -SPEED)
    assert moved(world)[0].x == pytest.approx(left.x, abs=0.001 if step < 0.1 else 0.01)
    resting = moved(world)
    drive(world, 1, -SPEED)
    assert moved(world) == resting
    assert not world.touching(0)


@pytest.mark.parametrize("thing", KINDS)
@pytest.mark.parametrize("mass", [0.215, 1.0])
def test_what_friction_holds_against_the_grip_stops_the_robot_while_its_encoders_count_on(thing, mass):
    assert mass * thing.friction * GRAVITY > GRIP
    world = drive(world_of(replace(thing, mass=mass)), 3)
    pose, steps = world.pose(0), world.encoders(0)[0]
    assert pose.x == pytest.approx(0.35 - RADIUS, abs=1e-6)
    drive(world, 2)
    assert (world.pose(0).x, world.pose(0).y) == pytest.approx((pose.x, pose.y), abs=1e-6)
    assert world.encoders(0)[0] - steps > 1500
    assert world.touching(0)
    (held,) = moved(world)
    assert (held.x, held.y) == (0.4, 0.5)


@pytest.mark.parametrize("mass", [0.2, 0.25])
def test_the_threshold_of_a_push_is_friction_times_weight(mass):
    # A robot pushes with 1.03 N; friction x mass x g is 0.98 N and 1.23 N.
    world = drive(world_of(Box(0.4, 0.5, 0.1, 0.1, is_pushable=True, mass=mass)), 4)
    is_moved = moved(world)[0].x > 0.5
    assert is_moved == (0.5 * mass * GRAVITY < GRIP)
    slippery = drive(world_of(Box(0.4, 0.5, 0.1, 0.1, is_pushable=True, mass=mass, friction=0.2)), 4)
    assert moved(slippery)[0].x > 0.5


def test_two_robots_push_what_one_cannot():
    heavy = Box(0.4, 0.5, 0.1, 0.2, is_pushable=True, mass=0.3)
    both = drive(world_of(heavy, starts=(Pose(0.3, 0.46), Pose(0.3, 0.54))), 4)
    assert moved(both)[0].x > 0.6
    assert both.pose(0).x == pytest.approx(0.3 + 4 * SPEED, abs=0.01)
    assert overlap(both) < 1e-6
    alone = drive(world_of(heavy), 4)
    assert moved(alone)[0].x == 0.4


@pytest.mark.parametrize("friction", [0.02, 0.05])
def test_what_has_little_friction_rolls_on_and_comes_to_rest_by_itself(friction):
    ball = Cylinder(0.4, 0.5, 0.03, is_pushable=True, mass=0.05, friction=friction)
    world = drive(world_of(ball), 1)
    at = moved(world)[0].x
    drive(world, 2, 0.0)
    # From speed v it rolls v^2 / (2 friction g).
    assert moved(world)[0].x - at == pytest.approx(SPEED**2 / (2 * friction * GRAVITY), rel=0.1)
    resting = moved(world)
    drive(world, 1, 0.0)
    assert moved(world) == resting


def test_without_friction_a_ball_keeps_its_speed_and_stops_at_the_wall():
    ball = Cylinder(0.4, 0.5, 0.03, is_pushable=True, friction=0.0)
    world = drive(world_of(ball), 1)
    at = moved(world)[0].x
    drive(world, 4, 0.0)
    assert moved(world)[0].x - at == pytest.approx(4 * SPEED, rel=0.01)
    drive(world, 20, 0.0)
    assert moved(world)[0].x == pytest.approx(2.0 - 0.03, abs=1e-6)


def test_a_box_that_is_pushed_off_its_middle_turns():
    world = drive(world_of(Box(0.5, 0.53, 0.1, 0.1, is_pushable=True)), 3)
    (box,) = moved(world)
    assert box.angle > 0.05  # Pushed on its right, it turns to the left.
    assert box.x > 0.5


def test_a_push_off_the_middle_turns_what_a_push_on_the_middle_does_not_move():
    long = Box(0.4, 0.5, 0.04, 0.4, is_pushable=True, mass=0.25)
    aside = drive(world_of(long, starts=(Pose(0.3, 0.34),)), 3)
    assert moved(aside)[0].angle > 0.2
    assert moved(drive(world_of(long), 3))[0] == long


def test_a_fixed_box_does_not_move():
    world = drive(world_of(Box(0.5, 0.5, 0.1, 0.1)), 4)
    assert world.snapshot().boxes[0].x == 0.5
    assert world.pose(0).x == pytest.approx(0.45 - RADIUS, abs=1e-6)


@pytest.mark.parametrize("other", KINDS)
def test_a_chain_of_two_things_against_a_wall_stops_the_robot(other):
    chain = Box(0.6, 0.5, 0.1, 0.1, is_pushable=True, mass=0.05), replace(other, x=0.8, mass=0.05)
    world = drive(world_of(*chain, walls=(Wall(1.0, 0.2, 1.0, 0.8),)), 12)
    pose = world.pose(0)
    assert sorted(thing.x for thing in moved(world)) == pytest.approx([0.85, 0.95], abs=1e-4)
    assert pose.x == pytest.approx(0.8 - RADIUS, abs=1e-4)
    drive(world, 2)
    assert (world.pose(0).x, world.pose(0).y) == pytest.approx((pose.x, pose.y), abs=1e-6)
    assert overlap(world) < 1e-6


@pytest.mark.parametrize("thing", KINDS)
@pytest.mark.parametrize("first", [0.1, 0.7])
def test_a_wall_stops_what_is_pushed_at_it_from_whichever_end_it_begins(thing, first):
    walls = (Wall(first, 0.7, 0.8 - first, 0.7),)
    world = drive(world_of(thing, walls=walls, starts=(Pose(0.4, 0.4, math.pi / 2),)), 4)
    assert moved(world)[0].y == pytest.approx(0.65, abs=1e-4)
    assert overlap(world) < 1e-6


def test_a_robot_sees_a_thing_where_it_was_pushed_to():
    world = drive(world_of(Cylinder(0.45, 0.5, 0.05, is_pushable=True, reflectance=1.0)), 3)
    near = world.proximity(0)
    assert near[0] > 1500
    assert near[7] > 1500
    assert world.distance(0) < 0.01
    boxed = drive(world_of(Box(0.45, 0.5, 0.1, 0.1, is_pushable=True, reflectance=1.0)), 3)
    assert boxed.proximity(0)[0] > 1500


@pytest.mark.parametrize(
    "pair",
    [
        (Box(1.0, 0.5, 0.1, 0.1, is_pushable=True), Box(1.05, 0.52, 0.1, 0.1, 0.3, is_pushable=True)),
        (Box(1.0, 0.5, 0.1, 0.1, is_pushable=True), Box(1.0, 0.5, 0.1, 0.1, is_pushable=True)),
        (Box(1.0, 0.5, *BAR, is_pushable=True), Box(1.0, 0.5, *BAR, math.pi / 2, is_pushable=True)),
        (Box(1.0, 0.5, *BAR, is_pushable=True), Box(1.05, 0.52, *BAR, 1.2, is_pushable=True, mass=1.0)),
        # Corners of each in the other that lie near different sides.
        (
            Box(1.0, 0.177, 0.1, 0.06, 0.48, is_pushable=True, friction=1.0),
            Box(1.022, 0.228, 0.1, 0.06, -1.63, is_pushable=True, mass=1.0),
        ),
        (Box(1.0, 0.5, 0.1, 0.1, is_pushable=True), Cylinder(1.02, 0.5, 0.03, is_pushable=True)),
        (Cylinder(1.0, 0.5, 0.05, is_pushable=True), Cylinder(1.0, 0.5, 0.05, is_pushable=True)),
    ],
    ids=["boxes", "same place", "crossed bars", "slanted bars", "corners", "box and cylinder", "cylinders"],
)
def test_two_things_put_into_each_other_come_apart_and_stand_still(pair):
    world = world_of(*pair)
    assert overlap(world) > 0.005
    world.run(64)
    assert overlap(world) < 1e-6
    resting = moved(world)
    assert max(math.dist((a.x, a.y), (b.x, b.y)) for a, b in zip(pair, resting, strict=True)) < 0.35
    world.run(64)
    assert moved(world) == resting


def test_three_boxes_pushed_in_a_row_go_straight_on():
    row = (Box(0.4 + 0.1 * k, 0.5, 0.1, 0.06, is_pushable=True, mass=0.03) for k in range(3))
    world = drive(world_of(*row), 4)
    front = world.pose(0).x + RADIUS
    assert [box.x - front for box in moved(world)] == pytest.approx([0.05, 0.15, 0.25], abs=1e-6)
    assert all(abs(box.angle) < 1e-6 and abs(box.y - 0.5) < 1e-6 for box in moved(world))
    assert world.pose(0).x == pytest.approx(0.7, abs=0.001)


def crosses(before, after, wall):
    """Return whether the way from one place to another leads through a wall."""
    if before == after:
        return False
    start, end = complex(wall.x1, wall.y1), complex(wall.x2, wall.y2)
    one, other = (((place - before) / (after - before)).imag for place in (start, end))
    here, there = (((place - start) / (end - start)).imag for place in (before, after))
    return one * other < 0 and here * there < 0


@few_and_many(6, 12)
def test_nothing_overlaps_and_nothing_goes_through_whatever_is_pushed_where(examples):
    @settings(max_examples=examples)
    @given(
        st.integers(0, 2**32),
        st.lists(st.floats(-0.13, 0.13), min_size=12, max_size=12),
        st.sampled_from([0.0, 0.02, 0.5]),
        st.sampled_from([0.01, 0.1, 2.0]),
        st.sampled_from([1 / 64, 0.1]),
    )
    def check(seed, speeds, friction, mass, step):
        def pushable(kind, *place):
            return kind(*place, is_pushable=True, friction=friction, mass=mass)

        scene = Scene(
            0.8,
            0.8,
            (Wall(0.4, 0.1, 0.4, 0.25), Wall(0.1, 0.35, 0.3, 0.4)),
            (pushable(Box, 0.25, 0.5, 0.1, 0.08, 0.4), pushable(Box, 0.5, 0.7, 0.2, 0.01), Box(0.6, 0.55, 0.1, 0.1)),
            (pushable(Cylinder, 0.55, 0.3, 0.04), pushable(Cylinder, 0.48, 0.2, 0.01), Cylinder(0.2, 0.2, 0.03)),
            step=step,
            model=IDEAL,
        )
        world = World(scene, robots=5, seed=seed)
        for robot in range(5):
            world.set_wheel_speeds(robot, speeds[2 * robot], speeds[2 * robot + 1])
        before = [complex(thing.x, thing.y) for thing in (*moved(world), *world.poses)]
        for _ in range(60):
            world.step()
            now = [complex(thing.x, thing.y) for thing in (*moved(world), *world.poses)]
            for here, there in zip(before, now, strict=True):
                assert not any(crosses(here, there, wall) for wall in scene.walls)
            before = now
            assert overlap(world) < 1e-5

    check()


@few_and_many(15, 30)
def test_nothing_is_pushed_faster_than_the_robots_drive(examples):
    @settings(max_examples=examples)
    @example(3.0, 0.0, 0.02, 0.0)
    @example(3.125, 0.0, 0.02, 0.0)
    @given(
        st.floats(0, math.tau), st.floats(-0.05, 0.05), st.sampled_from([0.02, 0.15, 2.0]), st.sampled_from([0.0, 0.5])
    )
    def check(heading, aside, mass, friction):
        radius = 0.04
        world = world_of(
            Cylinder(1.1, 0.5, radius, is_pushable=True, mass=mass, friction=friction),
            starts=(Pose(1.0, 0.5 + aside), Pose(1.25, 0.5, heading)),
        )
        for robot in (0, 1):
            world.set_wheel_speeds(robot, SPEED, SPEED)
        limit = SPEED
        for _ in range(120):
            before = moved(world)[0]
            world.step()
            after = moved(world)[0]
            way = math.dist((before.x, before.y), (after.x, after.y))
            # Between two robots that meet head on, a round thing comes out at the side, and may roll on.
            if all(
                math.hypot(after.x - pose.x, after.y - pose.y) < RADIUS + radius + SPEED / 64 for pose in world.poses
            ):
                limit = FASTEST
                assert way < 1.01 * math.sqrt(2 * (RADIUS + radius) * SPEED / 64)
            else:
                assert way * 64 < 1.01 * limit

    check()
