"""Every field of the Wi-Fi packets, both ways, against bytes written by hand from wire-protocol.md, 3.5 and 4.

Nothing here uses a table of the library: offsets, lengths and values stand as they go over the network.
"""

import struct
from collections.abc import Mapping

import pytest
from wifi_rig import Rig

REST: dict[str, object] = {
    "prox": [0x101, 0x202, 0x303, 0x404, 0x505, 0x606, 0x707, 0x808],
    "light": [0xF11, 0xF22, 0xF33, 0xF44, 0xF55, 0xF66, 0xF77, 0xF88],
    "gyro": [0, 0, 0],
    "mag": [1.5, -2.5, 3.25],
    "temp": 27,
    "tof": 0x3456,
    "mic_volume": [0x111, 0x222, 0x333, 0x444],
    "battery_raw": 0xC21,
    "sd": 1,
    "ir_check": 1,
    "ir_address": 5,
    "ir_data": 0x7F,
    "floor": [0x201, 0x302, 0x403, 9, 9],
    "floor_ambient": [0x21, 0x32, 0x43, 9, 9],
    "button": 1,
}

BEFORE_ANGLES = "02 0000 0000 0003 00004044"
"""Id 02; x = y = 0 and z = 768 of the accelerometer at rest; their magnitude, 768.0."""

BEHIND_ANGLES = """
    0000 0000 0000
    0000C03F 000020C0 00005040
    1B
    0101 0202 0303 0404 0505 0606 0707 0808
    110F 220F 330F 440F 550F 660F 770F 880F
    5634
    1101 2202 3303 4404
    0000 0000
    210C
    01
    01 05 7F
    0F
    0102 0203 0304
    2100 3200 4300
    01 00
"""
"""From the gyroscope on: magnetometer 1.5, -2.5, 3.25; 27 degrees; proximity; ambient light; distance; microphones;
steps; battery; SD card; remote control; selector 15; ground; ground in ambient light; button and spare byte."""


def resting() -> Rig:
    """Return a robot that reads REST, whose calibration at the start found nothing to subtract."""
    rig = Rig({**REST, "prox": [0] * 8})
    rig.hardware.set(prox=REST["prox"])
    return rig


def packet(rig: Rig) -> bytes:
    """Return a sensor packet with readings of now: those fetched ahead are dropped."""
    rig.send(bytes.fromhex("80 02 00 0000 0000 00 000000 000000 000000 000000 00"))
    return rig.packets(0.2)[-1]


def test_a_whole_sensor_packet() -> None:
    found = packet(resting())
    assert len(found) == 105
    assert found[:11] == bytes.fromhex(BEFORE_ANGLES)
    orientation, inclination = struct.unpack("<2f", found[11:19])
    assert orientation == 0
    assert inclination == pytest.approx(0, abs=0.01)  # the firmware's pi has four decimals
    assert found[19:].hex(" ") == bytes.fromhex(BEHIND_ANGLES).hex(" ")


FIELDS: tuple[tuple[Mapping[str, object], int, str], ...] = (
    ({"gyro": [0, 0x102, 0]}, 18, "FEFE"),  # the chip's -y is the robot's x: -258
    ({"gyro": [0x102, 0, 0]}, 20, "0201"),
    ({"gyro": [0, 0, -2]}, 22, "FEFF"),
    ({"mag": [-1.5, -2.5, 3.25]}, 24, "0000C0BF"),
    ({"mag": [1.5, 2.5, 3.25]}, 28, "00002040"),
    ({"mag": [1.5, -2.5, 0.0]}, 32, "00000000"),
    ({"temp": -5}, 36, "FB"),
    ({"tof": 2000}, 69, "D007"),
    ({"battery_raw": 3440}, 83, "700D"),
    ({"sd": 0}, 85, "00"),
    ({"ir_check": 0}, 86, "00"),
    ({"ir_address": 31}, 87, "1F"),
    ({"ir_data": 64}, 88, "40"),
    ({"selector": 3}, 89, "03"),
    ({"button": 0}, 102, "00"),
    *(
        (
            {"prox": [4095 if index == sensor else 0x101 * (index + 1) for index in range(8)]},
            37 + 2 * sensor,
            "FF0F",
        )
        for sensor in range(8)
    ),
    *(
        ({"light": [7 if index == sensor else 0xF11 + 0x11 * index for index in range(8)]}, 53 + 2 * sensor, "0700")
        for sensor in range(8)
    ),
    ({"mic_volume": [7, 0x222, 0x333, 0x444]}, 71, "0700"),
    ({"mic_volume": [0x111, 7, 0x333, 0x444]}, 73, "0700"),
    ({"mic_volume": [0x111, 0x222, 7, 0x444]}, 75, "0700"),
    ({"mic_volume": [0x111, 0x222, 0x333, 7]}, 77, "0700"),
    ({"floor": [1000, 0x302, 0x403, 9, 9]}, 90, "E803"),
    ({"floor": [0x201, 1000, 0x403, 9, 9]}, 92, "E803"),
    ({"floor": [0x201, 0x302, 1000, 9, 9]}, 94, "E803"),
    ({"floor_ambient": [8, 0x32, 0x43, 9, 9]}, 96, "0800"),
    ({"floor_ambient": [0x21, 8, 0x43, 9, 9]}, 98, "0800"),
    ({"floor_ambient": [0x21, 0x32, 8, 9, 9]}, 100, "0800"),
)
"""What is changed, the offset of its field behind the first byte, and the bytes there then."""


