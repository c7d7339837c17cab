"""Mistakes that were found once, each proved to be gone."""

import math
from functools import partial

import pytest

from elib.errors import ArgumentError
from elib.physics import Batch, Box, Controller, Cylinder, EpuckModel, Light, Pose, Scene, Stripe, Wall, World
from elib.physics import layout as at
from elib.physics.assembly import MOST_ENTRIES, Solids
from elib.physics.body import RADIUS
from elib.physics.worldfile import parse

ONE = (Pose(0.5, 0.5),)


def headlong(near, first, parameters, wheels):
    wheels[0] = wheels[1] = parameters[0]


@pytest.fixture(params=["interpreted", "compiled"])
def engine(request):
    if request.param == "compiled":
        pytest.importorskip("numba")
    return request.param


@pytest.mark.parametrize("speed", [1e19, 1e300])
def test_a_law_that_asks_for_an_enormous_speed_gets_the_fastest(engine, speed):
    world = World(Scene(1, 1, starts=ONE), engine=engine)
    world.run(3, Controller(headlong, (speed,)))
    fast = World(Scene(1, 1, starts=ONE), engine=engine)
    fast.run(3, Controller(headlong, (1000.0,)))
    assert world.poses == fast.poses
    turn = world.stepper()
    turn(-speed, math.nan)
    assert math.isfinite(world.pose(0).heading)


def test_a_law_that_cannot_be_compiled_is_refused_by_name():
    pytest.importorskip("numba")
    world = World(Scene(1, 1, starts=ONE), engine="compiled")
    with pytest.raises(ArgumentError, match="cannot be compiled as a law"):
        world.run(1, Controller(partial(headlong), (1.0,)))


def test_cylinders_larger_than_the_arena_do_not_fill_the_memory():
    posts = tuple(Cylinder(12.0, 12.0, 1000.0) for _ in range(400))
    scene = Scene(25, 25, cylinders=posts)
    solids = Solids(scene, (), posts, 0.12, 1)
    assert len(solids.cells) < MOST_ENTRIES * 1.2


def test_a_jam_of_two_things_leaves_the_others_asleep(monkeypatch):
    from elib.physics import collision

    looked = []
    real = collision.settle
    monkeypatch.setattr(collision, "settle", lambda k, *rest: looked.append(k) or real(k, *rest))
    posts = tuple(Cylinder(0.5 + 0.3 * (k % 5), 0.5 + 0.3 * (k // 5), 0.05, is_pushable=True) for k in range(20))
    jam = (Box(0.1, 1.0, 0.1, 0.1, is_pushable=True), Box(0.03, 1.0, 0.05, 0.2), Box(0.17, 1.0, 0.05, 0.2))
    world = World(Scene(2.5, 2.5, boxes=jam, cylinders=posts))
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
            model=EpuckModel(ambient=1000.0),
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
    world = World(Scene(2, 2, boxes=boxes, starts=(Pose(0.38, 0.52),)))
    world.set_speed(0, 800, 700)
    world.run(100)
    before = world.hash()
    world.move_box(1, Pose(1.5, 1.6))
    assert world.hash() == before
    sides = world._state.walls
    assert len(sides) == (4 + 4 + 4) * at.WALL


def test_a_thing_that_is_thrown_far_is_seen_where_it_landed():
    def near(far):
        posts = (
            Cylinder(1.5, 1.5, 0.5),
            Cylinder(1.51, 1.5, 0.05, is_pushable=True),
            Cylinder(6.0, 1.5, 0.5),
            Cylinder(6.01, 1.5, 0.05, is_pushable=True),
        )
        starts = (Pose(2.12, 1.5, math.pi), *((Pose(6.57, 1.5, math.pi),) if far else ()))
        world = World(Scene(8, 4, cylinders=posts, starts=starts))
        world.step()
        return world.proximity(0)

    assert near(False) == near(True)


def test_speeds_that_cancel_within_a_tick_are_not_driven_again():
    world = World(Scene(1, 1, starts=ONE))
    step = world.scene.step
    world.drive(0, 0.128, 0.128, at=0)
    world.drive(0, -0.128, -0.128, at=step / 2)
    world.run(2)
    assert world.pose(0).x - 0.5 == pytest.approx(-0.128 * step, abs=1e-12)


def test_a_wall_too_short_or_too_long_for_arithmetic_is_refused():
    with pytest.raises(Exception, match="has no length"):
        parse(b"[arena]\nsize=[1,1]\n[[wall]]\nfrom=[0,0]\nto=[1e-200,0]\n", "x.toml")
    with pytest.raises(ArgumentError, match=r"x1 is -1e\+308; it must be a number from -2000 to 2000 m"):
        Wall(-1e308, 0.5, 1e308, 0.5)


def test_a_heavy_box_cannot_push_a_robot_out_of_the_arena():
    box = Box(0.5, 0.7, 0.6, 0.5, is_pushable=True, mass=100)
    world = World(Scene(1, 1, boxes=(box,), starts=(Pose(0.05, 0.05), Pose(0.5, 0.05))))
    world.set_speed(0, 1000, 1000)
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
    world.set_speed(0, 1000, 1000)
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
                model=EpuckModel(sensor_noise=0),
            )
        ).distance(0)
        for x in (-0.001, 0.001)
    ]
    assert near[0] == pytest.approx(near[1], rel=0.02)
    assert near[0] < 0.5


