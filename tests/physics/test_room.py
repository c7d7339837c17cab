"""Room on the floor: things that touch, cross, lie within each other, or leave the arena."""

import math

import pytest

from elib.errors import ArgumentError
from elib.physics import Box, Cylinder, Pose, Scene, Wall, World
from elib.physics.geometry import gap
from elib.physics.moving import SLACK, blocker


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


def test_a_thing_has_room_up_to_the_edge_and_up_to_its_neighbours_and_not_beyond():
    others = [("epuck-2", disc(0.5, 0.5)), ("wall", Wall(0.2, 0.2, 0.2, 0.6))]
    assert blocker(disc(0.037, 0.963), others, 1, 1) is None
    assert blocker(disc(0.036, 0.5), others, 1, 1) == "the edge of the arena"
    assert blocker(disc(0.5 + 0.074, 0.5), others, 1, 1) is None
    assert blocker(disc(0.5 + 0.073, 0.5), others, 1, 1) == "epuck-2"
    assert blocker(disc(0.22, 0.3), others, 1, 1) == "wall"
    assert blocker(Box(0.1, 0.4, 0.3, 0.02), others, 1, 1) == "the edge of the arena"
    assert blocker(Box(0.2, 0.4, 0.3, 0.02), others, 1, 1) == "wall"


def test_a_box_is_not_put_into_another_one_or_into_a_wall_and_messages_call_robots_by_their_names():
    boxes = Box(0.2, 0.2, 0.1, 0.1, is_pushable=True), Box(0.8, 0.2, 0.1, 0.1, name="crate")
    world = World(Scene(1, 1, (Wall(0.5, 0, 0.5, 1),), boxes, (Cylinder(0.8, 0.8, 0.05),), (Pose(0.2, 0.8),)))
    world.name_robots(["mine"])
    for move, blocked in (
        (lambda: world.move_box(0, Pose(0.72, 0.2)), r"box 0 has no room at \(0.720, 0.200\): box 1 \(crate\) is in"),
        (lambda: world.move_box(0, Pose(0.46, 0.4)), "box 0 has no room .* wall 0 is in the way"),
        (lambda: world.move_box(1, Pose(0.8, 0.72)), r"box 1 \(crate\) has no room .* cylinder 0 is in the way"),
        (lambda: world.move_cylinder(0, 0.2, 0.12), "cylinder 0 has no room .* box 0 is in the way"),
        (lambda: world.move_cylinder(0, 0.2, 0.72), "cylinder 0 has no room .* mine is in the way"),
        (lambda: world.move_robot(0, Pose(0.2, 0.97)), "mine has no room .* the edge of the arena is in the way"),
    ):
        before = world.hash()
        with pytest.raises(ArgumentError, match=blocked):
            move()
        assert world.hash() == before
    world.move_box(0, Pose(0.45, 0.4))  # It touches the wall.
