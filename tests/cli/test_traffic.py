"""The traffic log of ``elib simulate -v``."""

from __future__ import annotations

import asyncio

import pytest

from elib.records.decoding.traffic import TrafficLog
from elib.records.decoding.words import PAUSE
from elib.testing import simulated


@pytest.fixture
def lines() -> list[str]:
    return []


async def test_a_text_line_is_shown_when_it_ends_with_the_command_it_is(lines: list[str]) -> None:
    log = TrafficLog("asercom-1.2.2", lines.append)
    log.note("epuck-1", 1.5, "to robot", b"D,5")
    log.note("epuck-1", 1.501, "to robot", b"00,500\r")
    assert lines == []  # a line feed may still belong to it
    log.note("epuck-1", 1.6, "to host", b"d\r\n")
    request, answer = (line.split() for line in lines)
    assert request[:4] == ["1.5000", "epuck-1", ">", r"D,500,500\r"]
    assert request[4].startswith("set_speed(left=")
    assert answer == ["1.6000", "epuck-1", "<", r"d\r\n", "set_speed:", "done"]


async def test_the_other_side_speaking_ends_a_piece(lines: list[str]) -> None:
    log = TrafficLog("asercom-1.2.2", lines.append)
    log.note("epuck-1", 0.0, "to robot", b"\xb7\0")
    log.note("epuck-1", 0.1, "to host", b"\x01\x28\x28")
    assert [line.split()[2:] for line in lines] == [[">", "b7", "00", "image()"]]
    log.flush()
    assert lines[1].split()[2:6] == ["<!01", "28", "28", "half"]


async def test_robots_do_not_mix(lines: list[str]) -> None:
    log = TrafficLog("btcom-2.0", lines.append)
    log.note("epuck-1", 0.0, "to robot", b"N")
    log.note("epuck-2", 0.0, "to robot", b"O\r")
    log.note("epuck-1", 0.0, "to robot", b"\r")
    log.flush()
    assert [line.split()[1:] for line in lines] == [
        ["epuck-1", ">", r"N\r", "proximity()"],
        ["epuck-2", ">", r"O\r", "ambient_light()"],
    ]


@simulated
async def test_what_never_ends_is_shown_after_a_pause(lines: list[str]) -> None:
    log = TrafficLog("btcom-2.0", lines.append)
    log.note("epuck-1", 0.0, "to robot", b"half a li")
    assert lines == []
    await asyncio.sleep(PAUSE)
    assert len(lines) == 1
    assert lines[0].endswith("epuck-1 >!half a li                   half: the CR that ends the command is missing")


@pytest.mark.parametrize(
    ("firmware", "data", "meaning"),
    [
        ("asercom-1.2.2", b"b\r", "battery()"),
        ("btcom-2.0", b"b,1\r", "set_body_led(action=ON)"),
        ("btcom-2.0", b"\xb2\0", "proximity()"),
        ("btcom-2.0", b"\0\0\rS\r", "stop()"),
    ],
)
async def test_the_letter_means_what_the_firmware_means_by_it(
    firmware: str, data: bytes, meaning: str, lines: list[str]
) -> None:
    log = TrafficLog(firmware, lines.append)
    log.note("epuck-1", 0.0, "to robot", data)
    log.flush()
    assert lines[-1].endswith(meaning)


async def test_several_lines_are_split_and_binary_data_is_not(lines: list[str]) -> None:
    log = TrafficLog("btcom-2.0", lines.append)
    log.note("epuck-1", 0.0, "to robot", b"V\rN\r")
    log.flush()
    assert [line.split()[3] for line in lines] == [r"V\r", r"N\r"]


async def test_of_long_data_the_beginning_is_shown_and_the_rest_counted(lines: list[str]) -> None:
    log = TrafficLog("btcom-2.0", lines.append)
    log.note("epuck-1", 0.0, "to robot", b"\xb7\0")
    log.note("epuck-1", 0.1, "to host", b"\x01\x28\x28" + bytes(range(200)) * 16)
    assert lines[1].endswith("01 28 28 00 .. 3203 in all  image: 40x40 colour, 3200 bytes")
