"""Maps of squares: from readings, from worlds, in files, and as worlds."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import elib
from elib.base.body import SENSOR_RADIUS
from elib.base.errors import ArgumentError
from elib.maps.grid import KNOWN, rectangles
from elib.simulator.physics import Box, Cylinder, Scene, Wall
from elib.simulator.physics.geometry import Polygon
from elib.testing import simulation_of

NOTHING = [math.inf] * 8


def seeing(grid: elib.Grid, pose: elib.Pose, distances: list[float], times: int = 3) -> elib.Grid:
    """Return *grid* after it got a reading several times."""
    for _ in range(times):
        grid.add(pose, distances)
    return grid


def test_a_new_map_knows_nothing_and_grows_with_what_is_added() -> None:
    grid = elib.Grid()
    assert grid.odds.size == 0
    assert not grid.is_free(0, 0)
    for x in (0.0, 1.0, -2.0):
        assert seeing(grid, elib.Pose(x, 0.3), NOTHING).is_free(x, 0.3)
    assert grid.is_free(0.0, 0.3), "what it knew before it keeps"


def test_a_reading_says_that_something_is_there_and_nothing_before_it() -> None:
    left = [*NOTHING[:5], 0.03, math.inf, math.inf]
    grid = seeing(elib.Grid(), elib.Pose(0.2, 0.1, math.pi / 2), left)
    wall = 0.2 - SENSOR_RADIUS - 0.03
    assert grid.is_occupied(wall, 0.1)
    assert grid.is_free(wall + 0.015, 0.1)
    assert not grid.is_free(wall - 0.02, 0.1), "what is behind it is not known"
    assert not grid.is_occupied(wall - 0.02, 0.1)


def test_nothing_seen_says_that_nothing_is_nearer_than_5_cm() -> None:
    grid = seeing(elib.Grid(), elib.Pose(0, 0), NOTHING)
    assert grid.is_free(0, SENSOR_RADIUS + 0.04)
    assert not grid.is_free(0, SENSOR_RADIUS + 0.07)
    assert not grid.occupied.any()


def test_what_is_taken_away_is_forgotten_and_where_the_robot_stands_is_nothing_else() -> None:
    ahead = [0.02, *NOTHING[:6], 0.02]
    grid = seeing(elib.Grid(), elib.Pose(0, 0), ahead, times=50)
    assert grid.is_occupied(0.05, 0.02)
    seeing(grid, elib.Pose(0.03, 0), NOTHING, times=8)
    assert grid.is_free(0.05, 0.02)


def test_a_robot_draws_the_wall_that_it_drives_along() -> None:
    grid = elib.Grid()
    with elib.connect("sim://square?speed=max&quality=ideal") as robot:
        start = simulation_of(robot).world.pose(0)
        robot.set_pose(start.x, start.y, start.heading)
        robot.distances()  # so that the sensors are known where nothing is near
        robot.go_to(0.5, 0.07, heading=0.0)
        for _ in range(20):
            robot.drive(0.01)
            grid.add(robot.pose(), robot.distances())
    for x in (0.56, 0.6, 0.64, 0.68):
        rows = np.nonzero(grid.occupied[:, grid.square(x, 0)[1]])[0]
        assert rows.size
        assert grid.place(int(rows.mean()), 0)[1] == pytest.approx(0, abs=0.012)
        assert grid.is_free(x, 0.03)


def test_a_world_as_a_map_has_its_walls_boxes_cylinders_and_polygons() -> None:
    scene = Scene(
        1.0,
        0.6,
        walls=(Wall(0.2, 0.1, 0.5, 0.4),),
        boxes=(Box(0.7, 0.3, 0.1, 0.04, angle=math.pi / 2),),
        cylinders=(Cylinder(0.2, 0.5, 0.03),),
        polygons=(Polygon(((0.6, 0.45), (0.9, 0.45), (0.9, 0.55), (0.75, 0.48), (0.6, 0.55))),),
    )
    for world in (scene, elib.World(scene)):
        grid = elib.Grid.of_world(world)
        assert grid.odds.shape == (61, 101)
        for x, y in ((0, 0.3), (1, 0.3), (0.5, 0.6), (0.35, 0.25), (0.7, 0.34), (0.7, 0.3), (0.2, 0.5), (0.22, 0.5)):
            assert grid.is_occupied(x, y), (x, y)
        for x, y in ((0.1, 0.1), (0.35, 0.3), (0.74, 0.3), (0.2, 0.45)):
            assert grid.is_free(x, y), (x, y)
        for x, y in np.ndindex(101, 61):  # the inside of a polygon is not free, its dents are
            is_inside = scene.polygons[0].distance(x / 100, y / 100) < 0
            assert not is_inside or grid.is_occupied(x / 100, y / 100), (x, y)
        assert grid.is_free(0.75, 0.52)
    assert elib.Grid.of_world("maze", 0.02).odds.shape == (71, 71)


def test_clearance_is_the_distance_from_the_nearest_thing_up_to_a_limit() -> None:
    grid = elib.Grid.of_world(Scene(0.4, 0.4))
    room = grid.clearance(0.08)
    assert room[5, 20] == pytest.approx(0.05)
    assert room[3, 4] == pytest.approx(0.03)
    assert room[20, 20] == pytest.approx(0.08)


def test_a_saved_map_opens_as_the_same_map(tmp_path: Path) -> None:
    grid = seeing(elib.Grid(0.02), elib.Pose(-0.3, 0.2, 1.0), [0.02, *NOTHING[:7]])
    grid.save(tmp_path / "room.png")
    again = elib.Grid.open(tmp_path / "room.png")
    assert (again.cell, again.x, again.y) == (grid.cell, grid.x, grid.y)
    assert np.allclose(again.odds, grid.odds, atol=0.25)
    sure = np.abs(np.abs(grid.odds) - KNOWN) > 0.02
    assert (again.occupied == grid.occupied)[sure].all()
    assert (again.free == grid.free)[sure].all()


def test_files_that_are_no_map_are_named_with_what_to_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    picture, beside = tmp_path / "room.png", tmp_path / "room.toml"
    with pytest.raises(ArgumentError, match=r"room.png cannot be read"):
        elib.Grid.open(picture)
    picture.write_bytes(b"no picture")
    with pytest.raises(ArgumentError, match=r"room.toml cannot be read"):
        elib.Grid.open(picture)
    for text in ("cell = 0.01", "cell = 0.01\norigin = 3", "origin = [0, 0]\ncell = 5.0", "["):
        beside.write_text(text)
        with pytest.raises(ArgumentError):
            elib.Grid.open(picture)
    beside.write_text("cell = 0.01\norigin = [0.0, 0.0]\n")
    with pytest.raises(ArgumentError, match="is not a picture"):
        elib.Grid.open(picture)
    with monkeypatch.context() as patch:
        patch.setattr(Image, "MAX_IMAGE_PIXELS", 10)  # Pillow refuses a picture of more than twice as many.
        Image.new("L", (8, 8)).save(picture)
        with pytest.raises(ArgumentError, match="has too many pixels"):
            elib.Grid.open(picture)
        Image.new("L", (4, 4)).save(picture)
        assert elib.Grid.open(picture).odds.shape == (4, 4)  # Pillow warns of it; that would be an error here.
    Image.new("RGB", (8, 8), (200, 30, 30)).save(picture)
    with pytest.raises(ArgumentError, match="has colours"):
        elib.Grid.open(picture)
    with pytest.raises(ArgumentError, match=r"room.jpg does not end in .png"):
        elib.Grid().save(tmp_path / "room.jpg")
    with pytest.raises(ArgumentError, match="cell"):
        elib.Grid(1.0)


def test_a_name_in_place_of_a_map_is_refused_with_what_opens_it() -> None:
    with pytest.raises(ArgumentError) as caught:
        elib.Localiser("explored.png")  # type: ignore[arg-type]
    assert "elib.Grid.open" in str(caught.value.hint)
    with elib.connect("sim://square?speed=max") as robot, pytest.raises(ArgumentError, match=r"must be an elib\.Grid"):
        robot.go_to(0.1, 0.1, map="explored.png")  # type: ignore[arg-type]


def test_a_map_becomes_a_world_with_the_same_walls(tmp_path: Path) -> None:
    grid = elib.Grid.of_world("maze")
    grid.to_world(tmp_path / "copy.toml")
    scene = Scene.load(tmp_path / "copy.toml")
    assert len(scene.boxes) < 100, "squares are joined"
    again = elib.Grid.of_world(scene)
    place = grid.square(0.1, 0.1)
    assert again.free[place]
    grown = grid.clearance(0.03) < 0.02
    assert not (again.occupied[:141, :141] & ~grown).any()
    with elib.connect(f"sim://{tmp_path / 'copy.toml'}?speed=max") as robot:
        assert robot.selector().position >= 0


def test_rectangles_cover_what_is_taken_and_nothing_twice() -> None:
    taken = np.random.default_rng(1).random((20, 30)) < 0.6
    count = np.zeros(taken.shape, int)
    for row, column, tall, wide in rectangles(taken):
        count[row : row + tall, column : column + wide] += 1
    assert (count == taken).all()


def test_a_pose_far_away_is_an_error_and_not_a_map_that_fills_the_memory() -> None:
    grid = seeing(elib.Grid(0.002), elib.Pose(0, 0), NOTHING)
    with pytest.raises(ArgumentError, match="too large"):
        grid.add(elib.Pose(50, 50), NOTHING)


def test_a_world_that_is_too_large_for_a_map_is_refused_with_what_helps() -> None:
    with pytest.raises(
        ArgumentError, match=r"a world of 25 x 20 m makes 2501 x 2001 squares: too large a map"
    ) as caught:
        elib.Grid.of_world(Scene(25, 20))
    assert caught.value.hint == "larger squares make a larger map: elib.Grid.of_world(world, 0.02)"
    assert elib.Grid.of_world(Scene(25, 20), 0.1).odds.shape == (201, 251)
