"""The line on the floor, and edges, in pictures as cameras take them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import elib
from elib.base.body import FOCAL
from elib.link.protocol.lines import edges, line
from elib.simulator.physics.optics import ABOVE
from elib.testing import world_of


def floor(first: int, last: int, *, of: int = 150, shows: int = 40, noise: float = 2.0) -> NDArray[np.uint8]:
    """Return 40 x 40 pixels of a floor whose columns from *first* up to *last* are a line."""
    pixels = np.full((40, 40), of, np.float32)
    pixels[:, first:last] = shows
    return np.clip(pixels + np.random.default_rng(1).normal(0, noise, (40, 40)), 0, 255).astype(np.uint8)


def test_the_middle_of_the_line_is_found_dark_or_bright_in_a_dim_or_a_bright_room() -> None:
    for of, shows in ((150, 40), (30, 12), (250, 200)):
        assert line(floor(10, 15, of=of, shows=shows, noise=1)) == pytest.approx(12, abs=0.2)
    assert line(floor(30, 40, of=60, shows=120), is_bright=True) == pytest.approx(34.5, abs=0.2)


def test_a_floor_without_a_line_has_none() -> None:
    assert line(floor(0, 0)) is None
    assert line(floor(10, 15, of=40, shows=120)) is None, "a bright line is no dark one"
    assert line(floor(10, 15, of=150, shows=140)) is None, "that is noise"


def test_a_row_that_lost_a_byte_neither_hides_nor_shows_a_line() -> None:
    torn = floor(10, 15)
    torn[36] = np.roll(torn[36], 9)
    assert line(torn) == pytest.approx(12, abs=0.2)
    torn = floor(0, 0)
    torn[37, 8:30] = 0
    assert line(torn) is None


@pytest.mark.parametrize("firmware", ["asercom-1.2.2", "epuck2"])
@pytest.mark.parametrize("aside", [-0.02, 0.0, 0.02])
def test_the_camera_shows_the_bearing_of_a_line_ahead(firmware: str, aside: float, tmp_path: Path) -> None:
    world = tmp_path / "line.toml"
    stripe = '[[stripe]]\npoints = [[0.1, 0.5], [0.9, 0.5]]\nwidth = 0.015\ncolour = "#101010"\n'
    world.write_text(f"[arena]\nsize = [1, 1]\n\n[[robot]]\nposition = [0.3, 0.5]\n\n{stripe}", "utf-8")
    with elib.connect(f"sim://{world}?speed=max&firmware={firmware}&quality=typical&seed=2") as robot:
        world_of(robot).move_robot(0, elib.Pose(0.3, 0.5 - aside, 0.0))
        robot.set_camera(40, 40, 8, "grey")
        picture = robot.image()
        found = picture.line()
        assert found is not None
        ahead = ABOVE / (0.375 * picture.height * picture.zoom / FOCAL)  # in the middle of the lowest quarter
        assert found == pytest.approx(math.atan2(aside, ahead), abs=0.03)
        assert picture.line(is_bright=True) is None


def test_edges_are_where_the_brightness_changes() -> None:
    pixels = np.zeros((6, 8, 3), np.uint8)
    pixels[:, 4:] = 90
    found = edges(pixels)
    assert found.shape == (6, 8)
    assert found[2].tolist() == [0, 0, 0, 45, 45, 0, 0, 0]
    assert not edges(pixels[:1]).any(), "one row has no edges up and down"
