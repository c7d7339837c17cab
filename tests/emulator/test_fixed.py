"""Hardware that stands still, and the file it comes from."""

import json
from pathlib import Path

import pytest

from elib.base.errors import ArgumentError
from elib.link.protocol.camera import CameraWindow
from elib.simulator.emulator.fixed_hardware import DEFAULT_STATE, FixedHardware, defaults_for
from elib.simulator.emulator.hardware import Hardware, Lights


def test_missing_keys_have_the_values_of_the_transcripts() -> None:
    hardware: Hardware = FixedHardware({"selector": 7})
    assert hardware.selector() == 7
    assert list(hardware.reflected_light()) == DEFAULT_STATE["prox"]
    assert hardware.microphones() == [(2000, 30), (2010, 40), (2020, 50), (2030, 60)]


def test_an_e_puck2_rests_on_its_wheels() -> None:
    assert FixedHardware(firmware="epuck2").inertial_acceleration()[2] == -16_384
    assert defaults_for("btcom-2.0")["acc13"] == [160, -320, 16_000]


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({"proxx": 1}, "hardware has no 'proxx'\nhint: did you mean prox?"),
        ({"selector": 16}, "selector is 16; it must be a whole number from 0 to 15"),
        ({"selector": 1.5}, "selector is 1.5"),
        ({"temp": "hot"}, "temp is 'hot'; it must be a whole number from -128 to 127"),
        ({"prox": [1, 2]}, "prox is [1, 2]; it must be 8 to 10 whole numbers, each from -32768 to 32767"),
        ({"acc": 5}, "acc is 5; it must be 3 whole numbers, each from -32768 to 32767"),
        ({"mag": [1, "x", 2]}, "mag is [1, 'x', 2]; it must be 3 numbers, each from"),
        ({"motor_time": "fast"}, 'motor_time is \'fast\'; it must be "frozen" or "running"'),
    ],
)
def test_a_wrong_state_is_refused_by_name(state: dict[str, object], message: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        FixedHardware(state)
    assert str(caught.value).startswith(message)


def test_a_refused_change_changes_nothing() -> None:
    hardware = FixedHardware()
    with pytest.raises(ArgumentError):
        hardware.set(selector=5, temp=1000)
    assert hardware.selector() == 3


def test_a_change_from_outside_is_seen() -> None:
    hardware = FixedHardware()
    hardware.set(batt_low=0, button=1, sd=True, mag=(0, 1.5, 2))
    assert (hardware.battery_is_low(), hardware.button_is_pressed(), hardware.has_sd_card()) == (True, True, True)
    assert list(hardware.magnetic_field()) == [0, 1.5, 2]


def test_the_state_read_back_is_a_copy() -> None:
    hardware = FixedHardware()
    hardware.state["selector"] = 9
    assert hardware.selector() == 3
    assert hardware.state.keys() == DEFAULT_STATE.keys()


def test_a_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "desk.json"
    path.write_text(json.dumps({"tof": 55, "motor_time": "running"}), encoding="utf-8")
    hardware = FixedHardware.load(path)
    assert (hardware.distance(), hardware.motor_time) == (55, "running")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "is not JSON"),
        ("[1]", "holds list, not an object"),
        ('{"prax": 1}', "hardware has no 'prax'\nhint: did you mean prox?"),
        ('{"tof": -1}', "tof is -1"),
    ],
)
def test_a_bad_file_is_named_with_its_mistake(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "desk.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(ArgumentError) as caught:
        FixedHardware.load(path)
    assert str(path) in str(caught.value)
    assert message in str(caught.value)


def test_a_missing_file_is_an_argument_error(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match=r"the hardware file .* cannot be read: No such file"):
        FixedHardware.load(tmp_path / "nowhere.json")


def test_what_the_firmware_does_can_be_seen() -> None:
    hardware, lights = FixedHardware(), Lights()
    lights.ring[3] = 1
    hardware.show(lights)
    lights.ring[3] = 0
    hardware.drive(999.7, -5.0)
    hardware.play_sound(4)
    assert hardware.lights.ring[3] == 1
    assert (hardware.rates, hardware.sound) == ((999.7, -5.0), 4)


@pytest.mark.parametrize(
    ("mode", "rows"),
    [
        (0, ["000306", "070a0d"]),
        (1, ["000008011002", "002108221023"]),
        (2, ["008003800682", "0780 0a7f 0d82"]),
    ],
    ids=["grey", "rgb", "yuv"],
)
def test_pictures_show_the_pattern_of_the_transcripts(mode: int, rows: list[str]) -> None:
    picture = FixedHardware().picture(CameraWindow(mode, 3, 2, 8, 0, 0))
    assert picture == bytes.fromhex("".join(rows))
