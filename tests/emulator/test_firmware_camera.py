"""Camera windows: accepted, refused, too large."""

import random
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest

import elib
from elib.base.body import FOCAL, LENS
from elib.base.errors import ArgumentError
from elib.link.protocol import actuators
from elib.link.protocol.actuators import camera_line
from elib.link.protocol.camera import CENTRED, EPUCK1_DRIVERS, EPUCK2, PO3030, CameraDriver, CameraWindow, WindowRefused
from elib.link.protocol.colours import Hue, coloured
from elib.link.protocol.context import Context, Profile
from elib.link.protocol.profiles import PROFILES
from elib.link.protocol.quantities import CameraMode
from elib.simulator.emulator.fixed_hardware import FixedHardware
from elib.simulator.physics.optics import ABOVE
from elib.testing import EmulatedRobot, simulated

E_PUCK1 = ("btcom-1.1.3", "btcom-2.0", "asercom-1.2.2")
REQUEST = b"\xb7\0"


def picture(mode: int, width: int, height: int) -> bytes:
    return FixedHardware().picture(CameraWindow(mode, width, height, 1, 0, 0))


def header(mode: int, width: int, height: int) -> bytes:
    return bytes(value & 0xFF for value in (mode, width, height))


def window(driver: CameraDriver, *numbers: int) -> CameraWindow | None:
    mode, width, height, zoom, x, y = (*numbers, CENTRED, CENTRED)[:6]
    try:
        return driver.window(mode, width, height, zoom, x, y)
    except WindowRefused:
        return None


