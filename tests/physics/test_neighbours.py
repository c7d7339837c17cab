"""Lists of what is near each robot: which things are on them, how long they hold, and that there is always room."""

import itertools
import math
import random

import pytest
from world_rig import ENGINES, IDEAL, segments, vehicle

from elib.simulator.physics import Box, Controller, Cylinder, EpuckModel, Pose, Scene, Wall, World, assembly
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.geometry import Colour
from elib.simulator.physics.neighbours import EDGE, NEAR_WALLS, STRAY
from elib.simulator.physics.profiles import Profile
from elib.simulator.physics.pushing import TOLERANCE
from lanes import few_and_many, short

CONTROLLER = vehicle()


def packed(columns, rows, gap=0.001):
    """Return starts as dense as they can be."""
    step = 2 * RADIUS + gap
    return tuple(
        Pose(0.05 + step * (column + 0.5 * (row % 2)), 0.05 + step * math.sqrt(0.75) * row, 0.7 * row)
        for row in range(rows)
        for column in range(columns)
    )


def listed(world):
    """Return the neighbours of each robot."""
    records = world._state.world
    return [list(map(int, records.lists[one.first_near : one.end_near])) for one in records.listings[: world.robots]]


def walls_listed(world):
    """Return for each robot the fixed walls that it may see or touch."""
    records = world._state.world
    return [list(map(int, records.lists[one.first_wall : one.end_wall])) for one in records.listings[: world.robots]]


def places(world):
    return [(float(robot.x), float(robot.y)) for robot in world._state.world.robots]


def listed_at(world):
    """Return where each robot was when the lists were made."""
    return [(float(one.x), float(one.y)) for one in world._state.world.listings[: world.robots]]


def test_everybody_who_may_be_touched_or_seen_is_listed_in_rising_order_and_nobody_farther_off(engine):
    world = World(
        Scene(1.5, 1.5, model=EpuckModel(motor_noise=0.05, quality="ideal")), robots=40, seed=5, engine=engine
    )
    reach = world._state.world.setting[0].horizon + RADIUS
    made = 0
    before = None
    for _ in range(40):
        world.run(3, CONTROLLER)
        lists, here, then = listed(world), places(world), listed_at(world)
        made += then != before
        before = then
        for i, neighbours in enumerate(lists):
            assert neighbours == sorted(neighbours)
            assert math.dist(here[i], then[i]) <= STRAY
            others = [j for j in range(40) if j != i]
            assert {j for j in others if math.dist(here[i], here[j]) < reach} <= set(neighbours)
            assert set(neighbours) == {j for j in others if math.dist(then[i], then[j]) < reach + 2 * STRAY}
    assert 2 < made < 40  # They held for some ticks, and were then made again.


def test_every_wall_that_may_be_touched_or_seen_is_listed_and_none_farther_off(engine):
    scene = Scene(1.5, 1.5, segments(40, 1.5, 2), model=EpuckModel(motor_noise=0.05, quality="ideal"))
    world = World(scene, robots=12, seed=5, engine=engine)
    walls = [*scene.edge, *scene.walls]
    sight = world._state.world.setting[0].horizon
    made, before, met = 0, None, 0
    for _ in range(40):
        world.run(3, CONTROLLER)
        here, then = places(world), listed_at(world)
        made += then != before
        before = then
        for i, near in enumerate(walls_listed(world)):
            now = [wall.distance(*here[i]) for wall in walls]
            assert near == sorted(set(near))
            assert {w for w, far in enumerate(now) if far < sight} <= set(near)
            assert set(near) == {w for w, wall in enumerate(walls) if wall.distance(*then[i]) < sight + STRAY}
            met += sum(far < RADIUS + 1e-6 for far in now[EDGE:])
    assert 2 < made < 40
    assert met > 0


