"""What is particular to Asercom 1.2.2."""

import struct

import pytest

from elib.testing import EmulatedRobot


@pytest.fixture
def bench() -> EmulatedRobot:
    return EmulatedRobot("asercom-1.2.2")


@pytest.fixture
def revision13() -> EmulatedRobot:
    return EmulatedRobot("asercom-1.2.2", {"hw13": 1})


def test_the_selector_is_announced_before_the_banner() -> None:
    assert EmulatedRobot("asercom-1.2.2", {"selector": 12}).boot.startswith(b"Selector pos 12\r\n\x0c\x07WELCOME")


def test_only_b_and_g_are_not_folded(bench: EmulatedRobot) -> None:
    assert bench.send(b"b\rB,1\rg\rt,1\r") == b"b,1\r\nb\r\ng,0,0,0\r\nt\r\n"


@pytest.mark.parametrize(
    ("raw", "reply"),
    [
        (2560, b"b,2560 (100%)\r\n"),
        (2070, b"b,2070 (0%)\r\n"),
        (2315, b"b,2315 (50%)\r\n"),
        (2600, b"b,2600 (108%)\r\n"),
    ],
)
def test_the_battery_is_raw_and_percent_from_revision_1_3(revision13: EmulatedRobot, raw: int, reply: bytes) -> None:
    revision13.set(battery_raw=raw)
    assert revision13.send(b"b\r") == reply
    assert revision13.send(b"\x9e\0") == struct.pack("<h", raw)


def test_the_older_battery_is_one_bit(bench: EmulatedRobot) -> None:
    bench.set(batt_low=0)
    assert bench.send(b"b\r\x9e\0") == b"b,0\r\n\0\0"


def test_the_gyroscope_is_256_off_in_text_where_the_low_byte_is_negative(revision13: EmulatedRobot) -> None:
    revision13.set(gyro=[127, 128, -1])
    assert revision13.send(b"g\r") == b"g,127,-128,-257\r\n"
    assert revision13.send(b"\x99\0") == struct.pack("<3h", 127, 128, -1)


def test_temperature_is_signed_and_binary_only(revision13: EmulatedRobot) -> None:
    revision13.set(temp=-3)
    assert revision13.send(b"\x8c\0") == b"\xfd"


def test_the_ground_module_is_read_at_every_request(bench: EmulatedRobot) -> None:
    bench.set(floor=[1, 2, 40_000, 4, 5])
    assert bench.send(b"M\r") == b"m,1,2,-25536,4,5\r\n"
    bench.set(floor_present=0)
    assert bench.send(b"M\r\xb3\0") == b"m,-1,-1,-1,-1,-1\r\n" + b"\xff" * 10


def test_registers_are_signed_and_laid_out_as_in_the_module(bench: EmulatedRobot) -> None:
    bench.set(floor=[0x0102, 0x0304, 0x05F0, 0x0708, 0x090A])
    replies = bench.send(b"".join(b"Y,192,%d\r" % register for register in (0, 1, 5, 6, 7, 13, 16, 40)))
    assert [int(line.split(b",")[1]) for line in replies.split(b"\r\n")[1::2]] == [1, 2, -16, 0, 11, 7, 10, -1]


def test_a_register_number_left_out_is_the_last_one(bench: EmulatedRobot) -> None:
    assert bench.send(b"Y,220,1\rY,192\r").split(b"\r\n")[2] == b"y,192,1"


def test_binary_i2c_writes_over_the_low_bytes_only(bench: EmulatedRobot) -> None:
    bench.send(b"W,300,-1,0\r")
    assert bench.send(b"\xa9\xc0\x02\x07\0Y\r").startswith(b"y,448,-254\r\n")


def test_the_scan_shows_what_answers_with_a_positive_byte(bench: EmulatedRobot) -> None:
    assert bench.send(b"Z\r") == b"192: 3\r\n220: 48\r\n"
    bench.set(floor=[-1 & 0xFFFF, 0, 0, 0, 0], camera=0x6030)
    assert bench.send(b"Z\r") == b"220: 96\r\n"


def test_the_inertial_chip_of_revision_1_3_is_on_the_bus(bench: EmulatedRobot, revision13: EmulatedRobot) -> None:
    revision13.set(acc13=[160, -320, 16_000], gyro=[11, -22, 333], temp=27)
    registers = [(60, each) for each in (15, *range(40, 46))] + [(212, each) for each in (38, *range(40, 46))]
    replies = revision13.send(b"".join(b"Y,%d,%d\r" % each for each in registers)).split(b"\r\n")[1::2]
    answers = struct.pack("14b", *(int(line.split(b",")[1]) for line in replies))
    assert answers == struct.pack("<b3hb3h", 64, 160, -320, 16_000, 27, 11, -22, 333)
    assert revision13.send(b"Z\r") == b"60: 0\r\n192: 3\r\n212: 0\r\n220: 48\r\n"
    assert bench.send(b"Y,60,15\r") == b"y,60,15\r\ny,-1\r\n"


def test_what_it_said_at_the_start_is_left_in_memory(bench: EmulatedRobot) -> None:
    whole = bench.send(b"\xb7\xb7\0")
    assert whole[:20] == b"\x01\x28\x28ector pos 3\r\n\0\0\0\0"


def test_the_rgb_panel_command_overwrites_answers_collected_before(bench: EmulatedRobot) -> None:
    assert bench.send(b"\xb2\x89" + bytes(range(1, 36)) + b"\0") == bytes(range(1, 17))


def test_both_hardware_revisions_have_their_own_help(bench: EmulatedRobot, revision13: EmulatedRobot) -> None:
    old, new = bench.send(b"H\r"), revision13.send(b"H\r")
    assert (len(old), len(new)) == (1071, 1112)
    assert b"Battery state" in old
    assert b'"t"' in new


def test_the_hardware_version_is_upper_case_hexadecimal_without_padding() -> None:
    assert EmulatedRobot("asercom-1.2.2", {"eeprom": 0x0ABC}).send(b"V\r").endswith(b"HW version: ABC\r\n")
