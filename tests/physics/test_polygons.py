"""A polygon of a world file is a block: its sides are walls, and nothing starts inside."""

import pytest
from world_rig import IDEAL

from elib.base.errors import ArgumentError, SimulationError
from elib.simulator.drawing import draw_svg
from elib.simulator.physics import Polygon, Pose, Scene, World
from elib.simulator.physics.geometry import extent
from elib.simulator.worlds.files import parse
from elib.simulator.worlds.oddities import oddities
from elib.simulator.worlds.writer import written_scene

DENTED = ((0.4, 0.2), (0.8, 0.2), (0.8, 0.8), (0.4, 0.8), (0.6, 0.5))
"""A square whose left side has a dent."""


def room(*starts: Pose, **more: object) -> Scene:
    return Scene(1, 1, polygons=(Polygon(DENTED),), starts=starts, model=IDEAL, **more)


def test_a_robot_that_drives_into_the_dent_stops_at_its_sides():
    world = World(room(Pose(0.2, 0.5)))
    world.set_wheel_speeds(0, 0.1, 0.1)
    world.run(64 * 6)
    assert world.touching(0)
    assert 0.5 < world.pose(0).x < 0.6 - 0.037


def test_sensors_camera_and_picture_see_the_sides_as_the_same_walls():
    scene = room(Pose(0.35, 0.25, 0.0))
    walls = Scene(1, 1, walls=scene.polygons[0].sides, starts=scene.starts, model=IDEAL)
    ours, theirs = World(scene), World(walls)
    assert ours.proximity(0) == theirs.proximity(0)
    assert max(ours.proximity(0)) > 100
    columns = [0.0, 10.0, 20.0], [0.0, 10.0]
    assert (ours.picture(0, *columns) == theirs.picture(0, *columns)).all()
    assert ours.snapshot().walls == walls.walls
    assert draw_svg(ours.snapshot()).count("<polyline") == draw_svg(theirs.snapshot()).count("<polyline")


def test_no_robot_starts_inside_but_in_the_dent_it_may():
    assert World(room(Pose(0.45, 0.5))).robots == 1
    with pytest.raises(SimulationError, match=r"polygon\[0\]"):
        World(room(Pose(0.7, 0.5)))
    crowd = World(room(seed=3), robots=20)
    assert all(Polygon(DENTED).distance(pose.x, pose.y) >= 0.037 for pose in crowd.poses)


def test_no_robot_is_put_into_a_polygon_however_large_it_is():
    large = Polygon(((1, 1), (3, 1), (3, 3), (1, 3)))
    world = World(Scene(4, 4, polygons=(large,), starts=(Pose(0.5, 0.5),), model=IDEAL))
    for place in ((2, 2), (1.02, 2)):
        with pytest.raises(ArgumentError, match="polygon 0 is in the way"):
            world.move_robot(0, Pose(*place))
    world.move_robot(0, Pose(0.9, 2))


def test_the_distance_is_below_zero_inside():
    polygon = Polygon(DENTED)
    assert polygon.distance(0.7, 0.5) == pytest.approx(-0.1)
    assert polygon.distance(0.7, 0.1) == pytest.approx(0.1)
    assert polygon.distance(0.45, 0.5) > 0
    assert extent(polygon) == (0.4, 0.8, 0.2, 0.8)


def test_a_file_with_polygons_is_written_and_read_again():
    scene = room(Pose(0.2, 0.5))
    text = written_scene(scene)
    assert "[[polygon]]\npoints = [[0.4, 0.2], [0.8, 0.2], [0.8, 0.8], [0.4, 0.8], [0.6, 0.5]]" in text
    assert parse(text.encode(), "world.toml").polygons == scene.polygons


def test_two_equal_corners_in_a_row_are_refused_with_their_line():
    text = b"[arena]\nsize = [1, 1]\n[[polygon]]\npoints = [[0.1, 0.1], [0.1, 0.1], [0.3, 0.3]]\n"
    with pytest.raises(SimulationError, match=r"bad\.toml:3: polygon\[0\]: the wall at .* has no length"):
        parse(text, "bad.toml")
    with pytest.raises(SimulationError, match=r"bad\.toml:4: polygon\[0\]\.points is .* 3 to 10000 places"):
        parse(text.replace(b"[0.1, 0.1], [0.1, 0.1]", b"[0.1, 0.1]"), "bad.toml")


def test_a_world_has_so_many_walls_and_sides_at_most():
    long = Polygon(tuple((0.5, 0.3 + 0.0001 * (n % 2)) for n in range(10_000)))
    with pytest.raises(ArgumentError, match="the world has 100003 walls"):
        Scene(1, 1, polygons=(*[long] * 10, Polygon(((0, 0), (0, 1), (1, 1)))))


def test_a_box_that_stands_in_a_side_is_odd():
    text = written_scene(room()) + "\n[[box]]\nposition = [0.8, 0.5]\nsize = [0.1, 0.1]\n"
    assert list(oddities(parse(text.encode(), "w.toml"))) == ["box[0] stands in polygon[0]"]