def test_where_more_walls_are_near_than_a_robots_own_list_holds_none_is_missed(engine):
    kerbs = tuple(Wall(0.4 + 0.002 * k, 0.45, 0.4 + 0.002 * k, 0.55) for k in range(100))
    world = World(Scene(1, 1, kerbs, starts=(Pose(0.3, 0.5), Pose(0.65, 0.5, math.pi)), model=IDEAL), engine=engine)
    for robot in (0, 1):
        world.set_step_rates(robot, 900, 900)
    world.run(100)
    assert all(len(near) > NEAR_WALLS for near in walls_listed(world))
    first, second = world.poses
    assert (first.x, second.x) == pytest.approx((0.4 - RADIUS, 0.598 + RADIUS), abs=1e-6)
    assert min(world.proximity(robot)[sensor] for robot in (0, 1) for sensor in (0, 7)) > 3000


def test_robots_do_the_same_in_a_room_so_large_that_it_has_few_cells_for_its_size(engine):
    starts = tuple(Pose(pose.x + 0.7, pose.y + 0.7, pose.heading) for pose in packed(5, 4))
    model = EpuckModel(motor_noise=0.05, quality="ideal")
    small, large = (
        World(Scene(side, side, starts=starts, model=model), robots=20, seed=5, engine=engine) for side in (2.0, 40.0)
    )
    for _ in range(20):
        small.run(3, CONTROLLER)
        large.run(3, CONTROLLER)
        assert places(small) == places(large)
        assert listed(small) == listed(large)
    setting = large._state.world.setting[0]
    assert setting.hash_columns * setting.hash_rows <= 20 * 20
    assert setting.cell_columns * setting.cell_rows <= 300


@pytest.mark.usefixtures("compiled_worlds")
def test_of_two_walls_on_one_line_the_one_that_was_built_first_is_seen_whenever_lists_were_made():
    # A pale stretch on a long white wall; the other robot only makes the first have lists.
    scene = Scene(
        1.5,
        1.0,
        (Wall(0.6, 0.5, 0.7, 0.5, reflectance=0.2), Wall(0.1, 0.5, 1.4, 0.5)),
        starts=(Pose(0.3, 0.44), Pose(1.4, 0.9)),
        model=EpuckModel(sensor_noise=0, quality="ideal"),
    )
    plain, usual, anew = worlds = [World(scene, engine=engine) for engine in (*ENGINES, "compiled")]
    for world in worlds:
        world.set_step_rates(0, 500, 500)
    told = set()
    for _ in range(500):
        for world in worlds:
            world.step()
        anew.move_robot(1, Pose(1.4, 0.9))
        assert plain.proximity(0) == usual.proximity(0) == anew.proximity(0)
        told.add(plain.proximity(0)[5])  # The left one.
    assert min(told) < 0.6 * max(told)  # It passed the pale stretch.


@pytest.mark.parametrize("noise", [0.0, 0.3])
@few_and_many(20, 50)
def test_no_wheel_rolls_so_far_in_a_tick_that_a_wall_is_missed(engine, noise, examples):
    start = Pose(1 - RADIUS - 0.1, 0.5)
    model = EpuckModel(motor_noise=noise, wheel_spread=noise / 3, quality="ideal")
    scene = Scene(2, 1, (Wall(1, 0.001, 1, 0.999),), step=0.1, model=model, starts=(start, Pose(1.8, 0.5)))
    touched = 0
    for seed in range(examples if noise else 1):
        world = World(scene, seed=seed, engine=engine)
        world.set_wheel_speeds(0, 0.19, 0.19)
        for _ in range(10):
            world.step()
            assert world.pose(0).x < 1 - RADIUS + 2 * TOLERANCE
            touched += world.touching(0)
    assert touched > 3


def test_a_robot_among_walls_goes_the_same_way_alone_and_with_another_far_off(engine):
    # Alone it looks walls up in the grid of fixed things, in company on its list.
    scene = Scene(
        2.0,
        1.0,
        segments(12, 1.0, 6),
        starts=(Pose(0.5, 0.1, 1.0), Pose(1.9, 0.9)),
        model=EpuckModel(motor_noise=0.05, quality="ideal"),
    )
    alone, both = World(scene, robots=1, engine=engine), World(scene, engine=engine)
    touched = 0
    for world in (alone, both):
        world.set_step_rates(0, 800, 780)
    for _ in range(120):
        for world in (alone, both):
            world.run(4)
        touched += alone.touching(0)
        assert alone.pose(0) == both.pose(0)
        assert alone.proximity(0) == both.proximity(0)
    assert touched > 20