def refused(chip: int, numbers: Sequence[Sequence[int]]) -> list[bool]:
    """Compute which windows the firmware's driver of an e-puck1 refuses, as the dsPIC does: in unsigned 16-bit numbers.

    (lib:camera/fast_2_timer/: e_calc_po3030k.c, e_calc_po6030k.c, e_calc_po8030d.c, the files of their registers, and
    e_timers.c)
    """
    mode, width, height, zoom, x, y = np.array(numbers).T
    word = np.uint16
    x = np.where(x == CENTRED, np.fix((640 - (width * zoom).astype("int16")) / 2), x).astype(int).astype(word)
    y = np.where(y == CENTRED, np.fix((480 - (height * zoom).astype("int16")) / 2), y).astype(int).astype(word)
    across, down, step = (width * zoom).astype(word), (height * zoom).astype(word), zoom.astype(word)
    x += word({0x3030: 210, 0x6030: 80 - 64, 0x8030: 0}[chip])
    y += word({0x3030: 7, 0x6030: 8, 0x8030: 0}[chip])
    bad = x + across > word({0x3030: 210, 0x6030: 80, 0x8030: 0}[chip] + 640)
    bad |= y + down > word({0x3030: 7, 0x6030: 8, 0x8030: 0}[chip] + 480)
    bad |= (step < 1) | ~np.isin(mode, (0, 1, 2))
    step = np.maximum(step, word(1))
    bad |= (across % step != 0) | (down % step != 0)
    skip = np.where(step % 4 == 0, word(4), np.where(step % 2 == 0, word(2), word(1)))
    x -= skip
    y -= skip
    if chip == 0x3030:
        bad |= (x >= 851) | (y >= 487)
    elif chip == 0x6030:
        bad |= (x // skip >= word(721) // skip) | (y >= 488)
    else:
        first, last = x // skip + (skip > 1).astype(word), x + across // skip - word(1)
        bad |= (first >= last) | (last > 775)
    pixel = np.where(mode == 0, 1, 2)
    bad |= (across // step).astype(int) * pixel * (step // skip) + 1 > 330
    return [bool(each) for each in bad]


@pytest.mark.parametrize("chip", EPUCK1_DRIVERS, ids=hex)
def test_each_chip_of_the_e_puck1_takes_what_its_driver_takes(chip: int) -> None:
    draw = random.Random(chip)
    numbers = [
        (
            draw.choice((0, 1, 2, 3)),
            draw.randint(-3, 100) if draw.random() < 0.7 else draw.randint(-32768, 32767),
            draw.randint(-3, 60) if draw.random() < 0.9 else draw.randint(-32768, 32767),
            draw.choice((1, 2, 3, 4, 5, 6, 8, 12)) if draw.random() < 0.9 else draw.randint(-32768, 32767),
            draw.choice((CENTRED, draw.randint(-260, 20), draw.randint(300, 700), draw.randint(-32768, 32767))),
            draw.choice((CENTRED, draw.randint(-12, 5), draw.randint(300, 500), draw.randint(-32768, 32767))),
        )
        for _ in range(20_000)
    ]
    found = [window(EPUCK1_DRIVERS[chip], *each) is None for each in numbers]
    assert [each for each, a, b in zip(numbers, found, refused(chip, numbers), strict=True) if a != b] == []
    assert found.count(False) > 1000


def sizes(profile: Profile) -> Iterator[tuple[int, int, int, int]]:
    """Yield width, height, zoom and mode of every picture that the robot's memory holds, and some too large ones."""
    for mode in (CameraMode.GREY, CameraMode.COLOUR):
        for zoom in profile.zooms or range(1, 17):
            side = 640 // (min(zoom, 4) if profile.zooms else zoom) + 2
            for width in range(1, side + 1):
                highest = profile.picture_bytes // (width * (1 + mode))
                for height in range(1, min(side, highest) + 1):
                    yield width, height, zoom, mode


CHIPS = {"btcom-1.1.3": (0x3030,), "btcom-2.0": tuple(EPUCK1_DRIVERS), "asercom-1.2.2": tuple(EPUCK1_DRIVERS)}
"""The chips whose drivers each firmware has."""


def compare_with_the_robots(profile: Profile, tried: Sequence[tuple[int, int, int, int]]) -> int:
    """Check that `set_camera` takes exactly what every chip of the firmware takes; return how many that were."""
    context, taken = Context(profile), []
    for size in tried:
        try:
            taken.append(bool(camera_line(size, context)))
        except ArgumentError:
            taken.append(False)
    swaps = profile.mounting.swaps
    numbers = [(m, *((h, w) if swaps else (w, h)), z, CENTRED, CENTRED) for w, h, z, m in tried]
    if profile.name in CHIPS:
        each = zip(*(refused(chip, numbers) for chip in CHIPS[profile.name]), strict=True)
        expected = [not any(refusals) for refusals in each]
    else:  # The driver of the e-puck2 refuses a window that leaves the chip, and single lines (camera/po8030.c).
        spans = [(w * min(z, 4), h * min(z, 4)) for _, w, h, z, _, _ in numbers]
        expected = [2 <= across <= 640 and 2 <= down <= 480 for across, down in spans]
    assert [size for size, a, b in zip(tried, taken, expected, strict=True) if a != b] == []
    return sum(taken)


@pytest.mark.parametrize("firmware", PROFILES)
def test_set_camera_takes_a_drawn_size_if_every_chip_takes_it(firmware: str) -> None:
    profile, draw = PROFILES[firmware], random.Random(1)
    tried = [size for size in sizes(profile) if draw.random() < 0.004]
    tried += [(80, 40, 8, 0), (79, 40, 8, 0), (40, 80, 8, 0), (40, 79, 8, 0), (1, 40, 1, 1), (40, 1, 1, 1)]
    assert compare_with_the_robots(profile, tried) > 200


@pytest.mark.long
@pytest.mark.parametrize(
    ("firmware", "taken"),
    [("btcom-1.1.3", 137_011), ("btcom-2.0", 135_688), ("asercom-1.2.2", 123_395), ("epuck2", 90_080)],
)
def test_set_camera_takes_each_size_that_every_chip_takes_and_no_other(
    firmware: str, taken: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(actuators, "_nearest_size", lambda *_: "")  # to look for a size that fits takes longest
    assert compare_with_the_robots(PROFILES[firmware], list(sizes(PROFILES[firmware]))) == taken


@pytest.mark.parametrize(
    ("firmware", "size", "words"),
    [
        ("asercom-1.2.2", (80, 40, 8, 0), "PO8030.*less than 4 pixels.*79 x 40 pixels fit"),
        ("asercom-1.2.2", (1, 40, 1, 1), "PO8030.*too narrow.*2 x 40 pixels fit"),
        ("asercom-1.2.2", (30, 90, 6, 0), "180 x 540 pixels does not fit.*30 x 80 pixels fit"),
        ("btcom-1.1.3", (2, 165, 1, 1), "PO3030.*331 bytes of the 330.*2 x 164 pixels fit"),
        ("btcom-2.0", (40, 80, 8, 0), "PO8030.*40 x 79 pixels fit"),
        ("epuck2", (40, 1, 1, 1), "PO8030.*2 rows.*40 x 2 pixels fit"),
        ("epuck2", (1, 40, 1, 1), "PO8030.*2 columns.*2 x 40 pixels fit"),
    ],
)
def test_a_refused_size_is_told_with_the_reason_and_one_that_fits(
    firmware: str, size: tuple[int, int, int, int], words: str
) -> None:
    with pytest.raises(ArgumentError, match=f"(?s){words}"):
        camera_line(size, Context(PROFILES[firmware]))


@pytest.mark.parametrize(
    ("mode", "zoom", "widest", "widest_of_8030"),
    [  # wire-protocol.md, 3.4
        *[(1, 1, 164, 164), (1, 2, 164, 164), (1, 3, 54, 54), (1, 4, 160, 158), (1, 6, 54, 54), (1, 8, 80, 79)],
        *[(0, 1, 329, 329), (0, 2, 320, 318), (0, 3, 109, 109), (0, 4, 160, 158), (0, 8, 80, 79)],
        *[(0, 10, 64, 63), (0, 12, 53, 52), (0, 16, 40, 39)],
    ],
)
def test_the_e_puck1_accepts_widths_up_to_the_published_limits(
    mode: int, zoom: int, widest: int, widest_of_8030: int
) -> None:
    for driver, most in ((PO3030, widest), (EPUCK1_DRIVERS[0x8030], widest_of_8030)):
        accepted = [width for width in range(2, 641) if window(driver, mode, width, 1, zoom)]
        assert accepted == list(range(2, most + 1))


@pytest.mark.parametrize(
    ("chip", "line", "is_taken"),
    [
        (0x3030, b"J,0,5,60,1,-10\r", True),
        (0x3030, b"J,0,5,60,1,-210\r", False),
        (0x6030, b"J,0,81,5,8\r", True),
        (0x6030, b"J,0,88,5,8,0\r", True),
        (0x6030, b"J,0,89,5,8,0\r", False),
        (0x8030, b"J,0,80,40,8\r", False),
        (0x8030, b"J,0,79,40,8\r", True),
        (0x8030, b"J,0,79,40,8,3\r", False),
        (0x8030, b"J,0,1,60,1\r", False),
        (0x1234, b"J,0,40,40,8\r", False),
    ],
)
def test_the_robot_keeps_its_window_where_its_own_chip_refuses(chip: int, line: bytes, is_taken: bool) -> None:
    bench = EmulatedRobot("asercom-1.2.2", {"camera": chip})
    bench.send(line)
    width, height = map(int, line.split(b",")[2:4])
    shown = picture(0, width, height) if is_taken else picture(1, 40, 40)[: width * height]
    assert bench.send(REQUEST)[: 3 + len(shown)] == header(0, width, height) + shown


def test_the_e_puck2_takes_every_other_zoom_as_4_in_the_middle() -> None:
    assert window(EPUCK2, 0, 40, 40, 8, 3, 3) == CameraWindow(0, 40, 40, 4, 240, 160)
    assert window(EPUCK2, 2, 40, 40, 2, 3, 5) == CameraWindow(1, 40, 40, 2, 3, 5)
    assert window(EPUCK2, 1, 160, 120, 100) == CameraWindow(1, 160, 120, 4, 0, 0)


@pytest.mark.parametrize(
    "numbers",
    [(0, 1, 9, 1), (0, 9, 1, 1), (0, 0, 40, 8), (0, 40, 40, 0), (0, -4, 4, 4), (0, 161, 1, 8), (1, 9, 121, 8)],
)
def test_the_e_puck2_refuses_single_lines_and_what_does_not_fit(numbers: tuple[int, int, int, int]) -> None:
    assert window(EPUCK2, *numbers) is None


@pytest.mark.parametrize("firmware", E_PUCK1)
def test_after_a_refusal_the_new_numbers_frame_the_old_picture(bench: EmulatedRobot) -> None:
    bench.send(b"J,0,30,10,4\r")
    bench.send(b"J,0,20,5,0\r")
    assert bench.send(b"I\r") == b"i,0,20,5,0,100\r\n"
    assert bench.send(REQUEST) == header(0, 20, 5) + picture(0, 30, 10)[:100]


@pytest.mark.parametrize("firmware", E_PUCK1)
def test_a_larger_answer_than_the_old_picture_shows_what_was_left_in_memory(bench: EmulatedRobot) -> None:
    bench.send(b"Q" + b"y" * 400 + b"\r")
    bench.send(b"J,0,10,10,8\rJ,0,15,20,0\r")
    answer = bench.send(REQUEST)
    assert answer == header(0, 15, 20) + picture(0, 10, 10) + b"y" * 200


@pytest.mark.parametrize("firmware", E_PUCK1)
def test_the_capture_finishes_last_and_covers_what_was_chained_behind_it(bench: EmulatedRobot) -> None:
    bench.send(b"J,0,4,4,0\r")  # refused: 16 bytes announced, 3,200 come
    assert bench.send(b"\xb7\xb1\0") == header(0, 4, 4) + picture(1, 40, 40)[: 16 + 16]


@pytest.mark.parametrize("firmware", [*E_PUCK1, "epuck2"])
def test_of_two_pictures_in_one_frame_only_the_last_is_taken(bench: EmulatedRobot) -> None:
    bench.send(b"J,0,10,8,4\r")
    whole = header(0, 10, 8) + picture(0, 10, 8)
    first, second = (lambda answer: (answer[:83], answer[83:]))(bench.send(b"\xb7\xb7\0"))
    assert second == whole
    assert first != whole
    assert bench.send(b"\xaf\xb7\xaf\0") == bytes(4) + whole + bytes(4)


@pytest.mark.parametrize(
    ("firmware", "line", "settings"),
    [
        ("asercom-1.2.2", b"J,0,60,58,4,10,20\r", b"i,1,40,40,4,3200\r\n"),
        ("asercom-1.2.2", b"J,0,64,54,4\r", b"i,0,64,54,4,3456\r\n"),
        ("asercom-1.2.2", b"J,1,160,120,4\r", b"i,1,160,120,4,-27136\r\n"),
        ("epuck2", b"J,0,60,69,4\r", b"i,1,40,40,4,3200\r\n"),
        ("epuck2", b"J,0,88,47,4\r", b"i,0,88,47,4,4136\r\n"),
        ("epuck2", b"J,1,160,120,4\r", b"i,1,40,40,4,3200\r\n"),
        ("btcom-2.0", b"J,0,60,58,4,10,20\r", b"i,0,60,58,4,3480\r\n"),
    ],
)
def test_too_large_a_picture_falls_back_where_the_firmware_checks(firmware: str, line: bytes, settings: bytes) -> None:
    assert EmulatedRobot(firmware).send(line + b"I\r") == b"j\r\n" + settings


def test_the_corner_lasts_for_one_command() -> None:
    bench = EmulatedRobot("asercom-1.2.2")
    bench.send(b"J,0,10,10,4,601,0\r")  # refused
    assert bench.send(REQUEST)[3:] == picture(1, 40, 40)[:100]
    bench.send(b"J,0,10,10,4\r")
    assert bench.send(REQUEST)[3:] == picture(0, 10, 10)


@pytest.mark.parametrize(
    ("firmware", "state"),
    [(firmware, {}) for firmware in E_PUCK1]
    + [(firmware, {"camera": 0}) for firmware in ("btcom-2.0", "asercom-1.2.2")],
    ids=lambda part: part if isinstance(part, str) else ("no camera" if part else "no rows"),
)
def test_a_picture_that_never_comes_ends_the_program_silently(firmware: str, state: dict[str, object]) -> None:
    bench = EmulatedRobot(firmware, state)
    if not state:
        bench.send(b"J,0,4,0,8\r")
    assert bench.send(REQUEST) == b""
    assert bench.send(b"C\r") == b""


@pytest.mark.parametrize("chip", [0x3030, 0x6030, 0x8030, 0x1234, 0])
def test_btcom_1_1_3_sends_pictures_whatever_chip_the_camera_reports(chip: int) -> None:
    bench = EmulatedRobot("btcom-1.1.3", {"camera": chip})
    assert bench.send(REQUEST) == header(1, 40, 40) + picture(1, 40, 40)
    assert bench.send(b"C\r") == b"c,3\r\n"


@pytest.mark.parametrize(
    ("firmware", "line"), [("epuck2", b"J,0,-4,4,4\r"), *[(name, b"J,0,40,-1,8\r") for name in E_PUCK1]]
)
def test_a_negative_picture_ends_the_program_silently(firmware: str, line: bytes) -> None:
    bench = EmulatedRobot(firmware)
    bench.send(line)
    assert bench.send(REQUEST + b"C\r") == b""


@pytest.mark.parametrize("firmware", E_PUCK1)
def test_a_camera_set_up_darkens_the_robot(bench: EmulatedRobot) -> None:
    bench.send(b"L,8,1\rB,1\rF,1\rJ,9\r")
    assert (bench.hardware["led"], bench.hardware["body"], bench.hardware["front"]) == ([0] * 8, 0, 0)


RED_BOX = """
[arena]
size = [2.0, 2.0]

[epuck]
sensor_noise = 0.0

[[box]]
position = [1.35, 1.05]
size = [0.1, 0.06]
height = 0.05
colour = "#a00000"

[[robot]]
position = [1.0, 1.0]
heading = 0
"""


@pytest.mark.parametrize("firmware", sorted(PROFILES))
@pytest.mark.parametrize("mode", [CameraMode.GREY, CameraMode.COLOUR])
def test_every_robot_shows_a_box_upright_where_geometry_says(firmware: str, mode: CameraMode, tmp_path: Path) -> None:
    path = tmp_path / "box.toml"
    path.write_text(RED_BOX)

    @simulated
    async def look() -> elib.Image:
        async with elib.open(f"sim://{path}?speed=max&quality=ideal&firmware={firmware}") as robot:
            await robot.set_camera(40, 40, 4, mode)
            return await robot.image()

    pixels = look().pixels
    assert pixels.shape[:2] == (40, 40)
    # Red is the darkest grey there is here.
    box = pixels < np.median(pixels) - 12 if mode is CameraMode.GREY else coloured(pixels, Hue.RED)
    rows, columns = np.nonzero(box)
    depth, scale = 0.3 - LENS, FOCAL / 4
    left, right = 19.5 - scale * 0.08 / depth, 19.5 - scale * 0.02 / (depth + 0.1)  # The latter of its far corner.
    top, foot = 19.5 - scale * (0.05 - ABOVE) / depth, 19.5 + scale * ABOVE / depth
    assert (rows.min(), rows.max()) == pytest.approx((top, foot), abs=1)
    assert (columns.min(), columns.max()) == pytest.approx((max(left, 0), right), abs=1)
