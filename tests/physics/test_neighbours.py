"""Each robot's list of neighbours: who is on it, how long it holds, and that there is always room for it."""

import itertools
import math
import random

import pytest
from world_rig import segments, to_segment

from elib.physics import Box, Controller, Cylinder, EpuckModel, Pose, Scene, Wall, World
from elib.physics import layout as at
from elib.physics.body import RADIUS
from elib.physics.geometry import Colour
from elib.physics.grid import HORIZON, SLACK, STRAY, approach
from elib.physics.things import TOLERANCE

ENGINES = ("interpreted", "compiled")
LAW = Controller.braitenberg()


@pytest.fixture(params=ENGINES)
def engine(request):
    if request.param == "compiled":
        pytest.importorskip("numba")
    return request.param


def packed(columns, rows, gap=0.001):
    """Return starts as dense as they can be."""
    step = 2 * RADIUS + gap
    return tuple(
        Pose(0.05 + step * (column + 0.5 * (row % 2)), 0.05 + step * math.sqrt(0.75) * row, 0.7 * row)
        for row in range(rows)
        for column in range(columns)
    )


def listed(world):
    numbers = world._state.numbers
    near = int(numbers[at.NEAR_AT])
    return [[int(numbers[m]) for m in range(numbers[near + i], numbers[near + i + 1])] for i in range(world.robots)]


def paired(world):
    numbers = world._state.numbers
    places = range(numbers[at.PAIRS_AT], numbers[at.PAIRS_END], 2)
    return [(int(numbers[k]), int(numbers[k + 1])) for k in places]


def walls_listed(world):
    """Return for each robot the walls that it may see, and those inside the arena that it may touch."""
    numbers = world._state.numbers
    sight = numbers[at.SIGHT_AT]
    seen = [[] for _ in range(world.robots)]
    touched = [[] for _ in range(world.robots)]
    for i in range(world.robots):
        for m in range(numbers[sight + i], numbers[sight + i + 1], 2):
            assert numbers[m] == i
            seen[i].append(int(numbers[m + 1]))
    for m in range(numbers[at.TOUCH_AT], numbers[at.TOUCH_END], 2):
        touched[numbers[m]].append(int(numbers[m + 1]))
    return seen, touched


def places(world, x=at.X, y=at.Y):
    robots = world._state.robots
    return [(robots[i * at.ROBOT + x], robots[i * at.ROBOT + y]) for i in range(world.robots)]


def test_everybody_who_may_be_touched_or_seen_is_listed_in_rising_order_and_nobody_farther_off(engine):
    world = World(Scene(1.5, 1.5, model=EpuckModel(motor_noise=0.05)), robots=40, seed=5, engine=engine)
    reach = world._state.profile.reach + HORIZON + RADIUS
    made = 0
    before = None
    for _ in range(40):
        world.run(3, LAW)
        lists, here, then = listed(world), places(world), places(world, at.LISTED_X, at.LISTED_Y)
        made += then != before
        before = then
        for i, neighbours in enumerate(lists):
            assert neighbours == sorted(neighbours)
            assert math.dist(here[i], then[i]) <= STRAY
            others = [j for j in range(40) if j != i]
            assert {j for j in others if math.dist(here[i], here[j]) < reach} <= set(neighbours)
            assert set(neighbours) == {j for j in others if math.dist(then[i], then[j]) < reach + SLACK}
        reach_out = 2 * (RADIUS + approach(world._state.fixed))
        close = {(i, j) for i in range(40) for j in lists[i] if j > i and math.dist(then[i], then[j]) < reach_out}
        assert set(paired(world)) == close
    assert 2 < made < 40  # They held for some ticks, and were made anew.


