"""Ambient light against ARGoS' law: exp(-2 d / I), linear in the angle, additive, up to 2.5 m, with shadows."""

import math
import random
import statistics
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from world_rig import room_of

from elib.base.body import SENSOR_DIRECTIONS
from elib.base.infrared import ROOM_READING
from elib.simulator.physics import Box, Cylinder, EpuckModel, Pose, Scene, Wall
from elib.simulator.physics.fittings import Light
from elib.simulator.physics.noise import AMBIENT
from elib.simulator.physics.profiles import BEARINGS
from lanes import few_and_many

QUIET = EpuckModel(sensor_noise=0, ambient=4000, quality="ideal")
SENSOR_HEIGHT = 0.033
SIDE, OTHER_SIDE = 5, 2  # Look to the left and to the right, 35 mm from the middle.
MIRROR = [7, 6, 5, 4, 3, 2, 1, 0]
ROOM = Scene(6, 6, starts=(Pose(3, 3),), model=QUIET)


def readings(scene, engine="interpreted", robot=0, tick=0, seed=0):
    return room_of(scene, seed, engine).at_tick(tick).read("ambient_light", robot)


def share(scene, sensor):
    """What a sensor gets, 0 no light, 1 full."""
    return 1 - readings(scene)[sensor] / 4000


def lit(*lights, **things):
    return replace(ROOM, lights=lights, **things)


def lamp_beside(distance, **options):
    """A lamp straight ahead of the left sensor, at its height."""
    return Light(3, 3.035 + distance, height=SENSOR_HEIGHT, **options)


def test_a_room_without_lamps_reads_the_same_everywhere():
    assert readings(ROOM) == [4000] * 8
    assert readings(replace(ROOM, model=EpuckModel(sensor_noise=0, quality="ideal"))) == [ROOM_READING] * 8


@pytest.mark.parametrize("intensity", [0.5, 1.0, 4.0])
@pytest.mark.parametrize("distance", [0.05, 0.2, 0.5, 1.0, 2.0, 2.4])
def test_a_lamp_straight_ahead_follows_the_published_exponential(distance, intensity):
    scene = lit(lamp_beside(distance, intensity=intensity))
    assert share(scene, SIDE) == pytest.approx(math.exp(-2 * distance / intensity), abs=0.5 / 4000 + 1e-9)
    assert share(scene, OTHER_SIDE) == 0


def test_beyond_two_and_a_half_metres_a_lamp_gives_nothing():
    assert share(lit(lamp_beside(2.49, intensity=10)), SIDE) > 0.5
    assert share(lit(lamp_beside(2.51, intensity=10)), SIDE) == 0


@pytest.mark.parametrize("degrees", [0, 15, 30, 45, 60, 75, 89, 91, 120])
def test_the_light_falls_linearly_with_the_angle_to_nothing_at_90_degrees(degrees):
    angle = math.radians(degrees)
    place = (3 - 0.5 * math.sin(angle), 3.035 + 0.5 * math.cos(angle))
    expected = math.exp(-1) * max(0, 1 - degrees / 90)
    assert share(lit(Light(*place, height=SENSOR_HEIGHT)), SIDE) == pytest.approx(expected, abs=0.5 / 4000 + 1e-9)


def test_the_height_of_a_lamp_counts_for_distance_and_angle():
    high = lit(Light(3, 3.035 + 0.3, height=SENSOR_HEIGHT + 0.4))
    angle = math.atan2(0.4, 0.3)
    assert share(high, SIDE) == pytest.approx(math.exp(-1) * (1 - angle / (math.pi / 2)), abs=2e-4)


def test_lamps_add_up_and_never_give_more_than_full_light():
    one, two = lamp_beside(0.5), lamp_beside(0.9)
    assert share(lit(one, two), SIDE) == pytest.approx(share(lit(one), SIDE) + share(lit(two), SIDE), abs=3e-4)
    assert readings(lit(*[lamp_beside(0.01, intensity=10)] * 3))[SIDE] == 0


def test_a_lamp_that_is_switched_off_gives_nothing():
    assert readings(lit(lamp_beside(0.1, intensity=0))) == [4000] * 8


@pytest.mark.parametrize(
    "thing",
    [
        {"walls": (Wall(2.8, 3.2, 3.2, 3.2, height=0.05),)},
        {"boxes": (Box(3, 3.2, 0.05, 0.05, height=0.05),)},
        {"boxes": (Box(3, 3.2, 0.05, 0.05, height=0.05, is_pushable=True),)},
        {"cylinders": (Cylinder(3, 3.2, 0.02, height=0.05),)},
        {"cylinders": (Cylinder(3, 3.2, 0.02, height=0.05, is_pushable=True),)},
        {"starts": (Pose(3, 3), Pose(3, 3.2))},
    ],
)
def test_what_stands_in_the_light_casts_a_shadow(thing):
    scene = lit(lamp_beside(0.5), **thing)
    assert share(lit(lamp_beside(0.5)), SIDE) > 0.3
    assert share(scene, SIDE) == 0