def test_in_the_densest_crowd_the_lists_have_the_room_they_need(engine):
    world = World(Scene(0.75, 0.65, starts=packed(8, 8), model=IDEAL), engine=engine)
    lists, records = listed(world), world._state.world
    assert max(map(len, lists)) > 20
    assert sum(map(len, lists)) > 64 * 6
    assert max(one.end_near for one in records.listings) <= len(records.lists)


@pytest.mark.usefixtures("compiled_worlds")
def test_both_engines_agree_with_more_in_sight_than_is_looked_at_in_one_go():
    chance = random.Random(8)
    spots = [(chance.uniform(0.35, 0.65), chance.uniform(0.35, 0.65), chance.uniform(0, math.tau)) for _ in range(160)]
    spots = [(x, y, turn) for x, y, turn in spots if math.dist((x, y), (0.5, 0.5)) > 0.06]
    assert len(spots) > 70
    walls = [Wall(x, y, x + 0.01 * math.cos(turn), y + 0.01 * math.sin(turn)) for x, y, turn in spots]
    posts = [Cylinder(1 - x, y, 0.002, colour=Colour(255, 0, 0)) for x, y, _ in spots]
    starts = (Pose(0.5, 0.5, 0.3), Pose(0.1, 0.1, 0.0), Pose(0.9, 0.9, 4.0))
    model = EpuckModel(rays=5, quality="ideal")
    scene = Scene(1.0, 1.0, tuple(walls), cylinders=tuple(posts), starts=starts, model=model)
    worlds = [World(scene, engine=engine) for engine in ENGINES]
    for world in worlds:
        world.run(30, CONTROLLER)
    assert worlds[0].hash("proximity") == worlds[1].hash("proximity")
    assert max(worlds[0].proximity(0)) > 100


@pytest.mark.usefixtures("compiled_worlds")
@pytest.mark.parametrize("robots", [1, 3, 4, 9, 17])
def test_robots_that_stand_among_others_stay_as_they_are_to_the_last_bit_on_both_engines(robots):
    worlds = [
        World(Scene(2, 2, model=EpuckModel(motor_noise=0.05, quality="ideal")), robots=robots, engine=each)
        for each in ENGINES
    ]
    before = worlds[0].poses
    for world in worlds:
        for robot in range(0, robots, 2):
            world.set_step_rates(robot, 300 + 20 * robot, 350)
        world.run(4)
    assert worlds[0].hash() == worlds[1].hash()
    assert worlds[0].poses[1::2] == before[1::2]
    assert worlds[0].pose(0) != before[0]


@pytest.mark.usefixtures("compiled_worlds")
def test_robots_that_push_each_other_along_walls_come_apart_in_a_few_passes():
    world = World(
        Scene(2.2, 2.2, segments(100, 2.2, 4), step=1 / 32, model=IDEAL), robots=50, seed=3, engine="compiled"
    )
    most = touched = 0
    for _ in range(60):
        world.run(25, CONTROLLER)
        passes = [int(robot.touched) for robot in world._state.world.robots]
        most, touched = max(most, *passes), touched + sum(each > 0 for each in passes)
        here = places(world)
        for one, other in itertools.combinations(here, 2):
            assert math.dist(one, other) > 2 * RADIUS - 2 * TOLERANCE
    assert touched > 60
    assert most < 40  # Of 48: none was wedged in, and put back to where it was.