def test_worlds_with_the_same_floor_share_its_picture():
    scene = Scene(1, 1, starts=ONE, paint=(Stripe(((0.1, 0.5), (0.9, 0.5))),))
    batch = Batch(scene, 3, engine="interpreted")
    assert batch[0].snapshot().floor is batch[1].snapshot().floor is batch[2].snapshot().floor


def test_a_seed_beyond_64_bits_is_refused_by_a_batch_too():
    with pytest.raises(ArgumentError, match="seed is 18446744073709551616"):
        Batch(Scene(1, 1, starts=ONE), 2, seed=1 << 64, engine="interpreted")


def test_an_absurd_number_of_robots_is_refused_in_words():
    with pytest.raises(Exception, match="no room for"):
        World.load("crowd", robots=10**400)


def no_parameter(near, first, parameters, wheels):
    wheels[0] = parameters[5]


def third_wheel(near, first, parameters, wheels):
    wheels[2] = 1000.0


def meddling(near, first, parameters, wheels):
    near[first] = 1


def wrong_signature(near):
    return 0


@pytest.mark.parametrize("law", [no_parameter, third_wheel, meddling, wrong_signature])
def test_a_law_that_reaches_beyond_its_numbers_is_refused_on_both_engines(engine, law):
    world = World(Scene(1, 1, starts=ONE), engine=engine)
    with pytest.raises(ArgumentError, match=f"the law '{law.__name__}' fails"):
        world.run(1, Controller(law, (1.0,)))
    assert world.tick == 0


def test_what_is_no_controller_is_refused_in_words():
    world = World(Scene(1, 1, starts=ONE))
    with pytest.raises(ArgumentError, match="is no controller"):
        world.run(3, headlong)
    with pytest.raises(ArgumentError, match="3 is no law"):
        Controller(3)
    with pytest.raises(ArgumentError, match="parameter 0 of the controller is 'a'"):
        Controller(headlong, ("a",))
    with pytest.raises(ArgumentError, match=r"ticks is 1\.5"):
        world.run(1.5)


def only_the_first(near, first, parameters, wheels):
    if parameters[0] > 0.0:
        wheels[0] += 300.0
        wheels[1] += 300.0


def test_a_law_begins_with_standing_wheels_for_each_robot(engine):
    world = World(Scene(2, 1, starts=(Pose(0.3, 0.3), Pose(0.3, 0.7))), engine=engine)
    world.run(64, Controller(only_the_first, (1.0,)))
    assert world.encoders(0) == world.encoders(1) == pytest.approx((303, 303), abs=2)


def fancy(near, first, parameters, wheels):
    wheels[0] = wheels[1] = float(str(len(sorted([parameters[0]], key=lambda value: -value))))


def test_a_law_that_numba_cannot_compile_is_refused_in_two_lines():
    pytest.importorskip("numba")
    World(Scene(1, 1, starts=ONE)).run(1, Controller(fancy, (1.0,)))
    with pytest.raises(Exception, match="the law 'fancy' cannot be compiled") as caught:
        World(Scene(1, 1, starts=ONE), engine="compiled").run(1, Controller(fancy, (1.0,)))
    assert len(str(caught.value)) < 400


def test_a_slanted_stripe_has_smooth_edges():
    scene = Scene(1, 1, starts=ONE, paint=(Stripe(((0.1, 0.1), (0.9, 0.6))),))
    shades = {pixel & 255 for pixel in World(scene).snapshot().floor.pixels}
    assert len(shades) > 5
