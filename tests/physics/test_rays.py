"""The culled, cross-multiplied ray cast against the plainest one."""

import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from elib.physics import Wall
from elib.physics.body import RADIUS, SENSOR_RADIUS
from elib.physics.scene import flat_walls
from elib.physics.sensors import distance, proximity
from elib.physics.sensors.rays import cast

NEAR = st.floats(-0.3, 0.3)
REACH = 0.12


def plain(fan, heading, walls, discs):
    """Every ray against everything, with angles and complex numbers."""
    turn = complex(math.cos(heading), math.sin(heading))
    rays = len(fan.ray_x) // len(fan.place_x)
    found = []
    for k, (ray_x, ray_y) in enumerate(zip(fan.ray_x, fan.ray_y, strict=True)):
        start = turn * complex(fan.place_x[k // rays], fan.place_y[k // rays])
        ray = turn * complex(ray_x, ray_y)
        best = REACH
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


@settings(derandomize=True, deadline=None, max_examples=150)
@given(
    st.floats(-4, 4),
    st.lists(st.tuples(NEAR, NEAR, NEAR, NEAR), max_size=4),
    st.lists(st.tuples(NEAR, NEAR, st.floats(0.01, 0.1)), max_size=3),
    st.lists(st.tuples(NEAR, NEAR), max_size=2),
)
@pytest.mark.parametrize("fan", [proximity.FAN, distance.FAN], ids=["infrared", "time of flight"])
def test_every_ray_ends_where_the_plainest_search_says(fan, heading, walls, posts, robots):
    assume(all(math.hypot(x2 - x1, y2 - y1) > 0.01 for x1, y1, x2, y2 in walls))
    # Nothing comes nearer than the robot's own rim: bodies do not overlap.
    assume(all(apart(*wall) > RADIUS for wall in walls))
    assume(all(math.hypot(x, y) > radius + RADIUS for x, y, radius in posts))
    assume(all(math.hypot(x, y) > 2 * RADIUS for x, y in robots))
    distances = [0.0] * len(fan.ray_x)
    cast(
        0,
        [0.0, *(x for x, _ in robots)],
        [0.0, *(y for _, y in robots)],
        math.cos(heading),
        math.sin(heading),
        [RADIUS] * (1 + len(robots)),
        flat_walls(tuple(Wall(*wall) for wall in walls)),
        [number for post in posts for number in post],
        fan.place_x,
        fan.place_y,
        fan.ray_x,
        fan.ray_y,
        fan.spread,
        REACH,
        SENSOR_RADIUS,
        distances,
    )
    expected = plain(fan, heading, walls, posts + [(x, y, RADIUS) for x, y in robots])
    for k, (here, there) in enumerate(zip(distances, expected, strict=True)):
        # Where a ray passes an end or a rim by a hair the two may round apart.
        assert here == pytest.approx(there, abs=1e-9) or grazes(fan, k, heading, walls, posts, robots)


def apart(x1, y1, x2, y2):
    """Return the distance of a wall from the robot's centre, m."""
    wall = complex(x2 - x1, y2 - y1)
    along = min(max((-complex(x1, y1) * wall.conjugate()).real / abs(wall) ** 2, 0.0), 1.0)
    return abs(complex(x1, y1) + along * wall)


def grazes(fan, k, heading, walls, posts, robots):
    """Return whether ray k passes an end of a wall or the rim of a disc by less than a nanometre."""
    turn = complex(math.cos(heading), math.sin(heading))
    place = k // (len(fan.ray_x) // len(fan.place_x))
    start = turn * complex(fan.place_x[place], fan.place_y[place])
    ray = turn * complex(fan.ray_x[k], fan.ray_y[k])
    ends = [complex(*wall[i : i + 2]) for wall in walls for i in (0, 2)]
    rims = [(complex(x, y), radius) for x, y, radius in posts] + [(complex(x, y), RADIUS) for x, y in robots]
    return any(abs(((end - start) / ray).imag) < 1e-9 for end in ends) or any(
        abs(abs(((centre - start) / ray).imag) - radius) < 1e-9 for centre, radius in rims
    )
