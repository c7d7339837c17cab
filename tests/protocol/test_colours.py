"""Things of one colour in pictures as real cameras take them: washed out, with a cast, with noise and lost bytes."""

from __future__ import annotations

import colorsys
import os
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from elib.base.errors import ArgumentError
from elib.behaviours.follow_ball import find_ball
from elib.link.protocol.colours import MIN_SHARE, Blob, Grey, Hue, blobs, coloured
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode

Pixels = NDArray[np.uint8]
GREY = (120, 120, 120)


def find(pixels: Pixels, hue: Hue, *, smallest: float = MIN_SHARE, grey: Grey | None = None) -> Blob | None:
    """Return the largest area of a colour."""
    return next(iter(blobs(pixels, hue, float, smallest=smallest, grey=grey)), None)


def picture(*spans: tuple[int, int], colour: tuple[int, int, int], room: tuple[int, int, int] = GREY) -> Pixels:
    """Return 40 x 40 pixels of a room in which these columns, from and up to, have a colour in the rows 10 to 29."""
    pixels = np.full((40, 40, 3), room, np.uint8)
    for first, last in spans:
        pixels[10:30, first:last] = colour
    return pixels


def paint(hue: int, saturation: float, brightness: float = 0.8) -> tuple[int, int, int]:
    """Return red, green and blue."""
    red, green, blue = (round(255 * part) for part in colorsys.hsv_to_rgb(hue / 360, saturation, brightness))
    return red, green, blue


@pytest.mark.parametrize("saturation", [0.22, 0.45, 0.9])
def test_the_colour_of_each_hue_is_its_own_and_no_others_however_washed_out(saturation: float) -> None:
    for hue in Hue:
        pixels = picture((10, 20), colour=paint(hue, saturation))
        assert {other for other in Hue if coloured(pixels, other).any()} == {hue}


def test_black_grey_and_white_have_no_colour() -> None:
    for colour in (GREY, (0, 0, 0), (22, 4, 4), (255, 255, 255), (128, 120, 120)):
        assert not any(coloured(picture((5, 9), colour=colour), hue).any() for hue in Hue)


def test_in_the_dark_two_steps_of_rgb565_are_a_colour_and_less_is_none() -> None:
    for others, has_colour in ((24, True), (25, False)):
        assert coloured(picture((5, 9), colour=(40, others, others)), Hue.RED).any() == has_colour


@pytest.mark.parametrize("gains", list(product((0.85, 1.0, 1.15), repeat=3)))
def test_a_colour_is_judged_beside_the_grey_of_the_picture(gains: tuple[float, float, float]) -> None:
    for hue in Hue:
        pixels = np.round(picture((10, 20), colour=paint(hue, 0.45)) * np.array(gains)).astype(np.uint8)
        assert {other for other in Hue if coloured(pixels, other).any()} == {hue}


def test_the_largest_area_that_hangs_together_is_found_and_less_than_half_a_percent_is_noise() -> None:
    blob = find(picture((3, 6), (20, 30), (34, 40), colour=(200, 30, 30)), Hue.RED)
    assert blob == (200, 24.5, 19.5, 20, 29, 0.125, 24.5, -10.0)
    speck = picture(colour=GREY)
    speck[5, 10:17] = (200, 30, 30)
    assert find(speck, Hue.RED) is None
    speck[6, 16] = (200, 30, 30)
    blob = find(speck, Hue.RED)
    assert blob is not None
    assert blob[:5] == (8, pytest.approx(13.4, abs=0.1), pytest.approx(5.1, abs=0.1), 10, 16)


def test_all_areas_that_count_come_the_largest_first() -> None:
    pixels = picture((3, 6), (20, 30), (34, 40), colour=(200, 30, 30))
    assert [(each.left, each.pixels) for each in blobs(pixels, Hue.RED, float)] == [(20, 200), (34, 120), (3, 60)]
    assert [each.left for each in blobs(pixels, Hue.RED, float, smallest=0.05)] == [20, 34]
    assert blobs(pixels, Hue.BLUE, float) == []


def test_areas_of_any_shape_are_counted_as_one_by_one() -> None:
    chance = np.random.default_rng(1)
    for _ in range(50):
        pixels = np.full((12, 15, 3), GREY, np.uint8)
        pixels[chance.random((12, 15)) < 0.55] = (200, 30, 30)
        mask, largest = coloured(pixels, Hue.RED), 0
        left = set(zip(*map(np.ndarray.tolist, mask.nonzero()), strict=True))
        while left:
            edge, size = [left.pop()], 0
            while edge:
                row, column = edge.pop()
                size += 1
                around = {(row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)} & left
                left -= around
                edge += around
            largest = max(largest, size)
        blob = find(pixels, Hue.RED, smallest=0.0)
        assert (blob.pixels if blob else 0) == largest