def test_every_wall_that_may_be_touched_or_seen_is_listed_and_none_farther_off(engine):
    scene = Scene(1.5, 1.5, segments(40, 1.5, 2), model=EpuckModel(motor_noise=0.05))
    world = World(scene, robots=12, seed=5, engine=engine)
    walls = [*scene.edge, *scene.walls]
    sight = world._state.profile.reach + HORIZON
    touch = RADIUS + approach(world._state.fixed)
    made, before, met = 0, None, 0
    for _ in range(40):
        world.run(3, LAW)
        here, then = places(world), places(world, at.LISTED_X, at.LISTED_Y)
        made += then != before
        before = then
        for i, (seen, touched) in enumerate(zip(*walls_listed(world), strict=True)):
            now = [to_segment(*here[i], wall) for wall in walls]
            listed = [to_segment(*then[i], wall) for wall in walls]
            assert seen == sorted(set(seen))
            assert {w for w, far in enumerate(now) if far < sight} <= set(seen)
            assert set(seen) == {w for w, far in enumerate(listed) if far < sight + STRAY}
            assert {w for w, far in enumerate(now) if w >= at.EDGE and far < touch - STRAY} <= set(touched)
            assert set(touched) == {w for w, far in enumerate(listed) if w >= at.EDGE and far < touch}
            met += sum(far < RADIUS + 1e-6 for far in now)
    assert 2 < made < 40
    assert met > 0


def test_of_two_walls_on_one_line_the_one_that_was_built_first_is_seen_whenever_lists_were_made():
    pytest.importorskip("numba")
    # A pale stretch on a long white wall; the other robot only makes the first have lists.
    scene = Scene(
        1.5,
        1.0,
        (Wall(0.6, 0.5, 0.7, 0.5, reflectance=0.2), Wall(0.1, 0.5, 1.4, 0.5)),
        starts=(Pose(0.3, 0.44), Pose(1.4, 0.9)),
        model=EpuckModel(sensor_noise=0),
    )
    plain, usual, anew = worlds = [World(scene, engine=engine) for engine in (*ENGINES, "compiled")]
    for world in worlds:
        world.set_speed(0, 500, 500)
    told = set()
    for _ in range(500):
        for world in worlds:
            world.step()
        anew.move_robot(1, Pose(1.4, 0.9))
        assert plain.proximity(0) == usual.proximity(0) == anew.proximity(0)
        told.add(plain.proximity(0)[5])  # The left one.
    assert min(told) < 0.6 * max(told)  # It passed the pale stretch.


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_no_wheel_rolls_so_far_in_a_tick_that_a_wall_is_missed(engine, noise):
    start = Pose(1 - RADIUS - 0.1, 0.5)
    model = EpuckModel(motor_noise=noise, wheel_spread=noise / 3)
    scene = Scene(2, 1, (Wall(1, 0.001, 1, 0.999),), step=0.1, model=model, starts=(start, Pose(1.8, 0.5)))
    touched = 0
    for seed in range(150 if noise else 1):
        world = World(scene, seed=seed, engine=engine)
        world.drive(0, 0.19, 0.19)
        for _ in range(10):
            world.step()
            assert world.pose(0).x < 1 - RADIUS + 2 * TOLERANCE
            touched += world.touching(0)
    assert touched > 3


def test_a_robot_among_walls_goes_the_same_way_alone_and_with_another_far_off(engine):
    # Alone it looks walls up in the grid of fixed things, in company on its list.
    scene = Scene(
        2.0, 1.0, segments(12, 1.0, 6), starts=(Pose(0.5, 0.1, 1.0), Pose(1.9, 0.9)), model=EpuckModel(motor_noise=0.05)
    )
    alone, both = World(scene, robots=1, engine=engine), World(scene, engine=engine)
    touched = 0
    for world in (alone, both):
        world.set_speed(0, 800, 780)
    for _ in range(120):
        for world in (alone, both):
            world.run(4)
        touched += alone.touching(0)
        assert alone.pose(0) == both.pose(0)
        assert alone.proximity(0) == both.proximity(0)
    assert touched > 20


def test_in_the_densest_crowd_the_lists_get_the_room_they_need(engine):
    starts = packed(8, 8)
    world = World(Scene(0.75, 0.65, starts=starts), engine=engine)
    lists = listed(world)
    assert max(map(len, lists)) > 20
    assert sum(map(len, lists)) > 64 * 6
    assert not world._state.numbers[at.NEAR_LACK]
    assert world._state.numbers[at.PAIRS_END] <= world._state.numbers[at.NEAR_END] <= len(world._state.numbers)


