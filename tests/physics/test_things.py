"""Things that can be pushed: they move as their masses say, turn when pushed aside, and stop where they are left."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from elib.physics import Box, Cylinder, Pose, Scene, Wall, World
from elib.physics.body import MASS, RADIUS

SPEED = 0.1


ONE = (Pose(0.3, 0.5),)


def world_of(*things, starts=ONE, size=2.0, walls=()):
    boxes = tuple(thing for thing in things if isinstance(thing, Box))
    cylinders = tuple(thing for thing in things if isinstance(thing, Cylinder))
    return World(Scene(size, 1.0, walls, boxes, cylinders, starts))


def run(world, seconds, robots=1):
    for robot in range(robots):
        world.drive(robot, SPEED, SPEED)
    world.run(round(64 * seconds))
    return world.snapshot()


def corners_inside(snapshot, tolerance=1e-6):
    points = [corner for box in snapshot.boxes for corner in box.corners]
    points += [
        (post.x + side * post.radius, post.y + up * post.radius)
        for post in snapshot.cylinders
        for side, up in ((1, 0), (-1, 0), (0, 1), (0, -1))
    ]
    return all(
        -tolerance <= x <= snapshot.width + tolerance and -tolerance <= y <= snapshot.depth + tolerance
        for x, y in points
    )


def to_box(box, x, y):
    """Return the distance of a point from a box, m, negative inside."""
    turned = complex(math.cos(-box.angle), math.sin(-box.angle)) * complex(x - box.x, y - box.y)
    beyond_x, beyond_y = abs(turned.real) - box.width / 2, abs(turned.imag) - box.depth / 2
    if beyond_x < 0 and beyond_y < 0:
        return max(beyond_x, beyond_y)
    return math.hypot(max(beyond_x, 0), max(beyond_y, 0))


@pytest.mark.parametrize(
    "thing", [Box(0.5, 0.5, 0.1, 0.1, is_pushable=True), Cylinder(0.5, 0.5, 0.05, is_pushable=True)]
)
def test_a_thing_is_pushed_along_and_stays_where_it_is_left(thing):
    world = world_of(thing)
    snapshot = run(world, 4)
    (moved,) = snapshot.boxes or snapshot.cylinders
    assert moved.x > 0.52
    assert moved.y == pytest.approx(0.5, abs=1e-9)
    assert moved.x - world.pose(0).x == pytest.approx(RADIUS + 0.05, abs=1e-6)
    world.drive(0, -SPEED, -SPEED)
    world.run(100)
    after = world.snapshot()
    (left,) = after.boxes or after.cylinders
    assert (left.x, left.y) == (moved.x, moved.y)
    assert not world.touching(0)


@pytest.mark.parametrize("mass", [0.01, 0.15, 1.0])
def test_the_masses_set_the_pace_of_a_push(mass):
    world = world_of(Cylinder(0.4, 0.5, 0.05, is_pushable=True, mass=mass))
    run(world, 2)
    before = world.pose(0).x
    world.run(64)
    assert world.pose(0).x - before == pytest.approx(SPEED * MASS / (MASS + mass), rel=0.01)


def test_a_box_that_is_pushed_off_its_middle_turns():
    world = world_of(Box(0.5, 0.53, 0.1, 0.1, is_pushable=True))
    (box,) = run(world, 3).boxes
    assert box.angle > 0.05  # Pushed on its right, it turns to the left.
    assert box.x > 0.5


def test_a_fixed_box_does_not_move():
    world = world_of(Box(0.5, 0.5, 0.1, 0.1))
    (box,) = run(world, 4).boxes
    assert (box.x, box.y) == (0.5, 0.5)
    assert world.pose(0).x == pytest.approx(0.45 - RADIUS, abs=1e-6)


def test_a_thing_stops_at_a_wall_and_stops_the_robot():
    things = Box(0.6, 0.5, 0.1, 0.1, is_pushable=True), Cylinder(0.8, 0.5, 0.04, is_pushable=True)
    world = world_of(*things, walls=(Wall(1.0, 0.2, 1.0, 0.8),))
    snapshot = run(world, 20)
    assert snapshot.cylinders[0].x == pytest.approx(1.0 - 0.04, abs=1e-4)
    assert snapshot.boxes[0].x == pytest.approx(1.0 - 0.08 - 0.05, abs=1e-4)
    assert world.pose(0).x == pytest.approx(1.0 - 0.08 - 0.1 - RADIUS, abs=1e-4)


def test_a_robot_sees_a_thing_where_it_was_pushed_to():
    world = world_of(Cylinder(0.45, 0.5, 0.05, is_pushable=True, reflectance=1.0))
    run(world, 3)
    near = world.proximity(0)
    assert near[0] > 1500
    assert near[7] > 1500
    assert world.distance(0) < 0.01
    boxed = world_of(Box(0.45, 0.5, 0.1, 0.1, is_pushable=True, reflectance=1.0))
    run(boxed, 3)
    assert boxed.proximity(0)[0] > 1500


@settings(max_examples=25)
@given(st.integers(0, 2**32), st.lists(st.floats(-0.13, 0.13), min_size=12, max_size=12))
def test_nothing_overlaps_whatever_is_pushed_where(seed, speeds):
    scene = Scene(
        0.8,
        0.8,
        (Wall(0.4, 0.1, 0.4, 0.25),),
        (Box(0.25, 0.5, 0.1, 0.08, 0.4, is_pushable=True), Box(0.6, 0.6, 0.1, 0.1)),
        (Cylinder(0.55, 0.3, 0.04, is_pushable=True), Cylinder(0.2, 0.2, 0.03)),
    )
    world = World(scene, robots=6, seed=seed)
    for robot in range(6):
        world.drive(robot, speeds[2 * robot], speeds[2 * robot + 1])
    for _ in range(80):
        world.step()
    snapshot = world.snapshot()
    assert corners_inside(snapshot, 1e-5)
    for robot in snapshot.robots:
        for box in snapshot.boxes:
            assert to_box(box, robot.pose.x, robot.pose.y) > RADIUS - 1e-5
        for post in snapshot.cylinders:
            assert math.hypot(robot.pose.x - post.x, robot.pose.y - post.y) > RADIUS + post.radius - 1e-5


@settings(max_examples=40)
@given(st.floats(0, math.tau), st.floats(-0.05, 0.05), st.sampled_from([0.02, 0.15, 2.0]))
def test_energy_never_grows_in_a_collision(heading, aside, mass):
    # Of speeds there are only those of the wheels: what moves in a tick is what is left of them.
    world = world_of(
        Cylinder(1.1, 0.5, 0.04, is_pushable=True, mass=mass),
        starts=(Pose(1.0, 0.5 + aside), Pose(1.25, 0.5, heading)),
    )
    for robot in (0, 1):
        world.drive(robot, SPEED, SPEED)
    free = 2 * 0.5 * MASS * SPEED**2
    before = world.snapshot()
    for _ in range(120):
        world.step()
        now = world.snapshot()
        energy = sum(
            0.5 * weight * ((b.x - a.x) ** 2 + (b.y - a.y) ** 2) * 64**2
            for weight, a, b in (
                *((MASS, a.pose, b.pose) for a, b in zip(before.robots, now.robots, strict=True)),
                (mass, before.cylinders[0], now.cylinders[0]),
            )
        )
        assert energy <= free * 1.001
        before = now
