"""The pages for users of Webots and of unifr_api_epuck lead to what exists, and say what is different."""

import re
from collections.abc import Iterator
from typing import NamedTuple

from pages import ROOT
from test_from_elib import world as world  # a fixture
from test_from_elib import wrong_rows

PAGES = {
    name: (ROOT / "docs/reference" / name).read_text(encoding="utf-8") for name in ("from-webots.md", "from-unifr.md")
}
WEBOTS = """
    left wheel motor, right wheel motor, left wheel sensor, right wheel sensor, ps0, ps7, ls0, ls7, led0, led7, led8,
    led9, camera, accelerometer, gyro, gs0, gs1, gs2, speaker, tof, emitter, receiver"""
"""The devices of Webots' e-puck, by its guide and its proto."""
UNIFR = """
    go_on sleep get_battery_level get_id set_id get_ip clean_up set_speed get_speed bounded_speed
    get_motors_steps enable_led disable_led enable_all_led disable_all_led enable_body_led disable_body_led
    enable_front_led disable_front_led init_sensors disable_sensors get_prox calibrate_prox get_calibrate_prox
    init_tof get_tof disable_tof init_ground get_ground get_gyro_axes get_accelerometer_axes get_acceleration
    get_roll get_pitch get_microphones get_temperature get_tv_remote init_camera disable_camera get_camera
    take_picture live_camera play_sound play_mario play_underworld play_star_wars stop_sound
    init_client_communication send_msg receive_msg has_receive_msg clean_msg get_connected_epucks initiate_model
    get_detection save_detection live_detection"""
"""The public methods of its robot over Wi-Fi."""


class Row(NamedTuple):
    page: str
    theirs: str
    ours: str
    remark: str


def rows() -> Iterator[Row]:
    for name, text in PAGES.items():
        for line in re.findall(r"^\| (?!---)(.*) \|$", text, re.MULTILINE):
            cells = [cell.strip() for cell in line.split(" | ")]
            if cells[1] != "elib":
                yield Row(name, cells[0], cells[1].rstrip("| "), cells[2] if len(cells) > 2 else "")


ROWS = list(rows())


def test_every_device_of_webots_has_its_row() -> None:
    theirs = " ".join(row.theirs for row in ROWS if row.page == "from-webots.md")
    assert [name for name in (" ".join(each.split()) for each in WEBOTS.split(",")) if f"`{name}`" not in theirs] == []


def test_every_method_of_unifr_has_its_row() -> None:
    theirs = " ".join(row.theirs for row in ROWS if row.page == "from-unifr.md")
    assert [name for name in UNIFR.split() if not re.search(rf"`(?:\w+\.)?{name}\(", theirs)] == []


def test_what_the_rows_lead_to_exists(world: dict[str, object]) -> None:
    assert wrong_rows([(f"{row.page}: {row.theirs}", row.ours, row.remark) for row in ROWS], world) == []