@pytest.mark.parametrize("turned", [False, True])
def test_a_row_that_lost_a_byte_is_neither_a_thing_nor_does_it_part_one(turned: bool) -> None:
    def torn(pixels: Pixels, colour: tuple[int, int, int]) -> Pixels:
        pixels[20] = colour
        return np.ascontiguousarray(pixels.transpose(1, 0, 2)) if turned else pixels

    assert find(torn(picture(colour=GREY), (200, 30, 160)), Hue.RED) is None
    blob = find(torn(picture((10, 20), colour=(200, 30, 30)), (30, 160, 220)), Hue.RED)
    assert blob is not None
    assert blob.pixels == 200


def test_a_pale_thing_that_fills_a_picture_is_not_taken_for_grey_after_others_showed_the_room() -> None:
    pale = picture((0, 38), colour=(140, 180, 170), room=(180, 180, 178))
    pale[:, :38] = (140, 180, 170)
    assert find(pale, Hue.RED) is not None
    grey = Grey()
    assert find(picture(colour=GREY), Hue.RED, grey=grey) is None
    assert find(pale, Hue.RED, grey=grey) is None


def test_an_image_finds_colours_by_name_and_teaches_the_others() -> None:
    red = 25 << 11 | 8 << 5 | 4
    image = Image(CameraMode.COLOUR, 10, 10, (red.to_bytes(2, "big") * 3 + (0x8410).to_bytes(2, "big") * 7) * 10)
    red = image.find("red")
    assert red is not None
    assert red[:6] == (30, 1.0, 4.5, 0, 2, 0.3)
    assert (red.bearing, red.width) == (image.bearing(1), image.bearing(-0.5) - image.bearing(2.5))
    assert image.find("Blue") is None
    with pytest.raises(ArgumentError, match="no colour 'pink'") as caught:
        image.find("pink")
    assert "red, orange, yellow, green, blue" in caught.value.hint
    with pytest.raises(ArgumentError, match="has no colours") as caught:
        Image(CameraMode.GREY, 10, 10, bytes(100)).find("red")
    assert "COLOUR" in caught.value.hint


# -- pictures of real robots -------------------------------------------------------------------------------------------

REAL = os.environ.get("ELIB_REAL_PICTURES", "")
"""A folder with pictures of real robots: elib may not ship them, because their authors state no licence."""
needs_real = pytest.mark.skipif(not REAL, reason="ELIB_REAL_PICTURES does not name the folder with real pictures")
RED = {1: range(18, 49), 2: range(16, 57), 3: range(0)}
"""In which pictures of each record of an e-puck1 a red bucket stands, by frame number. In the third it is blue."""
NEITHER = {1: {16, 50}, 2: {14, 15, 57, 58}, 3: set[int]()}
"""Those whose edge a bucket may or may not touch."""


def recorded() -> Iterator[tuple[int, int, Image]]:
    """Yield record, frame and picture."""
    for record in RED:
        with np.load(Path(REAL) / f"camera_epuck1_40x40_rgb565be_record{record}.npz") as kept:
            for frame, raw in zip(kept["frame"].tolist(), kept["raw"], strict=True):
                yield record, frame, Image(CameraMode.COLOUR, 40, 40, raw.tobytes())


@needs_real
def test_on_real_pictures_of_an_e_puck1_each_red_bucket_is_found_and_nothing_else() -> None:
    right = {True: 0, False: 0}
    for record, frame, picture in recorded():
        if frame in NEITHER[record]:
            continue
        is_there = frame in RED[record]
        assert (picture.find("red") is not None) == is_there, (record, frame)
        right[is_there] += 1
    assert min(right.values()) >= 30


@needs_real
def test_follow_ball_sees_the_red_and_the_blue_bucket_of_real_pictures_where_they_are() -> None:
    for record, frame, picture in recorded():
        for hue, is_there in ((Hue.RED, frame in RED[record]), (Hue.BLUE, record == 3)):
            seen, ball = picture.find(hue.name), find_ball(picture, hue)
            if not is_there:
                assert ball is None or frame in NEITHER[record], (record, frame, hue)
            elif seen is not None and seen.right > seen.left + 1:  # Not the bare edge of a bucket.
                assert ball is not None, (record, frame, hue)
                assert ball.bearing == pytest.approx(picture.bearing((seen.left + seen.right) / 2), abs=0.03)


@needs_real
def test_on_real_pictures_of_two_e_puck2_a_blue_block_is_blue_and_nothing_is_red() -> None:
    paths = sorted(Path(REAL).glob("camera_epuck2_160x120_*.npz"))
    assert len(paths) >= 3
    for path in paths:
        with np.load(path) as kept:
            for pixels in kept["rgb"]:
                assert find(pixels, Hue.BLUE) is not None
                assert all(find(pixels, hue) is None for hue in Hue if hue is not Hue.BLUE)
