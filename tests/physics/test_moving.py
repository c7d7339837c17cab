"""Changes by hand while the world runs: things are moved, lamps are dimmed, and a place without room is refused."""

import contextlib
import copy
import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from world_rig import IDEAL, ray_lengths

from elib.base.errors import ArgumentError
from elib.simulator.physics import Box, Cylinder, Light, Pose, Scene, Sound, Wall, World
from elib.simulator.physics.fittings import Zone
from lanes import short

SCENE = Scene(
    1.0,
    1.0,
    (Wall(0.5, 0.6, 0.5, 0.9),),
    (Box(0.7, 0.3, 0.1, 0.1), Box(0.3, 0.75, 0.1, 0.1, is_pushable=True)),
    (Cylinder(0.2, 0.5, 0.04), Cylinder(0.8, 0.8, 0.04, is_pushable=True)),
    (Pose(0.2, 0.2), Pose(0.5, 0.2)),
    lights=(Light(0.9, 0.1, intensity=0.0),),
    sounds=(Sound(0.5, 0.5, volume=0.0),),
    model=IDEAL,
)


@pytest.fixture
def world():
    return World(SCENE)


def test_a_robot_is_put_elsewhere_and_goes_on_from_there(world):
    world.set_wheel_speeds(0, 0.1, 0.1)
    world.run(10)
    world.move_robot(0, Pose(0.3, 0.4, math.pi / 2))
    assert (world.pose(0).x, world.pose(0).y, world.pose(0).heading) == pytest.approx((0.3, 0.4, math.pi / 2))
    assert world.acceleration(0)[0] == pytest.approx(0, abs=0.2)  # Moving it by hand is not a collision.
    world.run(64)
    assert world.pose(0).y == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("index", [0, 1])
def test_a_box_is_moved_and_stands_in_the_way_there(world, index):
    world.move_box(index, Pose(0.3, 0.2, 0.0))
    assert (world.snapshot().boxes[index].x, world.snapshot().boxes[index].y) == (0.3, 0.2)
    assert max(world.proximity(0)[0], world.proximity(0)[7]) > 300
    assert world.distance(0) == pytest.approx(0.25 - 0.234, abs=0.02)


@pytest.mark.parametrize("index", [0, 1])
def test_a_cylinder_is_moved_and_stands_in_the_way_there(world, index):
    world.move_cylinder(index, 0.3, 0.2)
    assert world.snapshot().cylinders[index].x == 0.3
    assert max(world.proximity(0)[0], world.proximity(0)[7]) > 100


def test_what_was_pushed_stays_there_when_something_fixed_is_moved(world):
    world.move_box(1, Pose(0.3, 0.2))
    world.set_wheel_speeds(0, 0.1, 0.1)
    world.run(64)
    pushed = world.snapshot().boxes[1]
    assert pushed.x > 0.3
    world.move_box(0, Pose(0.7, 0.5))
    assert world.snapshot().boxes[1].x == pushed.x


def test_light_and_sound_are_set_while_it_runs(world):
    dark, quiet = world.ambient_light(1), world.microphones(1)
    world.set_light(0, Light(0.65, 0.2, intensity=2.0))
    world.set_sound(0, Sound(0.5, 0.3, volume=2000.0))
    world.step()
    assert min(world.ambient_light(1)) < min(dark) - 500
    assert max(world.microphones(1)) > max(quiet) + 500
    world.set_ambient(4095)
    world.set_light(0, Light(0.65, 0.2, intensity=0.0))
    world.step()
    assert min(world.ambient_light(1)) > 4050


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda world: world.move_robot(5, Pose(0.5, 0.5)), "no robot 5; the world has 2"),
        (lambda world: world.move_robot(0, Pose(0.5, 0.25)), "robot 1 is in the way"),
        (lambda world: world.move_box(2, Pose(0.5, 0.5)), "no box 2"),
        (lambda world: world.remove_box(2), "no box 2"),
        (lambda world: world.move_wall(1, Wall(0.6, 0.1, 0.6, 0.9)), "no wall 1"),
        (lambda world: world.remove_wall(-1), "no wall -1"),
        (lambda world: world.move_cylinder(-1, 0.5, 0.5), "no cylinder -1"),
        (lambda world: world.set_light(1, Light(0, 0)), "no light 1"),
        (lambda world: world.set_sound(1, Sound(0, 0)), "no sound 1"),
        (lambda world: world.set_ambient(5000), "room's light is 5000"),
        (lambda world: world.play(0, -1), "volume is -1"),
        (lambda world: world.set_slot(0, 1.0), "slot is 1.0"),
        (lambda world: world.proximity(9), "no robot 9"),
        (lambda world: world.hash("smell"), "no sensor 'smell'"),
        (lambda world: world.run(-1), "ticks is -1"),
    ],
)
def test_what_does_not_exist_or_is_out_of_range_is_refused_by_name_and_changes_nothing(world, call, match):
    before, scene = world.hash(), world.scene
    with pytest.raises(ArgumentError, match=match):
        call(world)
    assert (world.hash(), world.scene) == (before, scene)


