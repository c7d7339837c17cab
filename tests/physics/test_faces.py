"""Pictures on walls and boxes, as cameras see them."""

from __future__ import annotations

import math
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from elib.base.errors import SimulationError
from elib.simulator.physics import Scene, World
from elib.simulator.physics.faces import cells_of
from elib.simulator.worlds.writer import written_scene

RED, GREEN, BLUE, WHITE = (200, 20, 20), (20, 180, 20), (20, 20, 220), (255, 255, 255)
ROOM = """
[arena]
size = [1.0, 0.6]
[epuck]
quality = "ideal"
[[robot]]
position = [0.2, 0.3]
heading = {heading}
"""
WALL = '[[wall]]\nfrom = [0.35, {}]\nto = [0.35, {}]\nheight = 0.08\ncolour = "#808080"\nface = "{}"\n'
BOX = '[[box]]\nposition = [0.4, 0.3]\nsize = [0.1, 0.1]\nheight = 0.08\ncolour = "#808080"\nface = "{}"\n'


def quarters(folder: Path) -> str:
    """Save a picture: red and green above, blue and nothing below."""
    pixels = np.zeros((40, 40, 4), np.uint8)
    for rows, columns, colour in ((0, 0, RED), (0, 20, GREEN), (20, 0, BLUE)):
        pixels[rows : rows + 20, columns : columns + 20] = (*colour, 255)
    Image.fromarray(pixels).save(folder / "quarters.png")
    return "quarters.png"


def seen(folder: Path, things: str, heading: float = 0.0) -> np.ndarray:
    """Return what a robot sees, in 80 x 60 pixels, so that the brightest one is 255."""
    file = folder / "world.toml"
    file.write_text(ROOM.format(heading=heading) + things)
    right, up = ((np.arange(count) - (count - 1) / 2) * 8 for count in (80, 60))
    picture = World(Scene.load(file)).picture(0, right, -up).astype(float)
    return picture * (255 / picture.max())


def hue(pixel: np.ndarray) -> str:
    """Return which colour a pixel has."""
    red, green, blue = (int(each) for each in pixel)
    if max(red, green, blue) - min(red, green, blue) < 40:
        return "white" if red > 180 else "grey"
    return ("red", "green", "blue")[int(np.argmax((red, green, blue)))]


def corners(picture: np.ndarray) -> list[str]:
    """Return what is seen right and left of the middle, above and below the middle of the wall."""
    return [hue(picture[row, column]) for row in (12, 32) for column in (30, 50)]


@pytest.mark.parametrize(
    "things",
    [WALL.format(0.34, 0.26, "{}"), WALL.format(0.26, 0.34, "{}"), BOX],
    ids=["wall", "wall from behind", "box"],
)
def test_a_picture_is_seen_the_right_way_round_and_is_white_where_it_is_transparent(
    things: str, tmp_path: Path
) -> None:
    assert corners(seen(tmp_path, things.format(quarters(tmp_path)))) == ["red", "green", "blue", "white"]


def test_a_picture_keeps_its_shape_in_the_middle_of_a_wider_wall(tmp_path: Path) -> None:
    picture = seen(tmp_path, WALL.format(0.4, 0.2, quarters(tmp_path)))
    assert corners(picture) == ["red", "green", "blue", "white"]
    assert [hue(picture[22, column]) for column in (3, 77)] == ["grey", "grey"]


def test_a_picture_is_seen_as_at_most_64_cells_along_its_longer_side(tmp_path: Path) -> None:
    Image.new("RGB", (400, 100), RED).save(tmp_path / "wide.jpg", quality=100)
    cells = np.array(cells_of(str(tmp_path / "wide.jpg")))
    assert cells.shape == (16, 64)
    assert np.abs(np.stack([cells >> 16, cells >> 8 & 255, cells & 255], -1) - RED).max() <= 3


def test_a_picture_that_is_written_anew_is_seen_in_the_next_world(tmp_path: Path) -> None:
    things = BOX.format(quarters(tmp_path))
    seen(tmp_path, things)
    file = tmp_path / "quarters.png"
    before = file.stat().st_mtime_ns
    Image.new("RGB", (10, 10), GREEN).save(file)
    assert file.stat().st_mtime_ns != before
    assert corners(seen(tmp_path, things)) == ["green"] * 4


def test_the_file_of_a_picture_is_asked_for_once_a_world_however_many_pictures_robots_take(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "world.toml"
    file.write_text(ROOM.format(heading=0.0) + BOX.format(quarters(tmp_path)))
    world, asked, stat = World(Scene.load(file)), [], Path.stat

    def counting(path: Path, *, follow_symlinks: bool = True) -> os.stat_result:
        asked.append(path)
        return stat(path, follow_symlinks=follow_symlinks)

    monkeypatch.setattr(Path, "stat", counting)
    counts = []
    for _ in range(3):
        assert world.picture(0, (-8.0, 0.0, 8.0), (8.0, 0.0)).any()
        counts.append(asked.count(tmp_path / "quarters.png"))
    assert counts[0] > 0
    assert counts == counts[:1] * 3


def test_a_world_with_pictures_shows_them_in_another_process_too(tmp_path: Path) -> None:
    file = tmp_path / "world.toml"
    file.write_text(ROOM.format(heading=0.0) + BOX.format(quarters(tmp_path)))
    world = World(Scene.load(file))
    look = "import pickle, sys; print(pickle.load(sys.stdin.buffer).picture(0, (-8.0, 8.0), (8.0, 0.0)).tolist())"
    again = subprocess.run([sys.executable, "-c", look], input=pickle.dumps(world), capture_output=True, check=True)
    assert again.stdout.decode() == f"{world.picture(0, (-8.0, 8.0), (8.0, 0.0)).tolist()}\n"


def test_a_world_with_pictures_is_saved_and_opens_as_it_was(tmp_path: Path) -> None:
    file = tmp_path / "world.toml"
    file.write_text(ROOM.format(heading=0.0) + WALL.format(0.34, 0.26, quarters(tmp_path)) + BOX.format("tag:3"))
    scene = Scene.load(file)
    assert (scene.walls[0].face, scene.boxes[0].face) == (str(tmp_path / "quarters.png"), "tag:3")
    (tmp_path / "elsewhere").mkdir()
    copy = tmp_path / "elsewhere" / "world.toml"
    copy.write_text(written_scene(scene))
    assert Scene.load(copy) == scene


@pytest.mark.parametrize(
    ("face", "said"),
    [
        ("nothing.png", r'box\[0\]\.face is "nothing\.png": there is no such file'),
        ("world.toml.png", r'box\[0\]\.face is "world\.toml\.png": it is not a PNG or JPEG picture'),
        ("tag:99", r"box\[0\]\.face is 'tag:99'; it must be a tag of 16h5.* or a PNG or JPEG file"),
    ],
)
def test_a_face_that_cannot_be_shown_is_refused_where_it_stands(face: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "world.toml.png").write_text("no picture")
    with pytest.raises(SimulationError, match=said):
        seen(tmp_path, BOX.format(face))


def test_robots_that_look_away_see_nothing_of_it(tmp_path: Path) -> None:
    away = seen(tmp_path, BOX.format(quarters(tmp_path)), heading=math.degrees(math.pi))
    assert not {"red", "green", "blue"} & {hue(pixel) for pixel in away.reshape(-1, 3)}
