"""AprilTags: on sheets, on the walls of worlds, and in the pictures of robots."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import pytest

import elib
from elib.base.body import LENS
from elib.base.tags import FACES, FAMILIES, cells, face_cells
from elib.link.protocol import tags
from elib.simulator.physics import Box, Wall
from elib.simulator.worlds.files import parse_file
from elib.simulator.worlds.writer import written_scene
from elib.testing import world_of

WORLD = """
[arena]
size = [2.0, 2.0]

[[robot]]
position = [0.5, 1.0]

[[wall]]
from = [1.0, 0.96]
to = [1.0, 1.04]
height = 0.08
face = "{face}"
"""


def looking(folder: Path, face: str, *, firmware: str = "epuck2-wifi", keys: str = "quality=typical&seed=1") -> str:
    """Return the URL of a robot before a wall that shows something."""
    world = folder / "tag.toml"
    world.write_text(WORLD.format(face=face), "utf-8")
    return f"sim://{world}?speed=max&firmware={firmware}&{keys}"


def place(robot: elib.BlockingEpuck, distance: float, bearing: float = 0.0, aslant: float = 0.0) -> None:
    """Put a robot where its lens is so far from the middle of the wall, and sees it at a bearing."""
    heading = aslant - bearing
    x, y = 1.0 - distance * math.cos(aslant), 1.0 - distance * math.sin(aslant)
    pose = elib.Pose(x - LENS * math.cos(heading), y - LENS * math.sin(heading), heading)
    world_of(robot).move_robot(0, pose)


@pytest.mark.parametrize(("face", "family", "black"), [("tag:7", "16h5", 0.06), ("tag36h11:42", "36h11", 0.064)])
def test_a_tag_of_a_wall_is_read_where_it_is(face: str, family: str, black: float, tmp_path: Path) -> None:
    with elib.connect(looking(tmp_path, face)) as robot:
        for distance, bearing, aslant in ((0.2, 0.1, 0.0), (0.4, -0.2, 0.5), (0.5, 0.0, -0.8)):
            place(robot, distance, bearing, aslant)
            (tag,) = robot.tags(black, family=family)
            assert tag.number == int(face.partition(":")[2])
            assert tag.distance == pytest.approx(distance, rel=0.02)
            assert tag.bearing == pytest.approx(bearing, abs=0.003)
            assert abs(tag.distance - distance) < tag.distance_error
            assert robot.tags(black, family="36h11" if family == "16h5" else "16h5") == []


def test_a_small_picture_of_an_e_puck1_shows_tags_too(tmp_path: Path) -> None:
    with elib.connect(looking(tmp_path, "tag:29", firmware="asercom-1.2.2")) as robot:
        place(robot, 0.4, 0.05)
        assert [tag.number for tag in robot.image().tags(0.06)] == [29]


def test_both_sides_of_a_wall_and_all_sides_of_a_box_show_their_tag_the_right_way_round(tmp_path: Path) -> None:
    with elib.connect(looking(tmp_path, "tag:3")) as robot:
        world_of(robot).move_robot(0, elib.Pose(1.4, 1.0, math.pi))
        assert [tag.number for tag in robot.tags(0.06)] == [3]
        world_of(robot).add_box(Box(0.5, 0.5, 0.08, 0.08, height=0.08, face="tag:4"))
        for k in range(4):
            angle = k * math.pi / 2
            there = elib.Pose(0.5 - 0.35 * math.cos(angle), 0.5 - 0.35 * math.sin(angle), angle)
            world_of(robot).move_robot(0, there)
            assert [tag.number for tag in robot.tags(0.06) if tag.distance < 0.4] == [4]


def test_the_nearest_tag_comes_first_and_a_wrong_family_or_size_is_refused(tmp_path: Path) -> None:
    with elib.connect(looking(tmp_path, "tag:1")) as robot:
        place(robot, 0.45)
        world_of(robot).add_wall(Wall(0.85, 1.06, 0.85, 1.14, 0.08, face="tag:2"))
        assert [tag.number for tag in robot.tags(0.06)] == [2, 1]
        with pytest.raises(elib.ArgumentError, match="no family '25h9'") as caught:
            robot.tags(0.06, family="25h9")
        assert "16h5, 36h11" in caught.value.hint
        with pytest.raises(elib.ArgumentError, match="no family"):
            robot.image().tags(0.06, family=["16h5"])  # type: ignore[arg-type]
        with pytest.raises(elib.ArgumentError, match="size is 60"):
            robot.tags(60)
        with pytest.raises(elib.ArgumentError, match="size is 60"):
            robot.image().tags(60)


def test_the_cells_are_those_of_opencv() -> None:
    import cv2

    for family, (side, known) in FAMILIES.items():
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_APRILTAG_{family}"))
        for number in range(len(known)):
            drawn = cv2.aruco.generateImageMarker(dictionary, number, side + 2) > 0
            assert cells(family, number) == drawn.tolist(), (family, number)


def test_without_opencv_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    tags._detector.cache_clear()
    monkeypatch.setitem(sys.modules, "cv2", None)
    with elib.connect("sim://?speed=max") as robot, pytest.raises(elib.Unsupported, match="opencv") as caught:
        robot.tags(0.06)
    assert "vision" in caught.value.hint


def test_each_face_has_a_white_rim_around_a_black_one() -> None:
    for face in FACES[1:]:
        found = face_cells(face)
        assert len({len(found), *map(len, found)}) == 1
        edge = [*found[0], *found[-1], *(row[0] for row in found), *(row[-1] for row in found)]
        assert all(edge)
        assert not any([*found[1][1:-1], *(row[1] for row in found[1:-1])])


def test_a_world_keeps_the_faces_of_its_walls_and_boxes() -> None:
    text = WORLD.format(face="tag:7") + '\n[[box]]\nposition = [0.3, 0.3]\nsize = [0.1, 0.1]\nface = "tag36h11:99"\n'
    scene = parse_file(text.encode(), "tags.toml").scene
    assert (scene.walls[0].face, scene.boxes[0].face) == ("tag:7", "tag36h11:99")
    again = parse_file(written_scene(scene).encode(), "tags.toml").scene
    assert again == scene
    with pytest.raises(elib.SimulationError, match="face is 'tag:30'; it must be a tag of 16h5"):
        parse_file(WORLD.format(face="tag:30").encode(), "tags.toml")
