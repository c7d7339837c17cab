"""The rays that the kernels look up, cull and turn, against the plainest search."""

import cmath
import math
from itertools import pairwise, product

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from world_rig import ENGINES, put, ray_lengths

from elib.simulator.physics import Cylinder, EpuckModel, Pose, Scene, Wall, World, profiles
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.sensors import distance
from lanes import few_and_many, short

NEAR = st.floats(-0.3, 0.3)
BRIGHT = st.floats(0.05, 1)
CENTRE = 1.0


def directions(model):
    """Return place and direction of every infrared ray in the robot's frame, as complex numbers."""
    return [
        (complex(*place), complex(*axis) * cmath.rect(1, math.radians(side * profiles.APERTURE)))
        for place, axis in zip(profiles.PLACES, profiles.AXES, strict=True)
        for side, _ in profiles.SHARES[model.rays]
    ]


def plain(fan, heading, reach, walls, discs):
    """Return the length of each ray, with angles and complex numbers, everything against everything."""
    turn = cmath.rect(1, heading)
    found = []
    for place, direction in fan:
        start, ray = turn * place, turn * direction
        best = reach
        for x1, y1, x2, y2 in walls:
            # In coordinates along the ray the wall crosses the real axis where its imaginary part is 0.
            a, b = (complex(x1, y1) - start) / ray, (complex(x2, y2) - start) / ray
            if a.imag * b.imag <= 0 and a.imag != b.imag:
                crossing = a.real + (b.real - a.real) * a.imag / (a.imag - b.imag)
                if 0 <= crossing < best:
                    best = crossing
        for x, y, radius in discs:
            centre = (complex(x, y) - start) / ray
            if abs(centre.imag) <= radius and centre.real > 0:
                best = min(best, max(0.0, centre.real - math.sqrt(radius**2 - centre.imag**2)))
        found.append(best)
    return found


def apart(x1, y1, x2, y2):
    """Return the distance of a wall from the robot's centre, m."""
    wall = complex(x2 - x1, y2 - y1)
    along = min(max((-complex(x1, y1) * wall.conjugate()).real / abs(wall) ** 2, 0.0), 1.0)
    return abs(complex(x1, y1) + along * wall)


def lists(parts, clear, most, least=0):
    """Return a strategy of lists of things, without those that the robot in the middle overlaps.

    They are left out one by one: where whole examples are refused for one thing, Hypothesis now and then gives up.
    """
    drawn = st.lists(st.tuples(*parts), min_size=least, max_size=most)
    return drawn.map(lambda things: [each for each in things if clear(*each)])


def walls_around(*more, least=0):
    """Return a strategy of lists of walls: both ends, and what *more* draws; *least* counts those left out, too."""

    def clear(x1, y1, x2, y2, *_):
        return math.hypot(x2 - x1, y2 - y1) > 0.01 and apart(x1, y1, x2, y2) > RADIUS

    return lists([NEAR, NEAR, NEAR, NEAR, *more], clear, 4, least)


def posts_around(*more):
    """Return a strategy of lists of posts: place, radius, and what *more* draws."""

    def clear(x, y, radius, *_):
        return math.hypot(x, y) > radius + RADIUS

    return lists([NEAR, NEAR, st.floats(0.01, 0.1), *more], clear, 3)


def robots_around():
    """Return a strategy of lists of places of robots."""
    return lists([NEAR, NEAR], lambda x, y: math.hypot(x, y) > 2 * RADIUS, 2)


def grazes(ray, heading, walls, discs):
    """Return whether a ray passes an end of a wall or the rim of a disc by less than a nanometre."""
    turn = cmath.rect(1, heading)
    start, direction = turn * ray[0], turn * ray[1]
    ends = [complex(*wall[i : i + 2]) for wall in walls for i in (0, 2)]
    return any(abs(((end - start) / direction).imag) < 1e-9 for end in ends) or any(
        abs(abs(((complex(x, y) - start) / direction).imag) - radius) < 1e-9 for x, y, radius in discs
    )


def room(walls, posts, robots, model, engine="interpreted"):
    """Return a world in whose middle robot 0 stands, with these things around it."""
    scene = Scene(
        2 * CENTRE,
        2 * CENTRE,
        walls=tuple(Wall(*(CENTRE + part for part in wall)) for wall in walls),
        cylinders=tuple(Cylinder(CENTRE + x, CENTRE + y, radius) for x, y, radius in posts),
        starts=(
            Pose(CENTRE, CENTRE),
            *(Pose(0.1 + 0.1 * k, 0.1) for k in range(len(robots))),
        ),
        model=model,
    )
    world = World(scene, engine=engine)
    for k, (x, y) in enumerate(robots, 1):
        put(world, k, CENTRE + x, CENTRE + y)
    return world


@pytest.mark.parametrize("rays", short([5, 1, 3], 5))
@few_and_many(20, 40)
def test_every_infrared_ray_ends_where_the_plainest_search_says(rays, examples):
    @settings(max_examples=examples)
    @given(st.floats(-4, 4), walls_around(), posts_around(), robots_around())
    def check(heading, walls, posts, robots):
        model = EpuckModel(rays=rays, quality="ideal")
        world = room(walls, posts, robots, model)
        put(world, 0, CENTRE, CENTRE, heading)
        discs = [*posts, *((x, y, RADIUS) for x, y in robots)]
        fan = directions(model)
        reach = profiles.profile(model.profile).reach
        expected = plain(fan, heading, reach, walls, discs)
        for ray, here, there in zip(fan, ray_lengths(world), expected, strict=True):
            # Where a ray passes very near an end or a rim the two may round apart.
            assert here == pytest.approx(there, abs=1e-9) or grazes(ray, heading, walls, discs)

    check()


