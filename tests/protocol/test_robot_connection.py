"""The robot's side of the wire, without any robot behind it."""

import pytest

from elib.link.protocol.robot_connection import (
    LINE_LIMIT,
    Opcode,
    RobotConnection,
    SessionEnd,
    TextLine,
    scan_integers,
)

LENGTHS = {0xB2: 0, 0xAF: 0, 0xB4: 2, 0xBC: 4}


@pytest.fixture
def robot() -> RobotConnection:
    return RobotConnection(LENGTHS)


def events(robot: RobotConnection, data: bytes) -> list[object]:
    return [event for byte in data if (event := robot.feed(byte)) is not None]


@pytest.mark.parametrize("end", [b"\r", b"\n"])
def test_a_line_ends_with_either_line_end_and_keeps_it(robot: RobotConnection, end: bytes) -> None:
    assert events(robot, b"D,1,2" + end) == [TextLine(b"D,1,2" + end)]


def test_line_ends_before_a_command_are_skipped(robot: RobotConnection) -> None:
    assert events(robot, b"\r\n\n\rV\r") == [TextLine(b"V\r")]


def test_zeros_between_commands_are_ignored(robot: RobotConnection) -> None:
    assert events(robot, b"\0\0V\r\0") == [TextLine(b"V\r")]
    assert robot.is_between_commands


def test_after_a_line_end_even_an_opcode_or_a_zero_opens_a_line(robot: RobotConnection) -> None:
    assert events(robot, b"C\r\n\xaf\0\r") == [TextLine(b"C\r"), TextLine(b"\xaf\0\r")]
    assert events(robot, b"\n\0V\r") == [TextLine(b"\0V\r")]


def test_a_stray_line_end_is_not_between_commands(robot: RobotConnection) -> None:
    assert events(robot, b"\r") == []
    assert not robot.is_between_commands


def test_zeros_and_opcodes_inside_a_line_belong_to_it(robot: RobotConnection) -> None:
    assert events(robot, b"D\0\xb2,7\r") == [TextLine(b"D\0\xb2,7\r")]


def test_opcodes_come_at_once_and_a_zero_ends_the_session(robot: RobotConnection) -> None:
    assert events(robot, b"\xb2\xaf") == [Opcode(0xB2, b""), Opcode(0xAF, b"")]
    assert robot.is_in_session
    assert events(robot, b"\0") == [SessionEnd()]
    assert robot.is_between_commands


def test_zeros_within_parameters_end_nothing(robot: RobotConnection) -> None:
    assert events(robot, b"\xbc\0\0\0\0\0") == [Opcode(0xBC, bytes(4)), SessionEnd()]


def test_half_received_parameters_keep_the_session_open(robot: RobotConnection) -> None:
    assert events(robot, b"\xb4\x03") == []
    assert robot.is_in_session
    assert events(robot, b"\x01") == [Opcode(0xB4, b"\x03\x01")]


def test_text_inside_a_session_is_swallowed(robot: RobotConnection) -> None:
    assert events(robot, b"\xb2V\rC\r\n") == [Opcode(0xB2, b"")]


def test_an_unknown_opcode_takes_no_parameters(robot: RobotConnection) -> None:
    # B0 is unknown here, so what was meant as its parameters is carried out: 00 ends, AF opens a new session.
    assert events(robot, b"\xb0\x00\xaf\x00") == [SessionEnd(), Opcode(0xAF, b""), SessionEnd()]


def test_0x80_opens_a_session_too(robot: RobotConnection) -> None:
    assert events(robot, b"\x80V\r\0V\r") == [SessionEnd(), TextLine(b"V\r")]


def test_an_endless_line_is_cut_and_still_ends(robot: RobotConnection) -> None:
    (event,) = events(robot, b"V" * (LINE_LIMIT + 100) + b"\r")
    assert event == TextLine(b"V" * LINE_LIMIT + b"\r")
    assert robot.is_between_commands


@pytest.mark.parametrize(
    ("line", "numbers"),
    [
        (b"D,1,2\r", [1, 2]),
        (b"D,+5,-5\n", [5, -5]),
        (b"D, 7, 8\r", [7, 8]),
        (b"D,\t9,\v10\r", [9, 10]),
        (b"D,007,010\r", [7, 10]),
        (b"D,5,6,7\r", [5, 6]),
        (b"D,1,2abc\r", [1, 2]),
        (b"D,7 ,8\r", [7]),
        (b"D,0x10,5\r", [0]),
        (b"D,1.5,2\r", [1]),
        (b"D,5;6\r", [5]),
        (b"D,7\0,8\r", [7]),
        (b"D,5,abc\r", [5]),
        (b"D,5,\r", [5]),
        (b"D 1,2\r", []),
        (b"D1,2\r", []),
        (b"DD,1,2\r", []),
        (b"D\0,7,8\r", []),
        (b"D,--5,5\r", []),
        (b"D,-,5\r", []),
        (b"D,,5\r", []),
        (b"D,\r", []),
        (b"D\r", []),
    ],
)
def test_numbers_are_scanned_as_sscanf_does(line: bytes, numbers: list[int]) -> None:
    assert scan_integers(line, 2) == numbers


@pytest.mark.parametrize(
    ("bits", "high", "low"), [(32, 2**31 - 1, -(2**31)), (64, 2**63 - 1, -(2**63))], ids=["dsPIC", "recorded e-puck2"]
)
def test_numbers_beyond_a_long_stick_at_its_ends(bits: int, high: int, low: int) -> None:
    huge = b"9" * 5000
    assert scan_integers(b"D," + huge + b",-" + huge + b"\r", 2, long_bits=bits) == [high, low]
    assert scan_integers(b"D,%d,%d\r" % (high, low), 2, long_bits=bits) == [high, low]


def test_leading_zeros_do_not_count_as_digits() -> None:
    assert scan_integers(b"D," + b"0" * 5000 + b"5,6\r", 2) == [5, 6]