def test_a_body_that_was_pushed_far_is_still_seen_and_touched(engine):
    scene = Scene(
        2.0,
        0.4,
        boxes=(Box(0.3, 0.2, 0.06, 0.3, is_pushable=True),),
        starts=(Pose(0.2, 0.2, 0.0), Pose(1.8, 0.2, math.pi)),
        model=IDEAL,
    )
    world = World(scene, engine=engine)
    world.set_step_rates(0, 700, 700)
    world.run(700)
    box = world.snapshot().boxes[0]
    assert box.x > 0.8
    assert world.touching(0)
    assert world.proximity(0)[0] > 500
    assert box.x - world.pose(0).x == pytest.approx(0.03 + RADIUS, abs=1e-3)


def test_there_is_room_for_all_neighbours_of_robots_that_see_far(engine):
    far = Profile("far", (4000.0,) * 4001, (0.0,) * 4001, "a test: it reaches 1 m")
    world = World(
        Scene(1.6, 1.6, starts=packed(18, 18, 0.002), model=EpuckModel(profile=far, quality="ideal")), engine=engine
    )
    records = world._state.world
    assert max(one.end_near for one in records.listings) <= len(records.lists)
    assert max(map(len, listed(world))) > 200


@pytest.mark.parametrize("engine", short(["interpreted", "compiled"], "compiled"))
def test_there_is_room_for_all_neighbours_of_many_long_things(engine):
    bars = tuple(Box(5.0, 4.0 + 0.02 * k, 9.9, 0.005, is_pushable=True) for k in range(100))
    starts = tuple(Pose(1.5 + 0.09 * i, 6.3 + 0.09 * j) for i in range(75) for j in range(20))
    records = World(Scene(10.0, 10.0, starts=starts, boxes=bars, model=IDEAL), engine=engine)._state.world
    assert max(one.end_near for one in records.listings) <= len(records.lists)


@pytest.mark.parametrize("gap", [0.118, 0.125, 0.13])
def test_robots_that_see_almost_nothing_still_touch(engine, gap):
    near = Profile("near", (4000.0, 0.0), (0.0, 0.0), "a test: it reaches 0.25 mm")
    starts = (Pose(0.3, 0.5), Pose(0.3 + gap, 0.5, math.pi))
    world = World(
        Scene(1.0, 1.0, starts=starts, step=0.1, model=EpuckModel(profile=near, quality="ideal")), engine=engine
    )
    for robot in range(2):
        world.set_wheel_speeds(robot, 0.19, 0.19)
    for _ in range(6):
        world.step()
        assert math.dist(*places(world)) > 2 * RADIUS - 2 * TOLERANCE


def test_where_there_is_no_room_for_all_neighbours_nothing_changes(engine, monkeypatch):
    scene = Scene(
        1.0,
        1.0,
        boxes=tuple(Box(0.2 + 0.1 * k, 0.5, 0.04, 0.2, is_pushable=True) for k in range(7)),
        cylinders=tuple(Cylinder(0.2 + 0.1 * k, 0.8, 0.02, is_pushable=True) for k in range(7)),
        step=1 / 16,
        model=IDEAL,
    )
    roomy = World(scene, robots=12, seed=3, engine=engine)
    monkeypatch.setattr(assembly, "room_for_neighbours", lambda *_: 40)
    tight = World(scene, robots=12, seed=3, engine=engine)
    assert max(map(len, listed(tight))) == 26
    for world in (roomy, tight):
        world.run(120, Controller.braitenberg([0.0] * 8, [0.0] * 7 + [0.02], base=700.0))
    assert tight.snapshot().cylinders != scene.cylinders
    assert tight.hash("proximity") == roomy.hash("proximity")


def test_ten_thousand_things_that_can_be_pushed_do_not_fill_the_memory():
    posts = tuple(
        Cylinder(0.05 + 0.1 * (k % 100), 0.05 + 0.1 * (k // 100), 0.01, is_pushable=True) for k in range(10_000)
    )
    records = World(Scene(10.0, 10.0, cylinders=posts, model=IDEAL), robots=0)._state.world
    assert len(records.lists) < 5_000_000
    assert max(one.end_near for one in records.listings) < len(records.lists)
