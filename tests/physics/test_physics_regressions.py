"""Defects that were found once; each test proves that one is gone."""

import importlib
import math
import pickle
import traceback
from types import ModuleType

import pytest
from world_rig import IDEAL, vehicle

from elib.base.errors import ArgumentError
from elib.simulator.physics import (
    Batch,
    Box,
    Controller,
    Cylinder,
    EpuckModel,
    Light,
    Pose,
    Scene,
    Stripe,
    Wall,
    World,
    contacts,
)
from elib.simulator.physics.assembly import MAX_ENTRIES, Grid, Solids
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.usage import constants_of
from elib.simulator.worlds.files import parse

ONE = (Pose(0.5, 0.5),)


def headlong(robot, parameters, memory):
    if parameters[0] > 0.0:
        robot.left += parameters[0]
        robot.right += parameters[0]


@pytest.mark.parametrize("speed", [1e19, 1e300])
def test_a_control_function_that_asks_for_an_enormous_speed_gets_the_fastest(engine, speed):
    blind = [0.0] * 8
    world = World(Scene(1, 1, starts=ONE, model=IDEAL), engine=engine)
    world.run(3, vehicle(blind, blind, base=speed))
    fast = World(Scene(1, 1, starts=ONE, model=IDEAL), engine=engine)
    fast.run(3, vehicle(blind, blind, base=1000.0))
    assert world.poses == fast.poses
    turn = world.stepper()
    turn(-speed, speed)
    assert math.isfinite(world.pose(0).heading)


def test_cylinders_larger_than_the_arena_do_not_fill_the_memory():
    posts = tuple(Cylinder(12.0, 12.0, 1000.0) for _ in range(400))
    scene = Scene(25, 25, cylinders=posts, model=IDEAL)
    grid = Grid(scene, Solids.of(scene, (), posts, {"": 0}), 0.12)
    assert sum(map(len, (*grid.walls.values(), *grid.discs.values()))) < MAX_ENTRIES * 1.2