def test_a_reading_is_at_its_place_and_nowhere_else() -> None:
    for change, offset, field in FIELDS:
        rig = resting()
        before = packet(rig)[1:]
        rig.hardware.set(**change)
        after, expected = packet(rig)[1:], bytes.fromhex(field)
        assert after[offset : offset + len(expected)].hex() == expected.hex(), change
        changed = {index for index in range(104) if before[index] != after[index]}
        assert changed, change
        assert changed <= set(range(offset, offset + len(expected))), change


@pytest.mark.parametrize(
    ("chip", "field"),
    [
        # A sixteenth minus a quarter of that: 1600 counts of the chip are 75, 12288 are 576.
        ([160 - 1600, -320, -16_384], "4B00 0000 0003"),
        ([160, -320 - 1600, -16_384], "0000 B5FF 0003"),
        ([160, -320, -16_384 + 12_288], "0000 0000 C000"),
    ],
)
def test_the_accelerometer_has_the_zero_of_the_start_and_the_e_puck1s_scale(chip: list[int], field: str) -> None:
    rig = Rig(REST)
    rig.hardware.set(acc13=chip)
    assert packet(rig)[1:7].hex() == bytes.fromhex(field).hex()


def test_the_angles_of_gravity() -> None:
    rig = Rig(REST)
    rig.hardware.set(acc13=[160 - 16_384, -320, 0])  # x = 768, z = 0: it lies on its side
    magnitude, orientation, inclination = struct.unpack("<3f", packet(rig)[7:19])
    assert (magnitude, orientation, inclination) == pytest.approx((768, 270, 90), abs=0.01)


def test_the_steps_are_the_low_words_of_the_counters() -> None:
    rig = Rig(REST)
    rig.send(bytes.fromhex("80 02 04 1000 FEFF 00 000000 000000 000000 000000 00"))  # set steps: 16 and -2
    rig.send(bytes.fromhex("80 02 00 0000 0000 00 000000 000000 000000 000000 00"))
    assert rig.packets(0.3)[-1][80:84].hex() == "1000feff"


def test_without_a_ground_module_its_fields_are_zero() -> None:
    assert packet(Rig({**REST, "floor_present": 0}))[91:103] == bytes(12)


def test_an_empty_packet_is_one_byte() -> None:
    rig = Rig(REST)
    rig.send(bytes.fromhex("80 00 00 0000 0000 00 000000 000000 000000 000000 00"))
    assert b"".join(data for _, data in rig.run(0.1)) == bytes.fromhex("03 03 03 03")


def test_a_picture_is_rgb565_with_the_high_byte_first_row_by_row() -> None:
    rig = Rig(REST)
    rig.send(bytes.fromhex("80 01 00 0000 0000 00 000000 000000 000000 000000 00"))
    picture = rig.packets(0.3)[-1]
    assert len(picture) == 1 + 160 * 120 * 2
    # The pattern: red is the column, green the row, blue their sum, each modulo 32, 64, 32.
    assert picture[:9].hex(" ") == "01 00 00 08 01 10 02 18 03"
    second_row = 1 + 320
    assert picture[second_row : second_row + 4].hex(" ") == "00 21 08 22"
    last = 1 + 2 * (119 * 160 + 159)  # column 159 is red 31, row 119 green 55, 278 blue 22
    assert picture[last:].hex(" ") == "fe f6"


# -- commands --


def obeyed(*commands: str) -> Rig:
    """Return a robot that has carried out the commands, one in each cycle."""
    rig = Rig(REST)
    for each in commands:
        data = bytes.fromhex(each)
        assert len(data) == 21
        rig.send(data)
        rig.run(0.1)
    return rig