def test_a_shadow_is_as_long_as_the_lamp_is_low():
    # The light sinks from 0.233 m to 0.033 m over 1 m: 0.183 m before the sensor it is 69.6 mm above the floor.
    lamp = Light(3, 4.035, height=0.233)
    beside = 3.035 + 0.183
    open_share = share(lit(lamp), SIDE)
    for height, expected in ((0.069, open_share), (0.070, 0.0)):
        wall = Wall(2.8, beside, 3.2, beside, height=height)
        assert share(lit(lamp, walls=(wall,)), SIDE) == expected
    # A post is as tall as the wall, but its near side comes first.
    for height, expected in ((0.065, open_share), (0.066, 0.0)):
        post = Cylinder(3, beside, 0.02, height=height)
        assert share(lit(lamp, cylinders=(post,)), SIDE) == pytest.approx(expected, abs=1e-9)


def test_a_lamp_above_throws_its_light_over_robots_but_not_into_those_close_by():
    lamp = Light(3, 4.0, height=0.15)
    assert share(lit(lamp, starts=(Pose(3, 3), Pose(3, 3.6))), SIDE) == share(lit(lamp), SIDE)
    assert share(lit(lamp, starts=(Pose(3, 3), Pose(3, 3.08))), SIDE) == 0


@pytest.mark.parametrize(
    "thing",
    [
        {"walls": (Wall(2.8, 3.6, 3.2, 3.6),)},  # Behind the lamp.
        {"walls": (Wall(2.8, 2.9, 3.2, 2.9),)},  # Behind the robot.
        {"walls": (Wall(3.05, 3.2, 3.4, 3.2),)},  # Beside the light.
        {"walls": (Wall(3.05, 3.1, 3.05, 3.5),)},  # Along it.
        {"walls": (Wall(2.8, 3.2, 3.2, 3.2, height=0.02),)},  # Below it.
        {"cylinders": (Cylinder(3.05, 3.2, 0.02),)},
        {"cylinders": (Cylinder(3, 3.7, 0.02),)},
        {"cylinders": (Cylinder(3.03, 3.58, 0.05),)},  # Close behind the lamp.
        {"starts": (Pose(3, 3), Pose(3, 2.9), Pose(3, 3.65))},
    ],
)
def test_what_stands_elsewhere_casts_none(thing):
    assert share(lit(lamp_beside(0.5), **thing), SIDE) == share(lit(lamp_beside(0.5)), SIDE)


def test_a_narrow_thing_in_front_of_one_sensor_leaves_the_others_in_the_light():
    lamp = Light(4, 3, height=SENSOR_HEIGHT)
    bright = readings(lit(lamp))
    for thing in ({"walls": (Wall(3.06, 3.018, 3.06, 3.04),)}, {"cylinders": (Cylinder(3.06, 3.0295, 0.01),)}):
        values = readings(lit(lamp, **thing))
        assert values[6] == 4000 > bright[6]
        assert [*values[:6], values[7]] == [*bright[:6], bright[7]]


def test_the_robots_own_body_shades_the_far_side():
    values = readings(lit(Light(3.5, 3, height=SENSOR_HEIGHT)))
    assert values[0] == values[7] < values[1] == values[6] < values[2] == values[5]
    assert values[3] == values[4] == 4000


def test_a_lamp_over_the_robot_lights_all_sensors_alike_on_both_sides():
    values = readings(lit(Light(3, 3, height=0.2)))
    assert values == [values[i] for i in MIRROR]


@few_and_many(4, 20)
def test_a_mirrored_room_gives_the_mirrored_readings(examples):
    @settings(max_examples=examples)
    @given(
        st.floats(-2, 2).filter(lambda x: abs(x) > 0.01),
        st.floats(-2, 2),
        st.floats(0.01, 0.4),
        st.floats(0.2, 1),
        st.floats(-0.5, 0.5),
    )
    def check(x, y, height, far, aside):
        def seen(mirror):
            wall = Wall(3 + far, 3 + mirror * aside, 3 + far / 2, 3 + mirror * (aside + 0.3))
            post = Cylinder(3 - far / 2, 3 + mirror * aside / 2, 0.03)
            start = (Pose(3, 3), Pose(3 + far / 3, 3 - mirror * aside))
            return readings(lit(Light(3 + x, 3 + mirror * y, height), walls=(wall,), cylinders=(post,), starts=start))

        there, here = seen(1), seen(-1)
        assert here == [there[i] for i in MIRROR]

    check()