def gathering():
    """Return a world whose robots drive together from all sides."""
    rings = [(math.tau * k / 12, 0.35 + 0.25 * (k // 12)) for k in range(36)]
    return Scene(
        2.0,
        2.0,
        starts=tuple(Pose(1 + far * math.cos(turn), 1 + far * math.sin(turn), turn + math.pi) for turn, far in rings),
    )


def straight(near, first, parameters, wheels):
    wheels[0] = wheels[1] = parameters[0]


def test_a_run_in_which_lists_outgrow_their_room_goes_on_as_if_there_had_been_enough(engine):
    law = Controller(straight, (900.0,))
    world, roomy = (World(gathering(), engine=engine) for _ in range(2))
    room = world._state.numbers[at.NEAR_END]
    roomy._state.numbers[at.NEAR_LACK] = 1
    assert roomy._state.make_room()  # More than it will ever need.
    world._state.numbers[at.NEAR_END] = world._state.numbers[at.PAIRS_END] + 8  # Hardly any.
    for part in (world, roomy):
        part.run(150, law)
    assert len(world._state.numbers) > room
    assert world.tick == roomy.tick == 150
    assert world.hash("proximity") == roomy.hash("proximity")
    by_hand = World(gathering(), engine=engine)
    by_hand._state.numbers[at.NEAR_END] = by_hand._state.numbers[at.PAIRS_END] + 8
    turn = by_hand.stepper()
    for k in range(1, 36):
        by_hand.set_speed(k, 900, 900)
    assert all(min(turn(900, 900)) >= 0 for _ in range(150))
    assert len(by_hand._state.numbers) > room


def test_both_engines_agree_with_more_in_sight_than_is_looked_at_in_one_go():
    pytest.importorskip("numba")
    chance = random.Random(8)
    spots = [(chance.uniform(0.35, 0.65), chance.uniform(0.35, 0.65), chance.uniform(0, math.tau)) for _ in range(160)]
    spots = [(x, y, turn) for x, y, turn in spots if math.dist((x, y), (0.5, 0.5)) > 0.06]
    assert len(spots) > 70
    walls = [Wall(x, y, x + 0.01 * math.cos(turn), y + 0.01 * math.sin(turn)) for x, y, turn in spots]
    posts = [Cylinder(1 - x, y, 0.002, colour=Colour(255, 0, 0)) for x, y, _ in spots]
    starts = (Pose(0.5, 0.5, 0.3), Pose(0.1, 0.1, 0.0), Pose(0.9, 0.9, 4.0))
    model = EpuckModel(rays=5)
    scene = Scene(1.0, 1.0, tuple(walls), cylinders=tuple(posts), starts=starts, model=model)
    worlds = [World(scene, engine=engine) for engine in ENGINES]
    for world in worlds:
        world.run(30, LAW)
    assert worlds[0].hash("proximity") == worlds[1].hash("proximity")
    assert max(worlds[0].proximity(0)) > 100


@pytest.mark.parametrize("robots", [1, 3, 4, 9, 17])
def test_robots_that_stand_among_others_stay_as_they_are_to_the_last_bit_on_both_engines(robots):
    pytest.importorskip("numba")
    worlds = [World(Scene(2, 2, model=EpuckModel(motor_noise=0.05)), robots=robots, engine=each) for each in ENGINES]
    before = worlds[0].poses
    for world in worlds:
        for robot in range(0, robots, 2):
            world.set_speed(robot, 300 + 20 * robot, 350)
        world.run(4)
    assert worlds[0].hash() == worlds[1].hash()
    assert worlds[0].poses[1::2] == before[1::2]
    assert worlds[0].pose(0) != before[0]


def test_robots_that_push_each_other_along_walls_come_apart_in_a_few_passes():
    pytest.importorskip("numba")
    world = World(Scene(2.2, 2.2, segments(100, 2.2, 4), step=1 / 32), robots=50, seed=3, engine="compiled")
    most = touched = 0
    for _ in range(60):
        world.run(25, LAW)
        passes = [world._state.robots[i * at.ROBOT + at.AWAKE] for i in range(50)]
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
    )
    world = World(scene, engine=engine)
    world.set_speed(0, 700, 700)
    world.run(700)
    box = world.snapshot().boxes[0]
    assert box.x > 0.8
    assert world.touching(0)
    assert world.proximity(0)[0] > 500
    assert box.x - world.pose(0).x == pytest.approx(0.03 + RADIUS, abs=1e-3)
