"""Room on the floor: things that touch, cross, lie within each other, or leave the arena."""

import math

import pytest
from world_rig import IDEAL

from elib.base.errors import ArgumentError
from elib.simulator.physics import Box, Cylinder, Pose, Scene, Wall, World
from elib.simulator.physics.geometry import gap
from elib.simulator.physics.moving import SLACK
from elib.simulator.worlds.files import parse
from elib.simulator.worlds.writer import written_scene


def disc(x, y, radius=0.037):
    return Cylinder(x, y, radius)


@pytest.mark.parametrize(
    ("one", "other", "apart"),
    [
        (disc(0, 0, 0.1), disc(0.5, 0, 0.2), 0.2),
        (disc(0, 0, 0.1), disc(0.25, 0, 0.2), -0.05),
        (disc(0.5, 0.3, 0.1), Wall(0, 0, 1, 0), 0.2),
        (disc(1.3, 0.4, 0.1), Wall(0, 0, 1, 0), 0.4),
        (disc(0.5, 0.5, 0.1), Box(0.5, 0, 0.4, 0.4), 0.2),
        (Box(0, 0, 0.2, 0.2), Box(0.5, 0, 0.2, 0.2), 0.3),
        (Box(0, 0, 0.2, 0.2), Box(0, 0.5, 0.2, 0.2, math.pi / 4), 0.4 - math.sqrt(0.02)),
    ],
)
def test_the_gap_is_the_distance_between_the_rims_both_ways(one, other, apart):
    assert gap(one, other) == pytest.approx(apart)
    assert gap(other, one) == pytest.approx(apart)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (disc(0, 0, 0.01), Box(0, 0, 1, 1)),
        (Wall(-1, 0, 1, 0), Box(0, 0, 0.2, 0.2)),
        (Wall(-0.05, 0, 0.05, 0), Box(0, 0, 0.2, 0.2)),
        (Wall(0, 0, 1, 1), Wall(0, 1, 1, 0)),
        (Box(0, 0, 1, 0.1), Box(0, 0, 0.1, 1)),
        (Box(0, 0, 1, 1), Box(0.01, 0.01, 0.1, 0.1, 0.5)),
        (Box(0, 0, 2, 1), Box(1, 0, 2, 1)),
        (Box(0, 0, 1, 1), Box(0, 0, 1, 1)),
    ],
)
def test_what_crosses_or_lies_within_overlaps_however_thin_it_is(one, other):
    assert gap(one, other) < -SLACK
    assert gap(other, one) < -SLACK


def test_an_overlap_is_as_deep_as_one_has_to_move_to_be_clear():
    assert gap(Box(0, 0, 2, 1), Box(1.8, 0, 2, 1)) == pytest.approx(-0.2)
    assert gap(disc(0, 0.9, 0.1), Box(0, 0, 2, 2)) == pytest.approx(-0.2)
    assert gap(Wall(0, -1, 0, 0.01), Box(0, 1, 2, 2)) == pytest.approx(-0.01)


def world():
    boxes = Box(0.2, 0.2, 0.1, 0.1, is_pushable=True), Box(0.8, 0.2, 0.1, 0.1, name="crate")
    world = World(
        Scene(1, 1, (Wall(0.5, 0, 0.5, 1),), boxes, (Cylinder(0.8, 0.8, 0.05),), (Pose(0.2, 0.8),), model=IDEAL)
    )
    world.name_robots(["mine"])
    return world


@pytest.mark.parametrize(
    ("x", "y", "blocked"),
    [
        (0.036, 0.5, "the edge of the arena"),
        (0.2, 0.97, "the edge of the arena"),
        (-3.0, 0.5, "the edge of the arena"),
        (0.53, 0.5, "wall 0"),
        (0.2, 0.28, "box 0"),
        (0.8, 0.2, r"box 1 \(crate\)"),
        (0.8, 0.72, "cylinder 0"),
    ],
)
def test_a_robot_is_put_into_nothing_and_the_message_says_what_is_in_the_way(x, y, blocked):
    moved, before = world(), world().hash()
    with pytest.raises(ArgumentError, match=rf"mine has no room at \({x:.3f}, {y:.3f}\): {blocked} is in the way"):
        moved.move_robot(0, Pose(x, y))
    assert moved.hash() == before


@pytest.mark.parametrize(("x", "y"), [(0.037, 0.963), (0.462, 0.5), (0.2, 0.288)])
def test_a_robot_has_room_up_to_the_edge_and_up_to_its_neighbours(x, y):
    moved = world()
    moved.move_robot(0, Pose(x, y))
    assert (moved.pose(0).x, moved.pose(0).y) == (x, y)


@pytest.mark.parametrize(
    ("act", "said"),
    [
        (lambda world, x, y: world.move_box(0, Pose(x, y)), "box 0"),
        (lambda world, x, y: world.move_box(1, Pose(x, y)), r"box 1 \(crate\)"),
        (lambda world, x, y: world.move_cylinder(0, x, y), "cylinder 0"),
        (lambda world, x, y: world.add_box(Box(x, y, 0.1, 0.1)), "box 2"),
        (lambda world, x, y: world.add_wall(Wall(x, y, x, y + 0.2)), "wall 1"),
        (lambda world, x, y: world.move_wall(0, Wall(x, y, x, y + 0.2)), "wall 0"),
    ],
)
def test_things_may_be_put_wherever_a_file_may_have_them_but_not_onto_a_robot(act, said):
    moved, before = world(), world().hash()
    with pytest.raises(ArgumentError, match=rf"{said} has no room .*: mine is in the way"):
        act(moved, 0.2, 0.78)
    if not said.startswith("wall"):
        with pytest.raises(ArgumentError, match=rf"{said} has no room .*: the edge of the arena is in the way"):
            act(moved, 1.001, 0.2)
    assert moved.hash() == before
    for x, y in ((0.2, 0.22), (0.5, 0.5), (0.8, 0.22), (0.8, 0.8), (0.99, 0.0)):
        act(moved, x, y)
        assert parse(written_scene(moved.scene).encode(), "moved.toml").boxes == moved.scene.boxes


def test_a_thing_that_can_be_pushed_comes_out_of_the_wall_that_it_was_put_into():
    moved = world()
    moved.move_box(0, Pose(0.49, 0.4))
    moved.run(64)
    assert gap(moved.snapshot().boxes[0], moved.scene.walls[0]) > -1e-6
