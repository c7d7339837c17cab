"""What is particular to BTCom 1.1.3 and 2.0."""

import struct

import pytest

from elib.testing import EmulatedRobot

OFF, ON = [0] * 8, [1] * 8


@pytest.fixture
def first() -> EmulatedRobot:
    return EmulatedRobot("btcom-1.1.3")


@pytest.fixture
def second() -> EmulatedRobot:
    return EmulatedRobot("btcom-2.0")


def test_version_1_reports_proximity_below_its_offset_in_text_and_without_offset_in_binary(
    first: EmulatedRobot,
) -> None:
    first.send(b"K\r")
    first.set(prox=[-7, 0, 5, 0, 0, 0, 0, 0, 0, 0])
    assert first.send(b"N\r") == b"n,-107,-90,-75,-70,-60,-50,-40,-30\r\n"
    assert first.send(b"\xb2\0") == struct.pack("<8h", -7, 0, 5, 0, 0, 0, 0, 0)


def test_version_1_knows_no_body_led_in_binary(first: EmulatedRobot) -> None:
    first.send(b"\xb4\x08\x01\0")
    assert (first.hardware["led"], first.hardware["body"]) == (ON, 0)


def test_version_2_switches_body_and_front_by_number(second: EmulatedRobot) -> None:
    second.send(b"\xb4\x08\x01\xb4\x09\x02\xb4\x0a\x01\0")
    assert (second.hardware["led"], second.hardware["body"], second.hardware["front"]) == (ON, 1, 1)
    second.send(b"\xb4\x0a\x02\0")
    assert second.hardware["led"] == OFF


def test_version_1_executes_the_parameters_of_commands_it_does_not_know(first: EmulatedRobot) -> None:
    # B0 (set steps) is unknown: B2 is read as "proximity", the zero ends the frame, 30 opens a line.
    assert len(first.send(b"\xb0\xb2\x00\x30\x00")) == 16
    assert first.send(b"\r") == b"z,Command not found\r\n"


def test_version_1_reads_the_accelerometer_raw_and_version_2_without_its_zero(
    first: EmulatedRobot, second: EmulatedRobot
) -> None:
    for bench, reply in ((first, b"a,2110,1985,2900\r\n"), (second, b"a,10,-5,868\r\n")):
        bench.set(acc=[2110, 1985, 2900])
        assert bench.send(b"A\r") == reply


def test_the_zero_is_taken_at_every_start(second: EmulatedRobot) -> None:
    second.set(acc=[2000, 2000, 2500])
    second.send(b"R\r")
    assert second.send(b"A\r") == b"a,0,0,768\r\n"


def test_version_2_calibrates_at_every_start(second: EmulatedRobot) -> None:
    assert second.send(b"N\r") == b"n,0,0,0,0,0,0,0,0\r\n"
    second.set(prox=[300] * 10)
    second.send(b"R\r")
    second.set(prox=[310] * 10)
    assert second.send(b"N\r") == b"n,10,10,10,10,10,10,10,10\r\n"


def test_revision_1_3_has_the_battery_on_the_third_analog_channel() -> None:
    bench = EmulatedRobot("btcom-1.1.3", {"hw13": 1, "battery_raw": 2222})
    assert bench.send(b"A\r") == b"a,2100,1990,2222\r\n"


def test_version_2_on_revision_1_3_reads_the_digital_accelerometer() -> None:
    bench = EmulatedRobot("btcom-2.0", {"hw13": 1})
    reply = bench.send(b"A\r")
    x, y, z = (int(number) for number in reply[2:].split(b","))
    assert bench.send(b"\x9f\0") == struct.pack("<3h", x, y, z)
    magnitude, _, _ = struct.unpack("<3f", bench.send(b"\xbf\0"))
    assert magnitude == pytest.approx((x * x + y * y + z * z) ** 0.5, abs=1e-3)


def test_attitude_points_where_the_robot_leans(first: EmulatedRobot) -> None:
    first.set(acc=[2100 + 500, 1990, 2032])
    magnitude, orientation, inclination = struct.unpack("<3f", first.send(b"\xbf\0"))
    assert (magnitude, inclination) == (500.0, 90.0)
    assert orientation == pytest.approx(270.0, abs=0.01)


def test_the_dummy_command_shows_what_was_left_in_the_buffer(second: EmulatedRobot) -> None:
    assert second.send(b"X,5\r") == b"x,11111\r\n"
    # The old ones show through behind the new end of line, up to the zero where the first answer ended.
    assert second.send(b"X,1\r") == b"x,1\r\n11\r\n"
    assert second.send(b"V\rX,2\r") == b"v,Version 2.0.0 January 2008\r\nx,11\r\n1\r\n"


def test_the_dummy_command_without_number_uses_the_left_step_counter(second: EmulatedRobot) -> None:
    assert second.send(b"P,3,9\rX\r") == b"p\r\nx,111\r\n"
    assert second.send(b"X\r").startswith(b"x,\r\n")  # it has counted itself down


@pytest.mark.parametrize(("line", "reply"), [(b"X,-5\r", b"x,-5\r"), (b"X,-1\r", b"x,\n1\r"), (b"X,-2\r", b"x,-2\r")])
def test_the_dummy_command_with_a_negative_number_writes_before_the_buffer(line: bytes, reply: bytes) -> None:
    assert EmulatedRobot("btcom-2.0").send(line) == reply


def test_the_turret_build_is_not_emulated(second: EmulatedRobot) -> None:
    assert second.send(b"W,-1\r\xa9\0C\r") == b"c,3\r\n"