def response(profile, depth):
    """Return what a flat surface this far ahead gives back, counts, from the published table."""
    place = depth / profiles.SPACING
    below = int(place)
    if below >= len(profile.counts) - 1:
        return profile.counts[-1]
    return profile.counts[below] + (place - below) * (profile.counts[below + 1] - profile.counts[below])


@pytest.mark.parametrize(
    ("rays", "engine"),
    short(product((1, 3, 5), ("interpreted", "compiled")), (3, "interpreted"), (5, "compiled")),
)
@few_and_many(15, 30)
def test_a_sensor_reads_the_weighted_responses_of_what_its_rays_meet_first(rays, engine, examples):
    @settings(max_examples=examples)
    @given(st.floats(-4, 4), walls_around(BRIGHT), posts_around(BRIGHT))
    def check(heading, walls, posts):
        model = EpuckModel(rays=rays, sensor_noise=0, quality="ideal")
        scene = Scene(
            2 * CENTRE,
            2 * CENTRE,
            walls=tuple(Wall(*(CENTRE + part for part in wall), reflectance=bright) for *wall, bright in walls),
            cylinders=tuple(Cylinder(CENTRE + x, CENTRE + y, size, reflectance=bright) for x, y, size, bright in posts),
            starts=(Pose(CENTRE, CENTRE),),
            model=model,
        )
        world = World(scene, engine=engine)
        put(world, 0, CENTRE, CENTRE, heading)
        fan = directions(model)
        profile = profiles.profile(model.profile)
        edges = [wall[:4] for wall in walls]
        discs = [post[:3] for post in posts]
        assume(not any(grazes(ray, heading, edges, discs) for ray in fan))
        # For each thing how far each ray would go if it were the only one.
        alone = [(plain(fan, heading, profile.reach, [wall[:4]], []), wall[4]) for wall in walls]
        alone += [(plain(fan, heading, profile.reach, [], [post[:3]]), post[3]) for post in posts]
        for ray in range(len(fan)):  # Which of two at the same distance it meets, rounding decides.
            lengths = sorted(found[ray] for found, _ in alone if found[ray] < profile.reach)
            assume(all(far - near > 1e-9 for near, far in pairwise(lengths)))
        shares = profiles.SHARES[rays]
        told = world.proximity(0)
        for sensor in range(profiles.COUNT):
            light = 0.0
            for k, (side, share) in enumerate(shares):
                length, bright = min(
                    ((lengths[sensor * rays + k], bright) for lengths, bright in alone), default=(1, 1)
                )
                if length < profile.reach:
                    depth = length * math.cos(math.radians(side * profiles.APERTURE))
                    light += share * response(profile, depth / bright)
            assert told[sensor] == pytest.approx(min(light, model.ambient), abs=0.51)

    check()


@pytest.mark.parametrize(
    ("rays", "profile"),
    [
        (3, "enki"),
        pytest.param(1, "gctronic", marks=pytest.mark.long),
        pytest.param(5, "webots", marks=pytest.mark.long),
    ],
)
@pytest.mark.usefixtures("compiled_worlds")
@few_and_many(8, 16)
def test_both_engines_cast_the_same_rays_to_the_last_bit_also_across_a_wall_or_in_a_post(rays, profile, examples):
    @settings(max_examples=examples)
    @given(
        st.floats(-4, 4),
        st.floats(0, 0.06),
        st.tuples(st.floats(-1000, 1000), st.floats(-1000, 1000)),
        walls_around(),
        posts_around(),
        st.lists(st.tuples(NEAR, NEAR), max_size=3),
    )
    def check(heading, aside, speeds, walls, posts, robots):
        model = EpuckModel(rays=rays, profile=profile, gain_spread=0.1, offset_spread=5.0, quality="ideal")
        told = []
        for engine in ENGINES:
            world = room(walls, posts, robots, model, engine)
            # Also across a wall or in a post, and after ticks that push it out.
            put(world, 0, CENTRE + aside, CENTRE, heading)
            told.append([world.snapshot(beams=True).robots[0].beams])
            world.set_step_rates(0, *speeds)
            for _ in range(3):
                world.step()
                told[-1] += [world.snapshot(beams=True).robots[0].beams, world.proximity(0)]
        assert told[0] == told[1]

    check()


@few_and_many(20, 40)
def test_the_time_of_flight_sensor_weighs_its_five_rays_by_their_light(examples):
    @settings(max_examples=examples)
    @given(st.floats(-4, 4), walls_around(least=1))
    def check(heading, walls):
        world = room(walls, [], [], EpuckModel(sensor_noise=0, quality="ideal"))
        put(world, 0, CENTRE, CENTRE, heading)
        spread = [distance.CONE * (0.5 - k / 4) for k in range(5)]
        fan = [(complex(*distance.PLACE), cmath.rect(1, angle)) for angle in spread]
        edge = [(-1, -1, 1, -1), (1, -1, 1, 1), (1, 1, -1, 1), (-1, 1, -1, -1)]
        lengths = plain(fan, heading, distance.REACH, [*walls, *edge], [])
        depths = [length * math.cos(a) for length, a in zip(lengths, spread, strict=True) if length < distance.REACH]
        light = [1 / max(depth, distance.TOUCHING) for depth in depths]
        mean = sum(light) / sum(each * each for each in light) if light else distance.REACH
        assert world.distance(0) == pytest.approx(mean, rel=1e-7) or any(grazes(ray, heading, walls, []) for ray in fan)

    check()