def test_the_pairs_of_sensors_are_as_old_as_their_places_in_the_row():
    # The front sensors of a robot that drives at a wall: pair 0 was sampled three slots before pair 3.
    def gaps(slot):
        world = World(Scene(1, 1, starts=(Pose(0.85, 0.5),), model=IDEAL))
        world.set_slot(0, slot)
        world.set_wheel_speeds(0, 0.1, 0.1)
        world.run(20)
        lengths = ray_lengths(world)
        return lengths[0], lengths[3 * 7]  # The middle rays of sensors 0 and 7, mirror images of each other.

    still_right, still_left = gaps(0.0)
    assert still_right == pytest.approx(still_left, abs=1e-9)
    right, left = gaps(1 / 256)
    assert left == pytest.approx(still_left, abs=1e-9)
    # 3/256 s at 0.1 m/s, along a ray that meets the wall at 17.2 degrees.
    assert right - left == pytest.approx(0.1 * 3 / 256 / math.cos(math.radians(17.2)), rel=1e-3)


def test_boxes_and_walls_come_and_go_while_what_is_pushed_moves_on(engine):
    world, untouched = (World(SCENE, engine=engine) for _ in range(2))
    for each in (world, untouched):
        each.move_robot(0, Pose(0.2, 0.75))
        each.set_wheel_speeds(0, 0.1, 0.1)
        each.run(40)  # it pushes box 1
    world.add_box(Box(0.5, 0.4, 0.05, 0.05, is_pushable=True))
    world.add_box(Box(0.9, 0.5, 0.05, 0.05))
    world.add_wall(Wall(0.6, 0.5, 0.7, 0.5))
    assert world.tick == untouched.tick
    for each in (world, untouched):
        each.run(20)
    assert world.snapshot().boxes[1] == untouched.snapshot().boxes[1]
    assert world.pose(0) == untouched.pose(0)
    assert len(world.scene.boxes) == 4
    world.remove_box(0)
    world.remove_wall(0)
    seen = world.snapshot()
    assert [(round(box.x, 6), box.y) for box in seen.boxes[1:]] == [(0.5, 0.4), (0.9, 0.5)]
    assert [wall.x1 for wall in seen.walls] == [0.6]
    assert seen.boxes[0] == untouched.snapshot().boxes[1]
    world.remove_box(2)
    world.remove_box(1)
    world.remove_box(0)
    world.run(10)
    assert world.snapshot().boxes == ()


def test_the_first_pushable_box_of_a_world_can_be_pushed():
    world = World(Scene(1.0, 1.0, starts=(Pose(0.2, 0.5),), model=IDEAL))
    world.add_box(Box(0.35, 0.5, 0.1, 0.1, is_pushable=True))
    world.set_wheel_speeds(0, 0.1, 0.1)
    world.run(200)
    assert world.snapshot().boxes[0].x > 0.45


def test_a_world_with_another_box_begins_again_with_it(world):
    world.add_box(Box(0.5, 0.4, 0.05, 0.05, is_pushable=True))
    world.run(10)
    world.reset()
    assert world.snapshot().boxes[2].x == 0.5
    assert world.hash() == World(world.scene).hash()