def test_a_jam_of_two_things_leaves_the_others_asleep(monkeypatch):
    looked = []
    real = contacts.leave_obstacles
    monkeypatch.setattr(contacts, "leave_obstacles", lambda world, k, *rest: looked.append(k) or real(world, k, *rest))
    posts = tuple(Cylinder(0.5 + 0.3 * (k % 5), 0.5 + 0.3 * (k // 5), 0.05, is_pushable=True) for k in range(20))
    jam = (Box(0.1, 1.0, 0.1, 0.1, is_pushable=True), Box(0.03, 1.0, 0.05, 0.2), Box(0.17, 1.0, 0.05, 0.2))
    world = World(Scene(2.5, 2.5, boxes=jam, cylinders=posts, model=IDEAL))
    world.step()
    assert looked.count(0) > 5  # The jammed one.
    assert all(looked.count(k) == 1 for k in range(1, 21))


def test_reading_before_a_lamp_is_changed_changes_nothing():
    def run(is_read):
        scene = Scene(
            1,
            1,
            (Wall(0.25, 0.3, 0.25, 0.7, height=0.04),),
            starts=(Pose(0.2, 0.5),),
            lights=(Light(0.24, 0.5, intensity=0.0),),
            model=EpuckModel(ambient=1000.0, quality="ideal"),
        )
        world = World(scene)
        world.step()
        if is_read:
            world.proximity(0)
        world.set_light(0, Light(0.5, 0.5, height=0.5, intensity=10))
        return world.proximity(0), world.hash()

    assert run(True) == run(False)


def test_moving_a_fixed_thing_leaves_the_pushable_ones_alone_to_the_last_bit():
    boxes = Box(0.5, 0.5, 0.1, 0.1, angle=0.3, is_pushable=True), Box(1.5, 1.5, 0.1, 0.1)
    world = World(Scene(2, 2, boxes=boxes, starts=(Pose(0.38, 0.52),), model=IDEAL))
    world.set_step_rates(0, 800, 700)
    world.run(100)
    before = world.hash()
    world.move_box(1, Pose(1.5, 1.6))
    assert world.hash() == before
    assert len(world._state.world.walls) == 4 + 4 + 4


def test_a_thing_that_is_thrown_far_is_seen_where_it_landed():
    def near(far):
        posts = (
            Cylinder(1.5, 1.5, 0.5),
            Cylinder(1.51, 1.5, 0.05, is_pushable=True),
            Cylinder(6.0, 1.5, 0.5),
            Cylinder(6.01, 1.5, 0.05, is_pushable=True),
        )
        starts = (Pose(2.12, 1.5, math.pi), *((Pose(6.57, 1.5, math.pi),) if far else ()))
        world = World(Scene(8, 4, cylinders=posts, starts=starts, model=IDEAL))
        world.step()
        return world.proximity(0)

    assert near(False) == near(True)


def test_speeds_that_cancel_within_a_tick_are_not_driven_again():
    world = World(Scene(1, 1, starts=ONE, model=IDEAL))
    step = world.scene.step
    world.set_wheel_speeds(0, 0.128, 0.128, at=0)
    world.set_wheel_speeds(0, -0.128, -0.128, at=step / 2)
    world.run(2)
    assert world.pose(0).x - 0.5 == pytest.approx(-0.128 * step, abs=1e-12)


def test_a_wall_too_short_or_too_long_for_arithmetic_is_refused():
    with pytest.raises(Exception, match="has no length"):
        parse(b"[arena]\nsize=[1,1]\n[[wall]]\nfrom=[0,0]\nto=[1e-200,0]\n", "x.toml")
    with pytest.raises(ArgumentError, match=r"x1 is -1e\+308 m; it must be a number from -2000 to 2000 m"):
        Wall(-1e308, 0.5, 1e308, 0.5)


def test_a_heavy_box_cannot_push_a_robot_out_of_the_arena():
    box = Box(0.5, 0.7, 0.6, 0.5, is_pushable=True, mass=100)
    world = World(Scene(1, 1, boxes=(box,), starts=(Pose(0.05, 0.05), Pose(0.5, 0.05)), model=IDEAL))
    world.set_step_rates(0, 1000, 1000)
    for _ in range(120):
        world.step()
        for pose in world.poses:
            assert RADIUS - 1e-9 <= pose.x <= 1 - RADIUS + 1e-9
            assert RADIUS - 1e-9 <= pose.y <= 1 - RADIUS + 1e-9


@pytest.mark.parametrize("step", [0.1, 1 / 32, 1 / 64])
@pytest.mark.parametrize(
    "thing", [Box(0.5, 0.5, 0.002, 0.1, is_pushable=True), Cylinder(0.5, 0.5, 0.002, is_pushable=True)]
)
def test_a_thin_thing_is_not_pushed_through_a_thin_wall(step, thing):
    kind = {"boxes": (thing,)} if isinstance(thing, Box) else {"cylinders": (thing,)}
    world = World(Scene(1, 1, (Wall(0.6, 0.2, 0.6, 0.8),), starts=(Pose(0.4, 0.5),), step=step, **kind))
    world.set_step_rates(0, 1000, 1000)
    for _ in range(round(4 / step)):
        world.step()
        snapshot = world.snapshot()
        (moved,) = snapshot.boxes or snapshot.cylinders
        assert moved.x < 0.6 or abs(moved.y - 0.5) > 0.3
        assert world.pose(0).x < 0.6


def test_the_time_of_flight_sensor_sees_a_large_post_beside_it():
    near = [
        World(
            Scene(
                30,
                30,
                cylinders=(Cylinder(15 + x, 25.05, 10.0),),
                starts=(Pose(15, 15),),
                model=EpuckModel(sensor_noise=0, quality="ideal"),
            )
        ).distance(0)
        for x in (-0.001, 0.001)
    ]
    assert near[0] == pytest.approx(near[1], rel=0.02)
    assert near[0] < 0.5


def test_worlds_with_the_same_floor_share_its_picture():
    scene = Scene(1, 1, starts=ONE, paint=(Stripe(((0.1, 0.5), (0.9, 0.5))),), model=IDEAL)
    batch = Batch(scene, 3, engine="interpreted")
    assert batch[0].snapshot().floor is batch[1].snapshot().floor is batch[2].snapshot().floor


def test_an_absurd_number_of_robots_is_refused_in_words():
    with pytest.raises(ArgumentError, match="robots is a number of 1329 bits"):
        World.load("crowd", robots=10**400)


def no_parameter(robot, parameters, memory):
    robot.left = parameters[5]


def third_wheel(robot, parameters, memory):
    robot.middle = 1000.0


def meddling(robot, parameters, memory):
    parameters[0] = 1.0


def no_memory(robot, parameters, memory):
    memory[0] = 1.0


def wrong_signature(robot):
    return 0


@pytest.mark.parametrize("function", [no_parameter, third_wheel, meddling, no_memory, wrong_signature])
def test_a_control_function_that_reaches_beyond_its_numbers_is_refused_on_both_engines(engine, function):
    world = World(Scene(1, 1, starts=ONE, model=IDEAL), engine=engine)
    with pytest.raises(ArgumentError, match=f"the control function '{function.__name__}' fails"):
        world.run(1, Controller(function, (1.0,)))
    assert world.tick == 0


def test_what_is_not_a_controller_is_refused_in_words():
    world = World(Scene(1, 1, starts=ONE, model=IDEAL))
    with pytest.raises(ArgumentError, match="is not a controller"):
        world.run(3, headlong)
    with pytest.raises(ArgumentError, match="3 is not a control function"):
        Controller(3)
    with pytest.raises(ArgumentError, match="parameters are \\('a',\\); they must be numbers"):
        Controller(headlong, ("a",))
    with pytest.raises(ArgumentError, match=r"ticks is 1\.5"):
        world.run(1.5)


def test_a_control_function_begins_with_standing_wheels_for_each_robot(engine):
    world = World(Scene(2, 1, starts=(Pose(0.3, 0.3), Pose(0.3, 0.7)), model=IDEAL), engine=engine)
    world.run(64, Controller(headlong, (300.0,)))
    assert world.encoders(0) == world.encoders(1) == pytest.approx((303, 303), abs=2)


def failing(robot, parameters, memory):
    robot.left = 1.0 / parameters[0] if robot.time > 0.0 else 0.0


def test_an_error_in_a_control_function_names_it_and_the_line_that_calls_it():
    with pytest.raises(ZeroDivisionError) as caught:
        World(Scene(1, 1, starts=ONE, model=IDEAL)).run(5, Controller(failing, (0.0,)))
    *_, caller, own = traceback.extract_tb(caught.value.__traceback__)
    assert own.name == "failing"
    assert "function(" in caller.line


def test_a_slanted_stripe_has_smooth_edges():
    scene = Scene(1, 1, starts=ONE, paint=(Stripe(((0.1, 0.1), (0.9, 0.6))),), model=IDEAL)
    shades = {pixel & 255 for pixel in World(scene).snapshot().floor.pixels}
    assert len(shades) > 5


def test_a_control_function_with_a_memory_runs_in_a_world_without_robots(engine):
    world = World(Scene(1, 1, model=IDEAL), robots=0, engine=engine)
    world.run(3, vehicle())
    assert world.tick == 3
    assert world.fitness.shape == (0,)


def test_the_fitness_of_a_run_is_kept_after_a_reset(engine):
    world = World(Scene(1, 1, starts=ONE, model=IDEAL), engine=engine)
    world.run(3, vehicle())
    fitness, before = world.fitness, world.fitness.tolist()
    world.reset()
    assert fitness.tolist() == before != [0.0]
    assert world.fitness.tolist() == [0.0]


def test_a_law_is_told_apart_by_what_it_takes_from_a_module():
    module = ModuleType("gains")
    names = {"gains": module}
    exec("def law(robot, parameters, memory):\n    robot.left = gains.left * gains.right", names)
    told = []
    for left, right in ((1.0, 1.0), (2.0, 1.0), (2.0, 3.0)):
        module.left, module.right = left, right
        told.append(tuple(constants_of(names["law"], set(), set())))
    module.unused = 5.0
    assert tuple(constants_of(names["law"], set(), set())) == told[-1]
    assert len(set(told)) == 3


@pytest.mark.usefixtures("compiled_threads")
def test_a_compiled_world_leaves_the_number_of_threads_as_it_was():
    numba = importlib.import_module("numba")
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        World(Scene(1, 1, model=IDEAL), robots=4, engine="compiled", threads=2).readings("proximity")
        assert numba.get_num_threads() == 1
    finally:
        numba.set_num_threads(before)


def test_a_world_can_be_pickled_after_a_picture():
    world = World(Scene(1, 1, starts=ONE, model=IDEAL))
    picture = world.picture(0, (-10.0, 0.0, 10.0), (5.0, -5.0))
    again = pickle.loads(pickle.dumps(world))
    assert (again.picture(0, (-10.0, 0.0, 10.0), (5.0, -5.0)) == picture).all()


@pytest.mark.parametrize("names", [["one"], ["one", "one"]])
def test_each_robot_gets_a_name_of_its_own(names):
    world = World(Scene(1, 1, model=IDEAL), robots=2)
    with pytest.raises(ArgumentError, match="are not 2 different names"):
        world.name_robots(names)