@pytest.mark.parametrize(
    ("speeds", "wheels"),
    [
        ("6400 0000", [100, 0]),
        ("0000 6400", [0, 100]),
        ("2C01 D4FE", [300, -300]),
        ("4C04 B4FB", [1100, -1100]),
        ("FF7F 0080", [1100, -1100]),  # the motors' limit
    ],
)
def test_speeds(speeds: str, wheels: list[int]) -> None:
    rig = obeyed(f"80 02 00 {speeds} 00 000000 000000 000000 000000 00")
    assert rig.robot.firmware.report()["speed"] == wheels
    rates = [100, 0, 300, 1100]
    for rate, wheel in zip(rig.hardware.rates, wheels, strict=True):
        assert abs(wheel) in rates
        assert rate == pytest.approx(wheel, rel=0.02)


def test_steps_instead_of_speeds() -> None:
    rig = obeyed(
        "80 02 00 6400 6400 00 000000 000000 000000 000000 00",
        "80 02 04 0102 FF7F 00 000000 000000 000000 000000 00",
    )
    assert rig.robot.firmware.report()["speed"] == [100, 100]
    left, right = rig.robot.firmware.report()["steps"]  # type: ignore[misc]
    assert 0x201 <= left <= 0x201 + 10
    assert 0x7FFF <= right <= 0x7FFF + 10


@pytest.mark.parametrize(
    ("bits", "ring", "body", "front"),
    [
        ("00", [], 0, 0),
        ("01", [0], 0, 0),
        ("02", [2], 0, 0),
        ("04", [4], 0, 0),
        ("08", [6], 0, 0),
        ("10", [], 1, 0),
        ("20", [], 0, 1),
        ("3F", [0, 2, 4, 6], 1, 1),
        ("C0", [], 0, 0),
    ],
)
def test_leds(bits: str, ring: list[int], body: int, front: int) -> None:
    rig = obeyed(
        "80 02 00 0000 0000 3F 000000 000000 000000 000000 00",
        f"80 02 00 0000 0000 {bits} 000000 000000 000000 000000 00",
    )
    lights = rig.hardware.lights
    assert [lamp for lamp in (0, 2, 4, 6) if lights.ring[lamp]] == ring
    assert (lights.body, lights.front) == (body, front)


@pytest.mark.parametrize(
    ("colours", "lamps"),
    [
        ("000000 010203 000000 000000", [1, 2, 3, 0, 0, 0, 0, 0, 0]),
        ("000000 000000 040506 000000", [0, 0, 0, 4, 5, 6, 0, 0, 0]),
        ("000000 000000 000000 070864", [0, 0, 0, 0, 0, 0, 7, 8, 100]),
    ],
)
def test_rgb_leds(colours: str, lamps: list[int]) -> None:
    rig = obeyed(f"80 00 00 0000 0000 00 {colours} 00")
    assert rig.hardware.lights.rgb[3:] == lamps


def test_a_colour_above_100_percent_leaves_it_as_it_is() -> None:
    rig = obeyed(
        "80 00 00 0000 0000 00 000000 0A0B0C 000000 000000 00",
        "80 00 00 0000 0000 00 000000 FF1465 000000 000000 00",
    )
    assert rig.hardware.lights.rgb[3:6] == [10, 20, 12]


def test_led2_is_not_the_clients() -> None:
    rig = obeyed("80 00 00 0000 0000 00 646464 000000 000000 000000 00")
    assert rig.hardware.lights.rgb[:3] == [0, 100, 0]  # green: it has sent no readings yet


@pytest.mark.parametrize(
    ("bits", "sound"), [("01", 1), ("02", 2), ("04", 3), ("08", 4), ("10", 5), ("20", 0), ("21", 0), ("00", 1)]
)
def test_sounds(bits: str, sound: int) -> None:
    rig = obeyed(
        "80 00 00 0000 0000 00 000000 000000 000000 000000 01",
        f"80 00 00 0000 0000 00 000000 000000 000000 000000 {bits}",
    )
    assert rig.hardware.sound == sound


def test_obstacle_avoidance_is_on_as_long_as_its_bit() -> None:
    rig = obeyed("80 02 02 6400 6400 00 000000 000000 000000 000000 00")
    assert rig.robot.firmware.report()["oa"] == 1
    rig.send(bytes.fromhex("80 02 00 6400 6400 00 000000 000000 000000 000000 00"))
    rig.run(0.1)
    assert rig.robot.firmware.report()["oa"] == 0


def test_a_calibration_makes_what_is_near_now_the_zero() -> None:
    rig = Rig(REST)
    rig.send(bytes.fromhex("80 02 01 0000 0000 00 000000 000000 000000 000000 00"))
    rig.send(bytes.fromhex("80 02 00 0000 0000 00 000000 000000 000000 000000 00"))
    assert rig.packets(5)[-1][38:54] == bytes(16)