ACTS = (
    lambda world, at: world.move_robot(1, Pose(0.1 + 0.8 * at, 0.12, 6 * at)),
    lambda world, at: world.move_box(0, Pose(0.65 + 0.2 * at, 0.4, at)),
    lambda world, at: world.move_box(len(world.snapshot().boxes) - 1, Pose(0.6, 0.4 + 0.2 * at)),
    lambda world, at: world.move_cylinder(0, 0.15, 0.4 + 0.2 * at),
    lambda world, at: world.move_cylinder(1, 0.75, 0.7 + 0.2 * at),
    lambda world, at: world.add_box(Box(0.5 + at / 3, 0.95, 0.05, 0.05, at, is_pushable=at < 0.5)),
    lambda world, at: world.remove_box(int(at * len(world.snapshot().boxes))),
    lambda world, at: world.add_wall(Wall(0.45, 0.4, 0.6, 0.5 + at / 3)),
    lambda world, at: world.remove_wall(0),
    lambda world, at: world.set_light(0, Light(at, 0.5, intensity=3 * at)),
    lambda world, at: world.set_sound(0, Sound(0.5, at, volume=2000 * at)),
    lambda world, at: world.set_ambient(4000 * at),
    lambda world, at: world.set_wheel_speeds(0, 0.1 * at, 0.13),
    lambda world, at: world.run(int(100 * at)),
)


@given(data=st.data())
@settings(max_examples=60, deadline=None)
@pytest.mark.parametrize("engine", short(["interpreted", "compiled"], "interpreted"))
def test_whatever_happened_since_a_world_that_goes_back_is_to_the_last_bit_what_it_was(engine, data):
    world = World(SCENE, engine=engine)
    world.set_wheel_speeds(0, 0.12, 0.1)

    def happen():
        for act, at in data.draw(st.lists(st.tuples(st.sampled_from(ACTS), st.floats(0, 1)), max_size=8)):
            with contextlib.suppress(ArgumentError):  # there is no room, or no such thing any more
                act(world, at)

    def seen():
        robots = [(robot.pose, robot.radius) for robot in world.snapshot().robots]
        return replace(world.snapshot(), tick=0, time=0.0, robots=()), robots, world.ambient, world.scene

    happen()
    moment, before = world.moment(), seen()
    others = copy.deepcopy(world)
    happen()
    now = world.time, [world.encoders(robot) for robot in range(2)]
    world.go_back(moment)
    assert seen() == before
    assert (world.time, [world.encoders(robot) for robot in range(2)]) == now
    for each in (world, others):
        for robot in range(2):
            each.set_wheel_speeds(robot, 0.0, 0.0)
        each.run(1)
    assert [(ball.x, ball.y) for ball in world.snapshot().cylinders] == [
        (ball.x, ball.y) for ball in others.snapshot().cylinders
    ]  # what rolled rolls on


def test_a_moment_of_another_world_is_refused_and_changes_nothing(world):
    other = World(replace(SCENE, width=2.0))
    before = other.hash()
    with pytest.raises(ArgumentError, match="a moment of another world"):
        other.go_back(world.moment())
    assert other.hash() == before


CRATE = replace(SCENE.boxes[1], name="crate")
KEYED = replace(SCENE, boxes=(CRATE,), zones=(Zone("plate", 0.9, 0.6, 0.05, by="crate"),))


def test_a_world_goes_back_whose_zone_is_switched_by_a_box():
    world = World(KEYED)
    then = world.moment()
    world.move_box(0, Pose(0.9, 0.6))
    world.go_back(then)
    assert world.snapshot().boxes == (CRATE,)


DOOR = Box(0.7, 0.6, 0.1, 0.1, switch="nope", slide=(0.1, 0.0))


@pytest.mark.parametrize(
    ("scene", "act", "what"),
    [
        (KEYED, lambda world: world.remove_box(0), r"box 0 \(crate\) stays: it switches the zone plate"),
        (KEYED, lambda world: world.add_box(DOOR), r'box\[1\].switch is "nope", which is no zone of this world'),
        (SCENE, lambda world: world.add_box(DOOR), r'box\[2\].switch is "nope", which is no zone of this world'),
    ],
)
def test_a_box_that_its_zone_needs_or_that_lacks_one_is_refused_and_changes_nothing(scene, act, what):
    world = World(scene)
    with pytest.raises(ArgumentError, match=what):
        act(world)
    assert (world.snapshot(), world.scene) == (World(scene).snapshot(), scene)