def expected(scene):
    """The law as it is written, one way of the light after the other."""
    here = scene.starts[0]
    discs = [(post.x, post.y, post.radius, post.height) for post in scene.cylinders]
    discs += [(pose.x, pose.y, 0.037, 0.05) for pose in scene.starts[1:]]
    sums = []
    for bearing, direction in zip(BEARINGS, SENSOR_DIRECTIONS, strict=True):
        at, axis = here.heading + math.radians(bearing), here.heading + direction
        x, y = here.x + 0.035 * math.cos(at), here.y + 0.035 * math.sin(at)
        total = 0.0
        for lamp in scene.lights:
            way = lamp.x - x, lamp.y - y, lamp.height - SENSOR_HEIGHT
            distance = math.hypot(*way)
            angle = math.acos((way[0] * math.cos(axis) + way[1] * math.sin(axis)) / distance)
            crossings = [(wall_crossing(wall, x, y, way), wall.height) for wall in scene.walls]
            crossings += [(disc_crossing(disc, x, y, way), disc[3]) for disc in discs]
            is_hidden = any(part is not None and SENSOR_HEIGHT + part * way[2] < top for part, top in crossings)
            if distance < 2.5 and angle < math.pi / 2 and not is_hidden:
                total += math.exp(-2 * distance / lamp.intensity) * (1 - angle / (math.pi / 2))
        sums.append(4000 * (1 - min(total, 1)))
    return sums


def wall_crossing(wall, x, y, way):
    """Where the light crosses it, as a part of its way from the sensor; None where it does not."""
    matrix = np.array([[way[0], wall.x1 - wall.x2], [way[1], wall.y1 - wall.y2]])
    part, along = np.linalg.solve(matrix, (wall.x1 - x, wall.y1 - y))
    return part if 0 < part < 1 and 0 <= along <= 1 else None


def disc_crossing(disc, x, y, way):
    """Where within it the light is lowest, as a part of its way from the sensor; None where it misses it."""
    ends = np.roots(
        [
            way[0] ** 2 + way[1] ** 2,
            -2 * (way[0] * (disc[0] - x) + way[1] * (disc[1] - y)),
            (disc[0] - x) ** 2 + (disc[1] - y) ** 2 - disc[2] ** 2,
        ]
    )
    if np.iscomplexobj(ends):
        return None
    enters, leaves = max(min(ends), 0.0), min(max(ends), 1.0)
    return None if enters >= leaves else enters if way[2] > 0 else leaves


def furnished(chance):
    """A lamp, and walls, posts and robots about it, anywhere within half a metre."""

    def anywhere(off=0.0):
        while True:
            x, y = chance.uniform(-0.5, 0.5), chance.uniform(-0.5, 0.5)
            if math.hypot(x, y) > off:
                return 3 + x, 3 + y

    def some(most):
        return range(chance.randint(0, most))

    heading = chance.uniform(-3, 3)
    return lit(
        Light(*anywhere(0.08), height=chance.uniform(0.02, 0.3), intensity=chance.uniform(0.3, 3)),
        walls=tuple(Wall(*anywhere(), *anywhere(), height=chance.uniform(0.02, 0.1)) for _ in some(3)),
        cylinders=tuple(
            Cylinder(*anywhere(0.08), chance.uniform(0.005, 0.04), height=chance.uniform(0.02, 0.1)) for _ in some(3)
        ),
        starts=(Pose(3, 3, heading), *(Pose(*anywhere(0.08)) for _ in some(2))),
    )


@few_and_many(12, 25)
def test_whatever_stands_there_the_readings_are_those_of_the_law(examples):
    chance = random.Random(4)
    lit_sensors = 0
    for _ in range(examples):
        scene = furnished(chance)
        wanted = expected(scene)
        assert readings(scene) == pytest.approx(wanted, abs=0.5 + 1e-6), scene
        lit_sensors += sum(counts < 4000 for counts in wanted)
    assert examples < lit_sensors < 4 * examples  # Neither all in the light nor all in the shadow.


def test_the_noise_is_two_counts_as_a_difference_of_two_has_three():
    scene = replace(ROOM, model=EpuckModel(ambient=2000, quality="ideal"))
    samples = [reading for tick in range(400) for reading in readings(scene, tick=tick)]
    assert statistics.fmean(samples) == pytest.approx(2000, abs=0.5)
    assert statistics.stdev(samples) == pytest.approx(3 / math.sqrt(2), rel=0.05)
    assert samples[:8] == readings(scene)
    assert AMBIENT == 32  # A channel that moved would change every recorded run.
