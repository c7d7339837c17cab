"""The camera: what stands where appears where it should, as large as it should."""

import math

import numpy as np
import pytest

from elib.physics import Box, Colour, Cylinder, Pose, Scene, World
from elib.physics.sensors.camera import ABOVE, FOCAL, FORWARD

RED = Colour(255, 0, 0)
COLUMNS = [k - 319.5 for k in range(640)]
ROWS = [239.5 - k for k in range(480)]


def red(picture):
    """Return where the picture is red, rows x columns."""
    return (picture[:, :, 0] > 100) & (picture[:, :, 1] < 40) & (picture[:, :, 2] < 40)


def seen(*things, pose=None, size=4.0):
    boxes = tuple(thing for thing in things if isinstance(thing, Box))
    posts = tuple(thing for thing in things if isinstance(thing, Cylinder))
    world = World(Scene(size, size, boxes=boxes, cylinders=posts, starts=(pose or Pose(1, 1),)))
    return world.picture(0, COLUMNS, ROWS)


def test_the_whole_chip_sees_56_degrees():
    assert 2 * math.degrees(math.atan(320 / FOCAL)) == pytest.approx(56)


def test_a_box_is_as_wide_and_high_as_the_pinhole_says():
    depth = 0.5
    box = Box(1 + FORWARD + depth + 0.05, 1, 0.1, 0.2, height=0.08, colour=RED)
    rows, columns = np.nonzero(red(seen(box)))
    assert columns.max() - columns.min() + 1 == pytest.approx(FOCAL * 0.2 / depth, abs=1.5)
    assert rows.min() == pytest.approx(240 - FOCAL * (0.08 - ABOVE) / depth, abs=1.5)
    assert rows.max() == pytest.approx(240 + FOCAL * ABOVE / depth, abs=1.5)


@pytest.mark.parametrize("heading", [0.0, 2.0, -1.2])
def test_left_is_left_whatever_the_heading(heading):
    ahead, left = 0.4, 0.1
    x = 2 + ahead * math.cos(heading) - left * math.sin(heading)
    y = 2 + ahead * math.sin(heading) + left * math.cos(heading)
    mask = red(seen(Cylinder(x, y, 0.03, colour=RED), pose=Pose(2, 2, heading)))
    assert mask.any()
    assert np.nonzero(mask)[1].max() < 320


def test_a_near_thing_hides_a_far_one_and_a_low_one_only_its_foot():
    far = Box(2.0, 1, 0.1, 0.4, height=0.3, colour=RED)
    near = Box(1.5, 1, 0.1, 0.8, height=0.1, colour=Colour(0, 0, 255))
    both, alone = red(seen(near, far)), red(seen(far))
    assert 0 < both.sum() < alone.sum()
    assert not both[240:].any()  # Below the horizon the near one covers everything.
    high = Box(1.5, 1, 0.1, 0.8, height=0.5, colour=Colour(0, 0, 255))
    assert not red(seen(high, far)).any()


def test_what_is_behind_is_not_seen():
    assert not red(seen(Cylinder(0.5, 1, 0.1, colour=RED))).any()


def test_another_robot_is_seen_and_oneself_is_not():
    alone = World(Scene(2, 2, starts=(Pose(0.5, 1), Pose(1.0, 1))), robots=1).picture(0, COLUMNS, ROWS)
    pair = World(Scene(2, 2, starts=(Pose(0.5, 1), Pose(1.0, 1)))).picture(0, COLUMNS, ROWS)
    different = (alone != pair).any(axis=2)
    columns = np.nonzero(different)[1]
    assert columns.mean() == pytest.approx(319.5, abs=1)
    assert columns.max() - columns.min() + 1 == pytest.approx(FOCAL * 0.074 / 0.47, abs=3)


def test_the_floor_is_below_the_horizon_and_the_wall_upon_it():
    picture = seen(pose=Pose(2, 2)).astype(int)
    middle = picture[:, 320]
    assert (middle[:200] == middle[0]).all(axis=1).sum() < 200  # The sky shades off.
    assert middle[300].sum() < middle[0].sum()
    assert (np.abs(np.diff(middle.sum(axis=1))) > 20).sum() == 2  # Sky to wall, wall to floor.
