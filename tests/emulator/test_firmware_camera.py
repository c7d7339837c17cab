"""Camera windows: accepted, refused, too large."""

from pathlib import Path

import numpy as np
import pytest

import elib
from elib.emulator.camera import epuck1_window, epuck2_window, subsampling
from elib.emulator.fixed_hardware import FixedHardware
from elib.emulator.hardware import CameraWindow
from elib.physics.sensors.camera import ABOVE, FOCAL, FORWARD
from elib.protocol.profiles import PROFILES
from elib.protocol.quantities import CameraMode
from elib.testing import EmulatedRobot, simulated

E_PUCK1 = ("btcom-1.1.3", "btcom-2.0", "asercom-1.2.2")
REQUEST = b"\xb7\0"


def picture(mode: int, width: int, height: int) -> bytes:
    return FixedHardware().picture(CameraWindow(mode, width, height, 1, 0, 0))


def header(mode: int, width: int, height: int) -> bytes:
    return bytes(value & 0xFF for value in (mode, width, height))


@pytest.mark.parametrize(("zoom", "kept"), [(1, 1), (2, 1), (3, 3), (4, 1), (6, 3), (8, 2), (10, 5), (12, 3)])
def test_the_camera_skips_by_4_or_2_and_the_driver_does_the_rest(zoom: int, kept: int) -> None:
    assert subsampling(zoom) == kept


@pytest.mark.parametrize(
    ("mode", "zoom", "widest"),
    [  # wire-protocol.md, 3.4
        *[(1, 1, 164), (1, 2, 164), (1, 3, 54), (1, 4, 160), (1, 6, 54), (1, 8, 80)],
        *[(0, 1, 329), (0, 2, 320), (0, 3, 109), (0, 4, 160), (0, 8, 80)],
    ],
)
def test_the_e_puck1_accepts_widths_up_to_the_published_limits(mode: int, zoom: int, widest: int) -> None:
    accepted = [width for width in range(1, 641) if epuck1_window(mode, width, 1, zoom)]
    assert accepted == list(range(1, widest + 1))


@pytest.mark.parametrize("zoom", [1, 3, 4, 8, 16])
def test_heights_go_to_480_over_zoom(zoom: int) -> None:
    assert epuck1_window(0, 1, 480 // zoom, zoom) is not None
    assert epuck1_window(0, 1, 480 // zoom + 1, zoom) is None


@pytest.mark.parametrize(
    "numbers", [(3, 40, 40, 8), (-1, 40, 40, 8), (0, 40, 40, 0), (0, 40, 40, -8), (0, -40, 40, 8), (1, 40, -1, 8)]
)
def test_the_e_puck1_refuses_other_modes_and_anything_negative(numbers: tuple[int, int, int, int]) -> None:
    assert epuck1_window(*numbers) is None


def test_a_corner_must_leave_room_for_the_window() -> None:
    assert epuck1_window(0, 10, 10, 4, 600, 440) == CameraWindow(0, 10, 10, 4, 600, 440)
    assert epuck1_window(0, 10, 10, 4, 601, 440) is None
    assert epuck1_window(0, 10, 10, 4, 600, 441) is None
    assert epuck1_window(0, 10, 10, 4, -2, 0) is None
    assert epuck1_window(0, 10, 10, 4, 0, -1) == CameraWindow(0, 10, 10, 4, 0, 220)


def test_the_e_puck2_takes_every_other_zoom_as_4_in_the_middle() -> None:
    assert epuck2_window(0, 40, 40, 8, 3, 3) == CameraWindow(0, 40, 40, 4, 240, 160)
    assert epuck2_window(2, 40, 40, 2, 3, 5) == CameraWindow(1, 40, 40, 2, 3, 5)
    assert epuck2_window(1, 160, 120, 100) == CameraWindow(1, 160, 120, 4, 0, 0)


@pytest.mark.parametrize(
    "numbers",
    [(0, 1, 9, 1), (0, 9, 1, 1), (0, 0, 40, 8), (0, 40, 40, 0), (0, -4, 4, 4), (0, 161, 1, 8), (1, 9, 121, 8)],
)
def test_the_e_puck2_refuses_single_lines_and_what_does_not_fit(numbers: tuple[int, int, int, int]) -> None:
    assert epuck2_window(*numbers) is None


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


def test_a_negative_picture_ends_the_e_puck2s_program_silently() -> None:
    bench = EmulatedRobot("epuck2")
    bench.send(b"J,0,-4,4,4\r")
    assert bench.send(REQUEST + b"C\r") == b""


@pytest.mark.parametrize("firmware", E_PUCK1)
def test_a_camera_set_up_darkens_the_robot(bench: EmulatedRobot) -> None:
    bench.send(b"L,8,1\rB,1\rF,1\rJ,9\r")
    assert (bench.hardware["led"], bench.hardware["body"], bench.hardware["front"]) == ([0] * 8, 0, 0)


RED_BOX = """
[arena]
size = [2.0, 2.0]

[[box]]
position = [1.35, 1.05]
size = [0.1, 0.06]
height = 0.06
colour = "#ff0000"

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
        async with elib.open(f"sim://{path}?speed=max&firmware={firmware}") as robot:
            await robot.set_camera(40, 40, 4, mode)
            return await robot.image()

    pixels = look().pixels.astype(int)
    assert pixels.shape[:2] == (40, 40)
    # Red is the darkest grey there is here: 77 of 256.
    box = pixels < 80 if mode is CameraMode.GREY else (pixels[:, :, 0] > 180) & (pixels[:, :, 1] < 40)
    rows, columns = np.nonzero(box)
    depth, scale = 0.3 - FORWARD, FOCAL / 4
    left, right = 19.5 - scale * 0.08 / depth, 19.5 - scale * 0.02 / (depth + 0.1)  # The latter of its far corner.
    top, foot = 19.5 - scale * (0.06 - ABOVE) / depth, 19.5 + scale * ABOVE / depth
    assert (rows.min(), rows.max()) == pytest.approx((top, foot), abs=1)
    assert (columns.min(), columns.max()) == pytest.approx((max(left, 0), right), abs=1)
